//! RGB9E5: three numbers that are not negative in four bytes, with one exponent for all of them; what
//! Vulkan calls `E5B9G9R9_UFLOAT_PACK32`, Direct3D `R9G9B9E5_SHAREDEXP` and wgpu `Rgb9e5Ufloat`.
//!
//! | bits | what |
//! |---|---|
//! | 0..9, 9..18, 18..27 | mantissas of red, green and blue |
//! | 27..32 | exponent e |
//!
//! A channel is `mantissa * 2^(e - 24)`. Any 32 bits are three finite numbers.

/// The largest number that there is.
pub(crate) const LARGEST: f32 = 65_408.0;

/// Bits of a mantissa.
const MANTISSA_BITS: i32 = 9;
/// Added to the exponent.
const BIAS: i32 = 15;

/// 2 to the power of `exponent`, exactly; -1022..=1023 are in range.
pub(crate) fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// The nearest texel to `rgb`: each channel is off by at most 1/512 of the largest one, or 2^-25. Numbers
/// beyond [`LARGEST`], and NaN as zero, are clipped: callers see to it that there are none.
pub(crate) fn encode(rgb: [f32; 3]) -> u32 {
    let rgb = rgb.map(|x| if x > 0.0 { x.min(LARGEST) } else { 0.0 });
    let largest = rgb.into_iter().fold(0.0, f32::max);
    // floor(log2), from the bits of the float; of zero and numbers without it below any that counts.
    let log2 = (largest.to_bits() >> 23) as i32 - 127;
    let exponent = log2.max(-BIAS - 1) + 1 + BIAS;
    let mantissa = |x: f32, exponent: i32| {
        // A power of two: exact.
        let scaled = f64::from(x) * power_of_two(BIAS + MANTISSA_BITS - exponent);
        (scaled + 0.5).floor() as u32
    };
    // Rounding may need one bit more.
    let is_carried = mantissa(largest, exponent) == 1 << MANTISSA_BITS;
    let exponent = exponent + i32::from(is_carried);
    let [r, g, b] = rgb.map(|x| mantissa(x, exponent));
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

/// The numbers of a texel.
pub(crate) fn decode(texel: u32) -> [f32; 3] {
    let exponent = (texel >> 27) as i32;
    // 2^(e - 24), put together from its bits: -24..=7 are exponents of normal floats.
    let unit = f32::from_bits(((exponent - BIAS - MANTISSA_BITS + 127) as u32) << 23);
    [0, 9, 18].map(|shift| (texel >> shift & 0x1ff) as f32 * unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_texels() {
        for (rgb, texel) in [
            ([0.0; 3], 0),
            ([1.0; 3], 256 | 256 << 9 | 256 << 18 | 16 << 27),
            ([LARGEST, 128.0, 0.0], 511 | 1 << 9 | 31 << 27),
            // One less than a power of two by less than half a mantissa.
            ([0.999_9, 0.5, 0.0], 256 | 128 << 9 | 16 << 27),
            ([2f32.powi(-24), 0.0, 0.0], 1),
        ] {
            assert_eq!(encode(rgb), texel, "{rgb:?}");
        }
        assert_eq!(decode(encode([LARGEST, 128.0, 0.0])), [LARGEST, 128.0, 0.0]);
    }

    #[test]
    fn what_is_decoded_is_encoded_as_it_was() {
        let mut n_checked = 0;
        for exponent in 0..32_u32 {
            for mantissa in (0..512_u32).step_by(7) {
                // The largest mantissa of a texel has its first bit, but with the smallest exponent.
                let red = 256 + mantissa / 2;
                let texel = red | (mantissa << 9) | (3 << 18) | (exponent << 27);
                let rgb = decode(texel);
                assert_eq!(decode(encode(rgb)), rgb, "{texel:x}");
                n_checked += 1;
            }
        }
        assert_eq!(n_checked, 32 * 74);
    }

    #[test]
    fn errors_are_small_beside_the_largest_channel() {
        let mut x = 1e-9_f32;
        while x < LARGEST {
            let rgb = [x, 0.37 * x, 0.011 * x];
            for (found, wanted) in decode(encode(rgb)).into_iter().zip(rgb) {
                let most = (x / 512.0).max(2f32.powi(-25)) * 1.000_1;
                assert!((found - wanted).abs() <= most, "{rgb:?}: {found}");
            }
            x *= 1.013;
        }
        for odd in [f32::NAN, -1.0, -0.0, f32::MIN_POSITIVE / 4.0] {
            assert_eq!(encode([odd; 3]), 0);
        }
        assert_eq!(decode(encode([f32::INFINITY; 3])), [LARGEST; 3]);
    }
}
