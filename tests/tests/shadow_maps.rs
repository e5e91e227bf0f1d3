//! Shadow maps that resolve fibres: against rays, and the GPU's against the CPU's.

mod render_common;

use glam::Vec3;
use render_common::{Random, context, light, relative_rmse, wig};
use strandlight_bake::cpu;
use strandlight_runtime::render;
use strandlight_runtime::shadow_maps::{NO_SLOT, ShadowPlan};
use strandlight_runtime::strands::Strands;

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

/// Whether a segment stands between `from` and the light: the ray passes its axis nearer than the
/// fibre's radius. Segments within `clear` along the ray do not count.
fn is_blocked(strands: &Strands, from: Vec3, towards: Vec3, clear: f32) -> bool {
    strands.segments.iter().any(|&segment| {
        let [a, b] = [0, 1].map(|end| {
            let [x, y, z, r] = strands.points[segment as usize + end];
            (Vec3::new(x, y, z) - from, r)
        });
        // In the plane across the ray the axis is a line.
        let flat = |p: Vec3| p - towards * p.dot(towards);
        let (flat_a, flat_b) = (flat(a.0), flat(b.0));
        let along = flat_b - flat_a;
        let t = -flat_a.dot(along) / along.length_squared().max(1e-20);
        if !(0.0..1.0).contains(&t) {
            return false;
        }
        let at = a.0.lerp(b.0, t);
        flat_a.lerp(flat_b, t).length() < a.1 && at.dot(towards) > clear
    })
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
        let lights = [light(direction, 0.02, [1.0; 3])];
        for (strands, least) in [(&straight, 1.0), (&arc, 0.995), (&helix, 0.97)] {
            let plan = ShadowPlan::new(&lights, strands, 1);
            let unblocked = cpu::shadow_maps(strands, &plan);
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
    let lights = [light([0.0, 1.0, 0.0], 0.01, [1.0; 3])];
    let plan = ShadowPlan::new(&lights, &strands, 4);
    assert_eq!(plan.views.len(), 1);
    let unblocked = cpu::shadow_maps(&strands, &plan);
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
    let strands = wig_strands(800, 0.03);
    let direction = Vec3::new(0.5, 0.6, 0.62).normalize();
    let lights = [light(direction.to_array(), 0.01, [1.0; 3])];
    let plan = ShadowPlan::new(&lights, &strands, 1);
    let found = cpu::shadow_maps(&strands, &plan);
    let mut random = Random(3);
    let (mut bias, mut square, mut mean, n) = (0.0, 0.0, 0.0, 1200);
    for _ in 0..n {
        let point = (random.next() * found.len() as f32) as usize;
        let at = |ix: usize| Vec3::from_slice(&strands.points[ix][..3]);
        let (before, after) = (strands.tangents[point][3], strands.normals[point][3]);
        let mut open = 0.0;
        for ix in 0..N_RAYS {
            let place = (ix as f32 + 0.5) / N_RAYS as f32 * (before + after) - before;
            let from = if place < 0.0 {
                at(point).lerp(at(point - 1), -0.5 * place / before)
            } else {
                at(point).lerp(at(point + 1), 0.5 * place / after)
            };
            open +=
                f32::from(u8::from(!is_blocked(&strands, from, direction, 0.05))) / N_RAYS as f32;
        }
        let error = f64::from(found[point] - open);
        bias += error / f64::from(n);
        square += error * error / f64::from(n);
        mean += f64::from(open) / f64::from(n);
    }
    let rms = square.sqrt();
    println!("mean {mean:.3}, bias {bias:.4}, RMS {rms:.4}");
    assert!(mean > 0.1 && mean < 0.9, "{mean}");
    assert!(bias.abs() < 0.01, "{bias}");
    assert!(rms < 0.1, "{rms}");
}

#[test]
fn both_backends_answer_alike() {
    let context = context();
    let strands = wig_strands(600, 0.012);
    let lights = [
        light([0.6, 0.7, 0.5], 0.08, [60.0, 55.0, 45.0]),
        light([-0.7, 0.3, -0.6], 0.25, [8.0, 9.0, 14.0]),
        light([0.0, 1.0, 0.0], 1.4, [0.25, 0.3, 0.4]),
    ];
    let plan = ShadowPlan::new(&lights, &strands, 16);
    assert_eq!((plan.slots[2], plan.n_slots), (NO_SLOT, 2));
    assert_eq!(plan.views.len(), 2 + 7);
    let on_cpu = cpu::shadow_maps(&strands, &plan);
    let on_gpu = render::shadow_maps(&context, &strands, &plan).unwrap();
    let error = relative_rmse(&on_gpu, &on_cpu);
    println!("relative RMSE {error:.2e}");
    assert!(error < 2e-3, "{error}");
    assert!(on_cpu.iter().all(|&x| (0.0..=1.001).contains(&x)));
}

#[test]
fn maps_go_to_the_most_powerful_narrow_lights() {
    let strands = wig_strands(20, 0.012);
    let lights = [
        light([1.0, 0.0, 0.0], 0.05, [1.0; 3]),
        light([0.0, 1.0, 0.0], 0.05, [30.0; 3]),
        light([0.0, 0.0, 1.0], 0.05, [0.001; 3]),
        light([0.0, 1.0, 1.0], 0.8, [1.0; 3]),
    ];
    let plan = ShadowPlan::new(&lights, &strands, 3);
    assert_eq!(plan.slots, [NO_SLOT, 0, NO_SLOT, NO_SLOT]);
    let total: f32 = plan.views.iter().map(|view| view.weight).sum();
    assert_eq!((plan.views.len(), total), (2, 1.0));
    let none = ShadowPlan::new(&lights, &strands, 0);
    assert!(none.views.is_empty() && none.slots == [NO_SLOT; 4]);
    assert!(cpu::shadow_maps(&strands, &none).is_empty());
}
