//! Buffers, pipelines and bind groups, with errors instead of panics.

use wgpu::util::DeviceExt;

use super::stamp::Stamp;
use crate::gpu::{Context, GpuError, ResourceCounters, cause_of};
use crate::limits::MOST_GROUPS;
use strandlight_scene::RenderError;
use strandlight_scene::strands::Strands;
use strandlight_shaders as shaders;

/// A GPU error as the renderer reports it.
pub(crate) fn failed(error: GpuError) -> RenderError {
    match error {
        GpuError::Lost { reason } => RenderError::DeviceLost(reason),
        error => RenderError::Gpu(error.into()),
    }
}

/// Runs `work` and turns validation and memory errors of the device into an error.
pub(crate) fn guarded<T>(
    context: &Context,
    work: impl FnOnce() -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    let validation = context
        .device
        .push_error_scope(wgpu::ErrorFilter::Validation);
    let memory = context
        .device
        .push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let result = work();
    let memory = pollster::block_on(memory.pop());
    let validation = pollster::block_on(validation.pop());
    match memory.or(validation) {
        Some(error) => Err(RenderError::Gpu(cause_of(error))),
        None => result,
    }
}

/// A buffer with contents; an empty slice becomes one zero entry, since bindings cannot be empty.
pub(crate) fn buffer_of<T: bytemuck::Pod>(
    context: &Context,
    label: &'static str,
    contents: &[T],
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let zero = [T::zeroed()];
    let contents = if contents.is_empty() { &zero } else { contents };
    let counters = context.resource_counters();
    counters.add_buffer(size_of_val(contents) as u64);
    counters.add_written(size_of_val(contents));
    context
        .device
        .create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents: bytemuck::cast_slice(contents),
            usage,
        })
}

/// A zeroed buffer.
pub(crate) fn labelled(
    context: &Context,
    label: &'static str,
    bytes: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    context.resource_counters().add_buffer(bytes);
    context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.max(16),
        usage,
        mapped_at_creation: false,
    })
}

/// A zeroed storage buffer of `bytes` that can be read back.
pub(crate) fn storage(context: &Context, label: &'static str, bytes: u64) -> wgpu::Buffer {
    let usage =
        wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    labelled(context, label, bytes, usage)
}

/// Makes `buffer` hold at least `bytes`: another one, of zeros, where it is smaller. Answers
/// whether it did, which puts bind groups out of date.
pub(crate) fn grow(context: &Context, buffer: &mut wgpu::Buffer, bytes: u64) -> bool {
    if buffer.size() >= bytes {
        return false;
    }
    context.resource_counters().add_buffer(bytes);
    *buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: bytes,
        usage: buffer.usage(),
        mapped_at_creation: false,
    });
    true
}

/// Writes `contents` into a buffer that grows if it must, as [`grow`].
pub(crate) fn write<T: bytemuck::Pod>(
    context: &Context,
    buffer: &mut wgpu::Buffer,
    contents: &[T],
) -> bool {
    let has_grown = grow(context, buffer, size_of_val(contents) as u64);
    context.write(buffer, 0, bytemuck::cast_slice(contents));
    has_grown
}

/// A uniform buffer holding `value`.
pub(crate) fn uniform<T: bytemuck::Pod>(
    context: &Context,
    label: &'static str,
    value: &T,
) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
    buffer_of(context, label, std::slice::from_ref(value), usage)
}

/// The whole of a buffer as entries of `T`, after all submitted work.
pub(crate) fn read_back<T: bytemuck::Pod>(
    context: &Context,
    what: &'static str,
    buffer: &wgpu::Buffer,
) -> Result<Vec<T>, RenderError> {
    let staging = context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(what),
        size: buffer.size(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    submit(context, |encoder| {
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
    });
    let bytes = context.read_buffer(what, &staging).map_err(failed)?;
    Ok(bytemuck::pod_collect_to_vec(&bytes))
}

/// A texture's whole, none of its sides being zero.
pub(crate) fn texture(
    context: &Context,
    label: &'static str,
    [width, height]: [u32; 2],
    sample_count: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureView {
    let texel = u64::from(format.block_copy_size(None).unwrap_or(4));
    let n_texels = u64::from(width) * u64::from(height) * u64::from(sample_count);
    context.resource_counters().add_texture(n_texels * texel);
    let texture = context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// A volume that compute shaders write and others read, none of its sides being zero.
pub(crate) fn texture_3d(
    context: &Context,
    label: &'static str,
    [width, height, depth_or_array_layers]: [u32; 3],
    format: wgpu::TextureFormat,
) -> wgpu::TextureView {
    let texel = u64::from(format.block_copy_size(None).unwrap_or(4));
    let n_texels = u64::from(width) * u64::from(height) * u64::from(depth_or_array_layers);
    context.resource_counters().add_texture(n_texels * texel);
    let texture = context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// Records and submits commands.
pub(crate) fn submit(context: &Context, record: impl FnOnce(&mut wgpu::CommandEncoder)) {
    context.submit(record);
}

/// The shader module `name` with all it imports.
pub(crate) fn shader(
    context: &Context,
    name: &'static str,
) -> Result<wgpu::ShaderModule, RenderError> {
    module_with(context, name, &[])
}

/// [`shader`] with `features`.
pub(crate) fn module_with(
    context: &Context,
    name: &'static str,
    features: &[&str],
) -> Result<wgpu::ShaderModule, RenderError> {
    let source =
        shaders::resolve_with(name, features).map_err(|error| RenderError::Gpu(error.into()))?;
    Ok(context
        .device
        .create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        }))
}

/// A compute pipeline; its layout follows the bindings that `entry` uses.
pub(crate) fn compute(
    context: &Context,
    module: &wgpu::ShaderModule,
    entry: &'static str,
) -> wgpu::ComputePipeline {
    compute_with(context, module, entry, &[])
}

/// [`compute`] with values for the module's overrides.
pub(crate) fn compute_with(
    context: &Context,
    module: &wgpu::ShaderModule,
    entry: &'static str,
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    ResourceCounters::add(&context.resource_counters().pipelines);
    context
        .device
        .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry),
            layout: None,
            module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants,
                ..Default::default()
            },
            cache: None,
        })
}

