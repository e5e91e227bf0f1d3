//! Compact sources - the sun, bare lamps - taken out of the map as narrow lights before the fit.

use std::f64::consts::LN_2;

use super::cells::srbf_solid_angle;
use super::map::Map;
use super::sphere::{Vec3, combine, dot, normalize};

/// Most sources that are taken out.
const MAX_SOURCES: usize = 4;

/// Smallest part of the map's luminance that makes a source worth a light of its own.
const MIN_SHARE: f64 = 0.04;

/// Largest radius of a source, radians: 3 degrees. What is larger is a lobe like any other.
const MAX_RADIUS: f64 = 0.052;

/// Smallest bandwidth of a light: the sun's disc has a radius of 0.0047.
pub(super) const MIN_LAMBDA: f64 = 0.005;

/// A compact source.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// Centroid of its energy above the background.
    pub direction: Vec3,
    /// Bandwidth that holds half the energy within the measured half-energy radius.
    pub lambda: f64,
    /// Radiance times solid angle above the background.
    pub energy: [f64; 3],
}

/// Finds the compact sources of a map, brightest pixel first, and cuts each down to its
/// background in `pixels`, which are returned.
pub(super) fn extract(map: &Map, limit: usize) -> (Vec<Source>, Vec<[f32; 3]>) {
    let mut pixels = map.pixels().to_vec();
    let mut sources = Vec::new();
    let total: f64 = map.energy().iter().sum();
    for _ in 0..MAX_SOURCES.min(limit) {
        match extract_one(map, &mut pixels, total) {
            Some(source) => sources.push(source),
            None => break,
        }
    }
    (sources, pixels)
}

/// A pixel near a source.
struct Near {
    ix: usize,
    direction: Vec3,
    solid_angle: f64,
    angle: f64,
}

fn extract_one(map: &Map, pixels: &mut [[f32; 3]], total: f64) -> Option<Source> {
    let grid = map.grid();
    let sum = |p: &[f32; 3]| f64::from(p[0]) + f64::from(p[1]) + f64::from(p[2]);
    // The first of the brightest pixels.
    let (peak_ix, peak) = pixels.iter().enumerate().fold((0, -1.0), |best, (ix, p)| {
        let value = sum(p);
        if value > best.1 { (ix, value) } else { best }
    });
    if peak <= 0.0 {
        return None;
    }
    let (i, j) = (peak_ix % grid.width, peak_ix / grid.width);
    let pixel = std::f64::consts::PI / grid.height as f64;
    let mut centre = grid.direction(i as f64 + 0.5, j as f64 + 0.5);
    // At least two pixels to each side; on coarse maps that is more than MAX_RADIUS.
    let reach = MAX_RADIUS.max(2.5 * pixel);

    let mut near = neighbours(map, centre, 2.0 * reach + pixel);
    for _ in 0..3 {
        for p in &mut near {
            p.angle = angle(p.direction, centre);
        }
        let background = ring_mean(&near, pixels, reach, 2.0 * reach);
        let mut moment = [0.0; 3];
        for p in near.iter().filter(|p| p.angle <= reach) {
            let weight = above(pixels[p.ix], background).iter().sum::<f64>() * p.solid_angle;
            moment = combine(moment, 1.0, p.direction, weight, [0.0; 3], 0.0);
        }
        if dot(moment, moment) > 0.0 {
            centre = normalize(moment);
        }
    }
    for p in &mut near {
        p.angle = angle(p.direction, centre);
    }
    near.sort_by(|a, b| a.angle.total_cmp(&b.angle).then(a.ix.cmp(&b.ix)));
    let background = ring_mean(&near, pixels, reach, 2.0 * reach);

    // Curve of growth.
    let mut energy = [0.0; 3];
    let mut growth = Vec::new();
    for p in near.iter().take_while(|p| p.angle <= reach) {
        let above = above(pixels[p.ix], background);
        for c in 0..3 {
            energy[c] += above[c] * p.solid_angle;
        }
        growth.push((p.angle, energy.iter().sum::<f64>()));
    }
    let whole: f64 = energy.iter().sum();
    // Compact: most of it within half the reach, and far brighter than its surroundings.
    let inner = growth
        .iter()
        .take_while(|(angle, _)| *angle <= 0.5 * reach)
        .last()
        .map_or(0.0, |(_, e)| *e);
    if whole < MIN_SHARE * total || inner < 0.75 * whole {
        return None;
    }
    let half = growth
        .iter()
        .find(|(_, e)| *e >= 0.5 * whole)
        .map_or(0.0, |(angle, _)| *angle);
    // Energy within gamma of a narrow SRBF: 1 - exp(-gamma^2 / lambda^2).
    let lambda = (half / LN_2.sqrt()).max(MIN_LAMBDA);
    for p in near.iter().take_while(|p| p.angle <= reach) {
        for c in 0..3 {
            let value = &mut pixels[p.ix][c];
            *value = value.min(background[c] as f32);
        }
    }
    Some(Source {
        direction: centre,
        lambda,
        energy,
    })
}

/// Amplitude of a light of this energy.
pub(super) fn amplitude(energy: [f64; 3], lambda: f64) -> [f64; 3] {
    energy.map(|e| e / srbf_solid_angle(lambda))
}

fn above(pixel: [f32; 3], background: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| (f64::from(pixel[c]) - background[c]).max(0.0))
}

/// Angle between unit vectors, exact for small ones.
fn angle(a: Vec3, b: Vec3) -> f64 {
    let chord = [0, 1, 2].map(|k| a[k] - b[k]);
    2.0 * (0.5 * dot(chord, chord).sqrt()).min(1.0).asin()
}

/// The pixels within `radius` of a direction.
fn neighbours(map: &Map, centre: Vec3, radius: f64) -> Vec<Near> {
    let grid = map.grid();
    let pixel = std::f64::consts::PI / grid.height as f64;
    let row = grid.position(centre)[1];
    let rows = radius / pixel + 1.0;
    let first = (row - rows).max(0.0) as usize;
    let last = ((row + rows) as usize).min(grid.height - 1);
    let mut near = Vec::new();
    for j in first..=last {
        let solid_angle = grid.solid_angle(j);
        for i in 0..grid.width {
            let direction = grid.direction(i as f64 + 0.5, j as f64 + 0.5);
            let angle = angle(direction, centre);
            if angle <= radius {
                near.push(Near {
                    ix: j * grid.width + i,
                    direction,
                    solid_angle,
                    angle,
                });
            }
        }
    }
    near
}

/// Mean radiance between two angles.
fn ring_mean(near: &[Near], pixels: &[[f32; 3]], from: f64, to: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut area = 0.0;
    for p in near.iter().filter(|p| p.angle > from && p.angle <= to) {
        area += p.solid_angle;
        for c in 0..3 {
            sum[c] += f64::from(pixels[p.ix][c]) * p.solid_angle;
        }
    }
    if area > 0.0 {
        sum.map(|s| s / area)
    } else {
        [0.0; 3]
    }
}
