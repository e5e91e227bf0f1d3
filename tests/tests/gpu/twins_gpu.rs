//! The WGSL functions on the adapter against their Rust twins, point by point. Fails without a
//! Vulkan, Metal or DX12 adapter; Mesa's lavapipe will do.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::{Arc, OnceLock};

use strandlight_render::probe::{
    Function, GpuProbe, MODE_ALL, PaintQuestion, Query, SAMPLED_AVERAGES, evaluate,
    gpu_paint_answers, gpu_painted_lobes, paint_answer, painted_lobes,
};
use strandlight_scattering::closed_form::{
    DirectionInFrame, Fibre, GAUSS_HERMITE, PointPaint, pack_paint,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::lobes::{DEFAULT_PAINTED_TEXELS, slice_painted};
use strandlight_scattering::{HairParams, Lobe, Model, PerLobe};
use strandlight_scene::material::{HairMaterial, LobeTables};
use strandlight_scene::optics::Optics;
use strandlight_scene::paint::PaintKinds;
use strandlight_scene::tables::ShadingTables;
use strandlight_tests::optics::{lobes, multiple_textures};
use strandlight_tests::random::SplitMix64;
use strandlight_tests::{corners, oracle};

const N: usize = 100_000;
/// Points of what the renderer does not evaluate.
const N_ASIDE: usize = 10_000;
/// Fibres that the scheme with lobes is compared on; each has textures of its own.
const N_FIBRES: usize = 100;

fn tables() -> &'static ShadingTables {
    static TABLES: OnceLock<ShadingTables> = OnceLock::new();
    TABLES.get_or_init(|| ShadingTables::from_file(&oracle::tables(false)).unwrap())
}

fn probe() -> &'static GpuProbe {
    static PROBE: OnceLock<GpuProbe> = OnceLock::new();
    PROBE.get_or_init(|| GpuProbe::new(tables()).expect("GPU tests need an adapter"))
}

/// Largest difference of any component over the largest value of the batch; every value must be
/// finite on both sides.
fn worst_difference(gpu: &[[f32; 4]], cpu: &[[f32; 4]]) -> f64 {
    assert_eq!(gpu.len(), cpu.len());
    assert!(!gpu.is_empty());
    let (mut worst, mut largest) = (0.0f64, 0.0f64);
    for (a, b) in gpu.iter().flatten().zip(cpu.iter().flatten()) {
        assert!(a.is_finite() && b.is_finite(), "{a} {b}");
        worst = worst.max((f64::from(*a) - f64::from(*b)).abs());
        largest = largest.max(f64::from(b.abs()));
    }
    worst / largest
}

/// What Mesa's lavapipe is held to, whose exponential and trigonometric functions are nearly exact;
/// 6.4e-7 at most was measured.
const USUAL: f64 = 2e-6;
/// For directions in a fibre's frame and local scattering; 2.1e-6 and 1.5e-6 were measured.
const WIDER: f64 = 6e-6;

/// What an adapter is held to: lavapipe to `on_lavapipe`, others to `on_gpus`. WGSL promises 3 + 2
/// |x| units in the last place of exp(x), and 2^-11 of a sine.
fn held(on_lavapipe: f64, on_gpus: f64) -> f64 {
    if probe().context().is_software() {
        on_lavapipe
    } else {
        on_gpus
    }
}

/// Answers of both.
fn both(queries: &[Query]) -> [Vec<[f32; 4]>; 2] {
    let optics = if queries.iter().any(Query::needs_optics) {
        optics()
    } else {
        &[]
    };
    let view = tables().view();
    let cpu = queries.iter().map(|query| evaluate(query, &view, optics));
    [probe().evaluate(queries, optics).unwrap(), cpu.collect()]
}

/// Runs `queries` on both and asserts the tolerances, see [`held`].
fn compare(name: &str, queries: &[Query], on_lavapipe: f64, on_gpus: f64) {
    let [gpu, cpu] = both(queries);
    let worst = worst_difference(&gpu, &cpu);
    println!(
        "{name}: {} points, worst {worst:.2e} of the largest value",
        queries.len()
    );
    assert!(worst < held(on_lavapipe, on_gpus), "{name}: {worst}");
}