/// Group 0 of a pipeline: resources by binding number.
pub(crate) fn bind(
    context: &Context,
    layout: &wgpu::BindGroupLayout,
    resources: &[(u32, wgpu::BindingResource)],
) -> wgpu::BindGroup {
    let entries: Vec<_> = resources
        .iter()
        .map(|(binding, resource)| wgpu::BindGroupEntry {
            binding: *binding,
            resource: resource.clone(),
        })
        .collect();
    ResourceCounters::add(&context.resource_counters().bind_groups);
    context
        .device
        .create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        })
}

/// Starts a compute pass.
pub(crate) fn compute_pass<'e>(
    context: &'e Context,
    encoder: &'e mut wgpu::CommandEncoder,
    stamp: Stamp,
) -> ComputePass<'e> {
    let pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: None,
        timestamp_writes: stamp.compute_writes(),
    });
    ComputePass {
        pass,
        counters: context.resource_counters(),
    }
}

/// A pass whose workgroups are counted, as far as the host knows them.
pub(crate) struct ComputePass<'e> {
    pass: wgpu::ComputePass<'e>,
    counters: &'e ResourceCounters,
}

impl ComputePass<'_> {
    pub fn set_pipeline(&mut self, pipeline: &wgpu::ComputePipeline) {
        self.pass.set_pipeline(pipeline);
    }

    /// Sets the bindings, with these offsets of those that have one.
    pub fn set_group(&mut self, group: &wgpu::BindGroup, offsets: &[u32]) {
        self.pass.set_bind_group(0, group, offsets);
    }

    pub fn dispatch(&mut self, groups: [u32; 2]) {
        self.counters.add_workgroups(groups);
        self.pass.dispatch_workgroups(groups[0], groups[1], 1);
    }
}

/// Adds a dispatch to a pass.
pub(crate) fn step(
    pass: &mut ComputePass,
    pipeline: &wgpu::ComputePipeline,
    group: &wgpu::BindGroup,
    groups: [u32; 2],
) {
    pass.set_pipeline(pipeline);
    pass.set_group(group, &[]);
    pass.dispatch(groups);
}

/// Workgroups of a dispatch.
#[derive(Clone, Copy)]
pub(crate) enum Groups<'a> {
    /// So many.
    Known([u32; 2]),
    /// As many as the device has written into this buffer, from this byte on.
    Written(&'a wgpu::Buffer, u64),
}

/// [`step`] with workgroups whose number the device may have found.
pub(crate) fn step_over(
    pass: &mut ComputePass,
    pipeline: &wgpu::ComputePipeline,
    group: &wgpu::BindGroup,
    groups: Groups,
) {
    match groups {
        Groups::Known(groups) => step(pass, pipeline, group, groups),
        Groups::Written(arguments, offset) => {
            pass.set_pipeline(pipeline);
            pass.set_group(group, &[]);
            pass.pass.dispatch_workgroups_indirect(arguments, offset);
        }
    }
}

/// Records one dispatch.
#[cfg(not(target_arch = "wasm32"))]
pub(crate) fn dispatch(
    context: &Context,
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::ComputePipeline,
    group: &wgpu::BindGroup,
    size: [u32; 2],
) {
    let mut pass = compute_pass(context, encoder, Stamp::default());
    step(&mut pass, pipeline, group, size);
}

/// Groups of 64 threads for `n`; more than one dimension takes go into the second.
pub(crate) fn groups_of_64(n: u32) -> [u32; 2] {
    let groups = n.div_ceil(64);
    let rows = groups.div_ceil(MOST_GROUPS).max(1);
    [groups.div_ceil(rows), rows]
}

/// The strands on the device.
pub(crate) struct StrandBuffers {
    pub points: wgpu::Buffer,
    pub tangents: wgpu::Buffer,
    pub normals: wgpu::Buffer,
    pub segments: wgpu::Buffer,
    pub n_points: u32,
    pub n_segments: u32,
}

impl StrandBuffers {
    pub fn new(context: &Context, strands: &Strands) -> Self {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        ResourceCounters::add(&context.resource_counters().geometry_uploads);
        StrandBuffers {
            points: buffer_of(context, "points", &strands.points, usage),
            tangents: buffer_of(context, "tangents", &strands.tangents, usage),
            normals: buffer_of(context, "normals", &strands.normals, usage),
            segments: buffer_of(context, "segments", &strands.segments, usage),
            n_points: strands.points.len() as u32,
            n_segments: strands.segments.len() as u32,
        }
    }

    /// Writes strands that have moved; which segments there are stays.
    pub fn update(&self, context: &Context, strands: &Strands) {
        ResourceCounters::add(&context.resource_counters().geometry_uploads);
        for (buffer, contents) in [
            (&self.points, &strands.points),
            (&self.tangents, &strands.tangents),
            (&self.normals, &strands.normals),
        ] {
            let contents = bytemuck::cast_slice(contents);
            context.write(buffer, 0, contents);
        }
    }

    pub fn bytes(&self) -> u64 {
        [&self.points, &self.tangents, &self.normals, &self.segments]
            .iter()
            .map(|buffer| buffer.size())
            .sum()
    }
}
