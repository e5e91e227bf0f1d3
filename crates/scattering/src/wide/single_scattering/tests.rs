use super::*;
use crate::closed_form::{self, LightInFrame};
use crate::random::SplitMix64;
use crate::wide::fixture::{Fixture, lights, params, place};
use crate::wide::{Peaks, levels};
use crate::{HairParams, Model};

/// A direction in the frame of a place.
fn along(place: &Place, light: [f32; 3]) -> [f32; 3] {
    let along = |axis: [f32; 3]| axis[0] * light[0] + axis[1] * light[1] + axis[2] * light[2];
    place.frame.map(along)
}

/// R, TT, TRT of the scalar code.
fn scalar(
    shading: &Shading<impl closed_form::SampleLobes>,
    place: &Place,
    light: [f32; 3],
    lambda: f32,
) -> [f32; 7] {
    let source = LightInFrame::from_vector(along(place, light), lambda);
    let [r, tt, trt] = [0, 1, 2]
        .map(|mode| closed_form::single_scattering_mode(mode, &source, &place.view, shading));
    [r[0], tt[0], tt[1], tt[2], trt[0], trt[1], trt[2]]
}

fn all(responses: &Responses, light: usize) -> [f32; 7] {
    let mut numbers = [0.0; 7];
    for entry in responses
        .entries()
        .iter()
        .filter(|entry| entry.light as usize == light)
    {
        match entry.mode {
            0 => numbers[0] = entry.rgb[0],
            mode => numbers[3 * mode as usize - 2..][..3].copy_from_slice(&entry.rgb),
        }
    }
    numbers
}

/// Time that this thread has had a core, ns; where the system does not say, wall time.
fn thread_ns() -> f64 {
    static START: std::sync::LazyLock<std::time::Instant> =
        std::sync::LazyLock::new(std::time::Instant::now);
    let statistics = std::fs::read_to_string("/proc/thread-self/schedstat");
    let first = statistics
        .ok()
        .and_then(|text| text.split(' ').next()?.parse().ok());
    first.unwrap_or_else(|| START.elapsed().as_nanos() as f64)
}

/// Prints what a product (a point, a light, three modes) costs, in core time:
/// `cargo test --release -p strandlight-scattering single_scattering_cost -- --ignored --nocapture`.
#[test]
#[ignore = "measures"]
fn single_scattering_cost() {
    let fixture = Fixture::new();
    let mut random = SplitMix64(11);
    let (directions, mut lambdas) = lights(&mut random, 40);
    for (ix, lambda) in lambdas.iter_mut().enumerate() {
        *lambda = 0.03 * (1.0f32 / 0.03).powf(ix as f32 / 39.0);
    }
    for (name, model, eccentricity) in [
        ("marschner", Model::Marschner, 1.0),
        ("energy", Model::Energy, 1.0),
        ("elliptic", Model::Marschner, 0.85),
    ] {
        let hair = fixture.hair_of(&HairParams {
            model,
            eccentricity,
            ..HairParams::default()
        });
        let shading = hair.shading(&fixture);
        let wide = WideLights::new(&directions, &lambdas);
        let places: Vec<Place> = (4..1004).map(|view| place(&mut random, view)).collect();
        let products = (places.len() * directions.len()) as f64;
        let least_ns = |run: &mut dyn FnMut()| {
            // The system counts in steps of some milliseconds.
            let timed = |run: &mut dyn FnMut()| {
                let start = thread_ns();
                (0..30).for_each(|_| run());
                (thread_ns() - start) / (30.0 * products)
            };
            (0..5).map(|_| timed(run)).fold(f64::INFINITY, f64::min)
        };
        let one = least_ns(&mut || {
            for place in &places {
                for (light, lambda) in directions.iter().zip(&lambdas) {
                    let source = LightInFrame::from_vector(along(place, *light), *lambda);
                    let all = closed_form::single_scattering(&source, &place.view, &shading);
                    std::hint::black_box(all);
                }
            }
        });
        println!("{name}: one light at a time: {one:.0} ns a product");
        for (name, level) in levels() {
            let mut responses = vec![Responses::default(); places.len()];
            let eight = least_ns(&mut || {
                single_scattering_at(
                    level,
                    &wide,
                    &[1.0; 40],
                    &places,
                    &shading,
                    None,
                    &mut responses,
                );
            });
            println!("eight, {name}: {eight:.0} ns, {:.1} times", one / eight);
        }
    }
}

/// Largest errors of R, TT and TRT, of the value and a hundredth of the largest `expected`.
fn errors(found: &[[f32; 7]], expected: &[[f32; 7]]) -> [f32; 3] {
    assert_eq!(found.len(), expected.len());
    [0..1, 1..4, 4..7].map(|mode| {
        let values = |all: &[[f32; 7]]| -> Vec<f32> {
            all.iter().flat_map(|x| x[mode.clone()].to_vec()).collect()
        };
        let (found, expected) = (values(found), values(expected));
        let largest = expected.iter().fold(0.0f32, |a, b| a.max(*b));
        let error = |(found, expected): (&f32, &f32)| {
            assert!(*found >= 0.0 && found.is_finite(), "{found}");
            (found - expected).abs() / (expected + 0.01 * largest + 1e-20)
        };
        let errors = found.iter().zip(&expected).map(error);
        errors.fold(0.0, f32::max)
    })
}