/// Largest difference of any component in units of `1e-3 |cpu| + 1e-6 lambda^2`: single scattering
/// grows with the light's energy, about lambda^2, so that no largest value measures narrow lights.
fn worst_pointwise(lambdas: &[f32], gpu: &[[f32; 4]], cpu: &[[f32; 4]]) -> f64 {
    assert!(gpu.len() == cpu.len() && lambdas.len() == cpu.len());
    let mut worst = 0.0f64;
    for ((lambda, a), b) in lambdas.iter().zip(gpu).zip(cpu) {
        for (a, b) in a.iter().zip(b) {
            assert!(a.is_finite() && b.is_finite(), "{a} {b}");
            let (a, b, lambda) = (f64::from(*a), f64::from(*b), f64::from(*lambda));
            worst = worst.max((a - b).abs() / (1e-3 * b.abs() + 1e-6 * lambda * lambda));
        }
    }
    worst
}

/// Runs `queries` of single scattering on both and asserts that [`worst_pointwise`] is below
/// `on_lavapipe`, or 1 on other adapters.
fn compare_pointwise(name: &str, queries: &[Query], on_lavapipe: f64) {
    let [gpu, cpu] = both(queries);
    let lambdas: Vec<f32> = queries.iter().map(|query| query.x).collect();
    let worst = worst_pointwise(&lambdas, &gpu, &cpu);
    println!("{name}: worst {worst:.2e} of 1e-3 |cpu| + 1e-6 lambda^2");
    assert!(worst < held(on_lavapipe, 1.0), "{name}: {worst}");
}

/// Round, elliptic, and of model `energy`, which takes round fibres.
fn hair(random: &mut SplitMix64) -> HairParams {
    let model = match random.next_u64() % 3 {
        0 => Model::Energy,
        _ => Model::Marschner,
    };
    HairParams {
        model,
        eta: random.uniform(1.2, 2.0),
        sigma_a: [(); 3].map(|()| random.log_uniform(0.01, 4.0)),
        shift: PerLobe {
            r: random.uniform(-0.2, 0.0),
            tt: random.uniform(0.0, 0.1),
            trt: random.uniform(0.0, 0.2),
        },
        width: PerLobe {
            r: random.uniform(0.05, 0.3),
            tt: random.uniform(0.03, 0.2),
            trt: random.uniform(0.1, 0.5),
        },
        caustic_width: random.uniform(0.05, 0.4),
        eccentricity: if random.uniform(0.0, 1.0) < 0.5 || model == Model::Energy {
            1.0
        } else {
            random.uniform(0.8, 1.25)
        },
        intensity: PerLobe {
            r: random.uniform(0.0, 1.0),
            tt: random.uniform(0.0, 1.0),
            trt: random.uniform(0.0, 1.0),
        },
    }
}

fn fibre(random: &mut SplitMix64) -> Fibre {
    let segments = 2 + random.next_u64() as u32 % 8;
    Fibre::new(&hair(random), &Lobe::ALL, segments).unwrap()
}

/// Random fibres with random numbers of nodes.
fn optics() -> &'static [Optics] {
    static OPTICS: OnceLock<Vec<Optics>> = OnceLock::new();
    OPTICS.get_or_init(|| {
        let mut random = SplitMix64(15);
        let optics = (0..N_FIBRES).map(|_| {
            let mut optics = multiple_textures(&hair(&mut random)).optics().clone();
            let nodes = [(); 3].map(|()| 1 + random.next_u64() as u32 % 8);
            optics.fibre = optics.fibre.with_nodes(nodes);
            optics
        });
        optics.collect()
    })
}

/// The place of some optics and the fibre they are of.
fn some_optics(random: &mut SplitMix64) -> (u32, Fibre) {
    let ix = random.next_u64() as usize % N_FIBRES;
    (ix as u32, optics()[ix].fibre)
}

fn direction(random: &mut SplitMix64) -> DirectionInFrame {
    let theta = random.uniform(-1.0, 1.0).asin();
    DirectionInFrame::from_angles(theta as f32, random.uniform(-PI, PI) as f32)
}

