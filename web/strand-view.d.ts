/** Where a picture is seen from. Lengths are those of the scene, cm. */
export interface Camera {
  position: [number, number, number];
  target: [number, number, number];
  /** Up in the picture; need not be a unit vector. */
  up: [number, number, number];
  /** Vertical field of view, degrees. */
  fov: number;
}

/** A value of a scene, as scene files have it. */
export type SceneValue = string | number | boolean | null | SceneValue[] | { [key: string]: SceneValue };

/** A scene is shown. */
export interface LoadDetail {
  renderer: "gpu" | "cpu";
  /** Why the CPU draws, where that was not asked for. */
  reason?: string;
}

/** The scene or the view of it is another, by `set`, by the user or by undo. */
export interface ChangeDetail {
  kind: "edit" | "stroke" | "flood" | "undo" | "redo" | "reloaded" | "view";
  /** The keys that `set` was called with. */
  keys?: string[];
  /** What the panel calls the edit. */
  label?: string;
}

/** How far the picture is. There are no samples to count unless a GPU has no room for a visibility list. */
export interface ProgressDetail {
  samples: number;
  totalSamples: number;
  /** Is it the scene as it is now, and not that of before the last change? */
  isShaded: boolean;
  isDone: boolean;
}

/** Something failed, and why. */
export interface ErrorDetail {
  message: string;
  error: Error;
}

export interface StrandViewEventMap {
  load: CustomEvent<LoadDetail>;
  change: CustomEvent<ChangeDetail>;
  progress: CustomEvent<ProgressDetail>;
  /** The picture is complete. */
  done: CustomEvent<{ samples: number }>;
  error: CustomEvent<ErrorDetail>;
}

/**
 * `<strand-view src="scene.toml">`: a scene and its picture, with an instance of the viewer to itself.
 * Must be in the document, and not in a shadow tree.
 */
export class StrandView extends HTMLElement {
  /** The viewer's program, `strandview_bg.wasm` beside this module by default; read by the first element. */
  static program: string | URL;

  /**
   * The program that draws on several processors where no GPU does, `strandview_threads_bg.wasm` beside this module by default; read where the page may
   * share memory. Undefined in packages that were made without `--threads`; set to undefined, one thread draws.
   */
  static threadsProgram: string | URL | undefined;

  /** Tables of scenes that name none, `default.tables` beside this module by default. */
  static tables: string | URL;

  /** Attribute `src`: the address of a scene, beside which are the files that it names. */
  src: string;

  /** Attribute `panel`: shows the bar, the panel and the status line; without it, the picture alone. */
  panel: boolean;

  /** Attribute `renderer`; `auto` is the GPU where the browser offers one. Another one loads the scene again that was loaded last. */
  renderer: "auto" | "gpu" | "cpu";

  /** How many threads draw where no GPU does: 1 until others have started. */
  readonly threads: number;

  /** Has the scene changes that were not saved from the panel? */
  readonly isModified: boolean;

  /** Where the picture is seen from. What is set may leave out what stays. */
  get camera(): Camera;
  set camera(camera: Partial<Camera>);

  /** Shows another scene in place of this one; resolves when it is shown. */
  load(address: string | URL): Promise<void>;

  /**
   * Sets a value by its key in scene files, such as `hair.eta`; null has it at its default. Throws what
   * is wrong with key or value, and changes nothing then.
   */
  set(key: string, value: SceneValue): void;

  /** Sets several values, one step to undo. */
  set(values: Record<string, SceneValue>): void;

  /** The value of a key; the default where the scene has none; undefined for keys that scene files leave out at their default. */
  get(key: string): SceneValue | undefined;

  /** The picture as a PNG, when it is complete. */
  snapshot(): Promise<Blob>;

  /** Gives memory and device back. The element shows nothing, wherever it is moved, until a scene is loaded or an attribute asks for one. */
  dispose(): void;

  addEventListener<K extends keyof StrandViewEventMap>(
    type: K,
    listener: (this: StrandView, event: StrandViewEventMap[K]) => unknown,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener<K extends keyof HTMLElementEventMap>(
    type: K,
    listener: (this: HTMLElement, event: HTMLElementEventMap[K]) => unknown,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject, options?: boolean | AddEventListenerOptions): void;
}

declare global {
  interface HTMLElementTagNameMap {
    "strand-view": StrandView;
  }
}
