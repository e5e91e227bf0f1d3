//! Scattering of all lights at every point. Twin of `shaders/pass/shade.wgsl`.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::{
    DirectionInFrame, ForwardTable, HairLayers, LightInFrame, PackedRecord, PaintedHair,
    SampleAverages, SampleLobes, Shading, ShadowRecord, TERM_GLOBAL, TERM_LOCAL, TERM_SINGLE,
    WidthProfile, axis_densities, direct_local_scattering, forward_light, forward_table,
    global_scattering, local_density, local_scattering, painted_averages, painted_fibre,
    painted_layers, painted_shading, plain_layers, sample_forward, sample_painted_forward,
    shadowed_single_scattering, unpack_paint, unpack_record,
};
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::{ViewUniform, screen_position, shading_margin};
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::{NO_SLOT, unblocked_share};
use strandlight_scene::strands::Strands;
use strandlight_scene::volume::{Grid, SELF_LIFT};

use super::along_segments::{Along, Answers, Nodes, PLACES, add_along, frames_about, shares_along};
use super::axis_shares::AxisShares;
use super::bounce::BounceLight;
use super::radiance::{Radiance, mean};
use super::shadow_map::Visibility;
use super::transmittance::{Shadows, mix_all};
use super::unblocked::VisiblePoint;
use super::voxelise::{grid_position, voxel_index};

/// What one batch of lights came to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    pub points_skipped: u64,
    /// Products evaluated and skipped, by term of [`strandlight_scene::stats::TERM_NAMES`].
    pub terms: [[u64; 2]; 4],
}

impl Counts {
    /// Of both.
    pub fn and(self, other: Counts) -> Counts {
        Counts {
            points_skipped: self.points_skipped + other.points_skipped,
            terms: [0, 1, 2, 3]
                .map(|term| [0, 1].map(|ix| self.terms[term][ix] + other.terms[term][ix])),
        }
    }
}

/// Adds the lights of a batch to the `radiance` of all points, times the view's radiance scale.
/// `shadows` are those of the batch, `visibility` that of the shadow maps; `axis_shares` are there where multiple
/// scattering is drawn.
pub(super) fn shade(
    scene: &PreparedScene,
    view: &ViewUniform,
    (grid, axis_shares): (&Grid, Option<&AxisShares>),
    lights: &[LightRecord],
    shadows: &Shadows,
    visibility: &Visibility,
    radiance: &mut Radiance,
) -> Counts {
    let n_points = scene.strands.points.len();
    let answers = (visibility, n_points);
    let Radiance { at, along } = radiance;
    let mut along: Vec<Option<&mut Along>> = along.iter_mut().map(Some).collect();
    along.resize_with(n_points, || None);
    let reaching = Reaching::new(scene, grid, shadows, visibility);
    let profile = scene.width_profile(view, None);
    let shader = PointShader::new(scene, view, profile.as_ref(), axis_shares);
    at.par_iter_mut()
        .zip(along)
        .enumerate()
        .map(|(point, (radiance, along))| {
            if !in_view(view, &scene.strands, point) {
                return Counts {
                    points_skipped: 1,
                    ..Counts::default()
                };
            }
            let arriving = |ix: usize, light: &LightRecord| reaching.at(point, ix, light);
            let at = VisiblePoint {
                place: point,
                point,
            };
            let along = along.map(|along| (&answers, along));
            shader.shade(at, lights, arriving, radiance, along)
        })
        .reduce(Counts::default, Counts::and)
}

/// What of a batch of lights reaches the points of a scene.
pub(super) struct Reaching<'a> {
    points: &'a [[f32; 4]],
    grid: &'a Grid,
    shadows: &'a Shadows,
    visibility: &'a Visibility,
    has_maps: bool,
}

