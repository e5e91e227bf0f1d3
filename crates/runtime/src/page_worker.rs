//! What runs in a worker of a page: all of its program that is called there, or a program that has nothing else.
//!
//! Where the program was built for shared memory (`web/build --threads`) a worker has threads: more workers, each with an
//! instance on the same memory. JavaScript starts them, since a program cannot: [`PageWorker::use_threads`] says how many
//! there are, and each calls [`run_thread`].

#[cfg(target_feature = "atomics")]
use std::sync::{Condvar, Mutex, PoisonError};

use js_sys::Uint8Array;
#[cfg(target_feature = "atomics")]
use rayon::{ThreadBuilder, ThreadPoolBuilder};
use wasm_bindgen::prelude::*;

use crate::worker::Worker;

/// What draws in a worker: it has an instance of the program to itself, and no page.
#[wasm_bindgen]
#[derive(Default)]
pub struct PageWorker(Worker);

#[wasm_bindgen]
impl PageWorker {
    /// Draws nothing yet.
    #[wasm_bindgen(constructor)]
    pub fn new() -> PageWorker {
        std::panic::set_hook(Box::new(|info| {
            web_sys::console::error_1(&info.to_string().into());
        }));
        PageWorker::default()
    }

    /// Takes a message of the page.
    pub fn take(&mut self, message: &[u8]) {
        self.0.take(message);
    }

    /// Goes on with the picture; answers a message for the page, if there is something new.
    pub fn work(&mut self) -> Option<Uint8Array> {
        self.0.work().map(|message| Uint8Array::from(&message[..]))
    }

    /// Is there something to do?
    pub fn is_working(&self) -> bool {
        self.0.is_working()
    }

    /// Draws with so many threads, this one among them, from now on. Waits for the others, which must be in [`run_thread`] or
    /// about to be.
    ///
    /// # Errors
    /// There are threads already.
    #[cfg(target_feature = "atomics")]
    pub fn use_threads(&self, n_threads: usize) -> Result<(), JsError> {
        let pool = ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .use_current_thread();
        let started = pool.spawn_handler(|thread| {
            let mut waiting = TO_RUN.lock().unwrap_or_else(PoisonError::into_inner);
            waiting.push(thread);
            THERE_IS_ONE.notify_one();
            Ok(())
        });
        let built = started.build_global();
        built.map_err(|error| JsError::new(&error.to_string()))
    }
}

/// Threads of the pool that no worker runs yet.
#[cfg(target_feature = "atomics")]
static TO_RUN: Mutex<Vec<ThreadBuilder>> = Mutex::new(Vec::new());

#[cfg(target_feature = "atomics")]
static THERE_IS_ONE: Condvar = Condvar::new();

/// Runs a thread of a [`PageWorker`] on the same memory, as soon as there is one. Never ends but by a panic.
#[cfg(target_feature = "atomics")]
#[wasm_bindgen]
pub fn run_thread() {
    let waiting = TO_RUN.lock().unwrap_or_else(PoisonError::into_inner);
    let waiting = THERE_IS_ONE.wait_while(waiting, |waiting| waiting.is_empty());
    let thread = waiting.unwrap_or_else(PoisonError::into_inner).pop();
    if let Some(thread) = thread {
        thread.run();
    }
}
