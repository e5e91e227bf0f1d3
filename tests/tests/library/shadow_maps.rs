//! Shadow maps that resolve fibres: against rays, and the GPU's against the CPU's.

use glam::Vec3;
use strandlight_cpu as cpu;
use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, Scene, SrbfLight, TableFile};
use strandlight_lab::bench::{TransmittanceOptions, run_transmittance};
use strandlight_lab::transmittance::{Method, point_shadows};
use strandlight_reference::rays::{Rays, Start};
use strandlight_render::passes;
use strandlight_scattering::closed_form::through_kernel;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::material::{HairMaterial, LobeTables};
use strandlight_scene::progress::Progress;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::{NO_SLOT, ShadowPlan, unblocked_share};
use strandlight_scene::strands::Strands;
use strandlight_scene::{Backend, Camera, PreparedScene};
use strandlight_tests::render_common::{Random, context, light, relative_rmse, scene, wig};
use strandlight_tests::scenes::{curtain, write_small_scene};

fn strands_of(strands: &[Vec<Vec3>], diameter: f32) -> Strands {
    let mut offsets = vec![0];
    let mut points = Vec::new();
    for strand in strands {
        points.extend(strand.iter().map(|point| point.to_array()));
        offsets.push(points.len() as u32);
    }
    Strands::new(&points, &offsets, |_, _| diameter, true).expect("a valid groom")
}

fn wig_strands(n: usize, diameter: f32) -> Strands {
    let (points, offsets) = wig(n, 24);
    Strands::new(&points, &offsets, |_, _| diameter, true).expect("a valid groom")
}

/// An eye, and where it looks.
const EYE: ([f32; 3], [f32; 3]) = ([0.0, 0.0, 60.0], [0.0, 0.0, -1.0]);

/// Shares of the first light at every point, of TT or of the other modes.
fn first_shares(strands: &Strands, plan: &ShadowPlan, is_tt: bool) -> Vec<f32> {
    let visibility = cpu::shadow_maps(strands, plan, EYE);
    let n_points = strands.points.len();
    (0..n_points)
        .map(|point| unblocked_share(&visibility, n_points, 0, is_tt, point))
        .collect()
}

#[test]
fn a_strand_casts_no_shadow_on_itself() {
    let straight = (0..20).map(|ix| Vec3::new(0.3 * ix as f32, 0.2 * ix as f32, 0.1));
    let helix = (0..200).map(|ix| {
        let turn = 0.12 * ix as f32;
        Vec3::new(2.0 * turn.cos(), 0.08 * ix as f32, 2.0 * turn.sin())
    });
    let arc = (0..40).map(|ix| {
        let turn = 0.04 * ix as f32;
        Vec3::new(8.0 * turn.cos(), 8.0 * turn.sin(), 0.0)
    });
    let straight = strands_of(&[straight.collect()], 0.008);
    let arc = strands_of(&[arc.collect()], 0.008);
    let helix = strands_of(&[helix.collect()], 0.008);
    let mut random = Random(1);
    for _ in 0..6 {
        let direction = random.direction().to_array();
        let lights = [light(direction, 0.002, [1.0; 3])];
        for (strands, least) in [(&straight, 1.0), (&arc, 0.995), (&helix, 0.97)] {
            let plan = ShadowPlan::new(&lights, strands, 1);
            let unblocked = first_shares(strands, &plan, false);
            let mean = unblocked.iter().sum::<f32>() / unblocked.len() as f32;
            assert!(mean >= least, "{direction:?}: {mean}, not {least}");
        }
    }
}

#[test]
fn a_comb_lets_its_gaps_through() {
    // Fibres 0.02 wide every 0.05 over a long one, and the light from above: 3/5 pass.
    let mut strands: Vec<Vec<Vec3>> = (0..400)
        .map(|ix| {
            let x = 0.05 * (ix as f32 - 200.0);
            vec![Vec3::new(x, 3.0, -2.0), Vec3::new(x, 3.0, 2.0)]
        })
        .collect();
    strands.push(vec![Vec3::new(-9.0, 0.0, 0.0), Vec3::new(9.0, 0.0, 0.0)]);
    let strands = strands_of(&strands, 0.02);
    let lights = [light([0.0, 1.0, 0.0], 0.002, [1.0; 3])];
    let plan = ShadowPlan::new(&lights, &strands, 4);
    assert_eq!(plan.views.len(), 1);
    let unblocked = first_shares(&strands, &plan, false);
    let [mut low, mut n] = [0.0, 0.0];
    for (point, share) in strands.points.iter().zip(&unblocked) {
        if point[1] < 1.0 {
            low += share;
            n += 1.0;
        } else {
            assert_eq!(*share, 1.0);
        }
    }
    let mean: f32 = low / n;
    assert!((mean - 0.6).abs() < 0.03, "{mean}");
}

