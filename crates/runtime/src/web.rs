//! The viewer in a web page: files by `fetch`, the window in a canvas, saving by download.
//!
//! `web/strand-view.js` calls [`open`] for the element `<strand-view>` and keeps the [`View`] that it
//! answers. Each element has an instance of the program to itself.

use std::path::{Path, PathBuf};

use js_sys::{Function, Promise, Uint8Array};
use serde_json::{Map, Value};
use strandlight_formats::Scene;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{HtmlCanvasElement, Response, Url};
use web_time::Instant;

use crate::choice::BackendChoice;
use crate::page::{self, words};
use crate::session::Session;
use crate::ui::{self, EventLog, Hosted, Launch, WorkerStart};
use crate::worker::files_of;
use strandlight_scene::files::Files;
use strandlight_scene::tables::DEFAULT_FILE;

pub use crate::page::{WebError, download, is_modified, note_modified, offer, say};

/// A viewer in a canvas, for its page. Values come and go as JSON.
#[wasm_bindgen]
pub struct View(Hosted);

fn refused(error: impl std::error::Error) -> JsError {
    JsError::new(&error.to_string())
}

/// The keys of the object that `json` is.
fn object(json: &str) -> Result<Map<String, Value>, JsError> {
    serde_json::from_str(json).map_err(refused)
}

/// Opens the scene at the address `scene` in `canvas`, drawn by `renderer` (`auto`, `gpu`, `cpu`), with
/// the tables at the address `tables` where the scene names none. `start_worker` answers a JavaScript `Worker` with a
/// [`PageWorker`](crate::page_worker::PageWorker), which draws where no GPU does; where it throws, the page draws. `tell` is called with the name of
/// what happens and JSON: `say` with text to show in place of the canvas, the empty text when there
/// is a picture, and events of the log.
///
/// # Errors
/// In words: what cannot be fetched, read or drawn.
#[wasm_bindgen]
pub async fn open(
    canvas: HtmlCanvasElement,
    scene: String,
    tables: String,
    renderer: String,
    has_panel: bool,
    start_worker: Function,
    tell: Function,
) -> Result<View, JsError> {
    page::set_tell(Some(tell));
    std::panic::set_hook(Box::new(|info| {
        web_sys::console::error_1(&info.to_string().into());
        page::say(&format!("Internal error: {info} (please report it)"));
    }));
    let choice = BackendChoice::ALL
        .into_iter()
        .find(|choice| choice.name() == renderer)
        .ok_or_else(|| {
            let names = BackendChoice::ALL.map(BackendChoice::name).join(", ");
            JsError::new(&format!("renderer is {renderer:?}, not one of {names}"))
        })?;
    let (path, files) = fetched(&scene, &tables).await.map_err(refused)?;
    let launch = Launch {
        name: path.display().to_string(),
        worker: WorkerStart::new(start_worker, path.clone(), files.clone()),
        open: Box::new(move || Session::open_in(&path, files)),
        choice,
        size: None,
        seconds: 0.0,
        log: EventLog::in_page(Instant::now()),
        loses_device: false,
        canvas,
        has_panel,
    };
    let view = ui::start(launch).map_err(refused)?;
    page::listen_to_pens();
    Ok(View(view))
}

#[wasm_bindgen]
impl View {
    /// Sets values of the scene, an object by keys such as `hair.eta`; one step to undo.
    ///
    /// # Errors
    /// In words: the key and what is wrong with it; nothing is changed then.
    pub fn set(&self, values: &str) -> Result<(), JsError> {
        self.0.set(&object(values)?).map_err(refused)
    }

    /// The value of a key of the scene; none where the scene leaves it to its default.
    ///
    /// # Errors
    /// No scene.
    pub fn get(&self, key: &str) -> Result<Option<String>, JsError> {
        let value = self.0.get(key).map_err(refused)?;
        Ok(value.map(|value| value.to_string()))
    }

    /// Where the picture is seen from: the keys of `camera` in a scene.
    ///
    /// # Errors
    /// No scene.
    pub fn camera(&self) -> Result<String, JsError> {
        let camera = self.0.camera().map_err(refused)?;
        serde_json::to_string(&camera).map_err(refused)
    }

