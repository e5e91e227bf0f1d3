//! From linear radiance to what a screen shows.

mod aces2;
pub(crate) mod srgb;

pub use aces2::aces2;
pub(crate) use aces2::lut as aces2_lut;
pub use srgb::srgb_from_linear;
pub use strandlight_formats::ToneMap;

/// [`ToneMap::None`] in shaders.
pub const TONE_NONE: u32 = 0;
/// [`ToneMap::Filmic`] in shaders.
pub const TONE_FILMIC: u32 = 1;
/// [`ToneMap::Agx`] in shaders.
pub const TONE_AGX: u32 = 2;
/// A LUT in place of the curve in shaders; [`ToneMap::Aces2`] is one.
pub const TONE_LUT: u32 = 3;

/// Relative luminance of linear Rec.709, which has that of white as 1.
pub fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// sRGB in 0..=1 of linear Rec.709 radiance (exposure already applied). [`ToneMap::Aces2`] is
/// interpolated in a table of [`aces2()`] that its first use makes, in some 40 ms.
pub fn display(rgb: [f32; 3], tone_map: ToneMap) -> [f32; 3] {
    let rgb = match tone_map {
        ToneMap::Aces2 => return aces2_lut().display(rgb.map(|x| x.max(0.0))),
        ToneMap::Filmic => filmic(rgb),
        ToneMap::Agx => agx(rgb),
        ToneMap::None => rgb,
    };
    rgb.map(|x| srgb_from_linear(x.clamp(0.0, 1.0)))
}

/// Stephen Hill's fit of the ACES reference rendering and output transforms (BakingLab, 2016),
/// linear Rec.709 in and out. The factor 1.8 undoes most of the fit's darkening of mid-tones: 0.18
/// in is 0.23 out. Highlights desaturate and roll off to 1.
pub fn filmic(rgb: [f32; 3]) -> [f32; 3] {
    // sRGB to XYZ, D65 to D60, to AP1, and ACES's red modifier and saturation.
    const IN: [[f32; 3]; 3] = [
        [0.59719, 0.35458, 0.04823],
        [0.07600, 0.90834, 0.01566],
        [0.02840, 0.13383, 0.83777],
    ];
    const OUT: [[f32; 3]; 3] = [
        [1.60475, -0.53108, -0.07367],
        [-0.10208, 1.10813, -0.00605],
        [-0.00327, -0.07276, 1.07602],
    ];
    // Beyond this the curve is flat, and squares would overflow.
    let bounded = rgb.map(|x| (x * 1.8).clamp(0.0, 1e6));
    let curved = transform(&IN, bounded)
        .map(|v| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081));
    transform(&OUT, curved).map(|x| x.clamp(0.0, 1.0))
}

fn transform(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|row: usize| m[row][0] * v[0] + m[row][1] * v[1] + m[row][2] * v[2])
}

/// AgX (Troy Sobotka, 2022) by Benjamin Wrensch's fit of its curve (2023), linear Rec.709 in and out: a
/// curve over 16.5 stops, in primaries so far inside Rec.709's that bright colours turn white. 0.18 in is 0.21
/// out.
pub fn agx(rgb: [f32; 3]) -> [f32; 3] {
    const IN: [[f32; 3]; 3] = [
        [0.842_479_1, 0.078_433_6, 0.079_223_745],
        [0.042_328_242, 0.878_468_6, 0.079_166_13],
        [0.042_375_655, 0.078_433_6, 0.879_143],
    ];
    const OUT: [[f32; 3]; 3] = [
        [1.196_879, -0.098_020_88, -0.099_029_74],
        [-0.052_896_857, 1.151_903_1, -0.098_961_18],
        [-0.052_971_635, -0.098_043_45, 1.151_073_7],
    ];
    // Stops at which the curve begins and ends.
    const FIRST: f32 = -12.473_93;
    const LAST: f32 = 4.026_069;
    let bounded = rgb.map(|x| x.clamp(0.0, 1e6));
    let curved = transform(&IN, bounded).map(|v| {
        let stops = v.max(1e-10).log2().clamp(FIRST, LAST);
        let x = (stops - FIRST) / (LAST - FIRST);
        let above = (15.5 * x - 40.14) * x + 31.96;
        (((above * x - 6.868) * x + 0.4298) * x + 0.1191) * x - 0.00232
    });
    // The curve is made for a display of gamma 2.2.
    transform(&OUT, curved).map(|x| x.clamp(0.0, 1.0).powf(2.2))
}

/// What is added to the levels of a pixel (column, row) before they are rounded, within 63/128 of a
/// level: slow changes of colour show no bands then, and the mean over 8 x 8 pixels is right to
/// 1/64 of a level. By Bayer's matrix, so a matter of the place alone; whole levels, black and
/// white among them, stay as they are.
pub fn dither(pixel: [u32; 2]) -> f32 {
    let (x, y) = (pixel[0] & 7, (pixel[0] ^ pixel[1]) & 7);
    // Bits of both by turns, the lowest first and highest.
    let rank = (y & 1) << 5 | (x & 1) << 4 | (y & 2) << 2 | (x & 2) << 1 | (y & 4) >> 1 | x >> 2;
    (rank as f32 - 31.5) / 64.0
}

