//! Random numbers of strands and locks.

use std::collections::HashMap;

use glam::Vec3;
use strandlight_formats::Groom;

use crate::sampling::hash_u32;

/// What a number is drawn for: numbers of different purposes are independent.
#[derive(Clone, Copy, Debug)]
#[repr(u32)]
pub(super) enum Purpose {
    Melanin = 1,
    Redness = 2,
    Roughness = 3,
    Grey = 4,
    Frizz = 5,
    LockPlace = 6,
}

/// A hash of `words`, their order included.
pub(super) fn hash(words: &[u32]) -> u32 {
    words.iter().fold(0x9e37_79b9, |state, &word| {
        hash_u32(state.rotate_left(5) ^ hash_u32(word.wrapping_add(0x632b_e5ab)))
    })
}

/// In 0..1.
pub(super) fn uniform(key: u32, purpose: Purpose, ix: u32) -> f64 {
    f64::from(hash(&[key, purpose as u32, ix])) / 4_294_967_296.0
}

/// Of mean 0 and variance 1: the sum of four uniform numbers, normal but for tails that end at
/// +- 3.5.
pub(super) fn normal(key: u32, purpose: Purpose) -> f64 {
    let sum: f64 = (0..4).map(|ix| uniform(key, purpose, ix)).sum();
    (sum - 2.0) * 3f64.sqrt()
}

/// The first point of a strand; strands may have none.
pub(super) fn root(groom: &Groom, strand: usize) -> Option<Vec3> {
    let points = groom.points.get(groom.strand(strand))?;
    points.first().map(|&root| root.into())
}

/// A key for each strand of `groom`, from the place of its root. Of strands with the same root each has
/// another one, in their order.
pub(super) fn strand_keys(groom: &Groom, seed: u32) -> Vec<u32> {
    let mut n_at: HashMap<[u32; 3], u32> = HashMap::with_capacity(groom.n_strands());
    let keys = (0..groom.n_strands()).map(|strand| {
        let root = root(groom, strand).unwrap_or_default();
        // Zero has no sign.
        let [x, y, z] = root.to_array().map(|x| (x + 0.0).to_bits());
        let n_before = n_at.entry([x, y, z]).or_insert(0);
        let key = hash(&[seed, x, y, z, *n_before]);
        *n_before += 1;
        key
    });
    keys.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_moments_that_they_should() {
        let n = 200_000;
        let numbers: Vec<f64> = (0..n).map(|key| normal(key, Purpose::Melanin)).collect();
        let mean = |power: i32| {
            let sum: f64 = numbers.iter().map(|x| x.powi(power)).sum();
            sum / f64::from(n)
        };
        // Standard errors: 0.0022, 0.0029 and about 0.006.
        assert!(mean(1).abs() < 0.01, "{}", mean(1));
        assert!((mean(2) - 1.0).abs() < 0.012, "{}", mean(2));
        assert!(mean(3).abs() < 0.025, "{}", mean(3));
        assert!(numbers.iter().all(|x| x.abs() < 3.47));
        // Other purposes and neighbours have nothing to do with it.
        let with = |other: &dyn Fn(u32) -> f64| {
            let sum: f64 = (0..n).map(|key| numbers[key as usize] * other(key)).sum();
            (sum / f64::from(n)).abs()
        };
        assert!(with(&|key| normal(key, Purpose::Redness)) < 0.01);
        assert!(with(&|key| normal(key + 1, Purpose::Melanin)) < 0.01);
        assert!(with(&|key| normal(key, Purpose::Melanin)) > 0.9);
    }
}
