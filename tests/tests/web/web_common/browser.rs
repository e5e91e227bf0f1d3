//! Chromium without a window, driven through its debugging pipe.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// WebGPU by SwiftShader: no GPU is needed.
pub const WITH_WEBGPU: &[&str] = &[
    "--enable-unsafe-webgpu",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
    "--use-webgpu-adapter=swiftshader",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
];

/// No adapter: what a browser without WebGPU, or without a GPU that it trusts, answers.
pub const WITHOUT_WEBGPU: &[&str] = &["--disable-gpu", "--disable-features=WebGPU"];

/// How long anything may take on a busy machine before the test gives up.
const PATIENCE: Duration = Duration::from_secs(120);

/// A browser with one page.
pub struct Browser {
    child: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
    session: Option<String>,
    last_id: u64,
    /// What the page wrote to its console, and what it threw.
    pub console: Vec<String>,
    /// Kinds of the questions that were asked before the page, such as `beforeunload`.
    pub dialogs: Vec<String>,
    profile: tempfile::TempDir,
}

impl Browser {
    /// Starts a browser whose page is `size` pixels large.
    pub fn start(flags: &[&str], size: [u32; 2]) -> Browser {
        let profile = tempfile::tempdir().expect("a temporary folder");
        // The pipe is file descriptors 3 and 4.
        let mut child = Command::new("sh")
            .args(["-c", "exec \"$@\" 3<&0 4>&1 </dev/null >/dev/null", "sh"])
            .args(["chromium", "--headless=new", "--no-sandbox"])
            .args(["--hide-scrollbars", "--force-device-scale-factor=1"])
            .args(["--no-first-run", "--disable-extensions"])
            .args(["--disable-background-networking", "--disable-dev-shm-usage"])
            .args(flags)
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .args(["--remote-debugging-pipe", "about:blank"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("a shell");
        let mut browser = Browser {
            requests: child.stdin.take().expect("piped"),
            answers: BufReader::new(child.stdout.take().expect("piped")),
            child,
            session: None,
            last_id: 0,
            console: Vec::new(),
            dialogs: Vec::new(),
            profile,
        };
        let targets = browser.call("Target.getTargets", json!({}));
        let page = targets["targetInfos"]
            .as_array()
            .and_then(|targets| targets.iter().find(|target| target["type"] == "page"))
            .expect("a page");
        let attached = browser.call(
            "Target.attachToTarget",
            json!({ "targetId": page["targetId"], "flatten": true }),
        );
        browser.session = attached["sessionId"].as_str().map(str::to_owned);
        browser.call("Page.enable", json!({}));
        browser.call("Runtime.enable", json!({}));
        browser.resize(size);
        browser
    }

    /// Memory of the processes that run pages: their share of what they hold.
    pub fn page_bytes(&self) -> u64 {
        let profile = self.profile.path().display().to_string();
        let processes = std::fs::read_dir("/proc").expect("a list of processes");
        let bytes = processes.flatten().filter_map(|process| {
            let read = |name| std::fs::read_to_string(process.path().join(name)).ok();
            let words = read("cmdline")?;
            (words.contains("--type=renderer") && words.contains(&profile)).then_some(())?;
            let memory = read("smaps_rollup")?;
            let line = memory.lines().find_map(|line| line.strip_prefix("Pss:"))?;
            line.split_whitespace().next()?.parse::<u64>().ok()
        });
        1024 * bytes.sum::<u64>()
    }

    /// Makes the page `width` and `height` pixels large.
    pub fn resize(&mut self, [width, height]: [u32; 2]) {
        self.call(
            "Emulation.setDeviceMetricsOverride",
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false }),
        );
    }

    /// Opens the page at `address`.
    pub fn go(&mut self, address: &str) {
        self.call("Page.navigate", json!({ "url": address }));
    }

    /// Runs `script` in every page from now on, before its own.
    pub fn before_pages(&mut self, script: &str) {
        let parameters = json!({ "source": script });
        self.call("Page.addScriptToEvaluateOnNewDocument", parameters);
    }

    /// Loads the page again; a question that this raises is answered by leaving or staying. Answers
    /// whether one was raised.
    pub fn reload(&mut self, leaves: bool) -> bool {
        let before = self.dialogs.len();
        self.evaluate("setTimeout(() => location.reload(), 0), 0");
        let start = Instant::now();
        while self.dialogs.len() == before && start.elapsed() < Duration::from_secs(2) {
            std::thread::sleep(Duration::from_millis(50));
            // The page itself answers neither while it asks nor while it goes; the browser does.
            let page = self.session.take();
            self.call("Target.getTargets", json!({}));
            self.session = page;
        }
        let is_asked = self.dialogs.len() > before;
        if is_asked {
            self.call("Page.handleJavaScriptDialog", json!({ "accept": leaves }));
        }
        is_asked
    }