/// The mean over all points is unbiased, and each point's share is that of rays around it.
#[test]
fn shares_are_those_of_rays() {
    const N_RAYS: u32 = 32;
    let strands = wig_strands(1500, 0.02);
    let rays = Rays::new(&strands);
    let direction = Vec3::new(0.5, 0.6, 0.62).normalize();
    let lights = [light(direction.to_array(), 0.002, [1.0; 3])];
    let plan = ShadowPlan::new(&lights, &strands, 1);
    let found = first_shares(&strands, &plan, false);
    let (mut bias, mut square, mut mean, mut n) = (0.0, 0.0, 0.0, 0.0);
    for (segment, &first) in strands.segments.iter().enumerate() {
        // The point at the segment's start, where the strand goes on on both sides.
        let point = first as usize;
        if strands.tangents[point][3] == 0.0 || segment % 3 != 0 {
            continue;
        }
        let mut open = 0.0;
        for ix in 0..N_RAYS {
            let (before, after) = (strands.tangents[point][3], strands.normals[point][3]);
            let place = (ix as f32 + 0.5) / N_RAYS as f32 * (before + after) - before;
            let start = if place < 0.0 {
                Start::inside(&strands, segment as u32 - 1, 1.0 + 0.5 * place / before)
            } else {
                Start::inside(&strands, segment as u32, 0.5 * place / after)
            };
            open += f32::from(u8::from(!rays.is_blocked(&start, direction))) / N_RAYS as f32;
        }
        let error = f64::from(found[point] - open);
        bias += error;
        square += error * error;
        mean += f64::from(open);
        n += 1.0;
    }
    let [bias, square, mean] = [bias, square, mean].map(|sum: f64| sum / n);
    let rms = square.sqrt();
    println!("{n} points: mean {mean:.4}, bias {bias:.4}, RMS {rms:.4}");
    assert!(mean > 0.1 && mean < 0.9, "{mean}");
    assert!(bias.abs() < 0.005, "{bias}");
    assert!(rms < 0.2, "{rms}");
}

/// TT's share of a wide light is the mean over the directions that light comes from through the fibre to the
/// eye, which the mean over the light is not.
#[test]
fn shares_of_tt_are_those_of_rays_through_the_fibre() {
    const N_RAYS: usize = 1500;
    let strands = wig_strands(1500, 0.02);
    let rays = Rays::new(&strands);
    let sky = light([0.2, 0.9, -0.3], 1.5, [1.0; 3]);
    let plan = ShadowPlan::new(&[sky], &strands, 64);
    let [of_tt, of_others] = [true, false].map(|is_tt| first_shares(&strands, &plan, is_tt));
    let mut random = Random(5);
    let mut sums = [[0.0_f64; 2]; 2];
    let (mut mean, mut n) = (0.0, 0.0);
    for (segment, &first) in strands.segments.iter().enumerate().step_by(97) {
        let point = first as usize;
        if strands.tangents[point][3] == 0.0 {
            continue;
        }
        let u = Vec3::from_slice(&strands.tangents[point]);
        let v = Vec3::from_slice(&strands.normals[point]);
        let in_frame = |d: Vec3| [u.dot(d), v.dot(d), u.cross(v).dot(d)];
        let position = Vec3::from_slice(&strands.points[point]);
        let eye = in_frame((Vec3::from(EYE.0) - position).normalize());
        let (mut open, mut all) = (0.0, 0.0);
        for _ in 0..N_RAYS {
            let towards = random.direction();
            let weight = through_kernel(in_frame(towards), eye)
                * (-towards.distance_squared(Vec3::from(sky.direction)) / sky.lambda.powi(2)).exp();
            let share = 0.5 * random.uniform();
            let start = if random.uniform() < 0.5 {
                Start::inside(&strands, segment as u32 - 1, 1.0 - share)
            } else {
                Start::inside(&strands, segment as u32, share)
            };
            all += weight;
            open += weight * f32::from(u8::from(!rays.is_blocked(&start, towards)));
        }
        for (sums, found) in sums.iter_mut().zip([&of_tt, &of_others]) {
            let error = f64::from(found[point] - open / all);
            sums[0] += error;
            sums[1] += error * error;
        }
        mean += f64::from(open / all);
        n += 1.0;
    }
    let [tt, others] = sums.map(|[bias, square]| [bias / n, (square / n).sqrt()]);
    mean /= n;
    println!(
        "{n} points: mean {mean:.3}; bias and RMS of TT's {tt:.3?}, of the others' {others:.3?}"
    );
    assert!(tt[0].abs() < 0.03, "{tt:?}");
    assert!(tt[1] < 0.6 * others[1], "{tt:?} {others:?}");
}

