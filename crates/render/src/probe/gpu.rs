//! The WGSL functions behind a [`Query`].

use crate::gpu::{Cause, Context, GpuError, cause_of};
use crate::gpu_optics::GpuOptics;
use crate::gpu_tables::GpuTables;
use strandlight_scene::optics::Optics;
use strandlight_scene::tables::ShadingTables;
use strandlight_shaders as shaders;

use super::Query;

/// Queries a dispatch: 16 MiB of them, far below every limit on bindings and workgroups.
const BATCH: usize = 1 << 17;
/// What answers hold before the shader writes them; no function returns it.
const SENTINEL: f32 = -1.0e30;
/// Threads a workgroup, as in the shader.
const WORKGROUP: u32 = 64;

/// Evaluates queries on the GPU.
#[derive(Debug)]
pub struct GpuProbe {
    context: Context,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    tables: GpuTables,
}

impl GpuProbe {
    /// Opens the adapter, compiles the shader and uploads `tables`.
    ///
    /// # Errors
    /// No usable adapter, or a shader the driver refuses.
    pub fn new(tables: &ShadingTables) -> Result<GpuProbe, GpuError> {
        let context = Context::new()?;
        let failed = |source: Cause| GpuError::Failed {
            what: "probe shader",
            source,
        };
        let source = shaders::resolve("pass/probe").map_err(|error| failed(error.into()))?;
        let scope = context
            .device
            .push_error_scope(wgpu::ErrorFilter::Validation);
        let module = context
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("probe"),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            });
        let buffer = |binding, read_only| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let mut entries = vec![buffer(0, true), buffer(1, false)];
        entries.extend(GpuTables::layout_entries(2, wgpu::ShaderStages::COMPUTE));
        entries.extend(GpuOptics::layout_entries(6, wgpu::ShaderStages::COMPUTE));
        entries.push(buffer(8, true));
        entries.push(GpuOptics::averages_layout_entry(
            9,
            wgpu::ShaderStages::COMPUTE,
        ));
        let layout = context
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("probe"),
                entries: &entries,
            });
        let pipeline_layout =
            context
                .device
                .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: Some("probe"),
                    bind_group_layouts: &[Some(&layout)],
                    ..Default::default()
                });
        let pipeline = context
            .device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("probe"),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some("probe"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            });
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(failed(cause_of(error)));
        }
        let tables = GpuTables::new(&context, tables);
        Ok(GpuProbe {
            context,
            pipeline,
            layout,
            tables,
        })
    }

    /// The device this probe runs on.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// The answer to each query, in order; see [`super::Function`]. `optics` are those that
    /// queries name by their place, at most [`crate::gpu_optics::MAX_OPTICS`].
    ///
    /// # Errors
    /// Too many or missing optics, the device was lost, or an answer was never written.
    pub fn evaluate(
        &self,
        queries: &[Query],
        optics: &[Optics],
    ) -> Result<Vec<[f32; 4]>, GpuError> {
        let is_missing = |query: &Query| match optics.get(query.optics as usize) {
            None => query.needs_optics(),
            Some(optics) => query.needs_averages() && optics.averages.is_empty(),
        };
        if queries.iter().any(is_missing) {
            return Err(GpuError::Failed {
                what: "probe",
                source: "a query names optics that are not there".into(),
            });
        }
        let none = [Optics::paper(bytemuck::Zeroable::zeroed())];
        let at_hand: Vec<&Optics> = match optics {
            [] => none.iter().collect(),
            some => some.iter().collect(),
        };
        let optics = GpuOptics::new(&self.context, &at_hand)?;
        let mut answers = Vec::with_capacity(queries.len());
        for batch in queries.chunks(BATCH) {
            answers.extend(self.evaluate_batch(batch, &optics)?);
        }
        Ok(answers)
    }

    fn evaluate_batch(
        &self,
        queries: &[Query],
        optics: &GpuOptics,
    ) -> Result<Vec<[f32; 4]>, GpuError> {
        let Context { device, queue, .. } = &self.context;
        let size = (queries.len() * size_of::<[f32; 4]>()) as u64;
        let buffer = |label, size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Usage;
        let query_bytes: &[u8] = bytemuck::cast_slice(queries);
        let input = buffer(
            "queries",
            query_bytes.len() as u64,
            Usage::STORAGE | Usage::COPY_DST,
        );
        let usage = Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC;
        let output = buffer("answers", size, usage);
        let readback = buffer("answers read back", size, Usage::MAP_READ | Usage::COPY_DST);
        queue.write_buffer(&input, 0, query_bytes);
        queue.write_buffer(
            &output,
            0,
            bytemuck::cast_slice(&vec![[SENTINEL; 4]; queries.len()]),
        );
        let mut entries = vec![
            wgpu::BindGroupEntry {
                binding: 0,
                resource: input.as_entire_binding(),
            },
            wgpu::BindGroupEntry {
                binding: 1,
                resource: output.as_entire_binding(),
            },
        ];
        entries.extend(self.tables.entries(2));
        entries.extend(optics.entries(6));
        entries.push(wgpu::BindGroupEntry {
            binding: 8,
            resource: optics.shading.as_entire_binding(),
        });
        entries.push(wgpu::BindGroupEntry {
            binding: 9,
            resource: wgpu::BindingResource::TextureView(&optics.averages),
        });
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("probe"),
            layout: &self.layout,
            entries: &entries,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            pass.dispatch_workgroups((queries.len() as u32).div_ceil(WORKGROUP), 1, 1);
        }
        encoder.copy_buffer_to_buffer(&output, 0, &readback, 0, size);
        queue.submit([encoder.finish()]);
        let bytes = self.context.read_buffer("probe", &readback)?;
        let answers: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
        // Callers take answers for queries by their place.
        if answers.len() != queries.len() {
            let (found, expected) = (answers.len(), queries.len());
            return Err(GpuError::Failed {
                what: "probe",
                source: format!("{found} answers came back to {expected} queries").into(),
            });
        }
        if answers.iter().flatten().any(|&value| value == SENTINEL) {
            return Err(GpuError::Failed {
                what: "probe",
                source: "the shader left answers unwritten".into(),
            });
        }
        Ok(answers)
    }
}