#[test]
fn special_functions_agree() {
    let mut random = SplitMix64(10);
    let queries: Vec<_> = (0..N)
        .map(|_| Query {
            x: random.uniform(-6.0, 6.0) as f32,
            y: random.log_uniform(1e-4, 2e6) as f32,
            ..Query::new(Function::Special)
        })
        .collect();
    compare("special", &queries, USUAL, 1e-5);
    let queries: Vec<_> = (0..N)
        .map(|_| Query {
            x: random.log_uniform(0.01, 2e6) as f32,
            y: random.log_uniform(0.01, 2e6) as f32,
            z: random.uniform(-1.0, 1.0).powi(5) as f32,
            ..Query::new(Function::CircularGaussian)
        })
        .collect();
    compare("circular Gaussian", &queries, USUAL, 1e-5);
    let queries: Vec<_> = (0..N)
        .map(|_| Query {
            x: random.uniform(1.0001, 3.0) as f32,
            y: random.uniform(0.0, 1.0) as f32,
            ..Query::new(Function::Fresnel)
        })
        .collect();
    compare("Fresnel", &queries, USUAL, 1e-5);
    let queries: Vec<_> = (0..N)
        .map(|_| Query {
            x: random.uniform(-1.0, 1.0) as f32,
            y: random.uniform(-1.0, 1.0).powi(3) as f32,
            z: random.uniform(-1.0, 1.0) as f32,
            ..Query::new(Function::Frame)
        })
        .collect();
    compare("frame", &queries, WIDER, 1e-5);
}

#[test]
fn tables_agree() {
    let mut random = SplitMix64(11);
    let queries: Vec<_> = (0..N)
        .map(|_| {
            let k = random.next_u64() as u32 % 7;
            let lambda_p = random.log_uniform(0.001, 10.0) as f32;
            Query::table_c(k, lambda_p, random.uniform(-PI, PI) as f32)
        })
        .collect();
    compare("table C", &queries, USUAL, 1e-5);
    let queries: Vec<_> = (0..N)
        .map(|_| {
            let mode = 1 + random.next_u64() as u32 % 2;
            let eta = random.log_uniform(1.0001, 10.0) as f32;
            Query::table_h(mode, eta, random.uniform(-FRAC_PI_2, FRAC_PI_2) as f32)
        })
        .collect();
    compare("table H", &queries, USUAL, 1e-4);
}

#[test]
fn outer_integrals_agree() {
    let mut random = SplitMix64(14);
    let queries: Vec<_> = (0..N)
        .map(|_| Query {
            mode: random.next_u64() as u32 % 3,
            fibre: fibre(&mut random),
            light: direction(&mut random),
            view: direction(&mut random),
            x: random.log_uniform(0.01, 5.0) as f32,
            y: (random.next_u64() % GAUSS_HERMITE.len() as u64) as f32,
            ..Query::new(Function::OuterNode)
        })
        .collect();
    // The bound of the narrowest light and the weight of the widest differ by much.
    for component in 0..4 {
        let only = |answers: Vec<[f32; 4]>| -> Vec<[f32; 4]> {
            answers.iter().map(|a| [a[component]; 4]).collect()
        };
        let [gpu, cpu] = both(&queries).map(only);
        let worst = worst_difference(&gpu, &cpu);
        println!("outer node, component {component}: worst {worst:.2e}");
        assert!(worst < held(USUAL, 1e-4), "{worst}");
    }
}

#[test]
fn inner_integrals_agree() {
    let mut random = SplitMix64(12);
    for mode in 0..3 {
        let mut query = |optics, fibre| {
            let lambda_p = random.log_uniform(0.01, 5.0) as f32;
            let dphi = random.uniform(-PI, PI) as f32;
            let theta_d = random.uniform(-1.5, 1.5) as f32;
            Query::azimuthal(mode, lambda_p, dphi, theta_d, fibre).with_optics(optics)
        };
        let name = Lobe::ALL[mode as usize].name();
        let mut fibres = SplitMix64(16);
        let queries: Vec<_> = (0..N)
            .map(|_| {
                let (ix, fibre) = some_optics(&mut fibres);
                query(ix, fibre)
            })
            .collect();
        compare(name, &queries, USUAL, 1e-4);
        let queries: Vec<_> = (0..N_ASIDE)
            .map(|_| query(0, fibre(&mut fibres)).by_paper())
            .collect();
        compare(&format!("{name} of the paper"), &queries, USUAL, 1e-4);
    }
}

