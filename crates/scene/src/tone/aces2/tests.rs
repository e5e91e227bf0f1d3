use glam::DVec3;

use super::appearance::{Appearance, GREY_J, J_WHITE, REC709, lightness, luminance};
use super::gamut::compressed_m;
use super::transform::{HALF, SCALE, UNIT, tone_scale};
use super::{aces2, lut, transform};
use crate::tone::{self, ToneMap, srgb_from_linear};

/// Linear Rec.709, and what OpenColorIO 2.6 shows of it by
/// `ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-100nit-REC709_2.0`, linear Rec.709 again.
#[rustfmt::skip]
const SHOWN_BY_OPENCOLORIO: &[([f32; 3], [f32; 3])] = &[
    ([0.001, 0.001, 0.001], [4.1e-06, 4.1e-06, 4.1e-06]),
    ([0.01, 0.01, 0.01], [0.0007123, 0.0007123, 0.0007123]),
    ([0.05, 0.05, 0.05], [0.0160486, 0.0160486, 0.0160486]),
    ([0.18, 0.18, 0.18], [0.0999991, 0.0999994, 0.0999993]),
    ([0.5, 0.5, 0.5], [0.279803, 0.279803, 0.279803]),
    ([1.0, 1.0, 1.0], [0.457565, 0.457566, 0.457566]),
    ([4.0, 4.0, 4.0], [0.787152, 0.787152, 0.787152]),
    ([20.0, 20.0, 20.0], [0.95588, 0.95588, 0.95588]),
    ([100.0, 100.0, 100.0], [0.997623, 0.997622, 0.997622]),
    ([0.18, 0.0, 0.0], [0.0513272, 0.000405, 0.0001242]),
    ([0.18, 0.18, 0.0], [0.0981657, 0.0990882, 0.0027879]),
    ([0.0, 0.18, 0.0], [0.0030635, 0.0889759, 0.0025282]),
    ([0.0, 0.18, 0.18], [0.0045898, 0.0943603, 0.094387]),
    ([0.0, 0.0, 0.18], [3.43e-05, 0.0, 0.0346588]),
    ([0.18, 0.0, 0.18], [0.0713613, 0.0008162, 0.0699622]),
    ([1.0, 0.0, 0.0], [0.554008, 0.0088254, 0.0033028]),
    ([1.0, 1.0, 0.0], [0.478943, 0.486986, 0.0471208]),
    ([0.0, 1.0, 0.0], [0.0472083, 0.514379, 0.0339152]),
    ([0.0, 1.0, 1.0], [0.0976397, 0.472321, 0.47133]),
    ([0.0, 0.0, 1.0], [0.0, 0.0, 0.5134]),
    ([1.0, 0.0, 1.0], [0.551869, 0.0135954, 0.538296]),
    ([10.0, 0.0, 0.0], [1.0, 0.359649, 0.275449]),
    ([10.0, 10.0, 0.0], [0.959044, 0.982883, 0.471166]),
    ([0.0, 10.0, 0.0], [0.619526, 1.0, 0.543112]),
    ([0.0, 10.0, 10.0], [0.712414, 0.931255, 0.928661]),
    ([0.0, 0.0, 10.0], [0.260987, 0.312532, 1.0]),
    ([10.0, 0.0, 10.0], [1.0, 0.518634, 0.980398]),
    ([0.6, 0.35, 0.15], [0.333731, 0.206727, 0.1007]),
    ([0.12, 0.06, 0.03], [0.0548373, 0.022087, 0.0074936]),
    ([2.4, 1.5, 0.7], [0.706029, 0.573308, 0.434214]),
    ([0.02, 0.012, 0.008], [0.002282, 0.0011055, 0.0005704]),
    ([0.9, 0.2, 0.05], [0.51866, 0.121427, 0.0331089]),
    ([0.35, 0.22, 0.18], [0.201981, 0.128013, 0.105075]),
    ([8.0, 3.0, 0.6], [1.0, 0.740403, 0.54148]),
    ([0.05, 0.2, 0.6], [0.0229129, 0.111239, 0.35208]),
    ([0.3, 0.02, 0.25], [0.158694, 0.0055255, 0.13096]),
    ([40.0, 38.0, 30.0], [0.980537, 0.979926, 0.977155]),
    ([0.0002, 0.003, 0.0005], [2.1e-06, 2.89e-05, 5.1e-06]),
    ([3.0, 0.01, 0.4], [1.0, 0.11919, 0.23577]),
    ([0.01, 60.0, 0.5], [0.949744, 1.0, 0.935732]),
    ([5.0, 0.02, 6.0], [0.967396, 0.332217, 1.0]),
    ([90.0, 0.3, 15.0], [1.0, 0.941395, 0.951804]),
    ([0.4, 0.5, 0.1], [0.231358, 0.285531, 0.0723821]),
    ([0.0, 0.0, 1.74], [0.0, 0.0, 0.970639]),
    ([0.97, 0.016, 1.85], [0.515069, 0.0258266, 0.933449]),
];

