// `<strand-view src="scene.toml">`: hair under environment lighting, drawn in a page. What it takes
// and answers is in strand-view.d.ts.

import { instantiate } from "./strandview.js";
import { threads } from "./threads.js";

const text = (error) => (error instanceof Error ? error.message : String(error));

// What the events of the viewer are to a page.
const CHANGES = new Set(["edit", "stroke", "flood", "undo", "redo", "reloaded", "view"]);

// Without weight: any rule of the page comes before these.
const STYLE = `
:where(strand-view) { display: block; position: relative; aspect-ratio: 3 / 2; overflow: hidden; background: #17181a; color: #d8d8d8; }
:where(strand-view > canvas) { position: absolute; inset: 0; width: 100%; height: 100%; touch-action: none; }
:where(strand-view > canvas:not(:focus-visible)) { outline: none; }
:where(strand-view > [role="status"]) { position: absolute; inset: 0; margin: 0; padding: 2em; display: grid; place-content: center; text-align: center; background: inherit; }
`;

const addStyle = () => {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(STYLE);
  document.adoptedStyleSheets.push(sheet);
};

// By address: compiled once for all elements, each of which has an instance to itself.
const compiled = new Map();

const compile = async (address) => {
  const response = await fetch(address);
  if (!response.ok) throw new Error(`cannot fetch ${address}: HTTP status ${response.status}`);
  // Servers that do not know programs send them as bytes, which browsers do not compile as they come.
  const isKnown = response.headers.get("content-type")?.startsWith("application/wasm");
  return isKnown ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
};

const program = (address) => {
  const key = String(address);
  const known = compiled.get(key);
  if (known) return known;
  const module = compile(key).catch((error) => {
    // The next element tries again.
    compiled.delete(key);
    throw error;
  });
  compiled.set(key, module);
  return module;
};

// What a worker does: it draws as the page's messages say. Elements that a GPU draws start none. This function and the programs
// are sent to it as they are written: no file has to be found beside this module, whoever has bundled it. Where the page may share
// memory the worker draws with threads: more workers, which are sent the same.
const draw = (instantiate, instantiateThreads) => {
  const loop = new MessageChannel();
  const waiting = [];
  let worker;
  let isDue = false;
  const goOn = () => {
    if (isDue) return;
    isDue = true;
    // Messages that have come meanwhile are taken first.
    loop.port2.postMessage(null);
  };
  const take = (message) => {
    worker.take(message);
    goOn();
  };
  loop.port1.onmessage = () => {
    isDue = false;
    const answer = worker.work();
    if (answer) postMessage(answer, [answer.buffer]);
    if (worker.is_working()) goOn();
  };
  // In a thread of another worker: it runs what the others leave it, for ever. The worker waits for its threads and hears
  // nothing meanwhile, so a thread that fails tells the page.
  const runThread = async ({ shared, memory, name }) => {
    const instance = instantiateThreads();
    await instance({ module_or_path: shared, memory });
    postMessage("ready");
    try {
      instance.run_thread();
    } catch (error) {
      new BroadcastChannel(name).postMessage({ error: `a thread ended: ${error}` });
    }
  };
  const startThreads = async ({ shared, source, nThreads, name }, memory) => {
    const address = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
    const threads = Array.from({ length: nThreads - 1 }, () => new Worker(address));
    const isReady = (thread) =>
      new Promise((resolve, reject) => {
        thread.onmessage = ({ data }) => (data === "ready" ? resolve() : reject(new Error(data)));
        thread.onerror = (event) => {
          event.preventDefault();
          reject(new Error(event.message ?? "a thread cannot be loaded"));
        };
        thread.postMessage({ shared, memory, name });
      });
    const isLate = new Promise((_, reject) => setTimeout(() => reject(new Error("threads do not start")), 20000));
    try {
      await Promise.race([Promise.all(threads.map(isReady)), isLate]);
    } catch (error) {
      for (const thread of threads) thread.terminate();
      throw error;
    } finally {
      URL.revokeObjectURL(address);
    }
  };
  const withThreads = async (head) => {
    const instance = instantiateThreads();
    const { memory } = await instance({ module_or_path: head.shared });
    const made = new instance.PageWorker();
    await startThreads(head, memory);
    made.use_threads(head.nThreads);
    new BroadcastChannel(head.name).postMessage({ nThreads: head.nThreads });
    return made;
  };
  const alone = async ({ module }) => {
    const instance = instantiate();
    await instance({ module_or_path: module });
    return new instance.PageWorker();
  };
  const start = async (head) => {
    let made;
    if (head.shared) {
      made = await withThreads(head).catch((error) => {
        console.warn(`strandview: the worker draws on one thread: ${error.message ?? error}`);
      });
    }
    worker = made ?? (await alone(head));
    for (const message of waiting.splice(0)) take(message);
  };
  const fail = (error) => postMessage(String(error));
  onmessage = ({ data }) => {
    if (data.memory) runThread(data).catch(fail);
    else if (data.module) start(data).catch(fail);
    else if (worker) take(data);
    else waiting.push(data);
  };
};

