//! Scattering of all lights at visible points, eight lights at a time.
//!
//! The same as [`super::shade`] but for rounding, and for multiple scattering, which comes from
//! tables of the fibre in place of the closed form: 1 % off at most, and a tenth of the work.
//! Painted points, each with a fibre of its own, keep to the other way.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::{
    DirectionInFrame, ForwardTable, PackedRecord, Shading, TERM_GLOBAL, TERM_LOCAL, TERM_SINGLE,
    forward_table,
};
use strandlight_scattering::multiple_tables::MultipleTables;
use strandlight_scattering::wide::{
    Directions, LANES, Level, Place, Responses, ShadowRecords, Simd, WideLights, dispatch, f32x8,
    forward_light, prelude::*, sample_forward, single_scattering,
};
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::{NO_SLOT, THROUGH_SLOT};
use strandlight_scene::volume::{Grid, SELF_LIFT};

use super::shade::{Counts, Terms};
use super::transmittance::{mix, mix_all};
use super::unblocked::{Unblocked, VisiblePoint};
use super::voxelise::{grid_position, voxel_index};

/// Visible points that a thread shades at a time.
const CHUNK: usize = 64;

/// Lights whose records are unpacked at a time.
const BATCH: usize = 64;

/// Shades unpainted points.
pub(super) struct WideShader<'a> {
    pub scene: &'a PreparedScene,
    pub view: &'a ViewUniform,
    pub grid: &'a Grid,
    /// Of the fibre.
    pub tables: &'a MultipleTables,
    /// Of all lights, black ones too.
    pub lights: &'a [LightRecord],
    /// `[light][voxel]`.
    pub records: &'a [PackedRecord],
    pub unblocked: &'a Unblocked,
    pub through: &'a Unblocked,
}

/// A batch of lights, none black.
struct Batch<'a> {
    lights: Vec<&'a LightRecord>,
    /// The same for single scattering.
    wide: WideLights,
    rows: Vec<Row>,
    /// `[light][voxel]`: shares at three exponents, and the sine of the inclination.
    records: Vec<[f32; 4]>,
}

/// Eight lights. The last row of a batch is filled up with lights that give nothing.
struct Row {
    direction: [[f32; LANES]; 3],
    lambda: [f32; LANES],
    rgb: [[f32; LANES]; 3],
    /// Solid angle; 0 of those that fill up.
    solid_angle: [f32; LANES],
}

/// What arrives at a point, by light.
#[derive(Default)]
struct Arriving {
    unblocked: Vec<f32>,
    unblocked_tt: Vec<f32>,
    shares: [Vec<f32>; 3],
    sin_theta: Vec<f32>,
}

/// What all points of a frame share.
struct Fibre<'a> {
    shading: Shading<'a>,
    forward: ForwardTable,
    terms: Terms,
}