impl<'a> Reaching<'a> {
    /// By `shadows`, those of the batch, and `visibility`, that of the shadow maps.
    pub fn new(
        scene: &'a PreparedScene,
        grid: &'a Grid,
        shadows: &'a Shadows,
        visibility: &'a Visibility,
    ) -> Reaching<'a> {
        let has_maps = matches!(shadows, Shadows::Volume(_)) && !visibility.shares.is_empty();
        Reaching {
            points: &scene.strands.points,
            grid,
            shadows,
            visibility,
            has_maps,
        }
    }

    /// The record of light `ix` of the batch at a point, and its unblocked shares, of all modes and of TT.
    pub fn at(&self, point: usize, ix: usize, light: &LightRecord) -> (ShadowRecord, f32, f32) {
        let n_points = self.points.len();
        let record = match self.shadows {
            Shadows::Volume(records) => {
                let of_light = &records[ix * self.grid.n_voxels()..];
                record_at_point(self.grid, of_light, &self.points[point], light.direction)
            }
            Shadows::Points(records) => unpack_record(&records[ix * n_points + point]),
        };
        if !self.has_maps || light.shadow_index == NO_SLOT {
            return (record, record.shares[0], record.shares[0]);
        }
        let shares = &self.visibility.shares;
        let share_of = |is_tt| unblocked_share(shares, n_points, light.shadow_index, is_tt, point);
        (record, share_of(false), share_of(true))
    }
}

/// Adds what the proxies send back to the `radiance` of all points, times the view's radiance scale.
pub(super) fn shade_bounce(
    scene: &PreparedScene,
    view: &ViewUniform,
    axis_shares: Option<&AxisShares>,
    bounce: &BounceLight,
    radiance: &mut Radiance,
) {
    let shader = PointShader::new(scene, view, None, axis_shares);
    let points = radiance.at.par_iter_mut().enumerate();
    points.for_each(|(point, radiance)| {
        if in_view(view, &scene.strands, point) {
            let found = shader.shade_bounce(bounce, point);
            for (sum, value) in radiance.iter_mut().zip(found) {
                *sum += value;
            }
        }
    });
}

/// Shades points by the closed forms.
pub(super) struct PointShader<'a> {
    scene: &'a PreparedScene,
    view: &'a ViewUniform,
    shading: Shading<'a>,
    forward: ForwardTable,
    layers: HairLayers,
    hair: PaintedHair,
    terms: Terms,
    profile: Option<&'a WidthProfile>,
    axis_shares: Option<&'a AxisShares>,
}

