//! Scattering of all lights at visible points, eight lights at a time: what [`super::shade`] computes
//! one after the other, the same to rounding, and for multiple scattering, which comes from
//! tables of the fibre in place of the closed form. Painted points that differ in absorption have tables too; others keep
//! to the other way.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::{
    DirectionInFrame, LightInFrame, TERM_GLOBAL, TERM_LOCAL, TERM_SINGLE, WidthProfile,
    forward_table, plain_layers,
};
use strandlight_scattering::wide::{
    LANES, Level, Peaks, Place, Responses, Roulette, Simd, WideLights, dispatch, f32x8, prelude::*,
    single_scattering,
};
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::scene::LightRecord;

mod bounce;
mod eight_lights;
mod multiple;
mod narrow;
mod narrow_light;
mod optics;
mod shadowed;

use super::along_segments::{Along, PLACES};
use super::arriving::{Arriving, lit_columns};
use super::axis_shares::AxisShares;
use super::draft_multiple::{DraftPoint, LightColumns};
use super::frame::kept::{N_NODES, narrow_columns};
use super::halves::{half, n_numbers};
use super::radiance::{Radiance, mean};
use super::scene_tables::SceneTables;
use super::shade::{Counts, Terms};
use super::unblocked::{Unblocked, VisiblePoint};

pub(super) use bounce::Fibres;
use eight_lights::{EightLights, Multiple};
use narrow_light::{AlongOf, Narrow};
use optics::{LastPainted, Painted, PlainOptics, PointOptics};

/// Visible points that a thread shades at a time.
const CHUNK: usize = 64;

/// Does something with the optics of a point, by a copy of the code for each kind; a function would be compiled without
/// the instruction set.
macro_rules! with_optics {
    ($shader:ident, $point:expr, $last:expr, $optics:ident => $body:expr) => {{
        let views = $shader.painted.as_ref().map(|painted| painted.views());
        let painted = $shader.painted.as_ref().zip(views.as_ref());
        let of_point = painted.and_then(|(painted, views)| painted.at(views, $point));
        match (painted, &of_point, &$shader.plain) {
            (Some((painted, views)), Some(of_point), _) => {
                let $optics = &painted.optics(views, of_point, $last);
                Some($body)
            }
            (_, _, Some($optics)) => Some($body),
            _ => None,
        }
    }};
}
use with_optics;

/// Shades points that tables serve.
pub(super) struct WideShader<'a> {
    scene: &'a PreparedScene,
    view: &'a ViewUniform,
    arriving: &'a Arriving,
    plain: Option<PlainOptics<'a>>,
    painted: Option<Painted<'a>>,
    terms: Terms,
    /// Of drafts, which leave to chance what hardly counts at points of the scene's fibre.
    peaks: Option<Peaks>,
    /// Colours of the lights that are not black, and their columns in [`Arriving`].
    colors: Vec<[f32; 3]>,
    columns: Vec<usize>,
    /// Columns of what is kept.
    n_columns: usize,
    /// The same lights, eight at a time.
    lights: Vec<EightLights>,
    /// The same for single scattering.
    wide: WideLights,
    /// Those of them whose shadows are found along segments; none before there are shadow maps.
    narrow: Vec<Narrow>,
    /// The same for single scattering.
    wide_narrow: WideLights,
    /// What shadow maps say, once there are some.
    maps: Option<&'a Unblocked>,
    /// Where multiple scattering is drawn.
    axis_shares: Option<&'a AxisShares>,
    /// Where strands are wide.
    profile: Option<&'a WidthProfile>,
}

/// What a thread shades points in.
#[derive(Default)]
struct Scratch {
    responses: Responses,
    /// By light, whole vectors.
    unblocked: Vec<[f32; LANES]>,
    unblocked_tt: Vec<[f32; LANES]>,
    weights: Vec<[f32; LANES]>,
    /// By channel and light, whole vectors: radiance for an amplitude of 1.
    of_lights: [Vec<[f32; LANES]>; 3],
    /// By narrow light.
    narrow: Vec<AlongOf>,
    narrow_weights: Vec<f32>,
    of_draft: DraftPoint,
    last_painted: LastPainted,
}

/// What a thread writes of its points.
struct Found<'a> {
    /// See [`Radiance::at`].
    radiance: &'a mut [[f32; 4]],
    /// Of narrow lights; nothing where there are none.
    along: &'a mut [Along],
    /// What is written down; nothing where nothing is.
    numbers: &'a mut [u16],
    rest: &'a mut [[f32; 4]],
}

/// What is written down of every light at a point, for pictures to come.
#[derive(Clone, Copy)]
pub(super) enum Written<'a> {
    Nothing,
    /// What is [kept](super::frame::kept) for lights of other colours.
    Kept,
    /// [Multiple scattering of a draft](super::draft_multiple), for shadow maps to come.
    Draft(&'a LightColumns),
}