#[test]
fn lobes_of_painted_fibres_agree() {
    let mut random = SplitMix64(18);
    let lobes = lobes();
    for table in [&lobes.tt, &lobes.trt].into_iter().flatten() {
        let texture = slice_painted(table, 1.5, 0.12, DEFAULT_PAINTED_TEXELS);
        let points: Vec<[f32; 4]> = (0..N)
            .map(|_| {
                let [r, g, b] = [(); 3].map(|()| random.log_uniform(1e-3, 60.0) as f32);
                [random.uniform(0.0, 1.0) as f32, r, g, b]
            })
            .collect();
        let gpu = gpu_painted_lobes(probe().context(), &texture, &points).unwrap();
        let cpu: Vec<_> = points.iter().map(|&p| painted_lobes(&texture, p)).collect();
        let parts = |all: &[[f32; 16]], part: usize| -> Vec<[f32; 4]> {
            let part = |numbers: &[f32; 16]| std::array::from_fn(|i| numbers[4 * part + i]);
            all.iter().map(part).collect()
        };
        for part in 0..4 {
            let worst = worst_difference(&parts(&gpu, part), &parts(&cpu, part));
            println!("painted {}, part {part}: {worst:.2e}", table.lobe.name());
            assert!(worst < held(USUAL, 1e-4), "{worst}");
        }
    }
}

/// Which of the answers of [`paint_answer`], three numbers each.
const DELTA_B: usize = 4;

#[test]
fn painted_points_agree() {
    let mut random = SplitMix64(19);
    let mut hair = HairMaterial::new(
        Arc::new(LobeTables::default()),
        Fresnel::Dielectric,
        &HairParams::default(),
        &[],
        4,
    )
    .unwrap();
    hair.enable_multiple(true);
    let kinds = |widths, shifts| PaintKinds { widths, shifts };
    for kinds in [
        kinds(false, false),
        kinds(true, false),
        kinds(false, true),
        kinds(true, true),
    ] {
        hair.enable_paint(Some(kinds)).unwrap();
        let mut scale = |is_painted| match is_painted {
            true => random.log_uniform(0.05, 20.0) as f32,
            false => 1.0,
        };
        let scales: Vec<[f32; 2]> = (0..N_ASIDE)
            .map(|_| [scale(kinds.widths), scale(kinds.shifts)])
            .collect();
        let questions: Vec<PaintQuestion> = scales
            .into_iter()
            .map(|[width_scale, shift_scale]| PaintQuestion {
                paint: pack_paint(&PointPaint {
                    dye: [(); 3].map(|()| random.log_uniform(1e-3, 50.0) as f32),
                    weight: random.uniform(0.0, 1.0) as f32,
                    width_scale,
                    shift_scale,
                    around: (random.uniform(0.0, 1.0) < 0.5)
                        .then(|| [(); 3].map(|()| random.log_uniform(1e-3, 50.0) as f32)),
                }),
                theta: random.uniform(-1.6, 1.6) as f32,
                sin_theta: random.uniform(0.0, 1.0) as f32,
                padding: [0; 2],
            })
            .collect();
        let gpu = gpu_paint_answers(probe().context(), &hair, &questions).unwrap();
        let (mut worst, mut n) = ([0.0f32; 8], 0);
        for (found, question) in gpu.iter().zip(&questions) {
            let expected = paint_answer(&hair, question);
            for (ix, (a, b)) in found.iter().zip(expected).enumerate() {
                let apart = (a - b).abs() / (1e-3 + b.abs());
                // NaN is not below anything.
                worst[ix / 3] = if apart <= worst[ix / 3] {
                    worst[ix / 3]
                } else {
                    apart
                };
                n += usize::from(b.abs() > 1e-3);
            }
        }
        println!("{kinds:?}: {worst:?}");
        let is_held = |(ix, &worst): (usize, &f32)| {
            // Delta_b goes through 0: 3.2e-3 of it on an H200.
            let on_gpus = if ix == DELTA_B { 1e-2 } else { 1e-3 };
            f64::from(worst) < held(USUAL, on_gpus)
        };
        assert!(n > 0 && worst.iter().enumerate().all(is_held), "{worst:?}");
    }
}