/// A board over a strand throws a shadow with edges that are sharper than a segment, in the picture by its
/// list and by samples.
#[test]
fn the_shadow_of_a_sun_has_edges_within_segments() {
    const SIZE: [u32; 2] = [180, 20];
    let lower = (0..7).map(|ix| Vec3::new(3.0 * ix as f32 - 9.0, 0.0, 0.0));
    let board = vec![Vec3::new(2.0, 3.0, -2.0), Vec3::new(2.0, 3.0, 2.0)];
    let drawn = |grown: Vec<Vec<Vec3>>, is_sampled: bool| {
        let (mut offsets, mut points) = (vec![0], Vec::new());
        for strand in &grown {
            points.extend(strand.iter().map(|point| point.to_array()));
            offsets.push(points.len() as u32);
        }
        let diameter = |strand: usize, _: usize| [0.2, 0.2, 3.0][strand];
        let strands = Strands::new(&points, &offsets, diameter, false).expect("a valid groom");
        let sun = light([0.0, 1.0, 0.0], 0.005, [1e4; 3]);
        let mut scene = scene(strands, vec![sun], &HairParams::default());
        // A tenth of a centimetre a pixel; the board is above the picture.
        scene.camera = Camera {
            eye: Vec3::new(0.0, 0.0, 40.0),
            target: Vec3::ZERO,
            fov_y: 2.0 * (1.0_f32 / 40.0).atan(),
            ..scene.camera
        };
        let mut renderer = match is_sampled {
            true => cpu::CpuRenderer::by_samples(scene),
            false => cpu::CpuRenderer::new(scene),
        };
        let (picture, _) = renderer.render(SIZE, 64, &|_| ()).expect("a picture");
        let of_column = |x: u32| -> f32 {
            let rows = (0..SIZE[1]).map(|y| picture.rgba[(x + SIZE[0] * y) as usize][1]);
            rows.sum()
        };
        (0..SIZE[0]).map(of_column).collect::<Vec<f32>>()
    };
    let lower: Vec<Vec3> = lower.collect();
    // Segments of nearly the same number are taken for those of one strand.
    let others = (0..9).map(|ix| Vec3::new(ix as f32, -9.0, 0.0)).collect();
    let grown = vec![lower, others, board];
    for is_sampled in [false, true] {
        let open = drawn(grown[..2].to_vec(), is_sampled);
        let shadowed = drawn(grown.clone(), is_sampled);
        let mut counts = [0; 2];
        for (x, (open, shadowed)) in open.iter().zip(&shadowed).enumerate() {
            let at = 0.1 * (x as f32 + 0.5) - 9.0;
            let share = shadowed / open;
            // From 0.5 to 3.5 cm; a place is 0.375 cm long.
            if (at - 2.0).abs() < 1.5 - 0.4 {
                assert!(share < 0.01, "{is_sampled} {at}: {share}");
                counts[0] += 1;
            } else if (at - 2.0).abs() > 1.5 + 0.4 && at.abs() < 8.5 {
                assert!((share - 1.0).abs() < 0.01, "{is_sampled} {at}: {share}");
                counts[1] += 1;
            }
        }
        assert!(counts[0] >= 20 && counts[1] > 100, "{counts:?}");
    }
}

#[test]
fn gpu_both_backends_answer_alike() {
    let context = context();
    let strands = wig_strands(600, 0.012);
    let lights = [
        light([0.6, 0.7, 0.5], 0.08, [60.0, 55.0, 45.0]),
        light([-0.7, 0.3, -0.6], 0.25, [8.0, 9.0, 14.0]),
        light([0.0, 1.0, 0.0], 1.4, [0.25, 0.3, 0.4]),
    ];
    let plan = ShadowPlan::new(&lights, &strands, 16);
    assert_eq!(plan.n_slots, 3);
    assert!(plan.views.len() > 10);
    let on_cpu = cpu::shadow_maps(&strands, &plan, EYE);
    let on_gpu = passes::shadow_maps(&context, &strands, &plan, EYE).unwrap();
    let n_points = strands.points.len();
    let shares = |visibility: &[u32], is_tt: bool| -> Vec<f32> {
        let slots = (0..plan.n_slots)
            .flat_map(|shadow_index| (0..n_points).map(move |p| (shadow_index, p)));
        slots
            .map(|(slot, point)| unblocked_share(visibility, n_points, slot, is_tt, point))
            .collect()
    };
    for is_tt in [false, true] {
        let error = relative_rmse(&shares(&on_gpu, is_tt), &shares(&on_cpu, is_tt));
        println!("TT {is_tt}: relative RMSE {error:.2e}");
        assert!(error < 2e-3, "{error}");
    }
    // The eye sees other light come through than arrives in the mean.
    let apart = relative_rmse(&shares(&on_cpu, true), &shares(&on_cpu, false));
    assert!(apart > 0.02, "{apart}");
}