/// What some visible points were shaded to.
pub(super) struct WideShaded {
    pub radiance: Radiance,
    /// What is written down of each, one after the other.
    pub numbers: Vec<u16>,
    /// Of a draft, what depends on no shadow map.
    pub rest: Vec<[f32; 4]>,
    pub counts: Counts,
}

impl<'a> WideShader<'a> {
    /// For the `lights` that arrive, as `view` sees `scene`, narrow ones along segments by `maps`, once there are some; with
    /// `axis_shares` where multiple scattering is drawn. By `peaks`, of drafts, what hardly counts is left to chance. Wide strands have a `profile`.
    pub fn new(
        scene: &'a PreparedScene,
        (view, profile): (&'a ViewUniform, Option<&'a WidthProfile>),
        tables: &'a SceneTables,
        (arriving, lights): (&'a Arriving, &[LightRecord]),
        (maps, axis_shares): (Option<&'a Unblocked>, Option<&'a AxisShares>),
        peaks: Option<Peaks>,
    ) -> WideShader<'a> {
        let lit: Vec<(usize, &LightRecord)> = lit_columns(&arriving.lights, lights).collect();
        let directions: Vec<[f32; 3]> = lit.iter().map(|(_, light)| light.direction).collect();
        let lambdas: Vec<f32> = lit.iter().map(|(_, light)| light.lambda).collect();
        let plain = tables.plain.as_ref().map(|tables| PlainOptics {
            shading: scene.hair.optics().shading(scene.tables.view()),
            forward: forward_table(scene.hair.averages()),
            layers: plain_layers(scene.hair.averages()),
            tables,
        });
        let n_lights = arriving.lights.len();
        let n_narrow = narrow_columns(&arriving.lights, lights).len();
        let narrow = match maps {
            Some(_) => Narrow::of(&lit, &arriving.lights, lights),
            None => Vec::new(),
        };
        let narrow_directions: Vec<_> = narrow.iter().map(|of| of.record.direction).collect();
        let narrow_lambdas: Vec<_> = narrow.iter().map(|of| of.record.lambda).collect();
        WideShader {
            scene,
            view,
            arriving,
            plain,
            painted: Painted::new(scene, &tables.painted),
            terms: Terms::new(scene),
            peaks,
            wide: WideLights::new(&directions, &lambdas),
            colors: lit.iter().map(|(_, light)| light.rgb).collect(),
            columns: lit.iter().map(|(column, _)| *column).collect(),
            lights: lit.chunks(LANES).map(EightLights::new).collect(),
            n_columns: n_lights + N_NODES * n_narrow,
            wide_narrow: WideLights::new(&narrow_directions, &narrow_lambdas),
            narrow,
            maps,
            axis_shares,
            profile,
        }
    }

    /// Shades some visible points, and writes down what pictures to come need.
    pub fn shade(&self, places: &[u32], visible: &[u32], written: Written) -> WideShaded {
        let (n_written, n_rest) = match written {
            Written::Nothing => (0, 0),
            Written::Kept => (n_numbers(self.n_columns), 0),
            Written::Draft(columns) => (columns.n_numbers(), places.len()),
        };
        let mut radiance = Radiance::black(places.len(), !self.narrow.is_empty());
        let mut numbers = vec![0; n_written * places.len()];
        let mut rest = vec![[0.0; 4]; n_rest];
        let mut numbers_chunks = numbers.chunks_mut(CHUNK * n_written.max(1));
        let mut rest_chunks = rest.chunks_mut(CHUNK);
        let chunks = radiance.chunks_mut(CHUNK).map(|(radiance, along)| Found {
            radiance,
            along,
            numbers: numbers_chunks.next().unwrap_or_default(),
            rest: rest_chunks.next().unwrap_or_default(),
        });
        let chunks: Vec<Found> = chunks.collect();
        let counts = chunks
            .into_par_iter()
            .zip(places.par_chunks(CHUNK))
            .map_init(Scratch::default, |scratch, (found, places)| {
                self.points((places, visible), written, found, scratch)
            })
            .reduce(Counts::default, Counts::and);
        WideShaded {
            radiance,
            numbers,
            rest,
            counts,
        }
    }

