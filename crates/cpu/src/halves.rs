//! The upper halves of floats: eight bits of precision, for what is kept of many lights at many points.

use strandlight_scattering::wide::LANES;

/// Numbers of a point where there are `n_columns`: `[channel][column]`, whole vectors of columns.
#[inline(always)]
pub(super) fn n_numbers(n_columns: usize) -> usize {
    3 * n_columns.next_multiple_of(LANES)
}

/// The upper half of a float, rounded.
#[inline(always)]
pub(super) fn half(value: f32) -> u16 {
    ((value.to_bits() + 0x8000) >> 16) as u16
}

/// The float of an upper half.
#[inline(always)]
pub(super) fn whole(half: u16) -> f32 {
    f32::from_bits(u32::from(half) << 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_right_to_their_eight_bits() {
        for ix in 0..10_000 {
            let value = 1e-6 * 1.003_f32.powi(ix);
            if value < 1e30 {
                let error = (whole(half(value)) / value - 1.0).abs();
                assert!(error <= 1.0 / 256.0, "{value}: {error}");
            }
        }
        assert_eq!(whole(half(0.0)), 0.0);
    }
}