#[test]
fn maps_go_to_the_lights_that_carry_most() {
    let strands = wig_strands(20, 0.012);
    let lights = [
        light([1.0, 0.0, 0.0], 0.5, [1.0; 3]),
        light([0.0, 1.0, 0.0], 0.5, [3.0; 3]),
        light([0.0, 0.0, 1.0], 0.05, [0.001; 3]),
        light([0.0, 1.0, 1.0], 0.001, [2e5; 3]),
    ];
    let plan = ShadowPlan::new(&lights, &strands, 40);
    let of = |ix: usize| {
        let views = plan
            .views
            .iter()
            .filter(|view| view.shadow_index == plan.slots[ix]);
        let weights: Vec<f32> = views.map(|view| view.weight).collect();
        (weights.len(), weights.iter().sum::<f32>())
    };
    let (counts, weights): (Vec<_>, Vec<_>) = [0, 1, 3].map(of).into_iter().unzip();
    assert!(weights.iter().all(|weight| (weight - 1.0).abs() < 1e-5));
    // The third is as good as black, the last as good as a point.
    assert_eq!(plan.slots[2], NO_SLOT);
    assert!(counts[1] > 2 * counts[0] && counts[2] == 1, "{counts:?}");
    let none = ShadowPlan::new(&lights, &strands, 0);
    assert!(none.views.is_empty() && none.slots == [NO_SLOT; 4]);
    assert!(cpu::shadow_maps(&strands, &none, EYE).is_empty());
}

/// They know no maps, and so no places along segments.
#[test]
fn earlier_methods_draw_suns() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let sun = SrbfLight {
        direction: [0.0, 0.6, 0.8],
        lambda: 0.01,
        rgb: [900.0; 3],
    };
    let hair = curtain(20, 6, 0.2, 0.0);
    let at = write_small_scene(folder.path(), &hair, vec![sun], |_| ());
    let scene = PreparedScene::load(&Scene::read(&at).expect("a scene")).expect("hair");
    let (lights, _) = scene.light_records();
    assert!(lights.iter().any(LightRecord::is_narrow));
    let mean = |method: Method| {
        let mut renderer = match method {
            Method::Sweep => cpu::CpuRenderer::by_samples(scene.clone()),
            _ => {
                let find = move |scene: &_, lights: &_| point_shadows(method, scene, lights);
                cpu::CpuRenderer::with_shadows(scene.clone(), Box::new(find))
            }
        };
        let (picture, _) = renderer.render([24, 16], 4, &|_| ()).expect("a picture");
        let all: f32 = picture.rgba.iter().map(|rgba| rgba[0]).sum();
        all / picture.rgba.len() as f32
    };
    let sweep = mean(Method::Sweep);
    assert!(sweep > 0.0);
    for method in Method::ALL {
        let found = mean(method) / sweep;
        assert!((0.5..2.0).contains(&found), "{method:?}: {found}");
    }
}

/// `bench transmittance` has the Fresnel term of the scene's tables.
#[test]
fn what_is_measured_has_the_fresnel_term_of_the_tables() {
    let options = TransmittanceOptions {
        n_points: 40,
        n_rays: 64,
        seed: 1,
        methods: Vec::new(),
        sides: Vec::new(),
        directions: Vec::new(),
    };
    let hair = HairParams::default();
    let file = TableFile::from_bytes(DEFAULT_TABLES).expect("part of the project");
    let forward = |fresnel| {
        let lobes = LobeTables::from_file(&file, &Lobe::ALL).expect("all lobes");
        let lights = vec![light([0.0, 0.3, 1.0], 0.5, [1.0; 3])];
        let mut scene = scene(wig_strands(300, 0.2), lights, &hair);
        scene.hair = HairMaterial::new(lobes.into(), fresnel, &hair, &Lobe::ALL, 4)
            .expect("valid parameters");
        let measured = run_transmittance(&scene, &options, |_, _| Progress::silent());
        measured.rows[0].classes[3].forward.mean
    };
    let [dielectric, schlick] = [Fresnel::Dielectric, Fresnel::Schlick].map(forward);
    // Both terms are close, and the rays are the same.
    assert!(dielectric > 0.0 && dielectric != schlick, "{dielectric}");
}
