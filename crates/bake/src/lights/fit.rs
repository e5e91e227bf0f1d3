//! The fit of a light set to a map, from pixels to lights.

use rayon::prelude::*;
use strandlight_formats::{LightSet, SrbfLight};

use super::cells::{Cell, map_cells, srbf_solid_angle};
use super::map::{Map, MapError};
use super::projection::{Lobe, State, Target, energy_row, refine};
use super::response::Response;
use super::search::{Candidates, grow, relocate};
use super::spectrum::Filter;
use super::sphere::fibonacci;
use super::sun::{Source, amplitude, extract};
use crate::progress::{Progress, timed};

/// Most lights of a set.
pub const MAX_LIGHTS: usize = 1024;

/// Points of the coarse level: a spacing of 7 degrees, enough to find places for lobes.
const COARSE_POINTS: usize = 800;

/// Points of the fine level: a spacing of 3.7 degrees, half the standard deviation of the
/// narrowest lobe of the response.
const FINE_POINTS: usize = 3072;

/// Places tried for a new lobe.
const CENTRES: usize = 640;

/// What to fit.
#[derive(Clone, Copy, Debug)]
pub struct FitOptions {
    /// Number of lights, 1..=[`MAX_LIGHTS`].
    pub count: usize,
    /// Turns the lattice from which the search starts; any value, same seed same lights.
    pub seed: u64,
}

impl Default for FitOptions {
    fn default() -> Self {
        FitOptions { count: 40, seed: 0 }
    }
}

/// A fitted light set and how it came about.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The lights, by falling energy.
    pub lights: LightSet,
    /// Lights that stand for compact sources (the sun, bare lamps).
    pub suns: usize,
    /// What each channel of the other lights was multiplied with to keep the energy exactly.
    pub energy_scale: [f64; 3],
    /// Seconds of each stage, in order.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Steps that [`fit`] reports to its progress.
pub const STEPS: u64 = 5;

/// Fits spherical Gaussian lights to a map.
///
/// Compact sources are taken out as narrow lights; the rest is fitted by variable projection
/// under the filter whose L2 norm is the expected squared error of a fibre (see `spectrum`).
/// Amplitudes are not negative. Each channel's energy is the map's. The result depends on the
/// map, the options and nothing else.
///
/// # Errors
/// [`MapError::Unusable`] if the map has no light, values too large, or the count is out of range.
pub fn fit(map: &Map, options: FitOptions, progress: &Progress) -> Result<Fit, MapError> {
    if !(1..=MAX_LIGHTS).contains(&options.count) {
        return Err(MapError::Unusable(format!(
            "the number of lights is {}, outside 1..={MAX_LIGHTS}",
            options.count
        )));
    }
    let energy = map.energy();
    let total: f64 = energy.iter().sum();
    if total == 0.0 {
        return Err(MapError::Unusable("the map has no light".to_owned()));
    }
    let mut seconds = Vec::new();

    // Compact sources, and the map without them.
    let ((sources, rest), time) = timed(|| {
        let (sources, pixels) = extract(map, options.count.div_ceil(4));
        let rest = Map::from_decoded(map.width(), map.height(), pixels, map.source().clone());
        (sources, rest)
    });
    seconds.push(("suns", time));
    progress.advance(1);

    // The filtered targets. Radiance is measured in units of the map's mean.
    let unit = total / (12.0 * std::f64::consts::PI);
    let ((filter, coarse, fine), time) = timed(|| {
        let filter = Filter::new(&[Response::default()]);
        let cells = map_cells(&rest);
        let coarse = filtered(&filter, &cells, COARSE_POINTS, unit);
        let fine = filtered(&filter, &cells, FINE_POINTS, unit);
        (filter, coarse, fine)
    });
    seconds.push(("filter", time));
    progress.advance(1);

    let count = options.count - sources.len();
    let turn = (options.seed % 65_536) as f64;
    let (state, time) = timed(|| {
        let candidates = Candidates::new(&filter, &coarse, CENTRES, turn);
        let empty = State::solve(&filter, &coarse, Vec::new(), &Default::default());
        let state = grow(&filter, &coarse, &candidates, empty, count);
        let state = refine(&filter, &coarse, state, 8);
        relocate(&filter, &coarse, &candidates, state, 8)
    });
    seconds.push(("search", time));
    progress.advance(2);

    let (state, time) = timed(|| {
        let start = State::solve(&filter, &fine, state.lobes, &state.amplitudes);
        refine(&filter, &fine, start, 16)
    });
    seconds.push(("refine", time));
    progress.advance(1);

    let (lights, energy_scale) = assemble(&state, &sources, energy, unit)?;
    Ok(Fit {
        lights,
        suns: sources.len(),
        energy_scale,
        seconds,
    })
}

