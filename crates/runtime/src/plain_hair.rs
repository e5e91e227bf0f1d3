//! Hair for a scene that has none: what lights are looked at on before there is a groom.

use glam::Vec3;
use strandlight_formats::{Attribute, Domain, Groom};
use strandlight_scattering::random::GOLDEN_ANGLE;

/// Strands, and points of each.
const STRANDS: usize = 4000;
const POINTS: usize = 16;
/// Radius of the head and length of the hair, cm.
const HEAD: f32 = 9.0;
const LENGTH: f32 = 22.0;
/// Diameter, cm: that of real hair would need many times as many strands to cover a head.
const DIAMETER: f32 = 0.03;

/// Straight hair on the upper part of a sphere, the same each time.
pub fn groom() -> Groom {
    let diameter = Attribute {
        name: "diameter".to_owned(),
        domain: Domain::Groom,
        components: 1,
        data: vec![DIAMETER],
    };
    let mut groom = Groom {
        strand_offsets: vec![0],
        attributes: vec![diameter],
        ..Groom::default()
    };
    for ix in 0..STRANDS {
        // From the crown to a little below the middle, less in front.
        let share = (ix as f32 + 0.5) / STRANDS as f32;
        let y = 1.0 - 1.25 * share;
        let around = GOLDEN_ANGLE as f32 * ix as f32;
        let across = (1.0 - y * y).max(0.0).sqrt();
        let out = Vec3::new(across * around.sin(), y, across * around.cos());
        // The face is free.
        if out.y < 0.55 && out.z > 0.35 {
            continue;
        }
        strand(&mut groom.points, out, ix as f32);
        groom.strand_offsets.push(groom.points.len() as u32);
    }
    groom
}

/// Out of the head, then down along it.
fn strand(points: &mut Vec<[f32; 3]>, out: Vec3, seed: f32) {
    let step = LENGTH / (POINTS - 1) as f32;
    let spread = (seed * 0.618_034).fract() - 0.5;
    let mut at = HEAD * out;
    let mut along = out;
    for _ in 0..POINTS {
        points.push(at.to_array());
        let away = (at / HEAD).normalize();
        let down = Vec3::NEG_Y - away * Vec3::NEG_Y.dot(away).min(0.0);
        along = (along + 1.6 * down + 0.04 * (1.0 + spread) * away).normalize();
        at += step * along;
        // Hair lies on the head, in layers.
        let least = HEAD * (1.02 + 0.12 * (0.5 + spread));
        if at.length() < least {
            at = least * at.normalize();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_a_head_of_hair() {
        let hair = groom();
        hair.validate().expect("a good groom");
        assert!(hair.n_strands() > 2500, "{}", hair.n_strands());
        let (min, max) = hair.bounds();
        let [width, height, _] = [0, 1, 2].map(|axis| max[axis] - min[axis]);
        assert!((15.0..40.0).contains(&width), "{width}");
        assert!((20.0..60.0).contains(&height), "{height}");
        assert!(hair.doubts(hair.diameter_range()).is_empty());
    }
}
