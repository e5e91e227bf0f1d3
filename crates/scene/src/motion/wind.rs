//! Wind that bends strands. Twin: `shaders/lib/wind.wgsl` and `shaders/pass/deform.wgsl`.
//!
//! A fibre keeps its direction by its stiffness and weight; wind pulls it aside by its drag, which
//! grows with the square of the speed. So a piece of a strand in direction r turns to that of
//! `r + flexibility pull`, as long as it was: strands are not stretched. Near the root stiffness
//! holds it, the root itself stays. Gusts and turbulence are noise that travels with the wind, so
//! that waves run through the hair. Everything is a function of the time alone: frames can be made
//! in any order, and the same seed gives the same hair.
//!
//! Strands do not see each other, nor a head: wind can blow them into either.

use glam::{DVec3, IVec3, Vec3};
use rayon::prelude::*;
use strandlight_formats::WindSection;

use crate::error::SceneError;
use crate::sampling::hash_u32;
use crate::strands::{STRANDS_AT_A_TIME, Strands};

/// Speed at which wind pulls as strongly as a fibre's weight, m/s.
const WEIGHT_SPEED: f32 = 6.0;

/// Share of the pull that turbulence turns aside.
const ASIDE: f32 = 0.5;

/// Cells of gusts and of turbulence, cm.
const CELLS_CM: [f64; 2] = [45.0, 14.0];

/// Strands and times that the space is measured with that the hair moves in.
const MEASURED_STRANDS: usize = 400;
const MEASURED_TIMES: u32 = 24;

/// Noise that travels with the wind; mirrored by `Octave` in `shaders/lib/wind.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Octave {
    /// Part of a cell that it has travelled.
    pub fraction: [f32; 3],
    /// Cells in a centimetre.
    pub cells_per_cm: f32,
    /// Whole cells that it has travelled.
    pub cells: [i32; 3],
    /// Another noise for every number.
    pub seed: u32,
}

/// The wind at a time; mirrored by `Wind` in `shaders/lib/wind.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Wind {
    /// Where it blows to, a unit vector.
    pub direction: [f32; 3],
    /// Mean speed, m/s.
    pub speed: f32,
    /// Gusts, and turbulence.
    pub octaves: [Octave; 2],
    /// How much gusts add and take, 0..=1.
    pub gust: f32,
    /// Length from the root at which half of the pull acts, cm.
    pub stiffness: f32,
    /// Strands to bend.
    pub n_strands: u32,
    /// Not used.
    pub pad: u32,
}

strandlight_scattering::mirrors! {
    Octave as "Octave" in "lib/wind" { fraction, cells_per_cm, cells, seed }
    Wind as "Wind" in "lib/wind" { direction, speed, octaves, gust, stiffness, n_strands, pad }
}

impl Wind {
    /// The wind of a scene, its values within their ranges, at a time in seconds.
    pub fn at(section: &WindSection, strands: &Strands, seconds: f64) -> Wind {
        let angle = section.direction_deg.to_radians();
        let direction = DVec3::new(angle.sin(), 0.0, angle.cos());
        let travelled = direction * (100.0 * section.speed * seconds);
        let octave = |ix: usize| {
            let cells = travelled / CELLS_CM[ix];
            let whole = cells.floor();
            Octave {
                fraction: (cells - whole).as_vec3().to_array(),
                cells_per_cm: (1.0 / CELLS_CM[ix]) as f32,
                cells: whole.as_ivec3().to_array(),
                seed: hash_u32(section.seed ^ (0x5eed_0000 + ix as u32)),
            }
        };
        Wind {
            direction: direction.as_vec3().to_array(),
            speed: section.speed as f32,
            octaves: [octave(0), octave(1)],
            gust: section.gust as f32,
            stiffness: section.stiffness as f32,
            n_strands: strands.n_strands as u32,
            pad: 0,
        }
    }
}

/// In -1..1 at a corner of the cells.
pub(crate) fn corner_value(corner: IVec3, seed: u32) -> f32 {
    let x = hash_u32(corner.x as u32 ^ seed);
    let y = hash_u32(x ^ corner.y as u32);
    let z = hash_u32(y ^ corner.z as u32);
    (z >> 8) as f32 * (1.0 / 8_388_608.0) - 1.0
}

/// Smooth in -1..1: values at the corners, mixed by quintic weights.
pub fn noise(octave: &Octave, channel: u32, position: Vec3) -> f32 {
    let p = position * octave.cells_per_cm - Vec3::from(octave.fraction);
    let low = p.floor();
    let f = p - low;
    let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let at = low.as_ivec3().wrapping_sub(IVec3::from(octave.cells));
    let seed = hash_u32(octave.seed.wrapping_add(channel));
    let value = |x, y, z| corner_value(at.wrapping_add(IVec3::new(x, y, z)), seed);
    let mix = |a: f32, b: f32, t: f32| a * (1.0 - t) + b * t;
    let along_x = |y, z| mix(value(0, y, z), value(1, y, z), w.x);
    mix(
        mix(along_x(0, 0), along_x(1, 0), w.y),
        mix(along_x(0, 1), along_x(1, 1), w.y),
        w.z,
    )
}