    /// Looks from elsewhere. Keys that are missing stay as they are.
    ///
    /// # Errors
    /// In words: a camera that no scene could have.
    pub fn set_camera(&self, keys: &str) -> Result<(), JsError> {
        self.0.set_camera(object(keys)?).map_err(refused)
    }

    /// Is the picture complete?
    ///
    /// # Errors
    /// No scene.
    pub fn is_done(&self) -> Result<bool, JsError> {
        self.0.is_done().map_err(refused)
    }

    /// Has the scene changes that were not saved?
    pub fn is_modified(&self) -> bool {
        is_modified()
    }

    /// The bytes of a PNG of the picture as it is.
    pub fn snapshot(&self) -> Promise {
        let hosted = self.0.clone();
        Promise::new(&mut |resolve, reject| {
            let fail = reject.clone();
            // Calls of functions that a promise has made do not fail.
            let asked = hosted.snapshot(move |png| {
                let _ = match png {
                    Ok(png) => resolve.call1(&JsValue::NULL, &Uint8Array::from(&png[..]).into()),
                    Err(error) => fail.call1(&JsValue::NULL, &refused(error).into()),
                };
            });
            if let Err(error) = asked {
                let _ = reject.call1(&JsValue::NULL, &refused(error).into());
            }
        })
    }

    /// Shows bar, panel and status line, or the picture alone.
    ///
    /// # Errors
    /// No scene.
    pub fn show_panel(&self, is_shown: bool) -> Result<(), JsError> {
        self.0.show_panel(is_shown).map_err(refused)
    }

    /// Ends it: nothing is told any more.
    ///
    /// # Errors
    /// Called while the viewer is at work.
    pub fn close(&self) -> Result<(), JsError> {
        page::set_tell(None);
        page::stop_listening();
        self.0.close().map_err(refused)
    }
}

/// The scene at the address `scene`, by a path that is seen from its folder, and the files that it
/// names.
async fn fetched(scene: &str, tables: &str) -> Result<(PathBuf, Files), WebError> {
    let path = file_of(scene)?;
    let bytes = fetch(&path, scene).await?;
    let read = Scene::from_bytes(&bytes, &path)?;
    let mut files = vec![(path.clone(), bytes)];
    let mut names = files_of(&read);
    names.extend(read.frame_paths());
    names.sort();
    names.dedup();
    for name in names {
        let is_default = read.tables_path().is_none() && name == Path::new(DEFAULT_FILE);
        let address = match is_default {
            true => tables.to_owned(),
            false => beside(scene, &name)?,
        };
        let bytes = fetch(&name, &address).await?;
        files.push((name, bytes));
    }
    Ok((path, Files::in_memory(files)))
}

/// The name of the file at an address.
fn file_of(address: &str) -> Result<PathBuf, WebError> {
    let url = Url::new(address).map_err(|error| no_address(address, &error))?;
    let path = url.pathname();
    let name = path.rsplit('/').next().unwrap_or_default();
    // Names that are no text stay as they were sent.
    let name = js_sys::decode_uri_component(name).map_or(name.to_owned(), String::from);
    Ok(PathBuf::from(match name.as_str() {
        "" => "scene.toml",
        name => name,
    }))
}

/// The address of the file that `path` is, seen from the folder of `scene`.
fn beside(scene: &str, path: &Path) -> Result<String, WebError> {
    let parts: Vec<String> = path
        .to_string_lossy()
        .split('/')
        .map(|part| js_sys::encode_uri_component(part).into())
        .collect();
    let url = Url::new_with_base(&parts.join("/"), scene);
    Ok(url.map_err(|error| no_address(scene, &error))?.href())
}

fn no_address(address: &str, error: &JsValue) -> WebError {
    WebError::Address {
        address: address.to_owned(),
        reason: words(error),
    }
}

/// The bytes of the file `path` at an address.
async fn fetch(path: &Path, address: &str) -> Result<Vec<u8>, WebError> {
    let window = web_sys::window().ok_or(WebError::NoWindow)?;
    let failed = |error: JsValue| WebError::Fetch {
        path: path.to_owned(),
        reason: words(&error),
    };
    let response = JsFuture::from(window.fetch_with_str(address))
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
