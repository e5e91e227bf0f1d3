//! What measures latency: moves of the mouse without a process for each, and a log that is not read again from the start.
//! Both would take time from what is measured.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use x11rb::NONE;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// Moves the mouse over a window.
pub struct Pointer {
    x: RustConnection,
    window: u32,
}

impl Pointer {
    pub(super) fn over(display: &str, window: u32) -> Pointer {
        let (x, _) = RustConnection::connect(Some(display)).expect("the X server is there");
        Pointer { x, window }
    }

    /// Pixels from the upper left corner of the window.
    pub fn move_to(&self, [to_x, to_y]: [i32; 2]) {
        let to = [to_x, to_y].map(|side| i16::try_from(side).expect("within the window"));
        self.x
            .warp_pointer(NONE, self.window, 0, 0, 0, 0, to[0], to[1])
            .expect("the mouse can be moved");
        self.x.flush().expect("the X server is there");
    }
}

/// Counts one kind of events of a log.
pub struct EventCounter {
    log: File,
    pattern: String,
    /// What was read of a line that is half written.
    rest: String,
    n: usize,
}

impl EventCounter {
    pub(super) fn new(log: &Path, event: &str) -> EventCounter {
        EventCounter {
            log: File::open(log).expect("there is a log"),
            pattern: format!("\"event\":\"{event}\""),
            rest: String::new(),
            n: 0,
        }
    }

    /// Events so far.
    pub fn count(&mut self) -> usize {
        self.log
            .read_to_string(&mut self.rest)
            .expect("the log is text");
        let end = self.rest.rfind('\n').map_or(0, |at| at + 1);
        let whole: String = self.rest.drain(..end).collect();
        self.n += whole.matches(&self.pattern).count();
        self.n
    }
}
