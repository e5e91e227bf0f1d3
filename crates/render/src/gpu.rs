//! One wgpu device, opened the same way by the renderer and by the probe.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crate::limits;

pub use crate::limits::Demand;
pub use strandlight_scene::interactive::ResourceCounts;

/// Why no device could be had, or why it failed later.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No driver, or no adapter the driver offers.
    #[error("no GPU adapter was found ({0})")]
    NoAdapter(#[source] Cause),
    /// The adapter exists but cannot do what every backend here needs.
    #[error("GPU adapter '{adapter}' cannot be used: {reason}")]
    Unsuitable {
        /// Name of the adapter.
        adapter: String,
        /// What is missing.
        reason: String,
    },
    /// Opening the device failed.
    #[error("GPU adapter '{adapter}' could not be opened: {source}")]
    NoDevice {
        /// Name of the adapter.
        adapter: String,
        /// The driver's answer.
        source: wgpu::RequestDeviceError,
    },
    /// The device is gone: reset, unplugged, its driver replaced. Another may be opened.
    #[error("the GPU device was lost: {reason}")]
    Lost {
        /// The driver's answer.
        reason: String,
    },
    /// A command or a read-back failed.
    #[error("GPU work '{what}' failed: {source}")]
    Failed {
        /// The work that failed.
        what: &'static str,
        /// The driver's answer.
        source: Cause,
    },
}

/// What failed below: an error of wgpu or of a shader, or a sentence.
pub type Cause = Box<dyn std::error::Error + Send + Sync>;

/// `error` as a cause. In a page, where it cannot leave its thread, only what it says.
pub(crate) fn cause_of(error: wgpu::Error) -> Cause {
    #[cfg(not(target_arch = "wasm32"))]
    return error.into();
    #[cfg(target_arch = "wasm32")]
    return error.to_string().into();
}

/// An opened device and its queue. Clones share both.
#[derive(Clone, Debug)]
pub struct Context {
    /// The adapter the device was opened on; none if a host opened it.
    pub adapter: Option<wgpu::Adapter>,
    /// The device.
    pub device: wgpu::Device,
    /// Its only queue.
    pub queue: wgpu::Queue,
    /// Name of the adapter as the driver gives it.
    pub adapter_name: String,
    /// `vulkan`, `metal`, `dx12` or `webgpu`.
    pub backend: String,
    faults: Arc<Mutex<Faults>>,
    resource_counters: Arc<ResourceCounters>,
    recorder: Arc<Mutex<Recorder>>,
}

/// Where commands go that are not submitted at once.
#[derive(Default)]
struct Recorder {
    /// The host's, or that of the commands which are collected; none: they are submitted at once.
    encoder: Option<wgpu::CommandEncoder>,
    /// Commands without a host are submitted together, at the next [`Context::flush`].
    is_collecting: bool,
    /// Carries what is written between commands of that encoder.
    belt: Option<wgpu::util::StagingBelt>,
}

impl Recorder {
    /// Ends what is written between the commands of `encoder`.
    fn finish(&mut self, encoder: &wgpu::CommandEncoder) {
        if let Some(belt) = &mut self.belt {
            belt.finish_and_recall_on_submit(encoder);
        }
    }
}

impl std::fmt::Debug for Recorder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recorder")
            .field("has_commands", &self.encoder.is_some())
            .field("is_collecting", &self.is_collecting)
            .finish()
    }
}

/// Bytes of a chunk of staging memory: the uniforms of many steps.
const BELT_CHUNK: u64 = 256 << 10;

/// What a device said of itself outside any error scope.
#[derive(Debug, Default)]
struct Faults {
    lost: Option<String>,
    first_error: Option<Cause>,
}

/// What was made on a device and written to it since it was opened.
#[derive(Debug, Default)]
pub(crate) struct ResourceCounters {
    pub buffers: AtomicU64,
    pub textures: AtomicU64,
    pub pipelines: AtomicU64,
    pub bind_groups: AtomicU64,
    pub geometry_uploads: AtomicU64,
    pub bytes: AtomicU64,
    pub submissions: AtomicU64,
    pub workgroups: AtomicU64,
    pub written_bytes: AtomicU64,
}