/// Pull at a place as a share of what holds a fibre in its direction, shorter than 1.
pub(crate) fn pull_at(wind: &Wind, position: Vec3) -> Vec3 {
    let speed = wind.speed * (1.0 + wind.gust * noise(&wind.octaves[0], 0, position));
    let drag = speed * speed / (WEIGHT_SPEED * WEIGHT_SPEED);
    let strength = drag / (1.0 + drag * drag).sqrt();
    let aside = Vec3::new(
        noise(&wind.octaves[1], 1, position),
        noise(&wind.octaves[1], 2, position),
        noise(&wind.octaves[1], 3, position),
    );
    let towards = Vec3::from(wind.direction) + ASIDE * wind.gust * aside;
    towards * (0.95 * strength / towards.length().max(1.0))
}

/// How much of the pull acts at this length from the root.
pub(crate) fn flexibility(wind: &Wind, length_cm: f32) -> f32 {
    let square = length_cm * length_cm;
    square / (square + wind.stiffness * wind.stiffness)
}

/// A piece of a strand bent by a pull: as long as it was.
pub fn bent(piece: Vec3, pull: Vec3) -> Vec3 {
    let length_cm = piece.length();
    let pulled = piece + pull * length_cm;
    pulled * (length_cm / pulled.length().max(1e-20))
}

/// Points of strand `points` (at rest, root first) in the wind.
fn deform(wind: &Wind, points: &[[f32; 4]], mut push: impl FnMut([f32; 4])) {
    let (mut moved, mut length_cm) = (Vec3::ZERO, 0.0);
    for (ix, point) in points.iter().enumerate() {
        let here = Vec3::from_slice(point);
        let place = here + moved;
        push([place.x, place.y, place.z, point[3]]);
        if let Some(next) = points.get(ix + 1) {
            let next = Vec3::from_slice(next);
            let piece = next - here;
            let half_length = 0.5 * piece.length();
            let flexibility = flexibility(wind, length_cm + half_length);
            let pull = pull_at(wind, 0.5 * (here + next)) * flexibility;
            moved += bent(piece, pull) - piece;
            length_cm += 2.0 * half_length;
        }
    }
}

/// [`Strands::points`] of strands at rest, in the wind.
pub fn deformed(wind: &Wind, strands: &Strands) -> Vec<[f32; 4]> {
    let ranges: Vec<[u32; 2]> = strands.ranges().collect();
    let of_strands = ranges.par_chunks(STRANDS_AT_A_TIME).map(|ranges| {
        let mut points = Vec::with_capacity(ranges.iter().map(|[_, n]| *n as usize).sum());
        for &[first, n] in ranges {
            let strand = &strands.points[first as usize..][..n as usize];
            deform(wind, strand, |point| points.push(point));
        }
        points
    });
    of_strands.collect::<Vec<_>>().concat()
}

/// The same strands at rest, in a space that holds them at all times, or nearly: that of some of
/// them at some times, and a twentieth more. So the grid of the shadow volume and the shadow maps
/// need not follow the hair, which would be read back for it; what leaves the space nevertheless
/// is lit as at its border.
pub fn with_room(section: &WindSection, strands: Strands) -> Strands {
    let (mut low, mut high) = strands.bounds;
    let ranges: Vec<[u32; 2]> = strands.ranges().collect();
    let step = ranges.len().div_ceil(MEASURED_STRANDS).max(1);
    for ix in 0..MEASURED_TIMES {
        // Not in step with the cells.
        let wind = Wind::at(section, &strands, 0.377 * f64::from(ix));
        for &[first, n] in ranges.iter().step_by(step) {
            let strand = &strands.points[first as usize..][..n as usize];
            deform(&wind, strand, |point| {
                low = low.min(Vec3::from_slice(&point));
                high = high.max(Vec3::from_slice(&point));
            });
        }
    }
    let margin = 0.05 * (high - low);
    strands.in_space(low - margin, high + margin)
}

/// `rest`, as [`with_room`] answers it, in the wind.
///
/// # Errors
/// As [`Strands::moved`].
pub fn bent_strands(wind: &Wind, rest: &Strands) -> Result<Strands, SceneError> {
    let moved = rest.moved(&deformed(wind, rest))?;
    let (low, high) = rest.bounds;
    Ok(moved.in_space(low, high))
}

/// `rest`, as [`with_room`] answers it, at a time in seconds.
///
/// # Errors
/// As [`Strands::moved`].
pub fn strands_at(
    section: &WindSection,
    rest: &Strands,
    seconds: f64,
) -> Result<Strands, SceneError> {
    bent_strands(&Wind::at(section, rest, seconds), rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the help of `motion.wind.speed` says.
    #[test]
    fn hanging_hair_leans_as_it_is_said() {
        let lean = |speed: f32| {
            let octave = Octave {
                fraction: [0.0; 3],
                cells_per_cm: 1.0,
                cells: [0; 3],
                seed: 0,
            };
            let wind = Wind {
                direction: [1.0, 0.0, 0.0],
                speed,
                octaves: [octave; 2],
                gust: 0.0,
                stiffness: 0.1,
                n_strands: 1,
                pad: 0,
            };
            let strand: Vec<[f32; 4]> = (0..40).map(|ix| [0.0, -(ix as f32), 0.0, 0.01]).collect();
            let mut points = Vec::new();
            deform(&wind, &strand, |point| {
                points.push(Vec3::from_slice(&point))
            });
            let tip = points[39] - points[38];
            (tip.x / -tip.y).atan().to_degrees().round()
        };
        assert_eq!([3.0, 6.0, 30.0].map(lean), [13.0, 34.0, 44.0]);
    }
}
