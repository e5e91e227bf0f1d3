//! The WGSL functions at work: many lights at many views, for timing.

use std::time::Instant;

use strandlight_scattering::closed_form::{DirectionInFrame, LightInFrame};
use wgpu::util::DeviceExt;

use super::Scheme;
use crate::gpu::{Cause, Context, GpuError, cause_of};
use crate::gpu_optics::GpuOptics;
use crate::gpu_tables::GpuTables;
use strandlight_scene::optics::Optics;
use strandlight_scene::tables::ShadingTables;
use strandlight_shaders as shaders;

/// Threads a workgroup, as in the shader.
const WORKGROUP: u32 = 64;
/// Most views of a workload: one dispatch of WebGPU's 65535 workgroups.
pub const MAX_VIEWS: usize = 65_535 * WORKGROUP as usize;

/// The entry point of `shaders/pass/bench.wgsl` that times `scheme`.
const fn entry_point(scheme: Scheme) -> &'static str {
    match scheme {
        Scheme::Lobes => "bench_lobes",
        Scheme::Paper => "bench_paper",
    }
}

/// Times single scattering on the adapter.
#[derive(Debug)]
pub struct GpuBench {
    context: Context,
    layout: wgpu::BindGroupLayout,
    pipelines: Vec<wgpu::ComputePipeline>,
}

/// What a run evaluates, on the device: every light at every view under every fibre.
#[derive(Debug)]
pub struct Workload {
    groups: Vec<wgpu::BindGroup>,
    answers: wgpu::Buffer,
    n_views: u32,
    n_evaluations: u64,
}

impl Workload {
    /// Evaluations of a run: fibres times views times lights.
    pub fn n_evaluations(&self) -> u64 {
        self.n_evaluations
    }
}

impl GpuBench {
    /// Opens the adapter and compiles the schemes.
    ///
    /// # Errors
    /// No usable adapter, or a shader the driver refuses.
    pub fn new() -> Result<GpuBench, GpuError> {
        let context = Context::new()?;
        let device = &context.device;
        let failed = |source: Cause| GpuError::Failed {
            what: "bench shader",
            source,
        };
        let source = shaders::resolve("pass/bench").map_err(|error| failed(error.into()))?;
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("bench"),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let buffer = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        use wgpu::BufferBindingType::{Storage, Uniform};
        let mut entries = vec![
            buffer(0, Uniform),
            buffer(1, Storage { read_only: true }),
            buffer(2, Storage { read_only: true }),
            buffer(3, Storage { read_only: false }),
        ];
        entries.extend(GpuTables::layout_entries(4, wgpu::ShaderStages::COMPUTE));
        entries.extend(GpuOptics::layout_entries(8, wgpu::ShaderStages::COMPUTE));
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("bench"),
            entries: &entries,
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("bench"),
            bind_group_layouts: &[Some(&layout)],
            ..Default::default()
        });
        let pipelines = Scheme::ALL
            .iter()
            .map(|&scheme| {
                device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(entry_point(scheme)),
                    layout: Some(&pipeline_layout),
                    module: &module,
                    entry_point: Some(entry_point(scheme)),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    cache: None,
                })
            })
            .collect();
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(failed(cause_of(error)));
        }
        Ok(GpuBench {
            context,
            layout,
            pipelines,
        })
    }

    /// The device of the runs.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// Uploads a workload; `views` beyond [`MAX_VIEWS`] are left out. Empty lists evaluate one
    /// zero. For the paper's scheme [`Optics::paper`] will do.
    pub fn workload(
        &self,
        tables: &ShadingTables,
        fibres: &[Optics],
        lights: &[LightInFrame],
        views: &[DirectionInFrame],
    ) -> Result<Workload, GpuError> {
        let views = &views[..views.len().min(MAX_VIEWS)];
        let device = &self.context.device;
        let upload = |label, contents: &[u8], usage| {
            let zeros = [0u8; 64];
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents: if contents.is_empty() {
                    &zeros
                } else {
                    contents
                },
                usage,
            })
        };
        use wgpu::BufferUsages as Usage;
        let light_buffer = upload("lights", bytemuck::cast_slice(lights), Usage::STORAGE);
        let view_buffer = upload("views", bytemuck::cast_slice(views), Usage::STORAGE);
        let answers = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("answers"),
            size: 16 * views.len().max(4) as u64,
            usage: Usage::STORAGE | Usage::COPY_SRC,
            mapped_at_creation: false,
        });
        let tables = GpuTables::new(&self.context, tables);
        let groups = fibres
            .iter()
            .map(|fibre| {
                let optics = GpuOptics::new(&self.context, &[fibre])?;
                let buffers = [&optics.shading, &light_buffer, &view_buffer, &answers];
                let mut entries: Vec<_> = (0u32..)
                    .zip(buffers)
                    .map(|(binding, buffer)| wgpu::BindGroupEntry {
                        binding,
                        resource: buffer.as_entire_binding(),
                    })
                    .collect();
                entries.extend(tables.entries(4));
                entries.extend(optics.entries(8));
                Ok(device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("bench"),
                    layout: &self.layout,
                    entries: &entries,
                }))
            })
            .collect::<Result<_, GpuError>>()?;
        Ok(Workload {
            groups,
            answers,
            n_views: views.len() as u32,
            n_evaluations: (fibres.len() * lights.len() * views.len()) as u64,
        })
    }

    /// Evaluates `workload` once, a dispatch a fibre; wall-clock seconds from submission until the
    /// device is done. Nothing is transferred.
    ///
    /// # Errors
    /// The device was lost, or took longer than a minute.
    pub fn run(&self, scheme: Scheme, workload: &Workload) -> Result<f64, GpuError> {
        let descriptor = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = self.context.device.create_command_encoder(&descriptor);
        for group in &workload.groups {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipelines[scheme as usize]);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(workload.n_views.div_ceil(WORKGROUP), 1, 1);
        }
        let commands = encoder.finish();
        let start = Instant::now();
        self.context.queue.submit([commands]);
        self.context.wait("bench")?;
        Ok(start.elapsed().as_secs_f64())
    }

    /// What the last run left for the last fibre: RGB summed over the lights, a view an entry.
    ///
    /// # Errors
    /// The device was lost.
    pub fn answers(&self, workload: &Workload) -> Result<Vec<[f32; 4]>, GpuError> {
        let size = workload.answers.size();
        let readback = self.context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("answers read back"),
            size,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let descriptor = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = self.context.device.create_command_encoder(&descriptor);
        encoder.copy_buffer_to_buffer(&workload.answers, 0, &readback, 0, size);
        self.context.queue.submit([encoder.finish()]);
        let bytes = self.context.read_buffer("bench", &readback)?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }
}