impl WideShader<'_> {
    /// Radiance of the `visible` points, rgb times the view's radiance scale and zero.
    pub fn shade(&self, visible: &[u32]) -> (Vec<[f32; 4]>, Counts) {
        let n_voxels = self.grid.n_voxels();
        let fibre = Fibre {
            shading: self.scene.hair.optics().shading(self.scene.tables.view()),
            forward: forward_table(self.scene.hair.averages()),
            terms: Terms::new(self.scene),
        };
        let mut radiance = vec![[0.0; 4]; visible.len()];
        let mut counts = Counts::default();
        let records = self.records.chunks(BATCH * n_voxels);
        for (lights, records) in self.lights.chunks(BATCH).zip(records) {
            let batch = Batch::new(lights, records, n_voxels);
            if batch.lights.is_empty() {
                continue;
            }
            let level = Level::new();
            let of_batch = radiance
                .par_chunks_mut(CHUNK)
                .zip(visible.par_chunks(CHUNK))
                .enumerate()
                .map_init(<(Arriving, Responses)>::default, |(arriving, responses), chunk| {
                    let (chunk, (radiance, points)) = chunk;
                    let mut counts = Counts::default();
                    dispatch!(level, simd => {
                        for (ix, (radiance, &point)) in radiance.iter_mut().zip(points).enumerate() {
                            let at = VisiblePoint {
                                place: CHUNK * chunk + ix,
                                point: point as usize,
                            };
                            arriving.find(self, &batch, at);
                            let sum = self.add(simd, &batch, &fibre, at.point, arriving, responses, &mut counts);
                            for (value, sum) in radiance.iter_mut().zip(sum) {
                                *value += sum * self.view.radiance_scale;
                            }
                        }
                    });
                    counts
                })
                .reduce(Counts::default, Counts::and);
            counts = counts.and(of_batch);
        }
        (radiance, counts)
    }

    /// What the eye sees of the lights of a batch at a point.
    #[inline(always)]
    #[allow(
        clippy::too_many_arguments,
        reason = "two of them are buffers, one is a sum"
    )]
    fn add<S: Simd>(
        &self,
        simd: S,
        batch: &Batch,
        fibre: &Fibre,
        point: usize,
        arriving: &Arriving,
        responses: &mut Responses,
        counts: &mut Counts,
    ) -> [f32; 3] {
        let strands = &self.scene.strands;
        let u = Vec3::from_slice(&strands.tangents[point]);
        let v = Vec3::from_slice(&strands.normals[point]);
        let w = u.cross(v);
        let towards = Vec3::from(self.view.eye) - Vec3::from_slice(&strands.points[point]);
        let place = Place {
            frame: [u, v, w].map(|axis: Vec3| axis.to_array()),
            view: DirectionInFrame::from_vector([u, v, w].map(|axis| axis.dot(towards))),
        };
        let terms = &fibre.terms;
        let mut sum = [0.0; 3];
        if terms.bits & TERM_SINGLE != 0 {
            let power = |ix: usize| {
                let share = arriving.unblocked[ix].max(arriving.unblocked_tt[ix]);
                share * batch.lights[ix].power
            };
            let is_wanted = |ix: usize| power(ix) >= terms.min_power;
            let shading = &fibre.shading;
            single_scattering(simd, &batch.wide, is_wanted, &place, shading, responses);
            let (r, tt, trt) = (responses.r(), responses.tt(), responses.trt());
            let mut n = 0;
            for (ix, light) in batch.lights.iter().enumerate() {
                let (share, share_tt) = (arriving.unblocked[ix], arriving.unblocked_tt[ix]);
                n += u64::from(is_wanted(ix));
                for (channel, sum) in sum.iter_mut().enumerate() {
                    let scattered = share * (r[ix] + trt[channel][ix]) + share_tt * tt[channel][ix];
                    *sum += light.rgb[channel] * scattered;
                }
            }
            counts.terms[0][0] += n;
            counts.terms[0][1] += batch.lights.len() as u64 - n;
        }
        if terms.bits & (TERM_LOCAL | TERM_GLOBAL) != 0 {
            let mut sums = [f32x8::splat(simd, 0.0); 3];
            for (ix, row) in batch.rows.iter().enumerate() {
                let n_lights = (batch.lights.len() - LANES * ix).min(LANES) as u64;
                self.add_multiple(simd, row, fibre, &place, arriving, ix, &mut sums);
                for (term, bit) in [(1, TERM_LOCAL), (2, TERM_GLOBAL), (3, TERM_LOCAL)] {
                    if terms.bits & bit != 0 {
                        counts.terms[term][0] += n_lights;
                    }
                }
            }
            for (sum, sums) in sum.iter_mut().zip(sums) {
                let lanes: [f32; LANES] = sums.into();
                *sum += lanes.iter().sum::<f32>();
            }
        }
        sum
    }

    /// Adds global, local and direct local scattering of eight lights.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "one of them is a sum")]
    fn add_multiple<S: Simd>(
        &self,
        simd: S,
        row: &Row,
        fibre: &Fibre,
        place: &Place,
        arriving: &Arriving,
        ix: usize,
        sums: &mut [f32x8<S>; 3],
    ) {
        let bits = fibre.terms.bits;
        let [density_forward, density_back] = fibre.terms.densities;
        // Loops and no closures around vectors, which would be compiled without the instruction set.
        let zero = f32x8::splat(simd, 0.0);
        let mut along = [zero; 3];
        for (along, axis) in along.iter_mut().zip(&place.frame) {
            for (direction, axis) in row.direction.iter().zip(axis) {
                *along += f32x8::load_array_ref(simd, direction) * *axis;
            }
        }
        let at = Directions::from_vectors(along);
        let view = &place.view;
        let cos_delta = at.cos_phi * view.cos_phi + at.sin_phi * view.sin_phi;
        let cos_delta = cos_delta.min(1.0).max(-1.0);
        let lambda = f32x8::load_array_ref(simd, &row.lambda);
        let solid_angle = f32x8::load_array_ref(simd, &row.solid_angle);
        let mut rgb = [zero; 3];
        for (rgb, numbers) in rgb.iter_mut().zip(&row.rgb) {
            *rgb = f32x8::load_array_ref(simd, numbers);
        }
        let lights = LANES * ix..LANES * (ix + 1);
        let unblocked = f32x8::from_slice(simd, &arriving.unblocked[lights.clone()]);
        let mut record = ShadowRecords {
            shares: [zero; 3],
            sin_theta: f32x8::from_slice(simd, &arriving.sin_theta[lights.clone()]),
        };
        for (share, shares) in record.shares.iter_mut().zip(&arriving.shares) {
            *share = f32x8::from_slice(simd, &shares[lights.clone()]);
        }
        let averages = sample_forward(&fibre.forward, record.sin_theta);
        let forward = forward_light(&record, unblocked, &averages, &rgb, lambda);
        let (global, local) =
            self.tables
                .at_lights(at.theta, view.theta, cos_delta, forward.sigma_f);
        let has_local = bits & TERM_LOCAL != 0;
        let mut direct = [zero; 3];
        if has_local {
            direct =
                self.tables
                    .direct_at_lights(at.theta, at.cos_theta, view.theta, cos_delta, lambda);
        }
        for channel in 0..3 {
            let mut scattered = direct[channel] * unblocked * density_back;
            let gained = forward.gained[channel] * density_forward;
            if bits & TERM_GLOBAL != 0 {
                scattered += gained * global[channel];
            }
            if has_local {
                scattered += gained * local[channel] * density_back;
            }
            sums[channel] += rgb[channel] * solid_angle * scattered;
        }
    }
}