impl ResourceCounters {
    /// Counts one.
    pub fn add(counter: &AtomicU64) {
        counter.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts a buffer.
    pub fn add_buffer(&self, bytes: u64) {
        Self::add(&self.buffers);
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Counts a texture.
    pub fn add_texture(&self, bytes: u64) {
        Self::add(&self.textures);
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Counts the workgroups of a dispatch.
    pub fn add_workgroups(&self, [x, y]: [u32; 2]) {
        let n = u64::from(x) * u64::from(y);
        self.workgroups.fetch_add(n, Ordering::Relaxed);
    }

    /// Counts bytes that go to the device.
    pub fn add_written(&self, bytes: usize) {
        self.written_bytes
            .fetch_add(bytes as u64, Ordering::Relaxed);
    }

    pub fn counts(&self) -> ResourceCounts {
        let of = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        ResourceCounts {
            buffers: of(&self.buffers),
            textures: of(&self.textures),
            pipelines: of(&self.pipelines),
            bind_groups: of(&self.bind_groups),
            geometry_uploads: of(&self.geometry_uploads),
            bytes: of(&self.bytes),
            submissions: of(&self.submissions),
            workgroups: of(&self.workgroups),
            written_bytes: of(&self.written_bytes),
        }
    }
}

impl Context {
    /// What draws, as pictures and statistics name it: `gpu: adapter (backend)`.
    pub fn name(&self) -> String {
        format!("gpu: {} ({})", self.adapter_name, self.backend)
    }

    /// Opens the fastest adapter of this machine; a software rasteriser is good enough.
    ///
    /// Limits are WebGPU's defaults, or what the adapter has where that is less and enough, except
    /// the sizes of buffers and storage bindings, which are what it offers. Time stamps are asked
    /// for where there are any, nothing else that is optional.
    ///
    /// # Errors
    /// No adapter, one that cannot do what is needed, or a driver that fails.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn new() -> Result<Context, GpuError> {
        Self::with_power_preference(wgpu::PowerPreference::HighPerformance)
    }

    /// As [`Context::new`], with a choice between the fast and the frugal adapter.
    ///
    /// # Errors
    /// As [`Context::new`].
    #[cfg(not(target_arch = "wasm32"))]
    pub fn with_power_preference(power: wgpu::PowerPreference) -> Result<Context, GpuError> {
        let options = wgpu::RequestAdapterOptions {
            power_preference: power,
            ..Default::default()
        };
        pollster::block_on(Self::with_demand(
            &headless_instance(),
            &options,
            Demand::Offered,
        ))
    }

    /// As [`Context::new`], with the limits that every adapter has.
    ///
    /// # Errors
    /// As [`Context::new`].
    #[cfg(not(target_arch = "wasm32"))]
    pub fn with_least_limits() -> Result<Context, GpuError> {
        let options = wgpu::RequestAdapterOptions::default();
        pollster::block_on(Self::with_demand(
            &headless_instance(),
            &options,
            Demand::Least,
        ))
    }

    /// As [`Context::new`], as if the adapter offered what `shrink` leaves of its limits.
    ///
    /// # Errors
    /// As [`Context::new`].
    #[cfg(not(target_arch = "wasm32"))]
    pub fn within(shrink: impl FnOnce(&mut wgpu::Limits)) -> Result<Context, GpuError> {
        let options = wgpu::RequestAdapterOptions::default();
        let (instance, demand) = (headless_instance(), Demand::Offered);
        pollster::block_on(Self::open_within(&instance, &options, demand, shrink))
    }

    /// The fastest adapter of `instance`, one that can present on `compatible_surface` if there is
    /// one.
    ///
    /// # Errors
    /// As [`Context::new`].
    pub async fn request(
        instance: &wgpu::Instance,
        compatible_surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Context, GpuError> {
        let power = wgpu::PowerPreference::HighPerformance;
        Self::open(instance, compatible_surface, power).await
    }

    /// As [`Context::request`], with a choice between the fast and the frugal adapter.
    ///
    /// # Errors
    /// As [`Context::new`].
    pub async fn open(
        instance: &wgpu::Instance,
        compatible_surface: Option<&wgpu::Surface<'_>>,
        power: wgpu::PowerPreference,
    ) -> Result<Context, GpuError> {
        let options = wgpu::RequestAdapterOptions {
            power_preference: power,
            compatible_surface,
            ..Default::default()
        };
        Self::with_demand(instance, &options, Demand::Offered).await
    }

    /// The adapter of `instance` that `options` describe, and a device that can do what `demand`
    /// says; less where the adapter does, as long as pictures can be made.
    ///
    /// # Errors
    /// As [`Context::new`].
    pub(crate) async fn with_demand(
        instance: &wgpu::Instance,
        options: &wgpu::RequestAdapterOptions<'_, '_>,
        demand: Demand,
    ) -> Result<Context, GpuError> {
        Self::open_within(instance, options, demand, |_| ()).await
    }

    async fn open_within(
        instance: &wgpu::Instance,
        options: &wgpu::RequestAdapterOptions<'_, '_>,
        demand: Demand,
        shrink: impl FnOnce(&mut wgpu::Limits),
    ) -> Result<Context, GpuError> {
        let adapter = instance
            .request_adapter(options)
            .await
            .map_err(|error| GpuError::NoAdapter(error.into()))?;
        let info = adapter.get_info();
        let unsuitable = |reason: String| GpuError::Unsuitable {
            adapter: info.name.clone(),
            reason,
        };
        let flags = adapter.get_downlevel_capabilities().flags;
        for (flag, what) in [
            (wgpu::DownlevelFlags::COMPUTE_SHADERS, "compute shaders"),
            (
                wgpu::DownlevelFlags::INDIRECT_EXECUTION,
                "draws and dispatches whose size the device finds",
            ),
            (
                wgpu::DownlevelFlags::VERTEX_STORAGE,
                "buffers in vertex shaders",
            ),
        ] {
            if !flags.contains(flag) {
                return Err(unsuitable(format!("it has no {what}")));
            }
        }
        let mut offered = adapter.limits();
        shrink(&mut offered);
        let mut descriptor = wgpu::DeviceDescriptor {
            label: Some("strandlight"),
            required_limits: limits::to_ask_for(&offered, demand).map_err(unsuitable)?,
            ..Default::default()
        };
        if demand == Demand::Offered {
            descriptor.required_features = adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
        }
        let (device, queue) = adapter
            .request_device(&descriptor)
            .await
            .map_err(|source| GpuError::NoDevice {
                adapter: info.name.clone(),
                source,
            })?;
        let faults = Arc::new(Mutex::new(Faults::default()));
        let of_errors = Arc::clone(&faults);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let mut faults = of_errors.lock().unwrap_or_else(PoisonError::into_inner);
            faults.first_error.get_or_insert_with(|| cause_of(error));
        }));
        let of_loss = Arc::clone(&faults);
        device.set_device_lost_callback(move |reason, message| {
            let mut faults = of_loss.lock().unwrap_or_else(PoisonError::into_inner);
            faults
                .lost
                .get_or_insert_with(|| format!("{reason:?} {message}").trim().to_owned());
        });
        Ok(Context {
            adapter: Some(adapter),
            device,
            queue,
            adapter_name: info.name,
            backend: info.backend.to_string(),
            faults,
            resource_counters: Arc::default(),
            recorder: Arc::default(),
        })
    }

