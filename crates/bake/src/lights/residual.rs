//! Compact sources as lights, the rest as a map: together the map.

use rayon::prelude::*;
use strandlight_formats::{FitReport, LightSet, SrbfLight};
use strandlight_images::{Map, MapError};
use strandlight_scene::progress::Progress;

use super::cells::radiance;
use super::report::{Judge, RowProgress};
use super::response::{Response, relative_rms, squares};
use super::sun::{amplitude, extract};

/// Most compact sources that [`separate`] takes out of a map.
pub const MAX_SUNS: usize = 16;

/// What a set records whose lights are the compact sources of its map alone.
pub fn rest_parameter() -> (String, String) {
    ("rest".to_owned(), "residual map".to_owned())
}

/// The compact sources of a map, and what is left of it.
#[derive(Clone, Debug)]
pub struct Separated {
    /// A light for each compact source, by falling energy; none if the map has none.
    pub lights: Vec<SrbfLight>,
    /// The map with each source cut down to its surroundings, pixel by pixel of the map.
    pub residual: Map,
}

/// Takes up to `most` compact sources (at most 3 degrees in radius, at least 4 % of the map's energy
/// each) out of a map, brightest pixel first. The energies of lights and residual add up to the
/// map's, up to rounding.
///
/// # Errors
/// The residual is no map; a map's always is.
pub fn separate(map: &Map, most: usize) -> Result<Separated, MapError> {
    let (sources, rest) = extract(map, most.min(MAX_SUNS));
    let grid = map.grid();
    let mut pixels = Vec::with_capacity(grid.width * grid.height);
    for j in 0..grid.height {
        pixels.extend_from_slice(rest.row(j));
    }
    let mut lights: Vec<(f64, SrbfLight)> = sources
        .iter()
        .map(|source| {
            let light = SrbfLight {
                direction: source.direction.map(|x| x as f32),
                lambda: source.lambda as f32,
                rgb: amplitude(source.energy, source.lambda).map(|a| a as f32),
            };
            (source.energy.iter().sum(), light)
        })
        .collect();
    // Stable: equals stay in the order in which they were found.
    lights.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    Ok(Separated {
        lights: lights.into_iter().map(|(_, light)| light).collect(),
        residual: Map::new(grid.width, grid.height, pixels)?,
    })
}

