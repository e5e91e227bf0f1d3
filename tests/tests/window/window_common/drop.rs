//! Files dropped on a window as a file manager does it: X's drag and drop (XDND).

use std::path::Path;
use std::time::{Duration, Instant};

use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    Atom, ClientMessageEvent, ConnectionExt as _, CreateWindowAux, EventMask, PropMode,
    SELECTION_NOTIFY_EVENT, SelectionNotifyEvent, SelectionRequestEvent, WindowClass,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;
use x11rb::{COPY_DEPTH_FROM_PARENT, COPY_FROM_PARENT, CURRENT_TIME};

/// Version of the protocol.
const VERSION: u32 = 5;

type Answer<T> = Result<T, Box<dyn std::error::Error>>;

/// Drops `files` in the middle of `window` and waits until it says that it has taken them.
pub fn files(display: &str, window: u32, files: &[&Path]) {
    let dropped = drop_on(display, window, files);
    dropped.unwrap_or_else(|error| panic!("files cannot be dropped: {error}"));
}

fn drop_on(display: &str, window: u32, files: &[&Path]) -> Answer<()> {
    let (x, screen) = RustConnection::connect(Some(display))?;
    let root = x.setup().roots[screen].root;
    let atom =
        |name: &str| -> Answer<Atom> { Ok(x.intern_atom(false, name.as_bytes())?.reply()?.atom) };
    let selection = atom("XdndSelection")?;
    let list = atom("text/uri-list")?;
    let (status, finished) = (atom("XdndStatus")?, atom("XdndFinished")?);
    let source = x.generate_id()?;
    x.create_window(
        COPY_DEPTH_FROM_PARENT,
        source,
        root,
        0,
        0,
        1,
        1,
        0,
        WindowClass::INPUT_OUTPUT,
        COPY_FROM_PARENT,
        &CreateWindowAux::new(),
    )?;
    x.set_selection_owner(source, selection, CURRENT_TIME)?;
    let tell = |message: &str, data: [u32; 5]| -> Answer<()> {
        let event = ClientMessageEvent::new(32, window, atom(message)?, data);
        x.send_event(false, window, EventMask::NO_EVENT, event)?;
        Ok(x.flush()?)
    };
    let uris: String = files
        .iter()
        .map(|file| format!("file://{}\r\n", file.display()))
        .collect();
    tell("XdndEnter", [source, VERSION << 24, list, 0, 0])?;
    let at = (300 << 16) | 200;
    tell(
        "XdndPosition",
        [source, 0, at, CURRENT_TIME, atom("XdndActionCopy")?],
    )?;
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(60) {
        match x.poll_for_event()? {
            Some(Event::SelectionRequest(asked)) => give(&x, &asked, uris.as_bytes())?,
            Some(Event::ClientMessage(event)) if event.type_ == status => {
                tell("XdndDrop", [source, 0, CURRENT_TIME, 0, 0])?;
            }
            Some(Event::ClientMessage(event)) if event.type_ == finished => return Ok(()),
            Some(_) => {}
            None => std::thread::sleep(Duration::from_millis(10)),
        }
    }
    Err("the window does not answer".into())
}

/// Puts `data` where the window asked for it.
fn give(x: &RustConnection, asked: &SelectionRequestEvent, data: &[u8]) -> Answer<()> {
    let (window, property) = (asked.requestor, asked.property);
    x.change_property8(PropMode::REPLACE, window, property, asked.target, data)?;
    let event = SelectionNotifyEvent {
        response_type: SELECTION_NOTIFY_EVENT,
        sequence: 0,
        time: asked.time,
        requestor: window,
        selection: asked.selection,
        target: asked.target,
        property,
    };
    x.send_event(false, window, EventMask::NO_EVENT, event)?;
    Ok(x.flush()?)
}
