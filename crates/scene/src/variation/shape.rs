//! Clumps and frizz.

use std::borrow::Cow;

use glam::{IVec3, Vec3};
use strandlight_formats::{Groom, VariationSection};

use super::locks::Locks;
use super::random::{Purpose, hash, strand_keys};
use crate::error::SceneError;
use crate::motion::wind::{bent, corner_value};

/// Bends the strands of a groom, in any pose that they have.
///
/// Clumps first: a point at the share t of its strand's length moves by `clump t` of the way to the point
/// at the same share of the middle strand of its lock. Then frizz: a piece in direction r turns to that of
/// `r + frizz t n`, n being noise along the strand whose components lie in -1..1. Each piece keeps its
/// length throughout, as wind has it, and each root its place.
#[derive(Clone, Debug)]
pub struct ShapeVariation {
    section: VariationSection,
    /// First point of each strand, and their number at the end.
    offsets: Vec<u32>,
    /// By strand: the one in the middle of its lock. None without clumps.
    middle: Vec<u32>,
    /// By strand: its random number. None without frizz.
    keys: Vec<u32>,
}

impl ShapeVariation {
    /// Of the strands of `groom` as `section` has them, locks being those of the pose of the groom; [`None`]
    /// where none is bent.
    pub fn new(section: &VariationSection, groom: &Groom) -> Option<ShapeVariation> {
        let section = section.of_shape();
        if !section.varies_shape() {
            return None;
        }
        let middle = match section.clump > 0.0 {
            true => Locks::new(section.seed, section.lock_size_cm).middle_strands(groom),
            false => Vec::new(),
        };
        let keys = match section.frizz > 0.0 {
            true => strand_keys(groom, section.seed),
            false => Vec::new(),
        };
        Some(ShapeVariation {
            section,
            offsets: groom.strand_offsets.clone(),
            middle,
            keys,
        })
    }

    /// The points of `groom` as `section` has them bent.
    pub fn points<'a>(section: &VariationSection, groom: &'a Groom) -> Cow<'a, [[f32; 3]]> {
        let shape = ShapeVariation::new(section, groom);
        // The offsets are those of the points.
        let bent = shape.and_then(|shape| shape.bend(&groom.points).ok());
        bent.map_or(Cow::Borrowed(&groom.points[..]), Cow::Owned)
    }

    /// `points` of a pose of the groom, cm, bent.
    ///
    /// # Errors
    /// Another number of points than the groom has.
    pub fn bend(&self, points: &[[f32; 3]]) -> Result<Vec<[f32; 3]>, SceneError> {
        if self.offsets.last().map_or(0, |&n| n as usize) != points.len() {
            return Err(SceneError::Offsets);
        }
        let mut bent = Vec::with_capacity(points.len());
        let mut clumped = Vec::new();
        for strand in 0..self.offsets.len() - 1 {
            let own = self.strand(strand, points);
            clumped.clear();
            clumped.extend(own.iter().map(|&point| Vec3::from(point)));
            if let Some(&middle) = self.middle.get(strand) {
                self.clump(&mut clumped, self.strand(middle as usize, points));
            }
            if let Some(&key) = self.keys.get(strand) {
                self.frizz(&mut clumped, key);
            }
            bent.extend(clumped.iter().map(Vec3::to_array));
        }
        Ok(bent)
    }

    fn strand<'a>(&self, strand: usize, points: &'a [[f32; 3]]) -> &'a [[f32; 3]] {
        &points[self.offsets[strand] as usize..self.offsets[strand + 1] as usize]
    }

    /// Draws a strand to the one in the middle of its lock.
    fn clump(&self, points: &mut [Vec3], middle: &[[f32; 3]]) {
        let middle: Vec<Vec3> = middle.iter().map(|&point| Vec3::from(point)).collect();
        let [length, of_middle] = [length(points), length(&middle)];
        let Some(&root) = points.first() else { return };
        if !(length > 0.0 && of_middle > 0.0) {
            return;
        }
        let mut along = Along::new(&middle);
        let (mut before, mut drawn_before, mut place) = (root, root, root);
        let mut at = 0.0;
        for point in &mut points[1..] {
            let here = *point;
            let piece = here - before;
            at += piece.length();
            let share = (at / length).min(1.0);
            let target = along.at(share * of_middle);
            let drawn = here + self.section.clump as f32 * share * (target - here);
            // In the drawn direction, as long as it was.
            let direction = (drawn - drawn_before).try_normalize();
            place += direction.map_or(piece, |direction| direction * piece.length());
            (before, drawn_before) = (here, drawn);
            *point = place;
        }
    }

    /// Bends a strand its own way.
    fn frizz(&self, points: &mut [Vec3], key: u32) {
        let length = length(points);
        let Some(&root) = points.first() else { return };
        if length <= 0.0 {
            return;
        }
        let (mut before, mut place, mut at) = (root, root, 0.0);
        for point in &mut points[1..] {
            let piece = *point - before;
            before = *point;
            let half = 0.5 * piece.length();
            let middle = at + half;
            at += 2.0 * half;
            let noise = noise(key, middle / self.section.frizz_length_cm as f32);
            let amount = self.section.frizz as f32 * (middle / length).min(1.0);
            place += bent(piece, amount * noise);
            *point = place;
        }
    }
}

/// Smooth, each component in -1..1: values at whole numbers, mixed by cubic weights.
fn noise(key: u32, at: f32) -> Vec3 {
    let seed = hash(&[key, Purpose::Frizz as u32]);
    let low = at.floor();
    let f = at - low;
    let w = f * f * (3.0 - 2.0 * f);
    let value = |ix: i32, axis: i32| corner_value(IVec3::new(ix, axis, 0), seed);
    let ix = low as i32;
    let mix = |axis| value(ix, axis) + w * (value(ix.wrapping_add(1), axis) - value(ix, axis));
    Vec3::new(mix(0), mix(1), mix(2))
}

fn length(points: &[Vec3]) -> f32 {
    points
        .windows(2)
        .map(|pair| pair[0].distance(pair[1]))
        .sum()
}

/// Walks along a polyline.
struct Along<'a> {
    points: &'a [Vec3],
    /// First point of the piece, and how far along that is.
    ix: usize,
    start: f32,
}

impl<'a> Along<'a> {
    /// `points` has at least one.
    fn new(points: &'a [Vec3]) -> Along<'a> {
        Along {
            points,
            ix: 0,
            start: 0.0,
        }
    }

    /// The point so far along, farther than the last one asked for; beyond the end the end.
    fn at(&mut self, distance: f32) -> Vec3 {
        while let Some(&next) = self.points.get(self.ix + 1) {
            let here = self.points[self.ix];
            let piece = here.distance(next);
            if distance <= self.start + piece && piece > 0.0 {
                return here.lerp(next, ((distance - self.start) / piece).clamp(0.0, 1.0));
            }
            self.start += piece;
            self.ix += 1;
        }
        self.points[self.ix]
    }
}
