//! One wgpu device, opened the same way by the renderer and by the probe.

use std::time::Duration;

/// Why no device could be had, or why it failed later.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No driver, or no adapter the driver offers.
    #[error("no GPU adapter was found ({0})")]
    NoAdapter(String),
    /// The adapter exists but cannot do what every backend here needs.
    #[error("GPU adapter '{adapter}' cannot be used: {reason}")]
    Unsuitable {
        /// Name of the adapter.
        adapter: String,
        /// What is missing.
        reason: String,
    },
    /// Opening the device failed.
    #[error("GPU adapter '{adapter}' could not be opened: {reason}")]
    NoDevice {
        /// Name of the adapter.
        adapter: String,
        /// The driver's answer.
        reason: String,
    },
    /// A command or a read-back failed.
    #[error("GPU work '{what}' failed: {reason}")]
    Failed {
        /// The work that failed.
        what: &'static str,
        /// The driver's answer.
        reason: String,
    },
}

/// An opened device and its queue; clones share them.
#[derive(Clone, Debug)]
pub struct Context {
    /// The adapter the device was opened on.
    pub adapter: wgpu::Adapter,
    /// The device.
    pub device: wgpu::Device,
    /// Its only queue.
    pub queue: wgpu::Queue,
    /// Name of the adapter as the driver gives it.
    pub adapter_name: String,
    /// `vulkan`, `metal` or `dx12`.
    pub backend: String,
}

impl Context {
    /// Opens the fastest adapter of this machine; a software rasteriser is good enough.
    ///
    /// No optional feature is asked for. Limits are WebGPU's defaults, except the sizes of
    /// buffers and storage bindings, which are what the adapter offers.
    pub fn new() -> Result<Context, GpuError> {
        Self::with_power_preference(wgpu::PowerPreference::HighPerformance)
    }

    /// As [`Context::new`], with a choice between the fast and the frugal adapter.
    pub fn with_power_preference(power: wgpu::PowerPreference) -> Result<Context, GpuError> {
        let instance =
            wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        pollster::block_on(Self::open(&instance, None, power))
    }

    /// As [`Context::new`] for an instance that the caller has made, without blocking. Where a
    /// `surface` is given, the adapter can present to it.
    pub async fn open(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
        power: wgpu::PowerPreference,
    ) -> Result<Context, GpuError> {
        let options = wgpu::RequestAdapterOptions {
            power_preference: power,
            compatible_surface: surface,
            ..Default::default()
        };
        let adapter = (instance.request_adapter(&options).await)
            .map_err(|error| GpuError::NoAdapter(error.to_string()))?;
        let info = adapter.get_info();
        if !adapter
            .get_downlevel_capabilities()
            .flags
            .contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
        {
            return Err(GpuError::Unsuitable {
                adapter: info.name,
                reason: "it has no compute shaders".to_owned(),
            });
        }
        let offered = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("strandlight"),
            required_limits: wgpu::Limits {
                max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
                max_buffer_size: offered.max_buffer_size,
                ..Default::default()
            },
            ..Default::default()
        };
        let (device, queue) =
            adapter
                .request_device(&descriptor)
                .await
                .map_err(|error| GpuError::NoDevice {
                    adapter: info.name.clone(),
                    reason: error.to_string(),
                })?;
        Ok(Context {
            adapter,
            device,
            queue,
            adapter_name: info.name,
            backend: info.backend.to_string(),
        })
    }

    /// Waits until all submitted work is done, at most a minute.
    pub fn wait(&self, what: &'static str) -> Result<(), GpuError> {
        self.device
            .poll(wgpu::PollType::Wait {
                submission_index: None,
                timeout: Some(Duration::from_secs(60)),
            })
            .map(|_| ())
            .map_err(|error| GpuError::Failed {
                what,
                reason: error.to_string(),
            })
    }

    /// Copies the whole of a mappable buffer (`MAP_READ`) into memory, after all submitted work.
    pub fn read_buffer(
        &self,
        what: &'static str,
        buffer: &wgpu::Buffer,
    ) -> Result<Vec<u8>, GpuError> {
        let failed = |reason: String| GpuError::Failed { what, reason };
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver lives until the answer has come.
            let _ = sender.send(result);
        });
        self.wait(what)?;
        receiver
            .recv()
            .map_err(|error| failed(error.to_string()))?
            .map_err(|error| failed(error.to_string()))?;
        let bytes = buffer
            .get_mapped_range(..)
            .map_err(|error| failed(error.to_string()))?
            .to_vec();
        buffer.unmap();
        Ok(bytes)
    }
}
