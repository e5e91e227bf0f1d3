//! Hair in the render pass of another program: `cargo run --release -p strandlight-render --example
//! embed_wgpu [SCENE.toml] [OUT.png]`.
//!
//! The host opens the device, draws two boards, and draws hair in the same pass with the same
//! depth: a red board stands before the left half of the hair, a blue one cuts through its middle.

mod wig;

use std::error::Error;

use glam::camera::rh::proj::directx::perspective_infinite_reverse;
use glam::camera::rh::view::look_at_mat4;
use glam::{Mat4, Vec3};
use strandlight_formats::Scene;
use strandlight_render::wgpu::util::DeviceExt;
use strandlight_render::{
    HairOptions, HairRenderer, HairView, PrepareBudget, required_limits, wgpu,
};
use strandlight_scene::tone::ToneMap;
use strandlight_scene::{Picture, PreparedScene};

const SIZE: [u32; 2] = [480, 360];

/// The boards: clip-space corners and a colour.
const BOARDS: &str = "
struct Board { corners: array<vec4f, 4>, color: vec4f }
@group(0) @binding(0) var<uniform> board: Board;
@vertex fn vertex(@builtin(vertex_index) ix: u32) -> @builtin(position) vec4f {
    return board.corners[ix];
}
@fragment fn fragment() -> @location(0) vec4f { return board.color; }
";

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = match arguments.next() {
        Some(path) => PreparedScene::load(&Scene::read(path)?)?,
        None => wig::wig()?,
    };
    let out = arguments.next().unwrap_or("embed_wgpu.png".to_owned());

    // The host's device, as it would be without hair, but for the limits.
    let instance = wgpu::Instance::default();
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let limits = required_limits(&adapter.limits())?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_limits: limits,
        ..Default::default()
    }))?;

    // The host's attachments: 4 samples of linear radiance, reversed depth.
    let options = HairOptions {
        reverse_z: true,
        ..HairOptions::default()
    };
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    let texture = |format, sample_count| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: extent(),
            mip_level_count: 1,
            sample_count,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: if sample_count > 1 {
                usage - wgpu::TextureUsages::COPY_SRC
            } else {
                usage
            },
            view_formats: &[],
        })
    };
    let color = texture(options.color_format, 4).create_view(&Default::default());
    let depth = texture(options.depth_format, 4).create_view(&Default::default());
    let resolved = texture(options.color_format, 1);
    let resolved_view = resolved.create_view(&Default::default());

    // The host's camera, in the unit of the scene (cm).
    let (centre, radius) = (scene.strands.centre, scene.strands.radius);
    let eye = centre + 4.0 * radius * Vec3::new(0.25, 0.3, 0.92);
    let view = look_at_mat4(eye, centre, Vec3::Y);
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let projection = perspective_infinite_reverse(0.6, aspect, 0.1);
    let clip = projection * view;
    let boards = [
        (Vec3::new(-0.42, 0.0, 1.1), [0.5, 0.04, 0.03, 1.0]),
        (Vec3::new(0.5, 0.0, 0.0), [0.03, 0.06, 0.4, 1.0]),
    ]
    .map(|(place, tint)| board(&device, &options, clip, centre, radius, place, tint));

    // The hair.
    let mut hair = HairRenderer::new(&device, &queue, scene, options)?;
    let hair_view = HairView {
        view_from_scene: view.to_cols_array_2d(),
        clip_from_view: projection.to_cols_array_2d(),
        origin: [0, 0],
        size: SIZE,
        frame: 0,
    };

    // A frame: what hair needs before the pass, the pass, one submission.
    let mut encoder = device.create_command_encoder(&Default::default());
    hair.prepare(&mut encoder, &hair_view, PrepareBudget::Complete)?;
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("scene"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &color,
            depth_slice: None,
            resolve_target: Some(&resolved_view),
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color {
                    r: 0.05,
                    g: 0.06,
                    b: 0.07,
                    a: 1.0,
                }),
                store: wgpu::StoreOp::Discard,
            },
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    for (pipeline, bindings) in &boards {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, bindings, &[]);
        pass.draw(0..4, 0..1);
    }
    hair.draw(&mut pass);
    drop(pass);
    let pixels = read(&device, &queue, encoder, &resolved)?;

    let picture = Picture {
        width: SIZE[0],
        height: SIZE[1],
        rgba: pixels,
    };
    std::fs::write(&out, picture.to_png(0.0, &ToneMap::Filmic.into())?)?;
    println!("{out}");
    Ok(())
}

fn extent() -> wgpu::Extent3d {
    wgpu::Extent3d {
        width: SIZE[0],
        height: SIZE[1],
        depth_or_array_layers: 1,
    }
}

/// A board that faces +Z at `place`, in radii from `centre`.
fn board(
    device: &wgpu::Device,
    options: &HairOptions,
    clip: Mat4,
    centre: Vec3,
    radius: f32,
    place: Vec3,
    tint: [f32; 4],
) -> (wgpu::RenderPipeline, wgpu::BindGroup) {
    let corner =
        |x: f32, y: f32| clip * (centre + radius * (place + Vec3::new(x, y, 0.0))).extend(1.0);
    let corners =
        [(-0.45, -0.5), (0.45, -0.5), (-0.45, 0.5), (0.45, 0.5)].map(|(x, y)| corner(x, y));
    let mut contents: Vec<f32> = corners
        .iter()
        .flat_map(|corner| corner.to_array())
        .collect();
    contents.extend(tint);
    let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("board"),
        contents: bytemuck::cast_slice(&contents),
        usage: wgpu::BufferUsages::UNIFORM,
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("boards"),
        source: wgpu::ShaderSource::Wgsl(BOARDS.into()),
    });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("boards"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: options.depth_format,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: options.sample_count,
            ..Default::default()
        },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(options.color_format.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: uniform.as_entire_binding(),
        }],
    });
    (pipeline, bindings)
}

/// Submits what `encoder` recorded and reads an `Rgba16Float` texture back.
fn read(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    mut encoder: wgpu::CommandEncoder,
    texture: &wgpu::Texture,
) -> Result<Vec<[f32; 4]>, Box<dyn Error>> {
    let row = 8 * SIZE[0];
    let pitch = row.next_multiple_of(256);
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: u64::from(pitch) * u64::from(SIZE[1]),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let to = wgpu::TexelCopyBufferInfo {
        buffer: &staging,
        layout: wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(pitch),
            rows_per_image: None,
        },
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), to, extent());
    queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |result| {
        if let Err(error) = result {
            eprintln!("{error}");
        }
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let bytes = staging.get_mapped_range(..)?;
    let pixels = bytes.chunks_exact(pitch as usize).flat_map(|line| {
        let halves = bytemuck::pod_collect_to_vec::<u8, [half::f16; 4]>(&line[..row as usize]);
        halves.into_iter().map(|texel| texel.map(f32::from))
    });
    Ok(pixels.collect())
}
