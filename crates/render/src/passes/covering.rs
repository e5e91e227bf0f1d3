//! Pipelines that cover samples of pictures.

use crate::gpu::{Context, ResourceCounters};

/// Format of the samples.
pub(super) const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// Format of their depth.
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A pipeline that covers samples of pictures: entry points of the vertices and the fragments, and
/// values for the overrides of the first.
pub(super) fn covering(
    context: &Context,
    label: &'static str,
    module: &wgpu::ShaderModule,
    [vertices, fragments]: [&'static str; 2],
    constants: &[(&str, f64)],
) -> wgpu::RenderPipeline {
    ResourceCounters::add(&context.resource_counters().pipelines);
    let descriptor = wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertices),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants,
                ..Default::default()
            },
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: 4,
            ..Default::default()
        },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragments),
            compilation_options: Default::default(),
            targets: &[Some(COLOR.into())],
        }),
        multiview_mask: None,
        cache: None,
    };
    context.device.create_render_pipeline(&descriptor)
}