#[test]
fn single_scattering_agrees() {
    let mut random = SplitMix64(13);
    let mut fibres = SplitMix64(17);
    for mode in 0..=MODE_ALL {
        let mut query = |optics, fibre| {
            let lambda = random.log_uniform(0.01, 2.0) as f32;
            let (light, view) = (direction(&mut random), direction(&mut random));
            Query::single(mode, light, lambda, view, fibre).with_optics(optics)
        };
        let queries: Vec<_> = (0..N)
            .map(|_| {
                let (ix, fibre) = some_optics(&mut fibres);
                query(ix, fibre)
            })
            .collect();
        compare(
            &format!("single scattering, mode {mode}"),
            &queries,
            USUAL,
            1e-4,
        );
        // 4.1e-3 was measured.
        compare_pointwise(&format!("single scattering, mode {mode}"), &queries, 0.02);
        let queries: Vec<_> = (0..N_ASIDE)
            .map(|_| query(0, fibre(&mut fibres)).by_paper())
            .collect();
        let name = format!("single scattering of the paper, mode {mode}");
        compare(&name, &queries, USUAL, 1e-4);
        // 8.5e-2 was measured.
        compare_pointwise(&name, &queries, 0.3);
    }
}

#[test]
fn half_circles_agree() {
    let mut random = SplitMix64(19);
    let queries: Vec<_> = (0..N)
        .map(|_| Query {
            x: random.log_uniform(1e-4, 2e6) as f32,
            y: random.uniform(-1.0, 1.0).powi(3) as f32,
            z: random.uniform(-FRAC_PI_2, FRAC_PI_2) as f32,
            w: random.log_uniform(0.001, 10.0) as f32,
            ..Query::new(Function::HalfCircle)
        })
        .collect();
    compare("half circle and mean cosine", &queries, USUAL, 1e-5);
}

#[test]
fn averages_agree() {
    let mut random = SplitMix64(20);
    for average in SAMPLED_AVERAGES {
        let queries: Vec<_> = (0..N_ASIDE)
            .map(|_| {
                let (ix, fibre) = some_optics(&mut random);
                let theta = random.uniform(-FRAC_PI_2, FRAC_PI_2) as f32;
                let query = Query::average(average, theta, fibre).expect("it is sampled");
                query.with_optics(ix)
            })
            .collect();
        compare(average.name(), &queries, USUAL, 1e-5);
    }
}

#[test]
fn multiple_scattering_agrees() {
    let mut random = SplitMix64(21);
    let sigma = |random: &mut SplitMix64| random.log_uniform(0.01, 2.0) as f32;
    for mode in 0..=MODE_ALL {
        let queries: Vec<_> = (0..N)
            .map(|_| {
                let (ix, fibre) = some_optics(&mut random);
                let (light, view) = (direction(&mut random), direction(&mut random));
                Query::global(mode, light, sigma(&mut random), view, fibre).with_optics(ix)
            })
            .collect();
        compare(&format!("global, mode {mode}"), &queries, USUAL, 1e-4);
    }
    for (name, query) in [
        ("local", Query::local as fn(_, _, _, _) -> _),
        ("direct local", Query::direct_local),
    ] {
        let queries: Vec<Query> = (0..N)
            .map(|_| {
                let (ix, fibre) = some_optics(&mut random);
                let (light, view) = (direction(&mut random), direction(&mut random));
                query(light, sigma(&mut random), view, fibre).with_optics(ix)
            })
            .collect();
        compare(name, &queries, WIDER, 1e-4);
    }
}

#[test]
fn corners_are_finite_on_the_gpu() {
    let optics = strandlight_tests::optics::optics(&corners::fibres());
    let lobes = corners::queries();
    let paper: Vec<_> = lobes.iter().map(|query| query.by_paper()).collect();
    assert!(lobes.len() > 10_000);
    for queries in [lobes, paper] {
        let answers = probe().evaluate(&queries, &optics).unwrap();
        for (query, answer) in queries.iter().zip(&answers) {
            for value in answer {
                assert!(value.is_finite() && *value >= 0.0, "{query:?} {answer:?}");
            }
        }
    }
}

#[test]
fn the_comparator_sees_a_difference() {
    let cpu = [[1.0, 2.0, 3.0, 4.0]];
    assert!(worst_difference(&cpu, &cpu) == 0.0);
    assert!(worst_difference(&[[1.0, 2.0, 3.00004, 4.0]], &cpu) > WIDER);
    // A narrow light beside a wide one: 10 % wrong, seen only point by point.
    let (lambdas, cpu) = ([1.0, 0.01], [[1.0; 4], [1e-5; 4]]);
    let gpu = [[1.0; 4], [1.1e-5; 4]];
    assert!(worst_difference(&gpu, &cpu) < USUAL);
    assert!(worst_pointwise(&lambdas, &gpu, &cpu) > 10.0);
    assert!(worst_pointwise(&lambdas, &cpu, &cpu) == 0.0);
}
