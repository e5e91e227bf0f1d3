//! Hair in a host's render pass: the host's formats, samples, depth, viewport and encoder.

use glam::Vec3;
use glam::camera::rh::proj::directx::{perspective, perspective_infinite_reverse};
use glam::camera::rh::view::look_at_mat4;
use strandlight_render::gpu::Context;
use strandlight_render::{
    HairError, HairOptions, HairRenderer, HairView, PrepareBudget, ProgressiveRenderer, wgpu,
};
use strandlight_scene::{PreparedScene, RenderError};
use strandlight_tests::render_common::{context, rings, wig_scene};

const SIZE: [u32; 2] = [96, 72];
const NEAR: f32 = 0.5;
const FAR: f32 = 900.0;

/// What a host's pass left: colour, and depth where it has one sample.
struct Frame {
    color: Vec<[f32; 4]>,
    depth: Option<Vec<f32>>,
}

fn scene() -> PreparedScene {
    wig_scene(300)
}

fn options(sample_count: u32, reverse_z: bool) -> HairOptions {
    HairOptions {
        sample_count,
        reverse_z,
        ..HairOptions::default()
    }
}

/// The view of the scene's camera.
fn view_of(scene: &PreparedScene, options: &HairOptions) -> HairView {
    let camera = &scene.camera;
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let projection = match options.reverse_z {
        true => perspective_infinite_reverse(camera.fov_y, aspect, NEAR),
        false => perspective(camera.fov_y, aspect, NEAR, FAR),
    };
    HairView {
        view_from_scene: look_at_mat4(camera.eye, camera.target, camera.up).to_cols_array_2d(),
        clip_from_view: projection.to_cols_array_2d(),
        origin: [0, 0],
        size: SIZE,
        frame: 0,
    }
}

/// The host's depth of a plane at `distance` along the line of sight.
fn depth_of(view: &HairView, distance: f32) -> f32 {
    let [.., z, w] = view.clip_from_view;
    -z[2] + w[2] / distance
}

fn hair(context: &Context, options: HairOptions, scene: &PreparedScene) -> HairRenderer {
    HairRenderer::new(&context.device, &context.queue, scene.clone(), options).unwrap()
}

/// A frame of a host whose targets have `size`, whose colour is cleared to `clear` and whose depth
/// is that of a plane.
fn frame(
    context: &Context,
    hair: &mut HairRenderer,
    options: &HairOptions,
    view: &HairView,
    (size, clear, plane): ([u32; 2], f64, f32),
    budget: PrepareBudget,
) -> Frame {
    let device = &context.device;
    let extent = wgpu::Extent3d {
        width: size[0],
        height: size[1],
        depth_or_array_layers: 1,
    };
    let texture = |format, sample_count| {
        let copied = match sample_count {
            1 => wgpu::TextureUsages::COPY_SRC,
            _ => wgpu::TextureUsages::empty(),
        };
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: extent,
            mip_level_count: 1,
            sample_count,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | copied,
            view_formats: &[],
        })
    };
    let samples = options.sample_count;
    let color = texture(options.color_format, samples);
    let depth = texture(options.depth_format, samples);
    let resolved = texture(options.color_format, 1);
    let [color_view, depth_view, resolved_view] =
        [&color, &depth, &resolved].map(|texture| texture.create_view(&Default::default()));
    let mut encoder = device.create_command_encoder(&Default::default());
    hair.prepare(&mut encoder, view, budget).unwrap();
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &color_view,
            depth_slice: None,
            resolve_target: (samples > 1).then_some(&resolved_view),
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color {
                    r: clear,
                    g: clear,
                    b: clear,
                    a: 0.0,
                }),
                store: wgpu::StoreOp::Store,
            },
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depth_view,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(plane),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    let [x, y] = view.origin.map(|x| x as f32);
    let [width, height] = view.size.map(|x| x as f32);
    pass.set_viewport(x, y, width, height, 0.0, 1.0);
    hair.draw(&mut pass);
    drop(pass);
    let source = if samples > 1 { &resolved } else { &color };
    let colors = copy(context, &mut encoder, source, 8);
    let depths = (samples == 1).then(|| copy(context, &mut encoder, &depth, 4));
    context.queue.submit([encoder.finish()]);
    let halves = rows(context, &colors, size, 8);
    let color = halves
        .chunks_exact(8)
        .map(|texel| [0, 2, 4, 6].map(|ix| half(u16::from_le_bytes([texel[ix], texel[ix + 1]]))))
        .collect();
    let depth = depths.map(|buffer| {
        let bytes = rows(context, &buffer, size, 4);
        bytemuck::pod_collect_to_vec(&bytes)
    });
    Frame { color, depth }
}

