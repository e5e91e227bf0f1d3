//! Time stamps of passes, read without waiting for them.

use super::readback::Readback;
use super::resources::labelled;
use super::stamp::Stamp;
use crate::gpu::Context;

/// Slices that are timed between two readings.
const SLICES: u32 = 64;

/// The device's clock.
pub(crate) struct Clock {
    device: Option<Device>,
}

struct Device {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readback: Readback,
    /// Names of the slices stamped since the last reading, and of those being read.
    names: Vec<&'static str>,
    reading: Vec<&'static str>,
    milliseconds_per_tick: f64,
}

impl Clock {
    /// A clock, which stands still if the device has no time stamps.
    pub fn new(context: &Context) -> Clock {
        let device = context.has_timestamps().then(|| {
            let set = context.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("clock"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * SLICES,
            });
            let bytes = u64::from(SLICES) * 16;
            let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
            Device {
                set,
                resolved: labelled(context, "time stamps", bytes, usage),
                readback: Readback::new(context, bytes),
                names: Vec::new(),
                reading: Vec::new(),
                milliseconds_per_tick: 1e-6 * f64::from(context.queue.get_timestamp_period()),
            }
        });
        Clock { device }
    }

    /// A clock that stands still.
    pub fn none() -> Clock {
        Clock { device: None }
    }

    /// Where the next slice, one of `name`, notes its time.
    pub fn stamp(&mut self, name: &'static str) -> Stamp {
        let Some(device) = &mut self.device else {
            return Stamp::default();
        };
        let ix = device.names.len() as u32;
        if ix >= SLICES || !device.readback.is_idle() {
            return Stamp::default();
        }
        device.names.push(name);
        Stamp {
            set: Some(device.set.clone()),
            begin: Some(2 * ix),
            end: Some(2 * ix + 1),
        }
    }

    /// Starts to read what was stamped, if no reading is under way.
    pub fn start_reading(&mut self, context: &Context) {
        let Some(device) = &mut self.device else {
            return;
        };
        if device.names.is_empty() || !device.readback.is_idle() {
            return;
        }
        let n = device.names.len() as u32;
        let (set, resolved) = (&device.set, &device.resolved);
        device
            .readback
            .send(context, resolved, u64::from(n) * 16, |encoder| {
                encoder.resolve_query_set(set, 0..2 * n, resolved, 0);
            });
        device.reading = std::mem::take(&mut device.names);
    }

    /// Tells `note` of the slices that a reading has brought: name and milliseconds.
    pub fn take(&mut self, mut note: impl FnMut(&'static str, f64)) {
        let Some(device) = &mut self.device else {
            return;
        };
        let Some(ticks) = device.readback.take::<[u64; 2]>() else {
            return;
        };
        for (name, [begin, end]) in device.reading.drain(..).zip(ticks) {
            let ticks = end.saturating_sub(begin) as f64;
            note(name, ticks * device.milliseconds_per_tick);
        }
    }
}
