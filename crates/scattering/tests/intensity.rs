//! The factors on the modes: everything that scatters follows them, in proportion.

use strandlight_scattering::dual_scattering::{
    AverageTable, PaintedAverageTable, all_orders, event,
};
use strandlight_scattering::exact::{Bcsdf, PaintedBcsdf};
use strandlight_scattering::exact::{Forward, Light, View, global, single};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe, PerLobe};

const FRESNEL: Fresnel = Fresnel::Dielectric;
const LIGHT: Light = Light {
    theta: 0.2,
    phi: 2.4,
    lambda: 0.4,
};
const VIEW: View = View {
    theta: -0.3,
    phi: 0.1,
};

fn hair(r: f64, tt: f64, trt: f64) -> HairParams {
    HairParams {
        intensity: PerLobe { r, tt, trt },
        ..HairParams::default()
    }
}

fn close(found: [f64; 3], expected: [f64; 3], what: &str) {
    for (a, b) in found.into_iter().zip(expected) {
        assert!(
            (a - b).abs() <= 1e-12 + 1e-6 * b.abs(),
            "{what}: {found:?} {expected:?}"
        );
    }
}

#[test]
fn the_exact_integrals_go_with_the_factor() {
    let whole = HairParams::default();
    let elliptic = |hair: HairParams| HairParams {
        eccentricity: 0.9,
        ..hair
    };
    let forward = Forward {
        theta: 0.2,
        phi: 2.4,
        sigma_f: 0.4,
    };
    for lobe in Lobe::ALL {
        for factor in [0.0, 0.3, 1.0] {
            let scaled = hair(factor, factor, factor);
            let [found, all] =
                [scaled, whole].map(|hair| single(lobe, LIGHT, VIEW, &hair, FRESNEL));
            assert!(all[0] > 0.0);
            close(found, all.map(|x| factor * x), lobe.name());
            let [found, all] =
                [scaled, whole].map(|hair| global(lobe, forward, VIEW, &hair, FRESNEL));
            close(found, all.map(|x| factor * x), lobe.name());
            let [found, all] = [elliptic(scaled), elliptic(whole)]
                .map(|hair| single(lobe, LIGHT, VIEW, &hair, FRESNEL));
            close(found, all.map(|x| factor * x), lobe.name());
        }
    }
    // Each mode has its own.
    let found = single(Lobe::Tt, LIGHT, VIEW, &hair(0.0, 0.5, 0.0), FRESNEL);
    let all = single(Lobe::Tt, LIGHT, VIEW, &whole, FRESNEL);
    close(found, all.map(|x| 0.5 * x), "TT alone");
}

/// S of the sampler is the sum of the modes times their factors, and what it draws estimates the
/// albedo of that.
#[test]
fn ground_truth_follows() {
    let view = [0.1f64.sin(), 0.1f64.cos(), 0.0];
    let modes = Lobe::ALL.map(|lobe| Bcsdf::new(&HairParams::default(), FRESNEL, &[lobe]).unwrap());
    let scaled = hair(0.25, 0.75, 0.5);
    let all = Bcsdf::new(&scaled, FRESNEL, &Lobe::ALL).unwrap();
    let painted = PaintedBcsdf::new(&scaled, FRESNEL, &Lobe::ALL).unwrap();
    let mut random = 0x9e37_79b9_7f4a_7c15u64;
    let mut uniform = || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut n_lit = 0;
    for _ in 0..200 {
        let (theta, phi) = ((2.0 * uniform() - 1.0).asin(), 6.3 * uniform());
        let towards = [
            theta.sin(),
            theta.cos() * phi.cos(),
            theta.cos() * phi.sin(),
        ];
        let parts = [0, 1, 2].map(|l| modes[l].view(view).evaluate(towards).s);
        let expected: [f64; 3] =
            std::array::from_fn(|c| 0.25 * parts[0][c] + 0.75 * parts[1][c] + 0.5 * parts[2][c]);
        let found = all.view(view).evaluate(towards).s;
        n_lit += usize::from(found[0] > 1e-4);
        close(found, expected, "S");
        let found = painted.view(&scaled, view).evaluate(towards).s;
        for (a, b) in found.into_iter().zip(expected) {
            assert!(
                (a - b).abs() < 5e-3 + 1e-2 * b,
                "painted: {found:?} {expected:?}"
            );
        }
    }
    assert!(n_lit > 20, "{n_lit}");
    let n = 200_000;
    let mut mean = [0.0; 3];
    for _ in 0..n {
        if let Some(sample) = all.view(view).sample(&mut uniform) {
            for (mean, weight) in mean.iter_mut().zip(sample.weight) {
                *mean += weight / f64::from(n);
            }
        }
    }
    let albedo = all.albedo(0.1);
    for (a, b) in mean.into_iter().zip(albedo) {
        assert!((a / b - 1.0).abs() < 0.01, "{mean:?} {albedo:?}");
    }
    // A fibre that scatters nothing draws nothing.
    let none = Bcsdf::new(&hair(0.0, 0.0, 0.0), FRESNEL, &Lobe::ALL).unwrap();
    assert!(none.view(view).sample(&mut uniform).is_none());
    assert_eq!(none.albedo(0.1), [0.0; 3]);
}

#[test]
fn the_averages_see_the_same_energy() {
    let whole = event(0.3, &HairParams::default(), FRESNEL);
    let half = event(0.3, &hair(0.5, 0.5, 0.5), FRESNEL);
    close(
        half.forward.attenuation,
        whole.forward.attenuation.map(|x| 0.5 * x),
        "a_f",
    );
    close(
        half.backward.attenuation,
        whole.backward.attenuation.map(|x| 0.5 * x),
        "a_b",
    );
    close(half.forward.width_2, whole.forward.width_2, "beta_f^2");
    // One mode alone has its own width.
    let tt = event(0.3, &hair(0.0, 1.0, 0.0), FRESNEL);
    let width = 2.0 * HairParams::default().width.tt;
    close(tt.forward.width_2, [width * width; 3], "TT alone");
    // Nothing at all: finite, and nothing.
    let none = hair(0.0, 0.0, 0.0);
    let back = all_orders(&event(0.3, &none, FRESNEL));
    assert_eq!(back.attenuation, [0.0; 3]);
    for factors in [
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
    ] {
        let [r, tt, trt] = factors;
        let hair = hair(r, tt, trt);
        let table = AverageTable::new(&hair, FRESNEL);
        let painted = PaintedAverageTable::new(&hair, FRESNEL, [16, 2, 2]);
        for theta in [-1.5f32, -0.4, 0.0, 1.2] {
            let finite = table
                .sample(theta)
                .as_flattened()
                .iter()
                .all(|x| x.is_finite());
            assert!(finite, "{factors:?} {theta}");
        }
        let finite = painted.texels.as_flattened().iter().all(|x| x.is_finite());
        assert!(finite, "{factors:?}");
    }
}