/// The 8-bit level of a value in 0..=1 at a place with this [`dither`].
pub fn level(value: f32, dither: f32) -> u8 {
    let level = value.clamp(0.0, 1.0) * 255.0 + dither;
    // `round`, which is a call where the instruction set has none.
    let whole = level as i32;
    (whole + i32::from(level - whole as f32 >= 0.5)) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_right_in_the_mean_and_whole_ones_exactly() {
        let places = || (0..8).flat_map(|x| (0..8).map(move |y| [x + 16, y + 24]));
        let mut seen: Vec<f32> = places().map(dither).collect();
        seen.sort_by(f32::total_cmp);
        seen.dedup();
        assert_eq!(seen.len(), 64);
        assert_eq!((seen[0], seen[63]), (-31.5 / 64.0, 31.5 / 64.0));
        for ix in 0..=255_u8 {
            let value = f32::from(ix) / 255.0;
            assert!(places().all(|place| level(value, dither(place)) == ix));
        }
        for ix in 0..1000 {
            let value = ix as f32 / 999.0;
            let sum: u32 = places()
                .map(|place| u32::from(level(value, dither(place))))
                .sum();
            let apart = sum as f32 / 64.0 - 255.0 * value;
            assert!(apart.abs() <= 0.0157, "{value}: {apart}");
        }
        // Neighbours differ: 2 x 2 pixels hold all quarters.
        let mut quarters = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|at| (dither(at) * 4.0).floor());
        quarters.sort_by(f32::total_cmp);
        assert_eq!(quarters, [-2.0, -1.0, 0.0, 1.0]);
    }

    #[test]
    fn levels_are_rounded() {
        for ix in 0..=20_000 {
            let value = ix as f32 / 20_000.0;
            for dither in [-31.5, -0.5, 0.0, 20.5, 31.5].map(|rank: f32| rank / 64.0) {
                assert_eq!(level(value, dither), (value * 255.0 + dither).round() as u8);
            }
        }
        let edge = 0.5 - f32::EPSILON / 4.0;
        assert_eq!([level(0.0, edge), level(0.0, 0.5)], [0, 1]);
        assert_eq!(level(f32::NAN, 0.0), 0);
    }

    #[test]
    fn filmic_is_monotone_keeps_grey_and_rolls_off() {
        let grey = filmic([0.18; 3]);
        assert!((grey[0] - 0.23).abs() < 0.01, "{grey:?}");
        let mut last = -1.0;
        for step in 0..200 {
            let x = (step as f32 * 0.1 - 10.0).exp2();
            let y = filmic([x; 3]);
            assert!(y[1] >= last && y[1] <= 1.0, "{x} {y:?}");
            assert!(
                (y[0] - y[1]).abs() < 1e-3 && (y[1] - y[2]).abs() < 1e-3,
                "{y:?}"
            );
            last = y[1];
        }
        assert!(filmic([1e30; 3])[0] > 0.99);
        let clipped = display([f32::MAX, 0.0, -1.0], ToneMap::None);
        assert!((clipped[0] - 1.0).abs() < 1e-6 && clipped[1..] == [0.0, 0.0]);
    }

    #[test]
    fn agx_is_monotone_keeps_grey_and_turns_bright_colours_white() {
        let grey = agx([0.18; 3]);
        assert!((grey[0] - 0.2145).abs() < 1e-3, "{grey:?}");
        let mut last = -1.0;
        for step in 0..300 {
            let x = (step as f32 * 0.1 - 16.0).exp2();
            let y = agx([x; 3]);
            assert!(y[1] >= last && y[1] <= 1.0, "{x} {y:?}");
            assert!((y[0] - y[1]).abs() < 1e-3 && (y[1] - y[2]).abs() < 1e-3);
            last = y[1];
        }
        assert_eq!(agx([0.0; 3]), [0.0; 3]);
        assert_eq!(agx([f32::NAN, -1.0, 0.0])[1..], [0.0; 2]);
        let [red, bright] = [1.0, 50.0].map(|x| agx([x, 0.0, 0.0]));
        assert!(red[0] > 0.7 && red[1] < 0.05, "{red:?}");
        assert!(bright[0] > 0.99 && bright[1] > 0.7, "{bright:?}");
        assert!(agx([1e30; 3])[0] > 0.99);
    }

    #[test]
    fn srgb_is_continuous() {
        assert!((srgb_from_linear(0.003_130_8) - srgb_from_linear(0.003_130_9)).abs() < 1e-5);
        assert!((srgb_from_linear(1.0) - 1.0).abs() < 1e-6);
    }
}