#[test]
fn eight_lights_answer_as_one_does() {
    let fixture = Fixture::new();
    let mut random = SplitMix64(7);
    let mut n = 0;
    let mut worst = [0.0f32; 3];
    for ix in 0..48 {
        let model = match ix % 3 {
            1 => Model::Energy,
            _ => Model::Marschner,
        };
        let hair = fixture.hair_of(&HairParams {
            model,
            ..params(&mut random, ix % 3 == 0)
        });
        let shading = hair.shading(&fixture);
        let (directions, lambdas) = lights(&mut random, 37);
        let wide = WideLights::new(&directions, &lambdas);
        let places: Vec<Place> = (0..16).map(|view| place(&mut random, view)).collect();
        let mut expected = Vec::new();
        for place in &places {
            for (direction, lambda) in directions.iter().zip(&lambdas) {
                expected.push(scalar(&shading, place, *direction, *lambda));
            }
        }
        n += expected.len();
        for (name, level) in levels() {
            let mut responses = vec![Responses::default(); places.len()];
            single_scattering_at(
                level,
                &wide,
                &[1.0; 40],
                &places,
                &shading,
                None,
                &mut responses,
            );
            let found: Vec<_> = responses
                .iter()
                .flat_map(|responses| (0..37).map(|light| all(responses, light)))
                .collect();
            let errors = errors(&found, &expected);
            assert!(
                errors.iter().all(|error| *error < 1e-5),
                "{name} {ix} {errors:?}"
            );
            worst = std::array::from_fn(|mode| worst[mode].max(errors[mode]));
        }
    }
    println!("{n} products, largest errors {worst:?}");
    assert!(n > 20_000);
}

#[test]
fn an_error_is_seen() {
    let expected = [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], [0.0; 7]];
    let mut found = expected;
    assert_eq!(errors(&found, &expected), [0.0; 3]);
    found[0][5] += 2e-4;
    found[1][0] = 2e-6;
    let errors = errors(&found, &expected);
    assert!(errors[0] > 1e-5 && errors[1] == 0.0 && errors[2] > 1e-5);
}

/// What a light gets depends on it alone; others get nothing.
#[test]
fn wanted_lights_get_the_same_among_any_others() {
    let fixture = Fixture::new();
    let mut random = SplitMix64(3);
    let hair = fixture.hair(&mut random, false);
    let shading = hair.shading(&fixture);
    let (directions, lambdas) = lights(&mut random, 29);
    let wide = WideLights::new(&directions, &lambdas);
    assert_eq!((wide.len(), wide.is_empty()), (29, false));
    let mut lit = 0;
    for (_, level) in levels() {
        for view in 0..20 {
            let place = place(&mut random, view);
            let bits = random.next_u64();
            let wanted = |light: usize| bits >> light & 1 == 1;
            let weights: Vec<f32> = (0..29)
                .map(|light| f32::from(wanted(light) as u8))
                .collect();
            let respond = |wanted: &[f32]| {
                let mut responses = [Responses::default()];
                single_scattering_at(
                    level,
                    &wide,
                    wanted,
                    &[place],
                    &shading,
                    None,
                    &mut responses,
                );
                let [responses] = responses;
                responses
            };
            let (every, some) = (respond(&[1.0; 29]), respond(&weights));
            for light in 0..29 {
                let expected = match wanted(light) {
                    true => all(&every, light),
                    false => [0.0; 7],
                };
                assert_eq!(all(&some, light), expected);
                lit += usize::from(expected[0] > 0.0);
            }
        }
    }
    assert!(lit > 250 * levels().len(), "{lit}");
}

#[test]
fn modes_that_are_off_and_no_lights_are_black() {
    let fixture = Fixture::new();
    let mut random = SplitMix64(5);
    let hair = fixture.hair(&mut random, false);
    let place = place(&mut random, 9);
    let at = |modes: u32, n: usize| {
        let fibre = crate::closed_form::Fibre {
            modes,
            ..hair.fibre
        };
        let shading = Shading {
            fibre: &fibre,
            ..hair.shading(&fixture)
        };
        let wide = WideLights::new(&vec![[0.0, 0.6, 0.8]; n], &vec![1.0; n]);
        let mut responses = [Responses::default()];
        single_scattering_at(
            Level::new(),
            &wide,
            &[1.0; 64],
            &[place],
            &shading,
            None,
            &mut responses,
        );
        let [responses] = responses;
        responses
    };
    let full = all(&at(7, 3), 2);
    assert!(full.iter().all(|x| *x > 0.0), "{full:?}");
    for modes in 0..8 {
        let found = all(&at(modes, 3), 2);
        for (ix, (found, full)) in found.into_iter().zip(full).enumerate() {
            let is_on = modes >> ix.div_ceil(3) & 1 == 1;
            assert_eq!(found, if is_on { full } else { 0.0 });
        }
    }
    assert!(at(7, 0).entries().is_empty());
}