/// Largest difference of a channel.
fn apart(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|ix| (a[ix] - b[ix]).abs()).fold(0.0, f32::max)
}

/// Places all over a cube of 0..1.
fn places() -> impl Iterator<Item = [f32; 3]> {
    (0..20_000u32).map(|ix| {
        [0x9E37_79B1, 0x85EB_CA77, 0xC2B2_AE3D]
            .map(|factor: u32| (ix.wrapping_mul(factor) >> 8) as f32 / 16_777_216.0)
    })
}

/// Radiance within ten stops of middle grey, each channel anywhere.
fn any_colors() -> impl Iterator<Item = [f32; 3]> {
    places().map(|at| at.map(|x| 0.18 * (20.0 * x - 10.0).exp2()))
}

/// The same with red brightest, and green and blue up to two stops below it.
fn hair_colors() -> impl Iterator<Item = [f32; 3]> {
    places().map(|[level, a, b]| {
        let red = 0.18 * (20.0 * level - 10.0).exp2();
        [
            red,
            red * (-2.0 * a.min(b)).exp2(),
            red * (-2.0 * a.max(b)).exp2(),
        ]
    })
}

#[test]
fn colors_are_those_of_opencolorio() {
    for &(rgb, wanted) in SHOWN_BY_OPENCOLORIO {
        let found = aces2(rgb);
        assert!(apart(found, wanted) < 5e-4, "{rgb:?}: {found:?} {wanted:?}");
        // The dark ones too.
        let levels = apart(found.map(srgb_from_linear), wanted.map(srgb_from_linear));
        assert!(255.0 * levels < 0.15, "{rgb:?}: {found:?} {wanted:?}");
    }
    assert!(SHOWN_BY_OPENCOLORIO.len() > 40);
}

#[test]
fn greys_stay_grey_and_get_brighter() {
    let mut last = -1.0;
    for step in 0..300 {
        let x = (step as f32 * 0.1 - 16.0).exp2();
        let y = aces2([x; 3]);
        assert!(y[1] >= last && y[1] <= 1.0, "{x} {y:?}");
        assert!(
            (y[0] - y[1]).abs() < 1e-5 && (y[1] - y[2]).abs() < 1e-5,
            "{y:?}"
        );
        last = y[1];
    }
    // 10 nits.
    assert!(apart(aces2([0.18; 3]), [0.1; 3]) < 2e-5);
    assert!(aces2([100.0; 3])[0] < 0.999);
    assert!(apart(aces2([128.5; 3]), [1.0; 3]) < 1e-5);
}

#[test]
fn bright_colors_turn_white() {
    let [red, bright] = [1.0, 100.0].map(|x| aces2([x, 0.0, 0.0]));
    assert!(red[0] > 0.5 && red[1] < 0.01, "{red:?}");
    assert!(bright[0] == 1.0 && bright[1] > 0.8, "{bright:?}");
}

#[test]
fn black_is_black_and_what_is_no_radiance_is_no_light() {
    let transforms: [fn([f32; 3]) -> [f32; 3]; 2] =
        [aces2, |rgb| tone::display(rgb, ToneMap::Aces2)];
    for shown in transforms {
        for rgb in [[0.0; 3], [-1.0; 3], [f32::NEG_INFINITY; 3], [f32::NAN; 3]] {
            assert_eq!(shown(rgb), [0.0; 3], "{rgb:?}");
        }
        assert_eq!(shown([f32::NAN, 0.5, -3.0]), shown([0.0, 0.5, 0.0]));
        for bright in [1e5, 1e30, f32::MAX, f32::INFINITY] {
            assert!(apart(shown([bright; 3]), [1.0; 3]) < 1e-5, "{bright}");
            for rgb in [[bright, 0.0, 0.0], [0.0, bright, 0.0], [0.0, 1e-30, bright]] {
                let found = shown(rgb);
                assert!(
                    found.iter().all(|x| (0.0..=1.0).contains(x)),
                    "{rgb:?} {found:?}"
                );
            }
        }
    }
}