/// A finite half float.
fn half(bits: u16) -> f32 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023) / 1024.0);
    assert!(exponent < 31, "radiance is finite");
    sign * match exponent {
        0 => mantissa * 2_f32.powi(-14),
        _ => (1.0 + mantissa) * 2_f32.powi(exponent - 15),
    }
}

fn pitch(size: [u32; 2], texel: u32) -> u32 {
    (texel * size[0]).next_multiple_of(256)
}

fn copy(
    context: &Context,
    encoder: &mut wgpu::CommandEncoder,
    texture: &wgpu::Texture,
    texel: u32,
) -> wgpu::Buffer {
    let size = [texture.width(), texture.height()];
    let pitch = pitch(size, texel);
    let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(pitch * size[1]),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let to = wgpu::TexelCopyBufferInfo {
        buffer: &buffer,
        layout: wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(pitch),
            rows_per_image: None,
        },
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), to, texture.size());
    buffer
}

fn rows(context: &Context, buffer: &wgpu::Buffer, size: [u32; 2], texel: u32) -> Vec<u8> {
    let bytes = context.read_buffer("host", buffer).unwrap();
    let lines = bytes.chunks_exact(pitch(size, texel) as usize);
    lines
        .flat_map(|line| line[..(texel * size[0]) as usize].to_vec())
        .collect()
}

