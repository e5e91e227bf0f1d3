//! A worker of the page, by its messages.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use js_sys::{Array, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::{Event, MessageEvent};

use super::Link;

/// What has come: answers, or in words why there are none.
type Inbox = Rc<RefCell<VecDeque<Result<Vec<u8>, String>>>>;

/// The way to a worker that the page has started. It ends with this.
pub struct PageLink {
    worker: web_sys::Worker,
    inbox: Inbox,
    _on_message: Closure<dyn Fn(MessageEvent)>,
    _on_error: Closure<dyn Fn(Event)>,
}

impl PageLink {
    /// Listens to `worker`, and calls `wake` whenever there is something to take.
    pub fn new(worker: web_sys::Worker, wake: impl Fn() + Clone + 'static) -> PageLink {
        let inbox = Inbox::default();
        let put = {
            let inbox = inbox.clone();
            move |answer| {
                inbox.borrow_mut().push_back(answer);
                wake();
            }
        };
        let put_error = put.clone();
        let on_message = Closure::<dyn Fn(MessageEvent)>::new(move |event: MessageEvent| {
            let data = event.data();
            // It says in words why it could not begin.
            put(match data.as_string() {
                Some(reason) => Err(reason),
                None => Ok(Uint8Array::new(&data).to_vec()),
            });
        });
        let on_error = Closure::<dyn Fn(Event)>::new(move |event: Event| {
            event.prevent_default();
            // Of a worker that could not be loaded it says nothing.
            let said = js_sys::Reflect::get(&event, &"message".into());
            let said = said.ok().and_then(|said| said.as_string());
            put_error(Err(said.unwrap_or_else(|| "it cannot be loaded".to_owned())));
        });
        worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
        PageLink {
            worker,
            inbox,
            _on_message: on_message,
            _on_error: on_error,
        }
    }
}

impl Link for PageLink {
    fn send(&mut self, message: Vec<u8>) {
        let bytes = Uint8Array::from(&message[..]);
        let moved = Array::of1(&bytes.buffer());
        // It fails only where the buffer is not this page's to give.
        let _ = self.worker.post_message_with_transfer(&bytes, &moved);
    }

    fn take(&mut self) -> Option<Result<Vec<u8>, String>> {
        self.inbox.borrow_mut().pop_front()
    }
}

impl Drop for PageLink {
    fn drop(&mut self) {
        self.worker.set_onmessage(None);
        self.worker.set_onerror(None);
        self.worker.terminate();
    }
}