impl<'a> PointShader<'a> {
    /// For the points of `scene` as `view` sees them, with a `profile` where strands are wide, and `axis_shares` where multiple
    /// scattering is drawn.
    pub fn new(
        scene: &'a PreparedScene,
        view: &'a ViewUniform,
        profile: Option<&'a WidthProfile>,
        axis_shares: Option<&'a AxisShares>,
    ) -> PointShader<'a> {
        let optics = scene.hair.optics();
        PointShader {
            scene,
            view,
            shading: optics.shading(scene.tables.view()),
            forward: forward_table(scene.hair.averages()),
            layers: plain_layers(scene.hair.averages()),
            hair: optics.painted_hair(),
            terms: Terms::new(scene),
            profile,
            axis_shares,
        }
    }

    /// Adds `lights` to the radiance of a point (rgb, and its side, see [`Radiance`]), times the view's radiance scale.
    /// `arriving` has, by light, its record there and its unblocked shares, of all modes and of TT.
    /// Single scattering of narrow lights is added to that `along` the segments, where there is one,
    /// by the answers of their maps.
    pub fn shade(
        &self,
        at: VisiblePoint,
        lights: &[LightRecord],
        arriving: impl Fn(usize, &LightRecord) -> (ShadowRecord, f32, f32),
        radiance: &mut [f32; 4],
        along: Option<(&impl Answers, &mut Along)>,
    ) -> Counts {
        let PointShader { scene, terms, .. } = self;
        let strands = &scene.strands;
        let point = at.point;
        let position = Vec3::from_slice(&strands.points[point]);
        let [u, v, w] = strands.frame(point);
        let in_frame = |d: Vec3| [u.dot(d), v.dot(d), w.dot(d)];
        let eye = DirectionInFrame::from_vector(in_frame(Vec3::from(self.view.eye) - position));
        let paint = scene
            .paint()
            .map(|paint| unpack_paint(&paint[point].texel()));
        let painted = paint.as_ref().map(|paint| {
            let optics = scene.hair.optics();
            let views = optics.painted_views(&self.hair, scene.tables.view());
            (painted_fibre(&self.hair.fibre, paint), views)
        });
        let painted = paint.as_ref().zip(painted.as_ref());
        let painted = painted.map(|(paint, (fibre, views))| {
            let shading = painted_shading(views, fibre);
            (shading, painted_averages(views.averages, fibre, paint))
        });
        let layers = match &painted {
            Some((_, averages)) if self.axis_shares.is_some() => painted_layers(averages),
            _ => self.layers,
        };
        let around = self.axis_shares.map_or([[0.0; 6]; 3], |shares| {
            axis_densities(&layers, &shares.at(position))
        });
        let mut sum = [0.0; 4];
        let mut evaluated = [0; 4];
        let (answers, mut along) = along.unzip();
        let world_eye = Vec3::from(self.view.eye);
        let frames = answers.map(|_| frames_about(strands, point, world_eye));
        for (ix, light) in lights.iter().enumerate() {
            let (record, unblocked, unblocked_tt) = arriving(ix, light);
            let direction = in_frame(Vec3::from(light.direction));
            let source = LightInFrame::from_vector(direction, light.lambda);
            let of_light = LightAt {
                light,
                source: &source,
                eye: &eye,
                scale: self.view.radiance_scale,
                layers: &layers,
                density_back: local_density(&around, light.direction)
                    .map(|density| terms.densities[1] * density),
                sides: self.profile.map(|profile| profile.sides(&source, &eye)),
            };
            let arriving = (&record, unblocked, unblocked_tt);
            let along = match (answers, &frames, along.as_deref_mut()) {
                (Some(answers), Some(frames), Some(along)) if light.is_narrow() => {
                    let scale = self.view.radiance_scale;
                    let shares = shares_along(strands, answers, light, at, scale);
                    Some((shares, frames, along))
                }
                _ => None,
            };
            let sums = (&mut sum, along, &mut evaluated);
            match &painted {
                Some((shading, averages)) => {
                    let forward = |sin_theta| {
                        sample_painted_forward(&averages.view, &averages.row, sin_theta)
                    };
                    let fibre = (shading, averages, forward);
                    terms.add(of_light, arriving, fibre, sums);
                }
                None => {
                    let forward = |sin_theta| sample_forward(&self.forward, sin_theta);
                    let fibre = (&self.shading, scene.hair.averages(), forward);
                    terms.add(of_light, arriving, fibre, sums);
                }
            }
        }
        for (radiance, sum) in radiance.iter_mut().zip(sum) {
            *radiance += sum * self.view.radiance_scale;
        }
        let drawn = [TERM_SINGLE, TERM_LOCAL, TERM_GLOBAL, TERM_LOCAL];
        Counts {
            points_skipped: 0,
            terms: [0, 1, 2, 3].map(|ix| match terms.bits & drawn[ix] {
                0 => [0, 0],
                _ => [evaluated[ix], lights.len() as u64 - evaluated[ix]],
            }),
        }
    }
}

impl PointShader<'_> {
    /// Bounce light at a point: rgb times the view's radiance scale, and zero.
    pub fn shade_bounce(&self, bounce: &BounceLight, point: usize) -> [f32; 4] {
        let position = Vec3::from_slice(&self.scene.strands.points[point]);
        let found = bounce.lights_at(position, self.view.radiance_scale);
        let lights = found.map(|(light, _)| light);
        let arriving = |ix: usize, _: &LightRecord| {
            let record = found[ix].1;
            (record, record.shares[0], record.shares[0])
        };
        let at = VisiblePoint {
            place: point,
            point,
        };
        let mut radiance = [0.0; 4];
        let along: Option<(&(&Visibility, usize), _)> = None;
        self.shade(at, &lights, arriving, &mut radiance, along);
        radiance
    }
}

