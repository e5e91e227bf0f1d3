//! Painted fibres against tables of each one's own.

use super::*;

/// Fibres that share eta and w_c, and what stands for all of them.
fn shared() -> (Vec<HairParams>, PaintedBcsdf) {
    let base = HairParams::default();
    let painted = PaintedBcsdf::new(&base, Fresnel::Dielectric, &Lobe::ALL).unwrap();
    let with = |sigma_a, width, shift| HairParams {
        sigma_a,
        ..base.scaled(width, shift)
    };
    let fibres = vec![
        base,
        with([0.0, 0.02, 0.1], 1.0, 1.0),
        with([1.5, 2.2, 3.5], 1.8, 0.5),
        with([0.03, 0.9, 9.0], 0.6, 2.0),
    ];
    (fibres, painted)
}

#[test]
fn the_fibre_is_its_own() {
    let (fibres, painted) = shared();
    let mut uniform = numbers(3);
    let mut worst = 0.0f64;
    for hair in &fibres {
        let own = bcsdf(hair);
        for _ in 0..40 {
            let omega_o = direction(2.6 * (uniform() - 0.5), 6.0 * uniform());
            let (a, b) = (painted.view(hair, omega_o), own.view(omega_o));
            let (mut off, mut peak) = ([0.0f64; 3], [0.0f64; 3]);
            for _ in 0..200 {
                let omega_i = direction(2.6 * (uniform() - 0.5), 6.3 * uniform());
                let [found, right] = [&a, &b].map(|view| view.evaluate(omega_i).s);
                for c in 0..3 {
                    off[c] = off[c].max((found[c] - right[c]).abs());
                    peak[c] = peak[c].max(right[c]);
                }
            }
            (0..3).for_each(|c| worst = worst.max(off[c] / peak[c]));
        }
    }
    println!("of the greatest S at one view: {worst:e}");
    assert!(worst < 2e-3, "{worst:e}");
    // It is a comparison.
    let (other, omega) = (direction(0.2, 1.0), direction(-0.3, 3.5));
    let [a, b] = [0, 1].map(|ix| painted.view(&fibres[ix], other).evaluate(omega).s[2]);
    assert!((a / b - 1.0).abs() > 0.1, "{a} {b}");
}

#[test]
fn samples_follow_their_density() {
    let (fibres, painted) = shared();
    let mut checked = 0;
    for (ix, hair) in fibres.iter().enumerate() {
        for (jx, theta_o) in [0.0, -0.5, 1.0, 1.45].into_iter().enumerate() {
            let n = 50_000;
            let view = painted.view(hair, direction(theta_o, 0.7));
            let (counts, expected) = histogram(&view, n, (10 * ix + jx) as u64);
            let mass: f64 = expected.iter().sum::<f64>() / n as f64;
            let z = deviation(&counts, &expected);
            println!("fibre {ix}, theta_o {theta_o}: {z:.2} sigma, mass {mass:.6}");
            assert!((mass - 1.0).abs() < 1e-3, "{mass}");
            assert!(z < 3.5, "{z}");
            checked += 1;
        }
    }
    assert_eq!(checked, 16);
}

#[test]
fn slow_the_mean_weight_is_the_albedo() {
    let (fibres, painted) = shared();
    for (ix, hair) in fibres.iter().enumerate() {
        let own = bcsdf(hair);
        for theta_o in [0.0, 0.7, -1.2] {
            let view = painted.view(hair, direction(theta_o, -2.0));
            let mut uniform = numbers(ix as u64 + 70);
            let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
            let n = 200_000;
            for _ in 0..n {
                if let Some(sample) = view.sample(&mut uniform) {
                    for c in 0..3 {
                        sum[c] += sample.weight[c];
                        squares[c] += square(sample.weight[c]);
                    }
                }
            }
            let n = f64::from(n);
            let albedo = own.albedo(theta_o);
            for c in 0..3 {
                let mean = sum[c] / n;
                let error = ((squares[c] / n - mean * mean) / n).sqrt();
                let off = mean - albedo[c];
                println!("{ix} {theta_o} {c}: {mean:.5} {off:e} {error:e}");
                assert!(
                    error < 2e-3 && off.abs() < 3.5 * error + 2e-4,
                    "{off:e} {error:e}"
                );
            }
        }
    }
}