/// As [`evaluate`](super::evaluate), of lights and a residual map of the same size together; `None`
/// if the sizes differ. Reports [`EVALUATION_STEPS`](super::EVALUATION_STEPS) steps.
pub fn evaluate_with_residual(
    set: &LightSet,
    residual: &Map,
    map: &Map,
    progress: &Progress,
) -> Option<FitReport> {
    let grid = map.grid();
    if residual.grid() != grid {
        return None;
    }
    let figures = Judge::new(map, &Response::default()).figures(set, Some(residual));
    let progress = RowProgress::of(map, progress);
    let rows: Vec<[f64; 2]> = (0..grid.height)
        .into_par_iter()
        .map(|j| {
            let solid_angle = grid.solid_angle(j);
            let mut sums = [0.0; 2];
            for (i, (rest, pixel)) in residual.row(j).iter().zip(map.row(j)).enumerate() {
                let direction = grid.direction(i as f64 + 0.5, j as f64 + 0.5);
                let own = radiance(&set.lights, direction);
                let both = [0, 1, 2].map(|c| own[c] + f64::from(rest[c]));
                let [difference, reference] = squares(both, pixel.map(f64::from));
                sums[0] += difference * solid_angle;
                sums[1] += reference * solid_angle;
            }
            progress.advance();
            sums
        })
        .collect();
    Some(FitReport {
        rel_l2: relative_rms(&rows),
        ..figures
    })
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use strandlight_scene::progress::ProgressDisplay;

    use super::*;
    use crate::lights::EVALUATION_STEPS;
    use crate::lights::sphere::{dot, normalize};
    use strandlight_scattering::spherical_gaussian::solid_angle;

    const SUN: [f64; 3] = [0.5, 0.6, -0.7];
    const LAMP: [f64; 3] = [-0.8, 0.1, 0.3];

    /// A sky with a disc of 0.7 degrees that has some 60 % of the light, and a dimmer reddish lamp.
    fn map() -> Map {
        let (width, height) = (1024, 512);
        let grid = strandlight_images::LatLong { width, height };
        let pixels = (0..width * height).map(|ix| {
            let d = grid.direction((ix % width) as f64 + 0.5, (ix / width) as f64 + 0.5);
            let near = |axis: [f64; 3], radius: f64| dot(d, normalize(axis)) > radius.cos();
            let sky = [0.3, 0.4, 0.6].map(|x| x * (1.2 + d[1]));
            let sun = if near(SUN, 0.012) {
                [30_000.0; 3]
            } else {
                [0.0; 3]
            };
            let lamp = if near(LAMP, 0.02) {
                [1500.0, 900.0, 300.0]
            } else {
                [0.0; 3]
            };
            [0, 1, 2].map(|c| (sky[c] + sun[c] + lamp[c]) as f32)
        });
        Map::new(width, height, pixels.collect()).unwrap()
    }

    #[test]
    fn lights_and_residual_add_up_to_the_map() {
        let map = map();
        for (most, found) in [(0, 0), (1, 1), (2, 2), (9, 2)] {
            let parts = separate(&map, most).unwrap();
            assert_eq!(parts.lights.len(), found, "{most}");
            let rest = parts.residual.energy();
            for (c, rest) in rest.into_iter().enumerate() {
                let lights = parts
                    .lights
                    .iter()
                    .map(|light| f64::from(light.rgb[c]) * solid_angle(f64::from(light.lambda)));
                let sum = lights.sum::<f64>() + rest;
                let ratio = sum / map.energy()[c];
                assert!((ratio - 1.0).abs() < 1e-5, "{most} {c}: {ratio}");
            }
            assert!(parts.residual.faults().is_clean());
        }
    }

    #[test]
    fn the_sources_are_gone_from_the_residual_and_nothing_else_is() {
        let map = map();
        let Separated { lights, residual } = separate(&map, 4).unwrap();
        for (light, axis) in lights.iter().zip([SUN, LAMP]) {
            let cos = dot(light.direction.map(f64::from), normalize(axis));
            assert!(cos > 0.002f64.cos(), "{light:?}");
        }
        let grid = map.grid();
        let (mut cut, mut kept) = (0, 0);
        for (ix, (rest, pixel)) in residual.pixels().iter().zip(map.pixels()).enumerate() {
            let d = grid.direction((ix % 1024) as f64 + 0.5, (ix / 1024) as f64 + 0.5);
            let is_far = [SUN, LAMP]
                .iter()
                .all(|axis| dot(d, normalize(*axis)) < 0.06f64.cos());
            assert!(
                rest.iter()
                    .zip(pixel)
                    .all(|(rest, pixel)| rest <= pixel && *rest >= 0.0)
            );
            // The sky is 1.4 at the most.
            assert!(rest.iter().all(|x| *x < 1.5), "{ix}: {rest:?}");
            cut += usize::from(rest != pixel);
            kept += usize::from(is_far);
            assert!(!is_far || rest == pixel);
        }
        assert!(cut > 20 && kept > 500_000, "{cut} {kept}");
    }

    #[test]
    fn together_they_light_hair_as_the_map_does() {
        let map = map();
        let Separated { lights, residual } = separate(&map, 4).unwrap();
        let set = LightSet {
            lights,
            ..LightSet::default()
        };
        let report = evaluate_with_residual(&set, &residual, &map, &Progress::silent()).unwrap();
        assert!(report.fibre_error < 2e-3, "{report:?}");
        assert!(report.irradiance_error < 1e-3, "{report:?}");
        assert!(
            report
                .energy_ratio
                .iter()
                .all(|ratio| (ratio - 1.0).abs() < 1e-3)
        );
        let alone = crate::lights::evaluate(&set, &map);
        assert!(alone.fibre_error > 0.1, "{alone:?}");
        assert!(report.rel_l2 < 1.0, "{report:?}");
        let small = Map::new(4, 2, vec![[1.0; 3]; 8]).unwrap();
        assert_eq!(
            evaluate_with_residual(&set, &small, &map, &Progress::silent()),
            None
        );
    }

    /// The steps that were reached.
    #[derive(Clone, Default)]
    struct Reached(Arc<Mutex<Vec<u64>>>);

    impl ProgressDisplay for Reached {
        fn advance(&self, _: u64) {}

        fn reach(&self, steps: u64) {
            self.0.lock().unwrap().push(steps);
        }

        fn say(&self, _: &str) {}

        fn finish(&self) {}
    }

    #[test]
    fn comparisons_tell_how_far_they_are() {
        let map = map();
        let Separated { lights, residual } = separate(&map, 4).unwrap();
        let set = LightSet {
            lights,
            ..LightSet::default()
        };
        let evaluations: [&dyn Fn(&Progress) -> FitReport; 2] = [
            &|progress| crate::lights::evaluate_with_progress(&set, &map, progress),
            &|progress| {
                let report = evaluate_with_residual(&set, &residual, &map, progress);
                report.unwrap()
            },
        ];
        for evaluation in evaluations {
            let reached = Reached::default();
            evaluation(&Progress::new(reached.clone()));
            let mut steps = reached.0.lock().unwrap().clone();
            steps.sort_unstable();
            steps.dedup();
            assert_eq!(steps, (0..=EVALUATION_STEPS).collect::<Vec<_>>());
        }
    }
}