/// Where a narrow light goes: the shares that reach the places about a point, if any is lit, the frames
/// there, and what is added to.
type NarrowSum<'a> = (
    Option<[f32; PLACES]>,
    &'a Nodes<([Vec3; 3], DirectionInFrame)>,
    &'a mut Along,
);

/// A light at a point.
struct LightAt<'a> {
    light: &'a LightRecord,
    source: &'a LightInFrame,
    eye: &'a DirectionInFrame,
    /// The view's radiance scale.
    scale: f32,
    /// The hair around.
    layers: &'a HairLayers,
    /// d_b f_local.
    density_back: [f32; 3],
    /// Factors of its modes over the width of a strand, where that is wide.
    sides: Option<[f32; 3]>,
}

/// The terms that are drawn.
pub(super) struct Terms {
    /// [`TERM_SINGLE`], [`TERM_LOCAL`], [`TERM_GLOBAL`].
    pub bits: u32,
    /// Power of a light below which a term is left out.
    pub min_power: f32,
    /// d_f and d_b.
    pub densities: [f32; 2],
    max_local: f32,
}

impl Terms {
    /// Those of `scene`.
    pub fn new(scene: &PreparedScene) -> Terms {
        Terms {
            bits: scene.terms(),
            min_power: scene.min_power(),
            densities: scene.densities,
            max_local: scene.max_local(&scene.hair),
        }
    }

    /// Is single scattering of a light drawn where it is unblocked?
    pub fn has_single_of(&self, light: &LightRecord) -> bool {
        self.bits & TERM_SINGLE != 0 && light.power >= self.min_power
    }

    /// Adds what the eye sees of one light: scattered by a fibre, of which there are what single and
    /// global scattering read, averages, and a_f and beta_f^2 by the sine of the inclination. Single
    /// scattering of a narrow light goes along the segments.
    fn add<A: SampleAverages + ?Sized>(
        &self,
        of_light: LightAt,
        (record, unblocked, unblocked_tt): (&ShadowRecord, f32, f32),
        (shading, averages, forward): (
            &Shading<impl SampleLobes>,
            &A,
            impl Fn(f32) -> ([f32; 3], [f32; 3]),
        ),
        (sum, along, evaluated): (&mut [f32; 4], Option<NarrowSum>, &mut [u64; 4]),
    ) {
        let LightAt {
            light,
            source,
            eye,
            scale,
            layers,
            density_back,
            sides,
        } = of_light;
        let is_along = along.is_some();
        // Factors of the modes, and so of their shares of the light.
        let side = |shares: [f32; 3]| match sides {
            Some(sides) => {
                let shares = [0, 1, 2].map(|mode: usize| shares[mode] * sides[mode]);
                let scattered = shadowed_single_scattering(source, eye, shading, shares);
                mean([0, 1, 2].map(|channel: usize| light.rgb[channel] * scattered[channel]))
            }
            None => 0.0,
        };
        if let Some((Some(shares), frames, along)) = along
            && self.has_single_of(light)
        {
            let nodes = frames.map(|(frame, eye)| {
                let direction = frame.map(|axis: Vec3| axis.dot(Vec3::from(light.direction)));
                let source = LightInFrame::from_vector(direction, light.lambda);
                let scattered = shadowed_single_scattering(&source, &eye, shading, [1.0; 3]);
                [0, 1, 2].map(|channel: usize| light.rgb[channel] * scattered[channel])
            });
            add_along(along, &shares, &nodes);
            // Shares are times the view's scale, as the sum is in the end.
            let share = shares.iter().sum::<f32>() / PLACES as f32 / scale;
            sum[3] += side([share; 3]);
            evaluated[0] += 1;
        }
        let mut of_single = 0.0;
        let mut add = |factor: [f32; 3], scattered: [f32; 3], term: usize| {
            for channel in 0..3 {
                sum[channel] += factor[channel] * light.rgb[channel] * scattered[channel];
            }
            evaluated[term] += 1;
        };
        let [density_forward, _] = self.densities;
        let direct_power = unblocked.max(unblocked_tt) * light.power;
        let has_single = self.bits & TERM_SINGLE != 0 && direct_power >= self.min_power;
        if has_single && !is_along {
            let shares = [unblocked, unblocked_tt, unblocked];
            let scattered = shadowed_single_scattering(source, eye, shading, shares);
            add([1.0; 3], scattered, 0);
            of_single = side(shares);
        }
        if self.bits & TERM_LOCAL != 0 && direct_power * self.max_local >= self.min_power {
            let scattered = direct_local_scattering(source, eye, averages);
            let factor = density_back.map(|density| density * unblocked * light.solid_angle);
            add(factor, scattered, 1);
        }
        if self.bits & (TERM_LOCAL | TERM_GLOBAL) == 0 {
            sum[3] += of_single;
            return;
        }
        let (a_f, beta_f_2) = forward(record.sin_theta);
        let (colored, behind) = ((light.rgb, light.lambda), (layers, density_back));
        let arriving = forward_light(record, a_f, beta_f_2, colored, behind);
        let gained = arriving.gained.map(|gained| density_forward * gained);
        let power_of = |shares: [f32; 3]| shares[0].max(shares[1]).max(shares[2]) * light.power;
        let (towards, sigma_f) = (&source.direction, arriving.sigma_f);
        let global = arriving.global.map(|global| density_forward * global);
        if self.bits & TERM_GLOBAL != 0 && power_of(global) >= self.min_power {
            add(
                global.map(|global| light.solid_angle * global),
                global_scattering(towards, eye, sigma_f, shading),
                2,
            );
        }
        if self.bits & TERM_LOCAL != 0 && power_of(gained) * self.max_local >= self.min_power {
            let scattered = local_scattering(towards, eye, sigma_f, averages);
            let factor = [0, 1, 2].map(|c: usize| density_back[c] * light.solid_angle * gained[c]);
            add(factor, scattered, 3);
        }
        sum[3] += of_single;
    }
}

