//! Multiple scattering by look-up, on the GPU.

use crate::gpu::Context;
use crate::gpu_optics::GpuOptics;
use crate::passes::multiple::{ELLIPTIC, Fill, Multiple};
use crate::passes::resources::{
    bind, buffer_of, compute, dispatch, failed, guarded, module_with, read_back, storage, submit,
};
use crate::passes::stamp::Stamp;
use strandlight_scene::RenderError;
use strandlight_scene::material::HairMaterial;

/// Where a look-up in [`MultipleTables`](strandlight_scattering::multiple_tables::MultipleTables) is
/// asked for.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MultipleQuestion {
    /// Inclination of the light, radians.
    pub theta_j: f32,
    /// Inclination of the view, radians.
    pub theta_o: f32,
    /// Azimuth of the light, radians.
    pub phi_j: f32,
    /// Azimuth of the view, radians.
    pub phi_o: f32,
    /// Width of light that was scattered forward.
    pub sigma_f: f32,
    /// Width of light that comes straight.
    pub lambda: f32,
    /// Cosine of `theta_j`.
    pub cos_theta_j: f32,
    /// Not used.
    pub padding: u32,
}

strandlight_scattering::mirrors! {
    MultipleQuestion as "MultipleQuestion" in "pass/probe_multiple" {
        theta_j, theta_o, phi_j, phi_o, sigma_f, lambda, cos_theta_j, padding,
    }
}

/// Global, local and direct local scattering by the WGSL functions, red, green and blue each, for each
/// of `questions`, from tables of `hair` that the device filled. None where `hair` has none.
///
/// # Errors
/// Whatever the device refuses.
pub fn gpu_multiple_answers(
    context: &Context,
    hair: &HairMaterial,
    questions: &[MultipleQuestion],
) -> Result<Vec<[f32; 9]>, RenderError> {
    let Some(source) = &hair.optics().multiple else {
        return Ok(Vec::new());
    };
    guarded(context, || {
        let optics = GpuOptics::new(context, &[hair.optics()]).map_err(failed)?;
        let mut tables = Multiple::new(context, source);
        let fill = Fill::new(context)?;
        tables.fill(context, &fill, &optics, Stamp::default());
        let features: Vec<&str> = source
            .is_elliptic()
            .then_some(ELLIPTIC)
            .into_iter()
            .collect();
        let module = module_with(context, "pass/probe_multiple", &features)?;
        let pipeline = compute(context, &module, "probe_multiple");
        let usage = wgpu::BufferUsages::STORAGE;
        let input = buffer_of(context, "questions", questions, usage);
        let output = storage(context, "answers", 36 * questions.len() as u64);
        let mut bindings = vec![
            (0, input.as_entire_binding()),
            (1, output.as_entire_binding()),
        ];
        bindings.extend(tables.bindings());
        let group = bind(context, &pipeline.get_bind_group_layout(0), &bindings);
        submit(context, |encoder| {
            let groups = (questions.len() as u32).div_ceil(64);
            dispatch(context, encoder, &pipeline, &group, [groups, 1]);
        });
        read_back(context, "answers", &output)
    })
}
