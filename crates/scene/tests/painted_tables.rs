//! Tables of multiple scattering of painted points against the closed form that they stand for.

use std::f64::consts::PI;
use std::sync::Arc;

use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, TableFile};
use strandlight_scattering::closed_form::{
    DirectionInFrame, LightInFrame, PointPaint, TERM_GLOBAL, TERM_LOCAL, direct_local_scattering,
    global_scattering, local_scattering, painted_averages, painted_fibre, painted_layers,
    painted_shading, plain_layers, sample_painted_forward,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::jobs::Job;
use strandlight_scattering::multiple_tables::{
    AzimuthsOfLights, N_PACKS, PaintedPlaces, PaintedTables, SeenLights, packs_of,
    painted_forward_table,
};
use strandlight_scattering::random::SplitMix64;
use strandlight_scattering::wide::{LANES, Level, dispatch, f32x8, prelude::*, sample_forward};
use strandlight_scattering::{HairParams, Lobe, PerLobe};
use strandlight_scene::material::{HairMaterial, LobeTables};
use strandlight_scene::paint::PaintKinds;
use strandlight_scene::tables::ShadingTables;

const BOTH: u32 = TERM_GLOBAL | TERM_LOCAL;
const TERMS: [&str; 3] = ["global", "local", "direct local"];

struct Bundled {
    tables: ShadingTables,
    material: HairMaterial,
}

/// Painted hair of these parameters.
fn painted(hair: &HairParams, kinds: PaintKinds) -> Bundled {
    let file = TableFile::from_bytes(DEFAULT_TABLES).unwrap();
    let lobes = Arc::new(LobeTables::from_file(&file, &Lobe::ALL).unwrap());
    let mut material = HairMaterial::new(lobes, Fresnel::Dielectric, hair, &Lobe::ALL, 4).unwrap();
    material.enable_multiple(true);
    material.enable_paint(Some(kinds)).unwrap();
    Bundled {
        tables: ShadingTables::from_file(&file).unwrap(),
        material,
    }
}

fn dyed(dye: [f32; 3], around: Option<[f32; 3]>) -> PointPaint {
    PointPaint {
        dye,
        weight: 1.0,
        width_scale: 1.0,
        shift_scale: 1.0,
        around,
    }
}

/// Absorption of blond to black hair.
fn any_absorption(random: &mut SplitMix64) -> [f32; 3] {
    let sigma = random.log_uniform(0.01, 4.0);
    [1.0, random.uniform(1.0, 3.0), random.uniform(2.0, 6.0)].map(|factor| (factor * sigma) as f32)
}

/// Squares of error and value of each term for points of these paints, eight lights each.
fn squares(bundled: &Bundled, paints: &[PointPaint], seed: u64) -> [[f64; 2]; 3] {
    let optics = bundled.material.optics();
    let hair = optics.painted_hair();
    let views = optics.painted_views(&hair, bundled.tables.view());
    let mut tables = PaintedTables::default();
    let mut squares = [[0.0; 2]; 3];
    for (ix, paint) in paints.iter().enumerate() {
        let fibre = painted_fibre(&hair.fibre, paint);
        let needed = packs_of(&fibre, paint);
        let mut missing = tables.missing(needed);
        while missing != 0 {
            let pack = missing.trailing_zeros() as usize;
            tables.fill(pack, &views, BOTH, |jobs| {
                jobs.into_iter().for_each(Job::run);
            });
            missing = tables.missing(needed);
        }
        let places = tables.places(&fibre, paint);
        assert_eq!(places.packs(), needed);
        let shading = painted_shading(&views, &fibre);
        let averages = painted_averages(views.averages, &fibre, paint);
        let mut random = SplitMix64::of_item(seed, ix as u64);
        let mut eight = |low: f64, high: f64| -> [f32; LANES] {
            std::array::from_fn(|_| random.uniform(low, high) as f32)
        };
        let (thetas, deltas) = (eight(-1.0, 1.0).map(f32::asin), eight(0.0, PI));
        let lambdas = eight(0.01f64.ln(), 1.2f64.ln()).map(f32::exp);
        // After 1 to 12 forward scatterings.
        let (events, sines) = (eight(0.0, 12f64.ln()).map(f32::exp), eight(0.0, 1.0));
        let sigmas: [f32; LANES] = std::array::from_fn(|lane| {
            let (_, beta_f_2) = sample_painted_forward(&averages.view, &averages.row, sines[lane]);
            (lambdas[lane].powi(2) + events[lane] * beta_f_2[lane % 3]).sqrt()
        });
        let theta_o = eight(-1.0, 1.0)[0].asin();
        let found: [[[f32; LANES]; 3]; 3] = dispatch!(Level::new(), simd => {
            let zero = f32x8::splat(simd, 0.0);
            let view = DirectionInFrame::from_angles(theta_o, 0.0);
            let cosines = f32x8::simd_from(simd, deltas.map(f32::cos));
            let seen = SeenLights {
                theta: f32x8::simd_from(simd, thetas),
                cos_theta: f32x8::simd_from(simd, thetas.map(f32::cos)),
                n: LANES,
                azimuths: AzimuthsOfLights::between([cosines, zero], &view),
                theta_o,
            };
            let sigma = f32x8::simd_from(simd, sigmas);
            let (global, local) = tables.at_lights(&places, &seen, sigma);
            let lambda = f32x8::simd_from(simd, lambdas);
            let direct = tables.direct_at_lights(&places, &seen, lambda);
            [global, local, direct].map(|rgb| rgb.map(Into::into))
        });
        for lane in 0..LANES {
            let light = LightInFrame::from_angles(thetas[lane], 0.0, lambdas[lane]);
            let view = DirectionInFrame::from_angles(theta_o, deltas[lane]);
            let (towards, sigma) = (&light.direction, sigmas[lane]);
            let exact = [
                global_scattering(towards, &view, sigma, &shading),
                local_scattering(towards, &view, sigma, &averages),
                direct_local_scattering(&light, &view, &averages),
            ];
            for (squares, (found, exact)) in squares.iter_mut().zip(found.iter().zip(exact)) {
                for (found, exact) in found.iter().zip(exact) {
                    squares[0] += f64::from(found[lane] - exact).powi(2);
                    squares[1] += f64::from(exact).powi(2);
                }
            }
        }
    }
    squares
}

/// Relative RMSE of each term in percent.
fn percent(squares: [[f64; 2]; 3]) -> [f64; 3] {
    squares.map(|[error, value]| 100.0 * (error / value).sqrt())
}

#[test]
fn points_of_any_absorption_are_within_one_percent() {
    let hair = HairParams::default();
    for kinds in [false, true].map(|is_painted| PaintKinds {
        widths: is_painted,
        shifts: is_painted,
    }) {
        let bundled = painted(&hair, kinds);
        let mut random = SplitMix64(5);
        let paints: Vec<PointPaint> = (0..1500)
            .map(|ix| {
                let around = (ix % 2 == 0).then(|| any_absorption(&mut random));
                dyed(any_absorption(&mut random), around)
            })
            .collect();
        let errors = percent(squares(&bundled, &paints, 11));
        println!("{kinds:?}: {TERMS:?} {errors:.3?} %");
        assert!(errors.iter().all(|&error| error < 1.0), "{errors:?}");
    }
}

#[test]
fn single_colours_are_within_their_bounds() {
    let bundled = painted(&HairParams::default(), PaintKinds::default());
    for sigma_a in [
        [0.0; 3],
        [0.0084, 0.0139, 0.0274],
        [0.1257, 0.2091, 0.411],
        [0.26, 0.42, 0.83],
        [1.2, 0.25, 0.02],
        [3.352, 5.576, 10.96],
    ] {
        let errors = percent(squares(&bundled, &vec![dyed(sigma_a, None); 400], 3));
        println!("{sigma_a:?}: {errors:.3?} %");
        assert!(errors.iter().all(|&error| error < 1.0), "{errors:?}");
    }
}

/// Of any roughness, index and caustic that hair has.
#[test]
fn hair_of_any_widths_is_within_its_bounds() {
    let degree = PI / 180.0;
    let (mut sum, mut worst) = ([[0.0; 2]; 3], [0.0f64; 3]);
    for ix in 0..40 {
        let mut random = SplitMix64::of_item(3, ix);
        let beta = random.uniform(4.0, 12.0) * degree * std::f64::consts::SQRT_2;
        let hair = HairParams {
            eta: random.uniform(1.4, 1.7),
            width: PerLobe {
                r: beta,
                tt: 0.5 * beta,
                trt: 2.0 * beta,
            },
            caustic_width: random.log_uniform(0.06, 0.3),
            ..HairParams::default()
        };
        let paints: Vec<PointPaint> = (0..200)
            .map(|_| dyed(any_absorption(&mut random), None))
            .collect();
        let found = squares(&painted(&hair, PaintKinds::default()), &paints, ix);
        for (term, error) in percent(found).into_iter().enumerate() {
            worst[term] = worst[term].max(error);
            sum[term][0] += found[term][0];
            sum[term][1] += found[term][1];
        }
    }
    let errors = percent(sum);
    println!("any widths: {TERMS:?} {errors:.3?} %, of the worst hair {worst:.3?} %");
    assert!(errors.iter().all(|&error| error < 1.0), "{errors:?}");
    assert!(worst.iter().all(|&error| error < 1.5), "{worst:?}");
}

#[test]
fn hair_without_r_is_within_its_bounds() {
    // Dark hair scatters nothing forward then.
    let hair = HairParams {
        intensity: PerLobe {
            r: 0.0,
            tt: 1.0,
            trt: 1.0,
        },
        ..HairParams::default()
    };
    let bundled = painted(&hair, PaintKinds::default());
    let errors = percent(squares(
        &bundled,
        &vec![dyed([0.26, 0.42, 0.83], None); 400],
        3,
    ));
    println!("without R: {errors:.3?} %");
    assert!(errors.iter().all(|&error| error < 1.0), "{errors:?}");
}

#[test]
fn tables_of_other_absorption_are_told_apart() {
    let bundled = painted(&HairParams::default(), PaintKinds::default());
    let optics = bundled.material.optics();
    let hair = optics.painted_hair();
    let views = optics.painted_views(&hair, bundled.tables.view());
    let paint = dyed([0.26, 0.42, 0.83], None);
    let other = dyed([0.26, 0.42, 1.2], None);
    let [fibre, of_other] = [&paint, &other].map(|paint| painted_fibre(&hair.fibre, paint));
    let mut tables = PaintedTables::default();
    let packs = packs_of(&fibre, &paint) | packs_of(&of_other, &other);
    for pack in (0..N_PACKS).filter(|pack| packs >> pack & 1 == 1) {
        tables.fill(pack, &views, BOTH, |jobs| {
            jobs.into_iter().for_each(Job::run);
        });
    }
    assert_eq!(tables.terms(), BOTH);
    assert!(tables.bytes() > 0);
    let places = tables.places(&fibre, &paint);
    let other = tables.places(&of_other, &other);
    let at = |places: &PaintedPlaces| -> [[f32; LANES]; 3] {
        dispatch!(Level::new(), simd => {
            let number = |x: f32| f32x8::splat(simd, x);
            let view = DirectionInFrame::from_angles(-0.3, 0.0);
            let seen = SeenLights {
                theta: number(0.2),
                cos_theta: number(0.2f32.cos()),
                n: LANES,
                azimuths: AzimuthsOfLights::between([number(0.1), number(0.0)], &view),
                theta_o: view.theta,
            };
            let (global, _) = tables.at_lights(places, &seen, number(0.4));
            global.map(Into::into)
        })
    };
    let (one, other) = (at(&places), at(&other));
    assert_eq!(one[..2], other[..2]);
    assert!(one[2][0] > 1.05 * other[2][0], "{one:?} {other:?}");
}

#[test]
fn what_hair_around_sends_on_is_as_one_look_up_says() {
    let bundled = painted(&HairParams::default(), PaintKinds::default());
    let optics = bundled.material.optics();
    let hair = optics.painted_hair();
    let views = optics.painted_views(&hair, bundled.tables.view());
    let paint = dyed([0.1, 0.3, 0.9], Some([0.4, 1.0, 0.2]));
    let fibre = painted_fibre(&hair.fibre, &paint);
    let averages = painted_averages(views.averages, &fibre, &paint);
    let table = painted_forward_table(&averages.view, &averages.row);
    for step in 0..=100 {
        let sine = 0.01 * step as f32;
        let (a_f, beta_f_2) = sample_painted_forward(&averages.view, &averages.row, sine);
        let found: [[f32; LANES]; 6] = dispatch!(Level::new(), simd => {
            let at = sample_forward(&table, f32x8::splat(simd, sine));
            let [a, b, c] = at.a_f;
            let [d, e, f] = at.beta_f_2;
            [a, b, c, d, e, f].map(Into::into)
        });
        for (found, one) in found.iter().zip(a_f.iter().chain(&beta_f_2)) {
            assert!((found[0] - one).abs() < 2e-6, "{sine}: {found:?} {one}");
        }
    }
}

/// Painted as the hair is, a point has the layers of hair that is not painted.
#[test]
fn layers_of_painted_hair_are_those_of_plain_hair() {
    for sigma_a in [[0.03, 0.1, 0.3], [0.3, 0.9, 3.0]] {
        let hair = HairParams {
            sigma_a,
            ..HairParams::default()
        };
        let mut bundled = painted(&hair, PaintKinds::default());
        bundled.material.keep_plain();
        let optics = bundled.material.optics();
        let painted = optics.painted_hair();
        let views = optics.painted_views(&painted, bundled.tables.view());
        let paint = dyed(sigma_a.map(|s| s as f32), None);
        let fibre = painted_fibre(&painted.fibre, &paint);
        let averages = painted_averages(views.averages, &fibre, &paint);
        let found = painted_layers(&averages);
        let expected = plain_layers(bundled.material.averages());
        for channel in 0..3 {
            let pairs = [
                (
                    found.two_layer_depth[channel],
                    expected.two_layer_depth[channel],
                ),
                (found.round_trip[channel], expected.round_trip[channel]),
                (found.gain[channel], expected.gain[channel]),
                (found.reflected[channel], expected.reflected[channel]),
                (
                    found.attenuation_b[channel],
                    expected.attenuation_b[channel],
                ),
            ];
            for (found, expected) in pairs {
                let error = (found - expected).abs();
                assert!(
                    error < 0.02 * expected.max(1e-3),
                    "{sigma_a:?}: {found} {expected}"
                );
            }
        }
    }
}