    fn points(
        &self,
        (places, visible): (&[u32], &[u32]),
        written: Written,
        found: Found,
        scratch: &mut Scratch,
    ) -> Counts {
        let Found {
            radiance,
            along,
            numbers,
            rest,
        } = found;
        let n_written = numbers.len() / places.len().max(1);
        let mut counts = Counts::default();
        dispatch!(Level::new(), simd => {
            for (ix, (radiance, &place)) in radiance.iter_mut().zip(places).enumerate() {
                let at = VisiblePoint {
                    place: place as usize,
                    point: visible[place as usize] as usize,
                };
                let mut last = std::mem::take(&mut scratch.last_painted);
                let sum = with_optics!(self, at.point, &mut last, optics => {
                    self.point(simd, at, optics, written, scratch, &mut counts)
                });
                scratch.last_painted = last;
                let sum = sum.unwrap_or_default();
                for (value, sum) in radiance.iter_mut().zip(sum) {
                    *value = sum * self.view.radiance_scale;
                }
                if let Some(along) = along.get_mut(ix) {
                    self.add_narrow(scratch, along);
                }
                let numbers = &mut numbers[n_written * ix..][..n_written];
                match written {
                    Written::Nothing => {}
                    Written::Kept => self.keep(scratch, numbers),
                    Written::Draft(columns) => {
                        rest[ix] = self.write_draft(columns, scratch, &sum, numbers);
                    }
                }
            }
        });
        counts
    }

    /// Writes down what each light came to at a point.
    #[inline(always)]
    fn keep(&self, scratch: &Scratch, kept: &mut [u16]) {
        let n_row = kept.len() / 3;
        let rows = kept.chunks_exact_mut(n_row.max(1));
        for (channel, (row, of_lights)) in rows.zip(&scratch.of_lights).enumerate() {
            let of_lights = of_lights.as_flattened();
            if self.columns.len() == self.arriving.lights.len() {
                for (kept, value) in row.iter_mut().zip(of_lights) {
                    *kept = half(*value);
                }
            } else {
                for (&column, value) in self.columns.iter().zip(of_lights) {
                    row[column] = half(*value);
                }
            }
            for (narrow, of) in self.narrow.iter().zip(&scratch.narrow) {
                for (kept, rgb) in row[narrow.column..].iter_mut().zip(&of.nodes) {
                    *kept = half(rgb[channel]);
                }
            }
        }
    }

    /// The frame of a point of the hair, and the eye in it.
    #[inline(always)]
    fn place(&self, point: usize) -> Place {
        let strands = &self.scene.strands;
        let [u, v, w] = strands.frame(point);
        let towards = Vec3::from(self.view.eye) - Vec3::from_slice(&strands.points[point]);
        Place {
            frame: [u, v, w].map(|axis: Vec3| axis.to_array()),
            view: DirectionInFrame::from_vector([u, v, w].map(|axis| axis.dot(towards))),
        }
    }

    /// What the eye sees at a point.
    #[inline(always)]
    fn point<S: Simd>(
        &self,
        simd: S,
        at: VisiblePoint,
        optics: &impl PointOptics,
        written: Written,
        scratch: &mut Scratch,
        counts: &mut Counts,
    ) -> [f32; 4] {
        let place = self.place(at.point);
        let arriving = self.arriving.at(at.place);
        self.narrow(simd, at, optics, scratch);
        if let Written::Draft(_) = written {
            scratch.of_draft.clear(self.lights.len());
        }
        if let Written::Kept = written {
            for of_lights in scratch.of_lights.iter_mut() {
                of_lights.clear();
                of_lights.resize(self.lights.len(), [0.0; LANES]);
            }
        }
        scratch.unblocked.clear();
        scratch.unblocked_tt.clear();
        for lights in &self.lights {
            scratch.unblocked.push(arriving.unblocked(&lights.columns));
            scratch
                .unblocked_tt
                .push(arriving.unblocked_tt(&lights.columns));
        }
        let mut sum = self.single(simd, at, (&place, optics), written, scratch, counts);
        let Scratch {
            unblocked,
            of_lights,
            of_draft,
            ..
        } = scratch;
        let terms = &self.terms;
        let n_lights = self.colors.len();
        let is_kept = matches!(written, Written::Kept);
        let is_draft = matches!(written, Written::Draft(_));
        if terms.bits & (TERM_LOCAL | TERM_GLOBAL) != 0 {
            let mut sums = [f32x8::splat(simd, 0.0); 3];
            let around = self.around(at.point, optics);
            for (ix, (lights, unblocked)) in self.lights.iter().zip(&*unblocked).enumerate() {
                let records = arriving.records(&lights.columns);
                let Multiple { direct, forward } =
                    self.multiple(simd, lights, &records, (&place, optics), &around);
                let unblocked = f32x8::load_array_ref(simd, unblocked);
                for channel in 0..3 {
                    let rgb = f32x8::load_array_ref(simd, &lights.rgb[channel]);
                    let found = direct[channel] * unblocked + forward[channel];
                    sums[channel] += rgb * found;
                    if is_kept {
                        let of_lights = &mut of_lights[channel][ix];
                        let sum = f32x8::load_array_ref(simd, of_lights) + found;
                        sum.store_array(of_lights);
                    }
                    if is_draft {
                        direct[channel].store_array(&mut of_draft.direct[channel][ix]);
                    }
                }
            }
            for (term, bit) in [(1, TERM_LOCAL), (2, TERM_GLOBAL), (3, TERM_LOCAL)] {
                if terms.bits & bit != 0 {
                    counts.terms[term][0] += n_lights as u64;
                }
            }
            for (sum, sums) in sum.iter_mut().zip(sums) {
                let lanes: [f32; LANES] = sums.into();
                *sum += lanes.iter().sum::<f32>();
            }
        }
        sum
    }

