//! The page around the viewer: what it shows, knows of the scene, and offers as files.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::path::PathBuf;

use js_sys::{Array, Function, Promise, Uint8Array};
use serde_json::Value;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{Blob, BlobPropertyBag, HtmlAnchorElement, Url};

use crate::session::Saved;
use strandlight_scene::files::Files;

thread_local! {
    /// Takes the name of something that happened and what there is to say of it.
    static TELL: RefCell<Option<Function>> = const { RefCell::new(None) };
    /// Has the scene changes that were not saved?
    static IS_MODIFIED: Cell<bool> = const { Cell::new(false) };
    /// Pressures of the pen in the event that the browser is telling of, one for each place; none of other pointers.
    static PEN: RefCell<VecDeque<f64>> = const { RefCell::new(VecDeque::new()) };
    /// What listens to pens.
    static LISTENER: RefCell<Option<Listener>> = const { RefCell::new(None) };
}

type Listener = Closure<dyn Fn(JsValue)>;

/// Listens to pens from now on, before the canvas hears of them: winit tells of pens as of mice, without pressure.
pub fn listen_to_pens() {
    stop_listening();
    let get = |of: &JsValue, key: &str| js_sys::Reflect::get(of, &key.into()).ok();
    let pressure = move |event: &JsValue| get(event, "pressure").and_then(|it| it.as_f64());
    let listener = Listener::new(move |event: JsValue| {
        let kind = get(&event, "pointerType").and_then(|kind| kind.as_string());
        let mut pressures = VecDeque::new();
        if kind.as_deref() == Some("pen") {
            // Of the places that a move comes by winit tells one after the other.
            let all = get(&event, "getCoalescedEvents")
                .and_then(|get_all| get_all.dyn_into::<Function>().ok())
                .and_then(|get_all| get_all.call0(&event).ok())
                .and_then(|all| all.dyn_into::<Array>().ok());
            pressures.extend(
                all.into_iter()
                    .flat_map(|all| all.to_vec())
                    .filter_map(|it| pressure(&it)),
            );
            if pressures.is_empty() {
                pressures.extend(pressure(&event));
            }
        }
        PEN.set(pressures);
    });
    // Where that is refused, pens are mice.
    let _ = call_for_pointers("addEventListener", &listener);
    LISTENER.set(Some(listener));
}

/// Listens no longer: a page that went on calling would keep the memory of a viewer that is closed.
pub fn stop_listening() {
    if let Some(listener) = LISTENER.take() {
        let _ = call_for_pointers("removeEventListener", &listener);
    }
}

/// Calls a method of the page with each event of pointers and `listener`, which hears of it before the canvas does.
fn call_for_pointers(method: &str, listener: &Listener) -> Result<(), JsValue> {
    let page = js_sys::global();
    let method: Function = js_sys::Reflect::get(&page, &method.into())?.dyn_into()?;
    for kind in ["pointerdown", "pointermove", "pointerup", "pointercancel"] {
        method.call3(&page, &kind.into(), listener.as_ref(), &JsValue::TRUE)?;
    }
    Ok(())
}

/// Pressure of the pen at the next place of the event that the browser is telling of, 0..=1; none of other pointers.
pub fn pen_pressure() -> Option<f64> {
    PEN.with_borrow_mut(|pressures| match pressures.len() {
        0 | 1 => pressures.front().copied(),
        _ => pressures.pop_front(),
    })
}

/// Takes the function of the page that [`tell`] calls, or none any more.
pub(crate) fn set_tell(tell: Option<Function>) {
    TELL.with_borrow_mut(|of_page| *of_page = tell);
}

/// Does the browser offer a GPU? A canvas that was asked for it and got none shows nothing else.
pub async fn has_webgpu() -> bool {
    let get = |of: &JsValue, key: &str| js_sys::Reflect::get(of, &key.into()).ok();
    let gpu = get(&js_sys::global(), "navigator").and_then(|navigator| get(&navigator, "gpu"));
    let Some(gpu) = gpu.filter(|gpu| !gpu.is_undefined()) else {
        return false;
    };
    let request = get(&gpu, "requestAdapter").and_then(|of_gpu| of_gpu.dyn_into::<Function>().ok());
    let asked = request.and_then(|request| request.call0(&gpu).ok());
    let Some(answer) = asked.and_then(|answer| answer.dyn_into::<Promise>().ok()) else {
        return false;
    };
    let adapter = JsFuture::from(answer).await;
    adapter.is_ok_and(|adapter| !adapter.is_null() && !adapter.is_undefined())
}

/// Tells the page that `event` happened. It must not call back before this returns.
pub(crate) fn tell(event: &str, detail: &Value) {
    TELL.with_borrow(|tell| {
        if let Some(tell) = tell {
            // A page that cannot be told has nowhere to say so either.
            let _ = tell.call2(&JsValue::NULL, &event.into(), &detail.to_string().into());
        }
    });
}

/// Shows `text` in place of the canvas, or the canvas if it is empty.
pub fn say(text: &str) {
    tell("say", &Value::from(text));
}

/// Has the scene changes that would be lost with the page?
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
    /// An address that is none.
    #[error("{address}: not an address: {reason}")]
    Address {
        /// As it was given.
        address: String,
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
pub(crate) fn words(error: &JsValue) -> String {
    match error.dyn_ref::<js_sys::Error>() {
        Some(error) => error.message().into(),
        None => format!("{error:?}"),
    }
}