/// Relative RMSE of means of 8 x 8 pixels.
fn block_rmse(found: &[[f32; 4]], expected: &[[f32; 4]]) -> f64 {
    let width = SIZE[0] as usize;
    let means = |pixels: &[[f32; 4]]| -> Vec<f64> {
        let mut means = vec![0.0; 4 * (width / 8) * (SIZE[1] as usize / 8)];
        for (ix, pixel) in pixels.iter().enumerate() {
            let block = ix % width / 8 + width / 8 * (ix / width / 8);
            for (channel, value) in pixel.iter().enumerate() {
                means[4 * block + channel] += f64::from(*value) / 64.0;
            }
        }
        means
    };
    let (found, expected) = (means(found), means(expected));
    let error: f64 = found
        .iter()
        .zip(&expected)
        .map(|(a, b)| (a - b).powi(2))
        .sum();
    (error / expected.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// Hair in a host's pass is the hair of pictures of as many samples, and its mean over frames that
/// of pictures of many, for any samples and direction of depth; nothing is submitted.
#[test]
fn hair_in_a_hosts_pass_is_that_of_pictures() {
    let context = context();
    let scene = scene();
    let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let (expected, _) = renderer.render_to_image(&scene.camera, SIZE, 64).unwrap();
    let (first_pass, _) = renderer.render_to_image(&scene.camera, SIZE, 4).unwrap();
    let noise = block_rmse(&first_pass.rgba, &expected.rgba);
    for (samples, reverse_z) in [(4, false), (4, true), (1, true)] {
        let options = options(samples, reverse_z);
        let view = view_of(&scene, &options);
        let mut hair = hair(&context, options, &scene);
        let far = depth_of(&view, 800.0);
        let at = (SIZE, 0.0, far);
        let whole = frame(
            &context,
            &mut hair,
            &options,
            &view,
            at,
            PrepareBudget::Complete,
        );
        let error = block_rmse(&whole.color, &expected.rgba);
        let same = block_rmse(&whole.color, &first_pass.rgba);
        println!("{samples} samples, reversed {reverse_z}: {error:.4} of {noise:.4}, {same:.2e}");
        // A fourth of the samples: twice the noise.
        let expected_noise = if samples == 4 { noise } else { 2.0 * noise };
        assert!(error < 1.2 * expected_noise, "{samples}: {error} {noise}");
        if samples == 4 {
            assert!(same < 1e-3, "{reverse_z}: {same}");
        }
        assert!(hair.is_complete());
        assert_eq!(hair.counts().submissions, 0);
        // Another frame at rest makes nothing; means over frames come closer.
        let before = hair.counts();
        let mut mean = vec![[0.0; 4]; whole.color.len()];
        for ix in 0..16 {
            let view = HairView { frame: ix, ..view };
            let one = frame(
                &context,
                &mut hair,
                &options,
                &view,
                at,
                PrepareBudget::Complete,
            );
            for (sum, pixel) in mean.iter_mut().flatten().zip(one.color.iter().flatten()) {
                *sum += pixel / 16.0;
            }
        }
        let since = hair.counts().since(before);
        assert_eq!([since.buffers, since.pipelines, since.submissions], [0; 3]);
        let closer = block_rmse(&mean, &expected.rgba);
        println!("mean of 16 frames: {closer:.4}");
        assert!(closer < 0.5 * error, "{closer} {error}");
    }
}

/// Close up, bent segments and tips come in pieces; from afar they do not, and again they do.
#[test]
fn close_ups_in_a_hosts_pass_are_those_of_pictures() {
    let context = context();
    let near = rings(9);
    let mut afar = near.clone();
    afar.camera.eye *= 8.0;
    let options = options(4, true);
    let mut hair = hair(&context, options, &near);
    let mut pictures = ProgressiveRenderer::new(&context, near.clone()).unwrap();
    for scene in [&near, &afar, &near] {
        let (expected, _) = pictures.render_to_image(&scene.camera, SIZE, 4).unwrap();
        let view = view_of(scene, &options);
        let at = (SIZE, 0.0, depth_of(&view, 800.0));
        let budget = PrepareBudget::Complete;
        let found = frame(&context, &mut hair, &options, &view, at, budget);
        let error = block_rmse(&found.color, &expected.rgba);
        println!("from {}: {error:.2e}", scene.camera.eye.z);
        assert!(error < 1e-3, "{error}");
    }
}

/// The host's depth hides hair, and hair writes the host's depth.
#[test]
fn depth_is_the_hosts_both_ways() {
    let context = context();
    let scene = scene();
    for reverse_z in [false, true] {
        let options = options(1, reverse_z);
        let view = view_of(&scene, &options);
        let mut hair = hair(&context, options, &scene);
        let centre = scene.camera.eye.distance(scene.strands.centre);
        let radius = 1.2 * scene.strands.radius;
        let mut covered = |distance: f32| {
            let plane = depth_of(&view, distance);
            let at = (SIZE, 0.0, plane);
            let drawn = frame(
                &context,
                &mut hair,
                &options,
                &view,
                at,
                PrepareBudget::Complete,
            );
            let depth = drawn.depth.expect("of one sample");
            let mut n = 0;
            for (pixel, depth) in drawn.color.iter().zip(depth) {
                match pixel[3] > 0.0 {
                    true => {
                        let [near, far] = [centre - radius, distance].map(|at| depth_of(&view, at));
                        let range = near.min(far) - 1e-6..=near.max(far) + 1e-6;
                        assert!(range.contains(&depth), "{depth} {range:?}");
                        n += 1;
                    }
                    false => assert_eq!(depth, plane),
                }
            }
            n
        };
        let [none, half, all] = [centre - radius, centre, centre + radius].map(&mut covered);
        println!("{none} {half} {all} pixels");
        assert_eq!(none, 0);
        assert!(half > 100 && all > half + 50, "{half} {all}");
    }
}

/// A viewport elsewhere in a larger target shows the same pixels there and nothing beside them.
#[test]
fn viewports_may_be_anywhere() {
    let context = context();
    let scene = scene();
    let options = options(4, true);
    let view = view_of(&scene, &options);
    let mut hair = hair(&context, options, &scene);
    let far = depth_of(&view, 800.0);
    let complete = PrepareBudget::Complete;
    let expected = frame(
        &context,
        &mut hair,
        &options,
        &view,
        (SIZE, 0.5, far),
        complete,
    );
    let moved = HairView {
        origin: [17, 9],
        ..view
    };
    let size = [SIZE[0] + 40, SIZE[1] + 30];
    let found = frame(
        &context,
        &mut hair,
        &options,
        &moved,
        (size, 0.5, far),
        complete,
    );
    let mut n_hair = 0;
    for (ix, pixel) in found.color.iter().enumerate() {
        let [x, y] = [ix as u32 % size[0], ix as u32 / size[0]];
        let inside = (17..17 + SIZE[0]).contains(&x) && (9..9 + SIZE[1]).contains(&y);
        let expected = match inside {
            true => expected.color[(x - 17 + SIZE[0] * (y - 9)) as usize],
            false => [0.5, 0.5, 0.5, 0.0],
        };
        assert_eq!(*pixel, expected, "{x} {y}");
        n_hair += usize::from(pixel[3] > 0.0);
    }
    assert!(n_hair > 500, "{n_hair}");
}

/// Step by step comes to the same picture; hair is there from the first frame on.
#[test]
fn budgets_spread_shading_over_frames() {
    let context = context();
    let scene = scene();
    let options = options(4, false);
    let view = view_of(&scene, &options);
    let mut whole = hair(&context, options, &scene);
    let at = (SIZE, 0.0, depth_of(&view, 800.0));
    let expected = frame(
        &context,
        &mut whole,
        &options,
        &view,
        at,
        PrepareBudget::Complete,
    );
    let mut hair = hair(&context, options, &scene);
    let mut n_frames = 0;
    loop {
        let budget = PrepareBudget::Steps(3);
        let found = frame(&context, &mut hair, &options, &view, at, budget);
        assert!(found.color.iter().any(|pixel| pixel[3] > 0.0));
        n_frames += 1;
        if hair.is_complete() {
            assert!(found.color == expected.color);
            break;
        }
    }
    println!("{n_frames} frames");
    assert!(n_frames > 3);
    assert_eq!(hair.counts().submissions, 0);
    // An edit of the hair is in the next complete picture.
    let mut params = *scene.hair.hair();
    params.sigma_a = [4.0; 3];
    whole.set_hair(&params, scene.hair.modes()).unwrap();
    let darker = frame(
        &context,
        &mut whole,
        &options,
        &view,
        at,
        PrepareBudget::Complete,
    );
    let sum = |frame: &Frame| frame.color.iter().map(|pixel| pixel[1]).sum::<f32>();
    assert!(sum(&darker) < 0.9 * sum(&expected));
}

/// What cannot be drawn is refused, and leaves the encoder usable.
#[test]
fn hosts_are_told_what_cannot_be_drawn() {
    let context = context();
    let scene = scene();
    let (device, queue) = (&context.device, &context.queue);
    let refused = HairRenderer::new(device, queue, scene.clone(), options(8, false));
    assert!(matches!(refused.err(), Some(HairError::Samples(8))));
    let options = options(4, false);
    let mut hair = hair(&context, options, &scene);
    let mut view = view_of(&scene, &options);
    view.view_from_scene[0] = (2.0 * Vec3::X).extend(0.0).to_array();
    let mut encoder = context.device.create_command_encoder(&Default::default());
    let refused = hair.prepare(&mut encoder, &view, PrepareBudget::Complete);
    assert!(matches!(refused, Err(HairError::View(_))));
    context.queue.submit([encoder.finish()]);
    context.wait("host").unwrap();
    // Records of so many lights are in a buffer that the device does not have.
    let small = Context::within(|limits| {
        limits.max_storage_buffer_binding_size = 16 << 20;
        limits.max_buffer_size = 16 << 20;
    });
    let small = small.unwrap();
    let mut many = scene.clone();
    many.lights = vec![scene.lights[0]; 64];
    let refused = HairRenderer::new(&small.device, &small.queue, many.clone(), options);
    let is_too_large = |error: &RenderError| matches!(error, RenderError::TooLarge { limit, .. } if *limit == 16 << 20);
    let refused = refused.err().expect("refused");
    assert!(
        matches!(&refused, HairError::Render(error) if is_too_large(error)),
        "{refused}"
    );
    let hair = HairRenderer::new(&small.device, &small.queue, scene.clone(), options);
    let mut hair = hair.unwrap();
    assert!(is_too_large(&hair.set_scene(many).unwrap_err()));
    assert_eq!(hair.scene().lights, scene.lights);
}