    /// The device and queue of a host. No callback is set on them.
    pub(crate) fn from_host(device: &wgpu::Device, queue: &wgpu::Queue) -> Context {
        let info = device.adapter_info();
        Context {
            adapter: None,
            device: device.clone(),
            queue: queue.clone(),
            adapter_name: info.name,
            backend: info.backend.to_string(),
            faults: Arc::default(),
            resource_counters: Arc::default(),
            recorder: Arc::default(),
        }
    }

    /// Has all commands of `work` recorded into `encoder` and nothing submitted. Clones of this
    /// context record there as well meanwhile.
    pub(crate) fn record<T>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        work: impl FnOnce() -> T,
    ) -> T {
        // Stands in for the host's encoder, which moves into the recorder and back.
        let stand_in = self.device.create_command_encoder(&Default::default());
        self.recorder().encoder = Some(std::mem::replace(encoder, stand_in));
        let result = work();
        let mut recorder = self.recorder();
        if let Some(recorded) = recorder.encoder.take() {
            *encoder = recorded;
        }
        recorder.finish(encoder);
        result
    }

    /// The same device and queue, with commands of its own that are recorded or collected.
    pub(crate) fn with_own_commands(&self) -> Context {
        Context {
            recorder: Arc::default(),
            ..self.clone()
        }
    }

    /// Collects the commands of `work`, and submits them together where something has to be waited for or read, or at
    /// the end: every submission costs a fast device more than small steps do. Nobody else may use this context meanwhile.
    pub(crate) fn collect<T>(&self, work: impl FnOnce() -> T) -> T {
        /// Ends collecting, also where `work` panics.
        struct Collecting<'c>(&'c Context);
        impl Drop for Collecting<'_> {
            fn drop(&mut self) {
                self.0.flush();
                self.0.recorder().is_collecting = false;
            }
        }
        self.recorder().is_collecting = true;
        let _collecting = Collecting(self);
        work()
    }

    /// Are commands collected?
    pub(crate) fn is_collecting(&self) -> bool {
        self.recorder().is_collecting
    }

    /// Submits the commands that were collected.
    pub(crate) fn flush(&self) {
        let mut recorder = self.recorder();
        if !recorder.is_collecting {
            return;
        }
        let Some(encoder) = recorder.encoder.take() else {
            return;
        };
        recorder.finish(&encoder);
        self.submit_now(encoder);
        // A belt panics on a device that is lost, where the queue takes what is written.
        let _ = self.device.poll(wgpu::PollType::Poll);
        if self.is_lost() {
            recorder.is_collecting = false;
            recorder.belt = None;
        }
    }

    fn is_lost(&self) -> bool {
        let faults = self.faults.lock().unwrap_or_else(PoisonError::into_inner);
        faults.lost.is_some()
    }

    fn submit_now(&self, encoder: wgpu::CommandEncoder) {
        ResourceCounters::add(&self.resource_counters.submissions);
        self.queue.submit([encoder.finish()]);
    }

    /// Records commands and submits them, unless a host's encoder takes them or they are collected.
    pub(crate) fn submit(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) {
        let new = || self.device.create_command_encoder(&Default::default());
        let mut recorder = self.recorder();
        if recorder.is_collecting {
            recorder.encoder.get_or_insert_with(new);
        }
        if let Some(encoder) = &mut recorder.encoder {
            record(encoder);
            return;
        }
        drop(recorder);
        let mut encoder = new();
        record(&mut encoder);
        self.submit_now(encoder);
    }

    /// Writes `bytes` (a multiple of 4) into `buffer`: after the commands before and before those
    /// to come, recorded or submitted.
    pub(crate) fn write(&self, buffer: &wgpu::Buffer, offset: u64, bytes: &[u8]) {
        self.resource_counters.add_written(bytes.len());
        if bytes.len() as u64 > BELT_CHUNK {
            self.flush();
        }
        let mut recorder = self.recorder();
        let Recorder { encoder, belt, .. } = &mut *recorder;
        let size = wgpu::BufferSize::new(bytes.len() as u64);
        match (encoder, size) {
            (Some(encoder), Some(size)) => {
                let belt = belt.get_or_insert_with(|| {
                    wgpu::util::StagingBelt::new(self.device.clone(), BELT_CHUNK)
                });
                belt.write_buffer(encoder, buffer, offset, size)
                    .copy_from_slice(bytes);
            }
            (None, Some(_)) => self.queue.write_buffer(buffer, offset, bytes),
            (_, None) => {}
        }
    }

    /// Writes the texels of a part of a texture: after the commands before, unless a host has them, and before those to
    /// come.
    pub(crate) fn write_texture(
        &self,
        texture: wgpu::TexelCopyTextureInfo,
        texels: &[u8],
        layout: wgpu::TexelCopyBufferLayout,
        size: wgpu::Extent3d,
    ) {
        self.resource_counters.add_written(texels.len());
        self.flush();
        self.queue.write_texture(texture, texels, layout, size);
    }

    fn recorder(&self) -> std::sync::MutexGuard<'_, Recorder> {
        self.recorder.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Does the device measure the time of passes?
    pub fn has_timestamps(&self) -> bool {
        self.device
            .features()
            .contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// Is it a program that draws on the processor, with no GPU behind it? Its time stamps then say
    /// little.
    pub fn is_software(&self) -> bool {
        self.device.adapter_info().device_type == wgpu::DeviceType::Cpu
    }

    /// The first error of the device that no error scope caught, since the last call; the device's
    /// loss stays.
    ///
    /// # Errors
    /// [`GpuError::Lost`] or [`GpuError::Failed`].
    pub fn check(&self, what: &'static str) -> Result<(), GpuError> {
        let mut faults = self.faults.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(reason) = &faults.lost {
            return Err(GpuError::Lost {
                reason: reason.clone(),
            });
        }
        match faults.first_error.take() {
            Some(source) => Err(GpuError::Failed { what, source }),
            None => Ok(()),
        }
    }

    /// What was made on the device since it was opened.
    pub fn counts(&self) -> ResourceCounts {
        self.resource_counters.counts()
    }

    pub(crate) fn resource_counters(&self) -> &ResourceCounters {
        &self.resource_counters
    }

    /// Waits until all submitted work is done, at most a minute.
    pub fn wait(&self, what: &'static str) -> Result<(), GpuError> {
        self.flush();
        self.device
            .poll(wgpu::PollType::Wait {
                submission_index: None,
                timeout: Some(Duration::from_secs(60)),
            })
            .map_err(|error| GpuError::Failed {
                what,
                source: error.into(),
            })?;
        self.check(what)
    }

    /// Copies the whole of a mappable buffer (`MAP_READ`) into memory, after all submitted work.
    pub fn read_buffer(
        &self,
        what: &'static str,
        buffer: &wgpu::Buffer,
    ) -> Result<Vec<u8>, GpuError> {
        let failed = |source: Cause| GpuError::Failed { what, source };
        let (sender, receiver) = std::sync::mpsc::channel();
        self.flush();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver lives until the answer has come.
            let _ = sender.send(result);
        });
        self.wait(what)?;
        receiver
            .recv()
            .map_err(|error| failed(error.into()))?
            .map_err(|error| failed(error.into()))?;
        let bytes = buffer
            .get_mapped_range(..)
            .map_err(|error| failed(error.into()))?
            .to_vec();
        buffer.unmap();
        Ok(bytes)
    }
}

/// An instance that draws to no display.
#[cfg(not(target_arch = "wasm32"))]
fn headless_instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env())
}
