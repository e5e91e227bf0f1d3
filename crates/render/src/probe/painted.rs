//! The lobes of painted fibres, on the CPU and on the GPU.

use strandlight_scattering::closed_form::{
    PaintTexel, lobe_layer, painted_averages, painted_fibre, sample_painted_averages,
    sample_painted_forward, sample_painted_lobes, unpack_paint,
};
use strandlight_scattering::lobes::PaintedTexture;

use crate::gpu::Context;
use crate::passes::painted::{upload_averages, upload_painted};
use crate::passes::resources::{
    bind, buffer_of, compute, dispatch, guarded, module_with, read_back, shader, storage, submit,
    uniform,
};
use strandlight_scene::RenderError;
use strandlight_scene::material::HairMaterial;
use strandlight_scene::paint::PaintKinds;

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
                dispatch(context, encoder, &pipeline, &group, [groups, 1]);
            });
            all.extend(read_back::<[f32; 16]>(context, "answers", &output)?);
        }
        Ok(all)
    })
}

/// A painted point and where its averages are asked for.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PaintQuestion {
    /// [`strandlight_scattering::closed_form::pack_paint`]'s answer.
    pub paint: PaintTexel,
    /// Incident inclination of the averages of many events, radians.
    pub theta: f32,
    /// Sine of the inclination of those of one, 0..=1.
    pub sin_theta: f32,
    /// Not used.
    pub padding: [u32; 2],
}

strandlight_scattering::mirrors! {
    PaintQuestion as "Question" in "pass/probe_paint" { paint, theta, sin_theta, padding }
}

/// The Rust functions' absorption, shifts and widths of the fibre of a painted point; A_b,
/// Delta_b, sigma_b^2; a_f, beta_f^2: three numbers each.
pub fn paint_answer(hair: &HairMaterial, question: &PaintQuestion) -> [f32; 24] {
    let optics = hair.optics();
    let common = optics.painted_hair();
    let averages = optics.painted.averages.view();
    let paint = unpack_paint(&question.paint);
    let fibre = painted_fibre(&common.fibre, &paint);
    let row = painted_averages(averages, &fibre, &paint).row;
    let at = sample_painted_averages(&averages, &row, question.theta);
    let (a_f, beta_f_2) = sample_painted_forward(&averages, &row, question.sin_theta);
    let all = [
        fibre.sigma_a,
        fibre.alpha,
        fibre.beta,
        at.attenuation_b,
        at.shift_b,
        at.width_b_2,
        a_f,
        beta_f_2,
    ];
    std::array::from_fn(|ix| all[ix / 3][ix % 3])
}

/// [`paint_answer`] by the WGSL functions, for each of `questions`.
///
/// # Errors
/// Whatever the device refuses.
pub fn gpu_paint_answers(
    context: &Context,
    hair: &HairMaterial,
    questions: &[PaintQuestion],
) -> Result<Vec<[f32; 24]>, RenderError> {
    guarded(context, || {
        let features = hair.paint().map_or(Vec::new(), PaintKinds::features);
        let module = module_with(context, "pass/probe_paint", &features)?;
        let pipeline = compute(context, &module, "probe_paint");
        let optics = hair.optics();
        let common = uniform(context, "painted hair", &optics.painted_hair());
        let averages = upload_averages(context, &optics.painted.averages);
        let mut all = Vec::with_capacity(questions.len());
        for questions in questions.chunks(BATCH) {
            let usage = wgpu::BufferUsages::STORAGE;
            let input = buffer_of(context, "questions", questions, usage);
            let output = storage(context, "answers", 96 * questions.len() as u64);
            let group = bind(
                context,
                &pipeline.get_bind_group_layout(0),
                &[
                    (0, input.as_entire_binding()),
                    (1, output.as_entire_binding()),
                    (2, common.as_entire_binding()),
                    (3, wgpu::BindingResource::TextureView(&averages)),
                ],
            );
            submit(context, |encoder| {
                let groups = (questions.len() as u32).div_ceil(64);
                dispatch(context, encoder, &pipeline, &group, [groups, 1]);
            });
            all.extend(read_back::<[f32; 24]>(context, "answers", &output)?);
        }
        Ok(all)
    })
}