/// The filtered map at `count` points and its mean radiance, in units of `unit`.
pub(super) fn filtered(filter: &Filter, cells: &[Cell], count: usize, unit: f64) -> Target {
    let profile = filter.point_profile();
    let flat: Vec<([f32; 3], [f32; 3])> = cells
        .iter()
        .map(|cell| {
            (
                cell.direction.map(|x| x as f32),
                cell.energy.map(|e| (e / unit) as f32),
            )
        })
        .collect();
    let scale = 1.0 / (count as f64).sqrt();
    let points: Vec<[f32; 3]> = (0..count)
        .map(|ix| fibonacci(ix, count, 0.0).map(|x| x as f32))
        .collect();
    let values: Vec<[f64; 3]> = points
        .par_iter()
        .map(|p| {
            let mut sum = [0.0f64; 3];
            for strip in flat.chunks(256) {
                let mut part = [0.0f32; 3];
                for (d, energy) in strip {
                    let value = profile.at(p[0] * d[0] + p[1] * d[1] + p[2] * d[2])[0];
                    for c in 0..3 {
                        part[c] += value * energy[c];
                    }
                }
                for c in 0..3 {
                    sum[c] += f64::from(part[c]);
                }
            }
            sum.map(|x| x * scale)
        })
        .collect();
    let rows = [0, 1, 2].map(|c| {
        let mut rows: Vec<f32> = values.iter().map(|v| v[c] as f32).collect();
        let energy: f64 = cells.iter().map(|cell| cell.energy[c] / unit).sum();
        rows.push(energy_row(energy) as f32);
        rows
    });
    Target { points, rows }
}

/// The light set of a state and the sources, its energy made the map's.
fn assemble(
    state: &State,
    sources: &[Source],
    energy: [f64; 3],
    unit: f64,
) -> Result<(LightSet, [f64; 3]), MapError> {
    let mut all: Vec<(Lobe, [f64; 3])> = state
        .lobes
        .iter()
        .enumerate()
        .map(|(j, lobe)| (*lobe, [0, 1, 2].map(|c| state.amplitudes[c][j] * unit)))
        .collect();
    let mut scale = [1.0; 3];
    for c in 0..3 {
        let suns: f64 = sources.iter().map(|source| source.energy[c]).sum();
        let lobes: f64 = all
            .iter()
            .map(|(lobe, rgb)| rgb[c] * srbf_solid_angle(lobe.lambda))
            .sum();
        if lobes > 0.0 {
            scale[c] = ((energy[c] - suns) / lobes).max(0.0);
        }
    }
    for (_, rgb) in &mut all {
        for c in 0..3 {
            rgb[c] *= scale[c];
        }
    }
    all.extend(sources.iter().map(|source| {
        let lobe = Lobe {
            axis: source.direction,
            lambda: source.lambda,
        };
        (lobe, amplitude(source.energy, source.lambda))
    }));
    all.retain(|(_, rgb)| rgb.iter().any(|a| *a > 0.0));
    let power =
        |(lobe, rgb): &(Lobe, [f64; 3])| rgb.iter().sum::<f64>() * srbf_solid_angle(lobe.lambda);
    // Stable: equals stay in the order in which they were found.
    all.sort_by(|a, b| power(b).total_cmp(&power(a)));
    let lights: Vec<SrbfLight> = all
        .iter()
        .map(|(lobe, rgb)| SrbfLight {
            direction: lobe.axis.map(|x| x as f32),
            lambda: lobe.lambda as f32,
            rgb: rgb.map(|a| a as f32),
        })
        .collect();
    if lights.is_empty()
        || lights
            .iter()
            .flat_map(|light| light.rgb)
            .any(|a| !a.is_finite())
    {
        return Err(MapError::Unusable(
            "the map's radiance leaves the range of single precision".to_owned(),
        ));
    }
    let lights = LightSet {
        lights,
        ..LightSet::default()
    };
    Ok((lights, scale))
}
