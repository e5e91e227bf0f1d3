//! Where the samples of a pixel lie, and which of them a thin strand covers.

use strandlight_scattering::random::R2;

/// Positions of the samples of one pass in a pixel, in 1/256 px: the standard 4x pattern that
/// Vulkan, Metal and Direct3D share.
pub const SAMPLE_POSITIONS: [[i32; 2]; 4] = [[96, 32], [224, 96], [32, 160], [160, 224]];

/// Samples of one pass; the last one of a picture may count fewer of its own, the first ones.
pub const PASS_SAMPLES: u32 = SAMPLE_POSITIONS.len() as u32;

/// Shift of the picture in a pass, in 1/256 px, within half the spacing of the samples: passes
/// fill the squares between the four samples evenly (the R2 low-discrepancy sequence).
pub fn pass_jitter(pass: u32) -> [i32; 2] {
    let fraction = |a: f64| (0.5 + f64::from(pass) * a).fract();
    let at = |a: f64| (fraction(a) * 128.0).floor() as i32 - 64;
    R2.map(at)
}

/// A 32-bit mixing function (the finaliser of lowbias32 by C. Wellons). Twin: `hash_u32` in
/// `shaders/lib/sampling.wgsl`.
pub(crate) fn hash_u32(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The key of a segment in a pixel. Twin in WGSL.
pub fn coverage_key(segment: u32, x: u32, y: u32) -> u32 {
    hash_u32(hash_u32(segment ^ x.wrapping_mul(0x9e37_79b9)) ^ y.wrapping_mul(0x85eb_ca6b))
}

/// Threshold in [0, 1) of sample `index`: the bits of the index reversed, each flipped by a hash
/// of the bits of lower weight (the permutation of Laine and Karras 2011, with Vegdahl's
/// constants). The first 2^k samples of a key hold exactly one threshold in each interval of
/// length 2^-k; which sample holds which is reshuffled for each key, so that layers that
/// cover half a pixel each do not all take the same half. Twin in WGSL.
pub(crate) fn coverage_threshold(index: u32, key: u32) -> f32 {
    let mut x = index.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(key);
    x = x.wrapping_mul((key >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    (x >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Which of the four samples of `pass` a strand of coverage `alpha` takes. Twin in WGSL.
pub fn coverage_mask(alpha: f32, pass: u32, key: u32) -> u32 {
    if alpha >= 1.0 {
        return 0xf;
    }
    (0..4)
        .filter(|sample| coverage_threshold(4 * pass + sample, key) < alpha)
        .fold(0, |mask, sample| mask | (1 << sample))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_stratified_for_every_key() {
        for key in (0..500).map(hash_u32) {
            for n in [4_u32, 16, 64, 256] {
                let mut seen = vec![0; n as usize];
                for index in 0..n {
                    seen[(coverage_threshold(index, key) * n as f32) as usize] += 1;
                }
                assert!(seen.iter().all(|&count| count == 1), "{key} {n} {seen:?}");
            }
        }
    }

    #[test]
    fn keys_are_independent_between_layers() {
        // Both of two layers of coverage 1/2 take a quarter of the samples on average.
        let n = 64;
        let (mut both, mut far_off) = (0, 0);
        for key in 0..2000 {
            let (a, b) = (coverage_key(key, 3, 5), coverage_key(key + 1, 3, 5));
            let overlap = (0..n)
                .filter(|&i| coverage_threshold(i, a) < 0.5 && coverage_threshold(i, b) < 0.5)
                .count();
            both += overlap;
            far_off += usize::from(!(8..=24).contains(&overlap));
        }
        // Independent halves overlap in 16 of 64 samples with a standard deviation of 2.8 (one
        // of each pair of samples); more than 8 off in 0.3 % of cases.
        assert!(far_off < 60, "{far_off}");
        let share = both as f64 / f64::from(2000 * n);
        assert!((share - 0.25).abs() < 0.005, "{share}");
    }

    #[test]
    fn jitter_stays_inside_and_covers_the_square() {
        let mut cells = [0; 16];
        for pass in 0..16 {
            let [x, y] = pass_jitter(pass);
            assert!((-64..64).contains(&x) && (-64..64).contains(&y));
            cells[((x + 64) / 32 + 4 * ((y + 64) / 32)) as usize] += 1;
        }
        assert!(cells.iter().filter(|&&n| n > 0).count() >= 12, "{cells:?}");
    }
}
