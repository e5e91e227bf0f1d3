//! The viewer in a web page: files by `fetch`, the window in a canvas, saving by download.
//!
//! `web/index.html` calls [`open`]; `web/build` puts page, program and scene into one folder.

use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};

use js_sys::{Array, Function, Uint8Array};
use strandlight_formats::Scene;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{Blob, BlobPropertyBag, HtmlAnchorElement, HtmlCanvasElement, Response, Url};
use web_time::Instant;

use crate::session::{Saved, Session};
use crate::ui::{self, EventLog, Launch};
use crate::viewer::Viewer;
use strandlight_scene::files::Files;
use strandlight_scene::tables::DEFAULT_FILE;

thread_local! {
    /// Shows a sentence in place of the canvas, or nothing for an empty one.
    static SAY: RefCell<Option<Function>> = const { RefCell::new(None) };
    /// Has the scene changes that were not saved?
    static IS_MODIFIED: Cell<bool> = const { Cell::new(false) };
}

/// Opens the scene at the address `scene`, seen from the page, in `canvas`. `say` is called with
/// text to show in place of the canvas, the empty text when there is a picture.
///
/// # Errors
/// In words: what cannot be fetched, read or drawn.
#[wasm_bindgen]
pub async fn open(canvas: HtmlCanvasElement, scene: String, say: Function) -> Result<(), JsValue> {
    SAY.with_borrow_mut(|of_page| *of_page = Some(say));
    std::panic::set_hook(Box::new(|info| {
        web_sys::console::error_1(&info.to_string().into());
        self::say(&format!("Internal error: {info} (please report it)"));
    }));
    let path = PathBuf::from(scene);
    let files = fetched(&path)
        .await
        .map_err(|error| JsValue::from(error.to_string()))?;
    let launch = Launch {
        open: Box::new(move |context| {
            let session = Session::open_in(&path, files)?;
            Ok(Viewer::new(context, session)?)
        }),
        size: None,
        seconds: 0.0,
        log: EventLog::of_page(Instant::now()),
        loses_device: false,
        canvas,
    };
    ui::start(launch).map_err(|error| error.to_string().into())
}

/// Shows `text` in place of the canvas, or the canvas if it is empty.
pub fn say(text: &str) {
    SAY.with_borrow(|say| {
        if let Some(say) = say {
            // A page that cannot show text has nowhere to say so either.
            let _ = say.call1(&JsValue::NULL, &text.into());
        }
    });
}

/// Has the scene changes that would be lost with the page?
#[wasm_bindgen]
pub fn is_modified() -> bool {
    IS_MODIFIED.get()
}

/// Tells the page whether the scene has changes that would be lost with it.
pub fn note_modified(is_modified: bool) {
    IS_MODIFIED.set(is_modified);
}

/// What a browser refuses. Its exceptions come as what they say: they cannot leave their thread.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WebError {
    /// A file that cannot be fetched.
    #[error("cannot fetch {}: {reason}", path.display())]
    Fetch {
        /// Its path, seen from the page.
        path: PathBuf,
        /// What the browser says.
        reason: String,
    },
    /// A file that the server does not give.
    #[error("cannot fetch {}: HTTP status {status}", path.display())]
    Status {
        /// Its path, seen from the page.
        path: PathBuf,
        /// The server's answer.
        status: u16,
    },
    /// A file that cannot be offered.
    #[error("cannot save {name}: {reason}")]
    Save {
        /// Its name.
        name: String,
        /// What the browser says.
        reason: String,
    },
    /// Not in a page.
    #[error("no browser window")]
    NoWindow,
    /// A file that was fetched or saved cannot be read.
    #[error(transparent)]
    Format(#[from] strandlight_formats::Error),
}

/// The scene at `path` and the files that it names.
async fn fetched(path: &Path) -> Result<Files, WebError> {
    let bytes = fetch(path).await?;
    let scene = Scene::from_bytes(&bytes, path)?;
    let mut files = vec![(path.to_owned(), bytes)];
    let tables = scene.tables_path().unwrap_or_else(|| DEFAULT_FILE.into());
    let mut names = vec![scene.groom_path(), scene.lights_path(), tables];
    names.extend(scene.frame_paths());
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

/// Offers files that were saved in memory to the reader of the page.
///
/// # Errors
/// What the browser refuses.
pub fn offer(files: &Files, saved: &Saved) -> Result<(), WebError> {
    for path in &saved.files {
        let bytes = files.read(path, u64::MAX)?;
        let name = path.file_name().unwrap_or_default();
        download(&name.to_string_lossy(), &bytes)?;
    }
    Ok(())
}

/// Offers `bytes` to the reader of the page as a file to keep.
///
/// # Errors
/// What the browser refuses.
pub fn download(name: &str, bytes: &[u8]) -> Result<(), WebError> {
    let refused = |error: JsValue| WebError::Save {
        name: name.to_owned(),
        reason: words(&error),
    };
    let parts = Array::of1(&Uint8Array::from(bytes));
    let kind = BlobPropertyBag::new();
    kind.set_type("application/octet-stream");
    let blob = Blob::new_with_u8_array_sequence_and_options(&parts, &kind).map_err(refused)?;
    let address = Url::create_object_url_with_blob(&blob).map_err(refused)?;
    let document = web_sys::window()
        .and_then(|window| window.document())
        .ok_or(WebError::NoWindow)?;
    let link: HtmlAnchorElement = document
        .create_element("a")
        .map_err(refused)?
        .unchecked_into();
    link.set_href(&address);
    link.set_download(name);
    link.click();
    Url::revoke_object_url(&address).map_err(refused)
}

/// What an exception of the browser says.
fn words(error: &JsValue) -> String {
    match error.dyn_ref::<js_sys::Error>() {
        Some(error) => error.message().into(),
        None => format!("{error:?}"),
    }
}
