//! The viewer in a web page: files by `fetch`, the window in a canvas, saving by download.
//!
//! `web/index.html` calls [`open`]; `web/build` puts page, program and scene into one folder.

use std::path::{Path, PathBuf};

use js_sys::{Function, Uint8Array};
use strandlight_formats::Scene;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{HtmlCanvasElement, Response};
use web_time::Instant;

use crate::choice::BackendChoice;
use crate::page::{self, words};
use crate::session::Session;
use crate::ui::{self, EventLog, Launch};
use strandlight_scene::files::Files;
use strandlight_scene::tables::DEFAULT_FILE;

pub use crate::page::{WebError, download, is_modified, note_modified, offer, say};

/// Opens the scene at the address `scene`, seen from the page, in `canvas`. `say` is called with
/// text to show in place of the canvas, the empty text when there is a picture.
///
/// # Errors
/// In words: what cannot be fetched, read or drawn.
#[wasm_bindgen]
pub async fn open(canvas: HtmlCanvasElement, scene: String, say: Function) -> Result<(), JsValue> {
    page::set_say(say);
    std::panic::set_hook(Box::new(|info| {
        web_sys::console::error_1(&info.to_string().into());
        page::say(&format!("Internal error: {info} (please report it)"));
    }));
    let path = PathBuf::from(scene);
    let files = fetched(&path)
        .await
        .map_err(|error| JsValue::from(error.to_string()))?;
    let launch = Launch {
        name: path.display().to_string(),
        open: Box::new(move || Session::open_in(&path, files)),
        choice: BackendChoice::Auto,
        size: None,
        seconds: 0.0,
        log: EventLog::in_page(Instant::now()),
        loses_device: false,
        canvas,
    };
    ui::start(launch).map_err(|error| error.to_string().into())
}

/// The scene at `path` and the files that it names.
async fn fetched(path: &Path) -> Result<Files, WebError> {
    let bytes = fetch(path).await?;
    let scene = Scene::from_bytes(&bytes, path)?;
    let mut files = vec![(path.to_owned(), bytes)];
    let tables = scene.tables_path().unwrap_or_else(|| DEFAULT_FILE.into());
    let mut names = vec![scene.groom_path(), scene.lights_path(), tables];
    names.extend(scene.frame_paths());
    names.extend(scene.lut_path());
    names.extend(scene.mesh_paths().into_iter().map(|(_, path)| path));
    names.sort();
    names.dedup();
    for name in names {
        let bytes = fetch(&name).await?;
        files.push((name, bytes));
    }
    Ok(Files::in_memory(files))
}

/// The bytes at an address that is a path seen from the page.
async fn fetch(path: &Path) -> Result<Vec<u8>, WebError> {
    let address: Vec<String> = path
        .to_string_lossy()
        .split('/')
        .map(|part| js_sys::encode_uri_component(part).into())
        .collect();
    let window = web_sys::window().ok_or(WebError::NoWindow)?;
    let failed = |error: JsValue| WebError::Fetch {
        path: path.to_owned(),
        reason: words(&error),
    };
    let response = JsFuture::from(window.fetch_with_str(&address.join("/")))
        .await
        .map_err(failed)?;
    let response: Response = response.dyn_into().map_err(failed)?;
    if !response.ok() {
        return Err(WebError::Status {
            path: path.to_owned(),
            status: response.status(),
        });
    }
    let buffer = JsFuture::from(response.array_buffer().map_err(failed)?).await;
    Ok(Uint8Array::new(&buffer.map_err(failed)?).to_vec())
}