// As many threads as processors, but for one that is left to the page where that leaves more than one.
const MOST_THREADS = 16;
const countThreads = () => {
  const n = navigator.hardwareConcurrency ?? 1;
  return n === 1 ? 1 : Math.min(Math.max(n - 1, 2), MOST_THREADS);
};

// A worker that draws with `module` or, where the page may share memory, with the program that has threads. How many it has is
// told to `tellThreads`. It is to be closed by `close`, besides being ended.
const startWorker = (module, tellThreads) => {
  const source = `(${draw})(${instantiate}, ${threads?.instantiate})`;
  const address = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
  try {
    const worker = new Worker(address);
    const nThreads = countThreads();
    if (!threads || !StrandView.threadsProgram || !globalThis.crossOriginIsolated || nThreads === 1) {
      worker.postMessage({ module });
      return { worker, close: () => {} };
    }
    const name = `strand-view ${crypto.randomUUID()}`;
    const channel = new BroadcastChannel(name);
    channel.onmessage = ({ data: { error, nThreads } }) => {
      if (!error) return tellThreads(nThreads);
      tellThreads(1);
      worker.dispatchEvent(new ErrorEvent("error", { message: error }));
    };
    program(StrandView.threadsProgram).then(
      (shared) => worker.postMessage({ module, shared, source, nThreads, name }),
      (error) => {
        console.warn(`strandview: the worker draws on one thread: ${text(error)}`);
        worker.postMessage({ module });
      },
    );
    return { worker, close: () => channel.close() };
  } finally {
    URL.revokeObjectURL(address);
  }
};

// Of the GPU the viewer says its name as well.
const rendererOf = ({ name, reason }, wanted) => {
  if (name !== "cpu") return { renderer: "gpu" };
  return wanted === "cpu" ? { renderer: "cpu" } : { renderer: "cpu", reason };
};

// JSON has no numbers that are none: they would take keys away.
const json = (values) =>
  JSON.stringify(values, (key, value) => {
    if (typeof value === "number" && !Number.isFinite(value)) throw new TypeError(`${key}: ${value} is no number of a scene`);
    return value === undefined ? null : value;
  });

// A server that renders pages imports modules without having elements.
const Element = globalThis.HTMLElement ?? class {};

export class StrandView extends Element {
  static observedAttributes = ["src", "panel", "renderer"];

  static program = new URL("./strandview_bg.wasm", import.meta.url);

  static threadsProgram = threads?.program;

  static tables = new URL("./default.tables", import.meta.url);

  #view; // of the program
  #canvas;
  #message;
  #cancel; // refuses the promise of what is being loaded
  #turn = 0; // of what is loaded or was; another one is another scene
  #isDue = false;
  #threads = 1;
  #closeWorker;
  #address; // of what was loaded last, until `src` is another
  #isDisposed = false;
  #waiting = []; // for the finished picture