impl<'a> Batch<'a> {
    /// Of `lights` with their packed records.
    fn new(lights: &'a [LightRecord], packed: &[PackedRecord], n_voxels: usize) -> Batch<'a> {
        let lit = || {
            lights
                .iter()
                .zip(packed.chunks_exact(n_voxels))
                .filter(|(light, _)| light.power > 0.0)
        };
        let lights: Vec<&LightRecord> = lit().map(|(light, _)| light).collect();
        let mut records = vec![[0.0; 4]; lights.len() * n_voxels];
        let packed: Vec<&[PackedRecord]> = lit().map(|(_, packed)| packed).collect();
        records
            .par_chunks_mut(n_voxels)
            .zip(packed)
            .for_each(|(records, packed)| {
                for (record, packed) in records.iter_mut().zip(packed) {
                    *record = unpack(packed);
                }
            });
        let directions: Vec<[f32; 3]> = lights.iter().map(|light| light.direction).collect();
        let lambdas: Vec<f32> = lights.iter().map(|light| light.lambda).collect();
        Batch {
            wide: WideLights::new(&directions, &lambdas),
            rows: lights.chunks(LANES).map(Row::new).collect(),
            lights,
            records,
        }
    }
}

impl Row {
    fn new(lights: &[&LightRecord]) -> Row {
        let of = |ix: usize| lights[ix.min(lights.len() - 1)];
        let numbers =
            |number: &dyn Fn(&LightRecord) -> f32| std::array::from_fn(|ix| number(of(ix)));
        let mut solid_angle: [f32; LANES] = numbers(&|light| light.solid_angle);
        solid_angle[lights.len()..].fill(0.0);
        Row {
            direction: [0, 1, 2].map(|axis: usize| numbers(&|light| light.direction[axis])),
            lambda: numbers(&|light| light.lambda),
            rgb: [0, 1, 2].map(|channel: usize| numbers(&|light| light.rgb[channel])),
            solid_angle,
        }
    }
}

impl Arriving {
    /// Finds what arrives at a visible point.
    #[inline(always)]
    fn find(&mut self, shader: &WideShader, batch: &Batch, at: VisiblePoint) {
        let n = batch.lights.len().next_multiple_of(LANES);
        let all = [
            &mut self.unblocked,
            &mut self.unblocked_tt,
            &mut self.sin_theta,
        ];
        for numbers in all.into_iter().chain(&mut self.shares) {
            numbers.clear();
            numbers.resize(n, 0.0);
        }
        let grid = shader.grid;
        let n_voxels = grid.n_voxels();
        let position = Vec3::from_slice(&shader.scene.strands.points[at.point]);
        let lift = SELF_LIFT * grid.h;
        let mut through = 0.0;
        if !shader.through.is_empty() {
            through = shader.through.share(THROUGH_SLOT, at);
        }
        for (ix, light) in batch.lights.iter().enumerate() {
            let g = grid_position(grid, position + Vec3::from(light.direction) * lift);
            let records = &batch.records[ix * n_voxels..][..n_voxels];
            let [a, b, c, sin_theta] = record_at(grid, records, g);
            let (mut unblocked, mut unblocked_tt) = (a, a);
            if light.shadow_index != NO_SLOT {
                unblocked = shader.unblocked.share(light.shadow_index, at);
                unblocked_tt = mix(unblocked, through, light.forward_weight);
            }
            (self.unblocked[ix], self.unblocked_tt[ix]) = (unblocked, unblocked_tt);
            for (shares, share) in self.shares.iter_mut().zip([a, b, c]) {
                shares[ix] = share;
            }
            self.sin_theta[ix] = sin_theta;
        }
    }
}

/// [`super::shade::record_at`] of unpacked records.
#[inline(always)]
fn record_at(grid: &Grid, records: &[[f32; 4]], g: Vec3) -> [f32; 4] {
    let (x, y, z) = (g.x as i32, g.y as i32, g.z as i32);
    let (fx, fy, fz) = (g.x - x as f32, g.y - y as f32, g.z - z as f32);
    let corner = voxel_index(grid, [x as u32, y as u32, z as u32]);
    let row = grid.dims[0] as usize;
    let above = corner + row * grid.dims[1] as usize;
    let along_x = |at: usize| mix_all(records[at], records[at + 1], fx);
    mix_all(
        mix_all(along_x(corner), along_x(corner + row), fy),
        mix_all(along_x(above), along_x(above + row), fy),
        fz,
    )
}

/// Shares at three exponents, and the sine of the inclination.
fn unpack(packed: &PackedRecord) -> [f32; 4] {
    let record = strandlight_scattering::closed_form::unpack_record(packed);
    let [a, b, c] = record.shares;
    [a, b, c, record.sin_theta]
}