/// Whether a point or a segment that it is an end of can touch the picture.
fn in_view(view: &ViewUniform, strands: &Strands, point: usize) -> bool {
    let [.., radius] = strands.points[point];
    let [x, y, depth] = screen_position(view, Vec3::from_slice(&strands.points[point]));
    let half_way = strands.tangents[point][3].max(strands.normals[point][3]);
    let margin = shading_margin(view, depth, 2.0 * half_way + radius);
    let inside = |at: f32, size: u32| at > -margin && at < size as f32 + margin;
    depth >= view.near && inside(x, view.size[0]) && inside(y, view.size[1])
}

/// The record at a point (x, y, z, radius) of one light in direction `towards`, from that light's
/// packed records `[voxel]`.
pub fn record_at_point(
    grid: &Grid,
    records: &[PackedRecord],
    point: &[f32; 4],
    towards: [f32; 3],
) -> ShadowRecord {
    let lifted = Vec3::from_slice(point) + Vec3::from(towards) * (SELF_LIFT * grid.h);
    record_at(grid, records, grid_position(grid, lifted))
}

/// Trilinear look-up in the records of one light.
pub(super) fn record_at(grid: &Grid, records: &[PackedRecord], g: Vec3) -> ShadowRecord {
    let base = g.as_uvec3();
    let f = g - base.as_vec3();
    let corner = voxel_index(grid, base.to_array());
    let row = grid.dims[0] as usize;
    let above = corner + row * grid.dims[1] as usize;
    let numbers = |at: usize| {
        let ShadowRecord {
            shares: [a, b, c],
            sin_theta,
        } = unpack_record(&records[at]);
        [a, b, c, sin_theta]
    };
    let along_x = |at: usize| mix_all(numbers(at), numbers(at + 1), f.x);
    let [a, b, c, sin_theta] = mix_all(
        mix_all(along_x(corner), along_x(corner + row), f.y),
        mix_all(along_x(above), along_x(above + row), f.y),
        f.z,
    );
    ShadowRecord {
        shares: [a, b, c],
        sin_theta,
    }
}