/// Numbers that are none give what they may, but no panic.
#[test]
fn nonsense_is_survived() {
    let fixture = Fixture::new();
    let mut random = SplitMix64(5);
    let shading_of = fixture.hair(&mut random, true);
    let shading = shading_of.shading(&fixture);
    let nasty = [
        f32::NAN,
        f32::INFINITY,
        -f32::INFINITY,
        0.0,
        -1.0,
        1e30,
        1e-30,
    ];
    let mut n = 0;
    for (_, level) in levels() {
        for x in nasty {
            for lambda in nasty {
                let wide = WideLights::new(&[[x, 0.3, x]; 9], &[lambda; 9]);
                let places = [place(&mut random, 9)];
                let mut responses = [Responses::default()];
                single_scattering_at(
                    level,
                    &wide,
                    &[1.0; 64],
                    &places,
                    &shading,
                    None,
                    &mut responses,
                );
                n += 1;
            }
        }
    }
    assert_eq!(n, levels().len() * 49);
}

/// Painted points, whose lobes are made texels of a fibre.
#[test]
fn painted_hair_answers_as_in_scalar_code() {
    let fixture = Fixture::new();
    let mut random = SplitMix64(13);
    let hair = fixture.hair(&mut random, false);
    let [tt, trt] = fixture.painted(&hair);
    let layers = |texture: &crate::lobes::PaintedTexture| {
        [0.1, 0.5, 2.0].map(|sigma_a| closed_form::lobe_layer(&texture.decode, sigma_a))
    };
    let uniform = hair.shading(&fixture);
    let lobes = |texture| closed_form::PaintedPointLobes {
        view: crate::lobes::PaintedTexture::view(texture),
        layers: layers(texture),
    };
    let shading = Shading {
        fibre: uniform.fibre,
        tables: uniform.tables,
        reflectance: uniform.reflectance,
        tt: lobes(&tt),
        trt: lobes(&trt),
    };
    let mut of_point = [closed_form::PointLobes::default(), Default::default()];
    of_point[0].take(&shading.tt);
    of_point[1].take(&shading.trt);
    let of_texels = Shading {
        fibre: uniform.fibre,
        tables: uniform.tables,
        reflectance: uniform.reflectance,
        tt: of_point[0].view(),
        trt: of_point[1].view(),
    };
    let (directions, lambdas) = lights(&mut random, 21);
    let wide = WideLights::new(&directions, &lambdas);
    let (mut found, mut expected) = (Vec::new(), Vec::new());
    for view in 0..40 {
        let place = place(&mut random, view);
        let mut responses = [Responses::default()];
        single_scattering_at(
            Level::new(),
            &wide,
            &[1.0; 64],
            &[place],
            &of_texels,
            None,
            &mut responses,
        );
        for (ix, (direction, lambda)) in directions.iter().zip(&lambdas).enumerate() {
            found.push(all(&responses[0], ix));
            expected.push(scalar(&shading, &place, *direction, *lambda));
        }
    }
    let errors = errors(&found, &expected);
    assert!(errors.iter().all(|error| *error < 1e-5), "{errors:?}");
}

#[test]
fn roulette_is_right_in_the_mean_and_leaves_work_out() {
    let fixture = Fixture::new();
    let mut random = SplitMix64(17);
    let hair = fixture.hair_of(&crate::HairParams::default());
    let shading = hair.shading(&fixture);
    let (directions, lambdas) = lights(&mut random, 40);
    let wide = WideLights::new(&directions, &lambdas);
    let weights: Vec<f32> = (0..40).map(|ix| 0.8_f32.powi(ix)).collect();
    let place = place(&mut random, 12);
    let respond = |roulette: Option<Roulette>| {
        let mut responses = [Responses::default()];
        let level = Level::new();
        let places = [place];
        single_scattering_at(
            level,
            &wide,
            &weights,
            &places,
            &shading,
            roulette,
            &mut responses,
        );
        let entries = responses[0].entries();
        let sum: f64 = entries
            .iter()
            .map(|entry| f64::from(weights[entry.light as usize] * entry.rgb[1]))
            .sum();
        (sum, entries.len())
    };
    let (exact, all) = respond(None);
    let peaks = Peaks::of(&shading);
    let n = 2000;
    let (mut mean, mut square, mut asked) = (0.0, 0.0, 0);
    for seed in 0..n {
        let tolerance = 0.01;
        let (sum, n_asked) = respond(Some(Roulette {
            tolerance,
            peaks,
            seed,
        }));
        mean += sum / f64::from(n);
        square += (sum / exact - 1.0).powi(2) / f64::from(n);
        asked += n_asked;
    }
    let deviation = square.sqrt();
    println!("{all} of {asked}, deviation {deviation}");
    assert!(asked < all * n as usize * 2 / 3, "{asked} {all}");
    assert!(deviation > 0.0 && deviation < 0.1, "{deviation}");
    // Seeds are spread evenly, so the mean is closer than that of independent ones.
    let error = (mean / exact - 1.0).abs();
    assert!(
        error < 3.0 * deviation / f64::from(n).sqrt(),
        "{error} {deviation}"
    );
}
