//! Asynchronous readback of small buffers.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use super::resources::{labelled, submit};
use crate::gpu::Context;

const IDLE: u8 = 0;
const UNDER_WAY: u8 = 1;
const HERE: u8 = 2;
const LOST: u8 = 3;

/// Takes one answer at a time from a buffer to memory.
pub(crate) struct Readback {
    staging: wgpu::Buffer,
    state: Arc<AtomicU8>,
    bytes: u64,
}

impl Readback {
    /// For at most `most` bytes.
    pub fn new(context: &Context, most: u64) -> Readback {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        Readback {
            staging: labelled(context, "readback", most, usage),
            state: Arc::default(),
            bytes: 0,
        }
    }

    /// Is there no answer under way?
    pub fn is_idle(&self) -> bool {
        self.state.load(Ordering::Acquire) == IDLE
    }

    /// Could so many bytes be sent now?
    pub fn has_room(&self, bytes: u64) -> bool {
        self.is_idle() && bytes <= self.staging.size()
    }

    /// Sends the first `bytes` of `from`, after what `before` records; answers whether it could.
    pub fn send(
        &mut self,
        context: &Context,
        from: &wgpu::Buffer,
        bytes: u64,
        before: impl FnOnce(&mut wgpu::CommandEncoder),
    ) -> bool {
        if !self.is_idle() {
            return false;
        }
        self.bytes = bytes;
        self.state.store(UNDER_WAY, Ordering::Release);
        let state = Arc::clone(&self.state);
        let arrived = move |result: Result<(), wgpu::BufferAsyncError>| {
            let now = if result.is_ok() { HERE } else { LOST };
            state.store(now, Ordering::Release);
        };
        submit(context, |encoder| {
            before(encoder);
            encoder.copy_buffer_to_buffer(from, 0, &self.staging, 0, bytes);
            encoder.map_buffer_on_submit(&self.staging, wgpu::MapMode::Read, 0..bytes, arrived);
        });
        true
    }

    /// What was sent, once it is here.
    pub fn take<T: bytemuck::Pod>(&mut self) -> Option<Vec<T>> {
        let state = self.state.load(Ordering::Acquire);
        let answer = match state {
            HERE => {
                let view = self.staging.get_mapped_range(0..self.bytes).ok();
                let answer = view.map(|view| bytemuck::pod_collect_to_vec(&view));
                self.staging.unmap();
                answer
            }
            LOST => None,
            _ => return None,
        };
        self.state.store(IDLE, Ordering::Release);
        answer
    }
}