    /// What single scattering comes to at a point, by the unblocked shares there; and of narrow lights the side.
    #[inline(always)]
    fn single<S: Simd>(
        &self,
        simd: S,
        at: VisiblePoint,
        (place, optics): (&Place, &impl PointOptics),
        written: Written,
        Scratch {
            responses,
            unblocked,
            unblocked_tt,
            weights,
            of_lights,
            narrow,
            of_draft,
            ..
        }: &mut Scratch,
        counts: &mut Counts,
    ) -> [f32; 4] {
        let terms = &self.terms;
        let mut sum = [0.0; 4];
        if terms.bits & TERM_SINGLE == 0 {
            return sum;
        }
        let n_lights = self.colors.len();
        weights.clear();
        let mut n = 0;
        for (lights, (unblocked, unblocked_tt)) in
            self.lights.iter().zip(unblocked.iter().zip(&*unblocked_tt))
        {
            let mut of_lights = [0.0; LANES];
            for lane in 0..lights.n {
                let share = unblocked[lane].max(unblocked_tt[lane]);
                if share * lights.power[lane] >= terms.min_power {
                    n += 1;
                    of_lights[lane] = share * lights.brightest[lane];
                }
            }
            weights.push(of_lights);
        }
        for (of, along) in self.narrow.iter().zip(&*narrow) {
            let weight = &mut weights.as_flattened_mut()[of.light];
            n -= u64::from(*weight > 0.0);
            n += u64::from(along.shares.is_some());
            *weight = 0.0;
            // Shares are times the view's scale, as the sum is in the end.
            let shares = along.shares.iter().flatten().sum::<f32>() / PLACES as f32;
            sum[3] += shares / self.view.radiance_scale * along.side;
        }
        let weights = weights.as_flattened();
        let (unblocked, unblocked_tt) = (unblocked.as_flattened(), unblocked_tt.as_flattened());
        let peaks = self.peaks.filter(|_| optics.is_plain());
        let roulette = peaks.map(|peaks| Roulette {
            tolerance: TOLERANCE,
            peaks,
            seed: at.point as u32,
        });
        let shading = optics.shading();
        single_scattering(
            simd, &self.wide, weights, place, shading, roulette, responses,
        );
        for entry in responses.entries() {
            let ix = entry.light as usize;
            // TT alone comes through.
            let share = if entry.mode == 1 {
                unblocked_tt[ix]
            } else {
                unblocked[ix]
            };
            let rgb = &self.colors[ix];
            let [r, g, b] = [0, 1, 2].map(|c: usize| rgb[c] * share * entry.rgb[c]);
            let mut scattered = [r, g, b, 0.0];
            if let Some(profile) = self.profile {
                let lights = &self.lights[ix / LANES];
                let direction = lights.direction.map(|axis| axis[ix % LANES]);
                let sides = sides(profile, direction, lights.lambda[ix % LANES], place);
                scattered[3] = sides[entry.mode as usize] * mean([r, g, b]);
            }
            for (sum, scattered) in sum.iter_mut().zip(scattered) {
                *sum += scattered;
            }
            if let Written::Draft(columns) = written
                && columns.has_maps(ix)
            {
                for (sum, scattered) in of_draft.single.iter_mut().zip(scattered) {
                    *sum += scattered;
                }
            }
            if let Written::Kept = written {
                for (of_lights, value) in of_lights.iter_mut().zip(entry.rgb) {
                    of_lights.as_flattened_mut()[ix] += share * value;
                }
            }
        }
        counts.terms[0][0] += n;
        counts.terms[0][1] += n_lights as u64 - n;
        sum
    }
}

/// Factors of the modes of a light over the width of a strand, at a place of it.
fn sides(profile: &WidthProfile, direction: [f32; 3], lambda: f32, place: &Place) -> [f32; 3] {
    let towards = Vec3::from(direction);
    let in_frame = place.frame.map(|axis| Vec3::from(axis).dot(towards));
    profile.sides(&LightInFrame::from_vector(in_frame, lambda), &place.view)
}

/// Modes of lights that are expected to be less than this share of a point's single scattering are left
/// to chance.
const TOLERANCE: f32 = 2e-3;