  constructor() {
    super();
    // Before the viewer, which keeps what it gets: without controls nothing in it takes the key that
    // goes on in the page, and the wheel scrolls the page until the picture has been clicked.
    this.addEventListener("keydown", (event) => this.#pass(event, event.key === "Tab"), true);
    const wheels = (event) => this.#pass(event, !event.ctrlKey && document.activeElement !== this.#canvas);
    this.addEventListener("wheel", wheels, { capture: true, passive: true });
    // The viewer focuses its canvas when it is pressed, which browsers take for the keyboard's doing.
    this.addEventListener("pointerdown", () => this.#outline("none"), true);
    this.addEventListener("focusout", () => this.#outline(""));
  }

  connectedCallback() {
    // One that was moved goes on; one that was disposed of stays so.
    if (!this.#view && !this.#cancel && !this.#isDisposed) this.#loadSoon();
  }

  disconnectedCallback() {
    // An element that is moved is back at once.
    queueMicrotask(() => {
      if (!this.isConnected) this.#release();
    });
  }

  attributeChangedCallback(name, before, after) {
    if (before === after) return;
    if (name === "panel") {
      try {
        this.#view?.show_panel(this.panel);
      } catch {
        // It has no scene yet, and looks at the attribute when it has.
      }
    } else {
      if (name === "src") {
        this.#address = undefined;
        this.#isDisposed = false;
      }
      this.#loadSoon();
    }
  }

  get src() {
    return this.getAttribute("src") ?? "";
  }

  set src(address) {
    this.setAttribute("src", address);
  }

  get panel() {
    return this.hasAttribute("panel");
  }

  set panel(isShown) {
    this.toggleAttribute("panel", Boolean(isShown));
  }

  get renderer() {
    return this.getAttribute("renderer") ?? "auto";
  }

  set renderer(name) {
    this.setAttribute("renderer", name);
  }

  get isModified() {
    return this.#view?.is_modified() ?? false;
  }

  get threads() {
    return this.#threads;
  }

  get camera() {
    const { fov_deg: fov, ...places } = JSON.parse(this.#shown().camera());
    return { ...places, fov };
  }

  set camera({ fov, ...keys }) {
    this.#shown().set_camera(json(fov === undefined ? keys : { ...keys, fov_deg: fov }));
  }

  async load(address) {
    this.#end(new DOMException("strand-view: another scene is loaded", "AbortError"));
    const turn = this.#turn;
    // Attributes that were set just before are those of this scene.
    this.#isDue = false;
    this.#isDisposed = false;
    const cancelled = new Promise((_, reject) => (this.#cancel = reject));
    try {
      const detail = await Promise.race([this.#open(address, turn), cancelled]);
      this.#cancel = undefined;
      this.#say("");
      this.#emit("load", detail);
    } catch (error) {
      if (turn === this.#turn) this.#fail(error);
      throw error;
    }
  }

  set(key, value) {
    this.#shown().set(json(typeof key === "object" ? key : { [key]: value }));
  }

  get(key) {
    const value = this.#shown().get(key);
    return value === undefined ? undefined : JSON.parse(value);
  }

  async snapshot() {
    const view = this.#shown();
    while (!view.is_done()) {
      await new Promise((resolve, reject) => this.#waiting.push({ resolve, reject }));
    }
    return new Blob([await view.snapshot()], { type: "image/png" });
  }

  focus(options) {
    this.#canvas?.focus(options);
  }

  dispose() {
    this.#isDisposed = true;
    this.#isDue = false;
    this.#release();
  }

  #release() {
    this.#end(new DOMException("strand-view: the element was disposed of", "AbortError"));
    this.#say("");
  }

  // Opens a scene in a canvas of its own, and goes no further once there is another turn.
  async #open(address, turn) {
    if (!document.contains(this)) throw new Error("must be in the document, and not in a shadow tree");
    this.#say("Loading ...");
    this.#address = address;
    const scene = new URL(address, document.baseURI).href;
    const tables = new URL(StrandView.tables, document.baseURI).href;
    const module = await program(StrandView.program);
    if (turn !== this.#turn) return;
    const instance = instantiate();
    await instance({ module_or_path: module });
    if (turn !== this.#turn) return;
    this.#canvas = document.createElement("canvas");
    this.prepend(this.#canvas);
    let renderer;
    let isShown = false;
    let later;
    const shown = new Promise((resolve, reject) => {
      const tell = (name, detail) => {
        if (turn !== this.#turn) return;
        if (name === "renderer") renderer = rendererOf(detail, this.renderer);
        else if (name !== "say") this.#tell(name, detail);
        else if (detail === "") resolve();
        else if (isShown) this.#fail(new Error(detail));
        else reject(new Error(detail));
      };
      // Not from within calls of the viewer: listeners may call it.
      later = (name, detail) => queueMicrotask(() => tell(name, JSON.parse(detail)));
    });
    // What is said of a scene that could not be opened at all is the other promise's.
    shown.catch(() => {});
    const start = () => {
      const { worker, close } = startWorker(module, (n) => turn === this.#turn && (this.#threads = n));
      this.#closeWorker = close;
      return worker;
    };
    const view = await instance.open(this.#canvas, scene, tables, this.renderer, this.panel, start, later);
    if (turn !== this.#turn) return view.close();
    this.#view = view;
    await shown;
    isShown = true;
    if (turn === this.#turn) view.show_panel(this.panel);
    return renderer;
  }

  #shown() {
    if (!this.#view) throw new Error("strand-view: no scene is shown");
    return this.#view;
  }

  #outline(style) {
    if (this.#canvas) this.#canvas.style.outline = style;
  }

  #pass(event, isPages) {
    if (isPages && !this.panel) event.stopPropagation();
  }

  // Attributes that change together are one scene.
  #loadSoon() {
    if (this.#isDue) return;
    this.#isDue = true;
    queueMicrotask(() => {
      const isDue = this.#isDue;
      this.#isDue = false;
      const address = this.#address ?? this.src;
      // What fails is told by the event.
      if (isDue && this.isConnected && address !== "") this.load(address).catch(() => {});
    });
  }

  // Ends what waits for the picture.
  #settle(error) {
    for (const { resolve, reject } of this.#waiting.splice(0)) {
      if (error) reject(error);
      else resolve();
    }
  }

  #tell(name, detail) {
    if (name === "progress") {
      this.#emit("progress", detail);
    } else if (name === "frame") {
      this.#settle();
      this.#emit("done", { samples: detail.samples });
    } else if (name === "error") {
      this.#refuse(new Error(detail.message));
    } else if (CHANGES.has(name)) {
      this.#emit("change", { kind: name, ...detail });
    }
  }

  #emit(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  #refuse(error) {
    this.#settle(error);
    this.#emit("error", { message: text(error), error });
  }

  #fail(error) {
    this.#end(error);
    this.#say(`strandview: ${text(error)}`);
    this.#refuse(error);
  }

  // Gives back what there is.
  #end(reason) {
    this.#turn += 1;
    try {
      this.#view?.close();
    } catch {
      // What has failed as a whole is collected with its memory.
    }
    this.#view = undefined;
    this.#canvas?.remove();
    this.#canvas = undefined;
    this.#closeWorker?.();
    this.#closeWorker = undefined;
    this.#threads = 1;
    this.#cancel?.(reason);
    this.#cancel = undefined;
    this.#settle(reason);
  }

  #say(sentence) {
    this.#message?.remove();
    this.#message = undefined;
    if (sentence === "") return;
    this.#message = document.createElement("p");
    this.#message.setAttribute("role", "status");
    this.#message.textContent = sentence;
    this.append(this.#message);
  }
}

if (globalThis.customElements && !customElements.get("strand-view")) {
  addStyle();
  customElements.define("strand-view", StrandView);
}