#[test]
fn constants_are_what_the_formulas_give() {
    let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
    // What the curve through `grey` at 0.18 has there and at its end.
    let [grey, white] = [0.10013_f64, 1.0].map(|y| 0.5 * (y + (y * (y + 0.16)).sqrt()));
    let to_white = 128.0 / white;
    let scale = white / (to_white / (to_white + 1.0)).powf(1.15);
    let x = (grey / scale).powf(1.0 / 1.15);
    let half = 0.18 * (1.0 - x) / (white * x);
    close(HALF, half * white);
    close(SCALE, white / (to_white / (to_white + half)).powf(1.15));
    close(tone_scale(128.0), 1.0);
    close(GREY_J, lightness(0.10013));
    close(UNIT, (0.03379_f64 * 100.0).powf(0.30596) - 0.45135);
}

#[test]
fn looks_are_those_of_colors() {
    let display = Appearance::new(&REC709);
    let (achromatic, white) = display.look(DVec3::ONE);
    assert!((achromatic - 1.0).abs() < 1e-12 && (white.j - J_WHITE).abs() < 1e-9);
    assert!(white.m < 1e-9, "{white:?}");
    assert!((luminance(achromatic) - 1.0).abs() < 1e-12);
    for rgb in any_colors() {
        let rgb = DVec3::from(rgb.map(|x| f64::from(x.min(1.0))));
        let back = display.rgb(display.look(rgb).1);
        assert!((back - rgb).abs().max_element() < 1e-9, "{rgb} {back}");
    }
}

#[test]
fn what_ap1_reaches_is_compressed_to_the_edge_and_little_else() {
    for [boundary, reach] in [[10.0, 12.0], [40.0, 90.0], [50.0, 49.0]] {
        let full = compressed_m(reach, boundary, reach);
        assert!((full - boundary.min(reach)).abs() < 1e-9, "{full}");
        let share = (boundary / reach).clamp(0.75, 1.0);
        let kept = 0.999 * share * boundary.min(reach);
        assert_eq!(compressed_m(kept, boundary, reach), kept);
    }
    // So hardly anything is clipped.
    let excess = |rgb: [f32; 3]| {
        rgb.map(|x| (x - 1.0).max(-x))
            .into_iter()
            .fold(0.0, f32::max)
    };
    let found: Vec<f32> = any_colors()
        .map(|rgb| excess(transform().shown(rgb)))
        .collect();
    let most = found.iter().copied().fold(0.0, f32::max);
    let mean = found.iter().sum::<f32>() / found.len() as f32;
    println!("beyond the display: {mean} in the mean, {most} at most");
    assert!(mean < 0.02 && most < 0.2, "{mean} {most}");
}

/// Mean, 99th percentile and largest difference of [`lut`] from [`aces2`], in levels of 255.
fn grid_errors(colors: impl Iterator<Item = [f32; 3]>) -> [f32; 3] {
    let error = |rgb| apart(lut().display(rgb), aces2(rgb).map(srgb_from_linear));
    let mut errors: Vec<f32> = colors.map(|rgb| 255.0 * error(rgb)).collect();
    errors.sort_by(f32::total_cmp);
    let mean = errors.iter().sum::<f32>() / errors.len() as f32;
    [
        mean,
        errors[errors.len() * 99 / 100],
        errors[errors.len() - 1],
    ]
}

#[test]
fn the_grid_is_as_exact_as_it_says() {
    let [any, hair, dark] = [
        grid_errors(any_colors()),
        grid_errors(hair_colors()),
        grid_errors(places().map(|at| at.map(|x| 0.02 * x * x))),
    ];
    println!("any colours {any:?}, of hair {hair:?}, dark ones {dark:?}");
    for (found, most) in [
        (any, [0.45, 3.0, 20.0]),
        (hair, [0.14, 0.85, 2.0]),
        (dark, [0.2, 0.5, 0.8]),
    ] {
        assert!((0..3).all(|ix| found[ix] <= most[ix]), "{found:?} {most:?}");
    }
    for step in 0..200 {
        let x = (step as f32 * 0.1 - 12.0).exp2();
        let [r, g, b] = tone::display([x; 3], ToneMap::Aces2);
        assert!((r - g).abs() < 1e-4 && (g - b).abs() < 1e-4, "{r} {g} {b}");
    }
}
