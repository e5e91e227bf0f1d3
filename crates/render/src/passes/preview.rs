//! A draft of the light on everything, before any shadow is there.

use super::proxies::{self, Proxies};
use super::resources::{
    StrandBuffers, bind, compute, compute_pass, groups_of_64, module_with, step, submit, uniform,
};
use super::stamp::Stamp;
use crate::gpu::Context;
use strandlight_scattering::Lobe;
use strandlight_scene::RenderError;
use strandlight_scene::proxy::LIGHT_MAP_SIDE;
use strandlight_scene::scene::{LightRecord, PreparedScene};

/// Lights that count; twin in `shaders/pass/preview.wgsl`.
const MOST_LIGHTS: usize = 16;

/// What R mirrors on top of what it does at normal incidence, the mean over a fibre's width.
const GRAZING: f64 = 0.05;

/// Way of light through a fibre, radii, the mean over its width about the usual index.
const MEAN_PATH: f64 = 1.8;

/// Mirrored by `Preview` in `shaders/pass/preview.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Preview {
    centre: [f32; 3],
    radius: f32,
    albedo: [f32; 3],
    depth: f32,
    shift: f32,
    width_2: f32,
    mirrored: f32,
    n_lights: u32,
    lights: [LightRecord; MOST_LIGHTS],
}

strandlight_scattering::mirrors! {
    Preview as "Preview" in "pass/preview" {
        centre, radius, albedo, depth, shift, width_2, mirrored, n_lights, lights,
    }
}

impl Preview {
    fn new(scene: &PreparedScene) -> Preview {
        let (strands, hair) = (&scene.strands, scene.hair.hair());
        let has = |lobe: Lobe| scene.hair.modes().contains(&lobe);
        let (mut albedo, mut mirrored) = ([0.0; 3], 0.0);
        if has(Lobe::Tt) || has(Lobe::Trt) {
            albedo = hair.sigma_a.map(|sigma_a| (-MEAN_PATH * sigma_a).exp());
        }
        if has(Lobe::R) {
            mirrored = ((hair.eta - 1.0) / (hair.eta + 1.0)).powi(2) + GRAZING;
        }
        let radius = strands.radius.max(1e-3);
        let mut look = Preview {
            centre: strands.centre.to_array(),
            radius,
            albedo: albedo.map(|x| x as f32),
            depth: radius * mean_extinction(scene, radius),
            shift: 2.0 * hair.shift.r as f32,
            width_2: (2.0 * hair.width.r as f32).powi(2),
            mirrored: mirrored as f32,
            n_lights: 0,
            lights: bytemuck::Zeroable::zeroed(),
        };
        let (mut lights, _) = scene.light_records();
        lights.retain(|light| light.power > 0.0);
        lights.sort_by(|a, b| b.power.total_cmp(&a.power));
        let power = |lights: &[LightRecord]| lights.iter().map(|light| light.power).sum::<f32>();
        let all = power(&lights);
        lights.truncate(MOST_LIGHTS);
        let factor = all / power(&lights);
        for (light, strongest) in look.lights.iter_mut().zip(lights) {
            let rgb = strongest.rgb.map(|x| (x * factor).min(f32::MAX));
            *light = LightRecord { rgb, ..strongest };
            look.n_lights += 1;
        }
        look
    }
}

/// Of a ball of fog of `radius` made of all strands, 1/cm.
fn mean_extinction(scene: &PreparedScene, radius: f32) -> f32 {
    let points = &scene.strands.points;
    let area: f64 = scene
        .strands
        .segments
        .iter()
        .map(|&first| {
            let [a, b] = [0, 1].map(|ix| glam::Vec4::from(points[first as usize + ix]));
            // Length times diameter; a fibre's shadow is pi/4 of it, the mean over all directions.
            f64::from((b - a).truncate().length() * (a.w + b.w)) * std::f64::consts::FRAC_PI_4
        })
        .sum();
    let volume = 4.0 / 3.0 * std::f64::consts::PI * f64::from(radius).powi(3);
    (area / volume) as f32
}

/// Where the draft goes.
pub(super) struct Drafted<'a> {
    pub view: &'a wgpu::Buffer,
    pub radiance: &'a wgpu::Buffer,
    /// The proxies, and which of their light maps.
    pub proxies: Option<(&'a Proxies, usize)>,
}

/// Lights `strands` and proxies for a first picture. What that takes is given back at once.
pub(super) fn take(
    context: &Context,
    scene: &PreparedScene,
    strands: &StrandBuffers,
    drafted: &Drafted,
    stamp: Stamp,
) -> Result<(), RenderError> {
    let look = uniform(context, "first look", &Preview::new(scene));
    // Meshes have their light in the open from the start.
    let analytic = drafted.proxies.filter(|(proxies, _)| proxies.n() > 0);
    let features: &[&str] = match analytic {
        Some(_) => &[proxies::FEATURE],
        None => &[],
    };
    let module = module_with(context, "pass/preview", features)?;
    let pipeline = compute(context, &module, "look_at_strands");
    let group = bind(
        context,
        &pipeline.get_bind_group_layout(0),
        &[
            (0, look.as_entire_binding()),
            (1, drafted.view.as_entire_binding()),
            (2, strands.points.as_entire_binding()),
            (3, strands.tangents.as_entire_binding()),
            (4, drafted.radiance.as_entire_binding()),
        ],
    );
    let of_proxies = analytic.map(|(proxies, into)| {
        let pipeline = compute(context, &module, "look_at_proxies");
        let group = bind(
            context,
            &pipeline.get_bind_group_layout(0),
            &[
                (0, look.as_entire_binding()),
                (1, drafted.view.as_entire_binding()),
                (5, proxies.records().as_entire_binding()),
                (6, proxies.light_map(into).as_entire_binding()),
            ],
        );
        (pipeline, group, proxies.n())
    });
    submit(context, |encoder| {
        let mut pass = compute_pass(context, encoder, stamp);
        let groups = groups_of_64(strands.n_points);
        step(&mut pass, &pipeline, &group, groups);
        if let Some((pipeline, group, n)) = &of_proxies {
            let groups = [(LIGHT_MAP_SIDE * LIGHT_MAP_SIDE).div_ceil(64), *n];
            step(&mut pass, pipeline, group, groups);
        }
    });
    Ok(())
}
