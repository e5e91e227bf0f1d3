//! The lobes of painted fibres, on the CPU and on the GPU.

use strandlight_scattering::closed_form::{lobe_layer, sample_painted_lobes};
use strandlight_scattering::lobes::PaintedTexture;

use crate::error::RenderError;
use crate::gpu::Context;
use crate::render::painted::upload_painted;
use crate::render::resources::{
    bind, buffer_of, compute, dispatch, guarded, read_back, shader, storage, submit, uniform,
};

/// Points a dispatch: 65535 workgroups of 64.
const BATCH: usize = 65_535 * 64;

/// The Rust function's lobes at `[cos(theta_d), sigma_a of r, g, b]`: widths, cos(mu/2) and
/// sin(mu/2) of the pairs, amplitudes per lobe, then channel.
pub fn painted_lobes(texture: &PaintedTexture, [cos_theta_d, r, g, b]: [f32; 4]) -> [f32; 16] {
    let layers = [r, g, b].map(|sigma_a| lobe_layer(&texture.decode, sigma_a));
    let lobes = sample_painted_lobes(&texture.view(), &layers, cos_theta_d);
    let mut numbers = [0.0; 16];
    numbers[..3].copy_from_slice(&lobes.lambda);
    numbers[3..5].copy_from_slice(&lobes.cos_half);
    numbers[5..7].copy_from_slice(&lobes.sin_half);
    numbers[7..].copy_from_slice(lobes.amplitude.as_flattened());
    numbers
}

/// [`painted_lobes`] by the WGSL function, for each of `points`.
///
/// # Errors
/// Whatever the device refuses.
pub fn gpu_painted_lobes(
    context: &Context,
    texture: &PaintedTexture,
    points: &[[f32; 4]],
) -> Result<Vec<[f32; 16]>, RenderError> {
    guarded(context, || {
        let module = shader(context, "pass/probe_painted")?;
        let pipeline = compute(context, &module, "probe_painted");
        let decode = uniform(context, "painted decode", &texture.decode);
        let painted = upload_painted(context, "painted lobes", texture);
        let mut all = Vec::with_capacity(points.len());
        for points in points.chunks(BATCH) {
            let input = buffer_of(context, "points", points, wgpu::BufferUsages::STORAGE);
            let output = storage(context, "answers", 64 * points.len() as u64);
            let group = bind(
                context,
                &pipeline.get_bind_group_layout(0),
                &[
                    (0, input.as_entire_binding()),
                    (1, output.as_entire_binding()),
                    (2, decode.as_entire_binding()),
                    (3, wgpu::BindingResource::TextureView(&painted)),
                ],
            );
            submit(context, |encoder| {
                let groups = (points.len() as u32).div_ceil(64);
                dispatch(encoder, &pipeline, &group, [groups, 1]);
            });
            all.extend(read_back::<[f32; 16]>(context, "answers", &output)?);
        }
        Ok(all)
    })
}
