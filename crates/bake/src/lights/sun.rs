//! Compact sources - the sun, bare lamps - taken out of the map as narrow lights before the fit.

use std::collections::BTreeMap;
use std::f64::consts::LN_2;

use rayon::prelude::*;

use super::cells::srbf_solid_angle;
use super::sphere::{Vec3, combine, dot, normalize};
use strandlight_images::{LatLong, Map};

/// Most sources that a fit takes out.
pub(super) const MAX_SOURCES: usize = 4;

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

/// A map without its compact sources. Only rows that differ from the map's are copied: maps can
/// take gigabytes.
pub(super) struct Rest<'a> {
    map: &'a Map,
    cut: BTreeMap<usize, Vec<[f32; 3]>>,
}

impl<'a> Rest<'a> {
    /// The whole map.
    pub fn new(map: &'a Map) -> Self {
        Rest {
            map,
            cut: BTreeMap::new(),
        }
    }

    pub fn grid(&self) -> LatLong {
        self.map.grid()
    }

    /// The pixels of row `j`.
    pub fn row(&self, j: usize) -> &[[f32; 3]] {
        match self.cut.get(&j) {
            Some(row) => row,
            None => self.map.row(j),
        }
    }

    /// Integral over the sphere.
    pub fn energy(&self) -> [f64; 3] {
        let grid = self.grid();
        grid.energy((0..grid.height).map(|j| self.row(j)))
    }

    fn pixel(&self, ix: usize) -> [f32; 3] {
        let width = self.map.width();
        self.row(ix / width)[ix % width]
    }

    /// Cuts pixel `ix` down to `background`.
    fn cut_down(&mut self, ix: usize, background: [f64; 3]) {
        let (i, j) = (ix % self.map.width(), ix / self.map.width());
        let map = self.map;
        let row = self.cut.entry(j).or_insert_with(|| map.row(j).to_vec());
        for (x, background) in row[i].iter_mut().zip(background) {
            *x = x.min(background as f32);
        }
    }

    /// Index and value of the first pixel with the largest sum of channels.
    fn peak(&self) -> (usize, f64) {
        let grid = self.grid();
        let sum = |p: &[f32; 3]| f64::from(p[0]) + f64::from(p[1]) + f64::from(p[2]);
        let first_largest = |best: (usize, f64), (ix, value): (usize, f64)| {
            if value > best.1 { (ix, value) } else { best }
        };
        let of_rows: Vec<(usize, f64)> = (0..grid.height)
            .into_par_iter()
            .map(|j| {
                let values = self.row(j).iter().map(sum).enumerate();
                values.fold((0, -1.0), first_largest)
            })
            .collect();
        of_rows
            .into_iter()
            .enumerate()
            .map(|(j, (i, value))| (j * grid.width + i, value))
            .fold((0, -1.0), first_largest)
    }
}

/// Finds the compact sources of a map, `limit` of them at the most, brightest pixel first, and cuts
/// each down to its background in the rest.
pub(super) fn extract(map: &Map, limit: usize) -> (Vec<Source>, Rest<'_>) {
    let mut rest = Rest::new(map);
    let mut sources = Vec::new();
    let total: f64 = map.energy().iter().sum();
    for _ in 0..limit {
        match extract_one(&mut rest, total) {
            Some(source) => sources.push(source),
            None => break,
        }
    }
    (sources, rest)
}

/// A pixel near a source.
struct Near {
    ix: usize,
    direction: Vec3,
    solid_angle: f64,
    angle: f64,
}

fn extract_one(rest: &mut Rest, total: f64) -> Option<Source> {
    let grid = rest.grid();
    let (peak_ix, peak) = rest.peak();
    if peak <= 0.0 {
        return None;
    }
    let (i, j) = (peak_ix % grid.width, peak_ix / grid.width);
    let pixel = std::f64::consts::PI / grid.height as f64;
    let mut centre = grid.direction(i as f64 + 0.5, j as f64 + 0.5);
    // At least two pixels to each side; on coarse maps that is more than MAX_RADIUS.
    let reach = MAX_RADIUS.max(2.5 * pixel);

    let mut near = neighbours(grid, centre, 2.0 * reach + pixel);
    for _ in 0..3 {
        for p in &mut near {
            p.angle = angle(p.direction, centre);
        }
        let background = ring_mean(&near, rest, reach, 2.0 * reach);
        let mut moment = [0.0; 3];
        for p in near.iter().filter(|p| p.angle <= reach) {
            let weight = above(rest.pixel(p.ix), background).iter().sum::<f64>() * p.solid_angle;
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
    let background = ring_mean(&near, rest, reach, 2.0 * reach);

    // Curve of growth.
    let mut energy = [0.0; 3];
    let mut growth = Vec::new();
    for p in near.iter().take_while(|p| p.angle <= reach) {
        let above = above(rest.pixel(p.ix), background);
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
        rest.cut_down(p.ix, background);
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
fn neighbours(grid: LatLong, centre: Vec3, radius: f64) -> Vec<Near> {
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
fn ring_mean(near: &[Near], rest: &Rest, from: f64, to: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut area = 0.0;
    for p in near.iter().filter(|p| p.angle > from && p.angle <= to) {
        area += p.solid_angle;
        for (sum, x) in sum.iter_mut().zip(rest.pixel(p.ix)) {
            *sum += f64::from(x) * p.solid_angle;
        }
    }
    if area > 0.0 {
        sum.map(|s| s / area)
    } else {
        [0.0; 3]
    }
}