    /// Calls a method of the debugging protocol and waits for its answer.
    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.last_id += 1;
        let mut request = json!({ "id": self.last_id, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            request["sessionId"] = json!(session);
        }
        let sent = write!(self.requests, "{request}\0").and_then(|()| self.requests.flush());
        sent.unwrap_or_else(|error| panic!("{method}: chromium is not there: {error}"));
        loop {
            let mut bytes = Vec::new();
            let n = self.answers.read_until(0, &mut bytes).unwrap_or(0);
            assert!(
                n > 0,
                "{method}: chromium ended (is it installed? tests/run does it)"
            );
            bytes.pop();
            let mut answer: Value = serde_json::from_slice(&bytes).expect("JSON");
            if answer["id"] == json!(self.last_id) {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].take();
            }
            self.note(&answer);
        }
    }

    fn note(&mut self, event: &Value) {
        match event["method"].as_str() {
            Some("Runtime.consoleAPICalled") => {
                let words = event["params"]["args"].as_array().into_iter().flatten();
                let words: Vec<String> = words
                    .map(|word| match word["value"].as_str() {
                        Some(text) => text.to_owned(),
                        None => word["description"].to_string(),
                    })
                    .collect();
                self.console.push(words.join(" "));
            }
            Some("Page.javascriptDialogOpening") => {
                let kind = event["params"]["type"].as_str().unwrap_or_default();
                self.dialogs.push(kind.to_owned());
            }
            Some("Runtime.exceptionThrown") => {
                self.console.push(event["params"].to_string());
            }
            _ => {}
        }
    }

    /// The value of a JavaScript expression in the page.
    pub fn evaluate(&mut self, expression: &str) -> Value {
        let answer = self.call(
            "Runtime.evaluate",
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true }),
        );
        answer["result"]["value"].clone()
    }

    /// Waits until `expression` is true in the page.
    pub fn wait_for(&mut self, expression: &str) {
        self.wait_until(expression, |browser| {
            browser.evaluate(expression) == json!(true)
        });
    }

    /// Waits until `is_there`; tells what the page shows if it never is.
    pub fn wait_until(&mut self, what: &str, mut is_there: impl FnMut(&mut Browser) -> bool) {
        let start = Instant::now();
        while !is_there(self) {
            if start.elapsed() > PATIENCE {
                let text = self.evaluate(
                    "`${document.body.innerText} ${document.querySelector('canvas')?.outerHTML}`",
                );
                panic!("never: {what}; page: {text}; console: {:?}", self.console);
            }
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Drags the mouse with its left button from one place to another, in pixels of the page.
    pub fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        const STEPS: u32 = 8;
        self.mouse("mouseMoved", from, 0);
        self.mouse("mousePressed", from, 1);
        for step in 1..=STEPS {
            let t = f64::from(step) / f64::from(STEPS);
            let at = [0, 1].map(|axis: usize| from[axis] + t * (to[axis] - from[axis]));
            self.mouse("mouseMoved", at, 1);
            std::thread::sleep(Duration::from_millis(30));
        }
        self.mouse("mouseReleased", to, 0);
    }

    /// Moves the mouse to a corner of the page.
    pub fn mouse_away(&mut self) {
        for x in [6.0, 3.0] {
            self.mouse("mouseMoved", [x, 3.0], 0);
        }
    }

    fn mouse(&mut self, kind: &str, [x, y]: [f64; 2], buttons: u32) {
        let button = if kind == "mouseMoved" && buttons == 0 {
            "none"
        } else {
            "left"
        };
        self.call(
            "Input.dispatchMouseEvent",
            json!({ "type": kind, "x": x, "y": y, "button": button, "buttons": buttons,
                    "clickCount": 1, "pointerType": "mouse" }),
        );
    }

    /// Turns the wheel by some pixels, down where they are positive.
    pub fn wheel(&mut self, [x, y]: [f64; 2], pixels: f64) {
        self.call(
            "Input.dispatchMouseEvent",
            json!({ "type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": pixels,
                    "pointerType": "mouse" }),
        );
    }

    /// Drags fingers, each from one place to another, at the same time.
    pub fn touch(&mut self, fingers: &[([f64; 2], [f64; 2])]) {
        const STEPS: u32 = 8;
        for step in 0..=STEPS {
            let t = f64::from(step) / f64::from(STEPS);
            let at = |(id, (from, to)): (usize, &([f64; 2], [f64; 2]))| {
                let [x, y] = [0, 1].map(|axis: usize| from[axis] + t * (to[axis] - from[axis]));
                json!({ "x": x, "y": y, "id": id })
            };
            let points: Vec<Value> = fingers.iter().enumerate().map(at).collect();
            let kind = if step == 0 { "touchStart" } else { "touchMove" };
            let touch = json!({ "type": kind, "touchPoints": points });
            self.call("Input.dispatchTouchEvent", touch);
            std::thread::sleep(Duration::from_millis(30));
        }
        let end = json!({ "type": "touchEnd", "touchPoints": [] });
        self.call("Input.dispatchTouchEvent", end);
    }

    /// Drags one finger that presses with `force`, 0..=1.
    pub fn press(&mut self, from: [f64; 2], to: [f64; 2], force: f64) {
        const STEPS: u32 = 8;
        for step in 0..=STEPS {
            let t = f64::from(step) / f64::from(STEPS);
            let [x, y] = [0, 1].map(|axis: usize| from[axis] + t * (to[axis] - from[axis]));
            let kind = if step == 0 { "touchStart" } else { "touchMove" };
            let point = json!({ "x": x, "y": y, "id": 0, "force": force });
            let touch = json!({ "type": kind, "touchPoints": [point] });
            self.call("Input.dispatchTouchEvent", touch);
            std::thread::sleep(Duration::from_millis(30));
        }
        let end = json!({ "type": "touchEnd", "touchPoints": [] });
        self.call("Input.dispatchTouchEvent", end);
    }

    /// Drags a pen that presses with `force`, 0..=1, and lifts it.
    pub fn draw(&mut self, from: [f64; 2], to: [f64; 2], force: f64) {
        const STEPS: u32 = 8;
        let mut pen = |kind: &str, at: [f64; 2], force: f64| {
            let is_down = kind != "mouseReleased" && force > 0.0;
            let event = json!({ "type": kind, "x": at[0], "y": at[1], "pointerType": "pen", "force": force,
                                "button": if force > 0.0 || kind == "mouseReleased" { "left" } else { "none" },
                                "buttons": u32::from(is_down), "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", event);
            std::thread::sleep(Duration::from_millis(30));
        };
        pen("mouseMoved", from, 0.0);
        pen("mousePressed", from, force);
        for step in 1..=STEPS {
            let t = f64::from(step) / f64::from(STEPS);
            let at = [0, 1].map(|axis: usize| from[axis] + t * (to[axis] - from[axis]));
            pen("mouseMoved", at, force);
        }
        pen("mouseReleased", to, 0.0);
    }

    /// Presses Tab.
    pub fn tab(&mut self) {
        for kind in ["rawKeyDown", "keyUp"] {
            self.key_event(kind, 0, "Tab", "Tab", 9);
        }
    }

    /// Presses a letter's key while Control is held.
    pub fn control(&mut self, letter: char) {
        self.key_event("rawKeyDown", 2, "Control", "ControlLeft", 17);
        self.letter(letter, 2);
        self.key_event("keyUp", 0, "Control", "ControlLeft", 17);
    }

    /// Presses a letter's key.
    pub fn key(&mut self, letter: char) {
        self.letter(letter, 0);
    }

    fn letter(&mut self, letter: char, modifiers: u32) {
        let upper = letter.to_ascii_uppercase();
        let (key, code) = (letter.to_string(), format!("Key{upper}"));
        for kind in ["rawKeyDown", "keyUp"] {
            self.key_event(kind, modifiers, &key, &code, upper as u32);
        }
    }

    fn key_event(&mut self, kind: &str, modifiers: u32, key: &str, code: &str, number: u32) {
        self.call(
            "Input.dispatchKeyEvent",
            json!({ "type": kind, "modifiers": modifiers, "key": key, "code": code,
                    "windowsVirtualKeyCode": number }),
        );
    }

    /// Downloads go to `folder`.
    pub fn download_to(&mut self, folder: &Path) {
        self.call(
            "Browser.setDownloadBehavior",
            json!({ "behavior": "allow", "downloadPath": folder.display().to_string() }),
        );
    }

    /// What the page looks like, as a PNG.
    pub fn screenshot(&mut self) -> Vec<u8> {
        let answer = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        from_base64(answer["data"].as_str().expect("a picture"))
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        self.session = None;
        let _ = write!(
            self.requests,
            "{}\0",
            json!({ "id": 0, "method": "Browser.close" })
        )
        .and_then(|()| self.requests.flush());
        let start = Instant::now();
        while matches!(self.child.try_wait(), Ok(None)) {
            if start.elapsed() > Duration::from_secs(10) {
                let _ = self.child.kill();
                let _ = self.child.wait();
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

fn from_base64(text: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut n_bits) = (0_u32, 0);
    for digit in text.bytes().take_while(|&digit| digit != b'=') {
        let value = match digit {
            b'A'..=b'Z' => digit - b'A',
            b'a'..=b'z' => digit - b'a' + 26,
            b'0'..=b'9' => digit - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => panic!("not base64: {digit}"),
        };
        bits = bits << 6 | u32::from(value);
        n_bits += 6;
        if n_bits >= 8 {
            n_bits -= 8;
            bytes.push((bits >> n_bits) as u8);
        }
    }
    bytes
}
