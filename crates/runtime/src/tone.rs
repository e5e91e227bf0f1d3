//! From linear radiance to what a screen shows.

pub use strandlight_formats::ToneMap;

/// [`ToneMap::None`] in shaders.
pub(crate) const TONE_NONE: u32 = 0;
/// [`ToneMap::Filmic`] in shaders.
pub(crate) const TONE_FILMIC: u32 = 1;

/// sRGB, 8 bit, of linear Rec.709 radiance (exposure already applied).
pub fn display(rgb: [f32; 3], tone_map: ToneMap) -> [u8; 3] {
    let rgb = match tone_map {
        ToneMap::Filmic => filmic(rgb),
        ToneMap::None => rgb,
    };
    rgb.map(|x| (srgb_from_linear(x.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

/// Stephen Hill's fit of the ACES reference rendering and output transforms (BakingLab, 2016),
/// linear Rec.709 in and out. The factor 1.8 undoes most of the fit's darkening of mid-tones: 0.18 in
/// is 0.23 out. Highlights desaturate and roll off to 1.
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
    let transform = |m: &[[f32; 3]; 3], v: [f32; 3]| {
        [0, 1, 2].map(|row: usize| m[row][0] * v[0] + m[row][1] * v[1] + m[row][2] * v[2])
    };
    // Beyond this the curve is flat, and squares would overflow.
    let bounded = rgb.map(|x| (x * 1.8).clamp(0.0, 1e6));
    let curved = transform(&IN, bounded)
        .map(|v| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081));
    transform(&OUT, curved).map(|x| x.clamp(0.0, 1.0))
}

/// The sRGB transfer curve (IEC 61966-2-1), 0..=1 to 0..=1.
pub fn srgb_from_linear(x: f32) -> f32 {
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(display([f32::MAX, 0.0, -1.0], ToneMap::None), [255, 0, 0]);
    }

    #[test]
    fn srgb_is_continuous() {
        assert!((srgb_from_linear(0.003_130_8) - srgb_from_linear(0.003_130_9)).abs() < 1e-5);
        assert!((srgb_from_linear(1.0) - 1.0).abs() < 1e-6);
    }
}
