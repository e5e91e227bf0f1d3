use glam::Vec3;
use strandlight_formats::SrbfLight;
use strandlight_scattering::closed_form::P_1;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::strands::Strands;
use strandlight_scene::volume::sweep_directions;

use super::*;
use strandlight_scattering::random::SplitMix64;

/// Straight fibres along x and y in a slab of a side of 4 cm, 2 cm deep.
fn slab(n: usize) -> Strands {
    let random = &mut SplitMix64(7);
    let (mut points, mut offsets) = (Vec::new(), vec![0_u32]);
    for fibre in 0..n {
        let (y, z) = (
            random.uniform(-2.0, 2.0) as f32,
            random.uniform(-1.0, 1.0) as f32,
        );
        for ix in 0..=8 {
            let x = 0.5 * ix as f32 - 2.0;
            points.push(if fibre % 2 == 0 { [x, y, z] } else { [y, x, z] });
        }
        offsets.push(points.len() as u32);
    }
    Strands::new(&points, &offsets, |_, _| 0.008, false).unwrap()
}

fn light(lambda: f32) -> (LightRecord, Vec<[f32; 4]>) {
    let light = SrbfLight {
        direction: [0.0, 0.0, 1.0],
        lambda,
        rgb: [1.0; 3],
    };
    let directions: Vec<[f32; 4]> = sweep_directions(&light)
        .iter()
        .map(|&[x, y, z]| [x, y, z, 0.0])
        .collect();
    let record = LightRecord {
        direction: light.direction,
        lambda,
        rgb: light.rgb,
        power: 1.0,
        first_sweep: 0,
        n_sweeps: directions.len() as u32,
        solid_angle: 1.0,
        shadow_index: strandlight_scene::shadow_maps::NO_SLOT,
        record: 0,
        first_map: 0,
        n_maps: 0,
        pad: 0,
    };
    (record, directions)
}

#[test]
fn all_methods_agree_on_a_slab() {
    // Optical depth of the whole slab: 1000 fibres of 0.008 cm over 4 cm.
    let strands = slab(1000);
    let (light, directions) = light(0.05);
    for method in Method::ALL {
        let builder = ShadowBuilder::new(method, &strands);
        let light_shadows = builder.light_shadows(&light, &directions);
        let (mut sum, mut expected, mut n) = ([0.0; 2], [0.0; 2], 0.0);
        for (point, &[x, y, z, _]) in strands.points.iter().enumerate() {
            if Vec3::new(x, y, 0.0).abs().max_element() > 1.2 {
                continue;
            }
            let record = light_shadows.record(point as u32);
            let depth = 2.0 * (1.0 - f64::from(z)) / 2.0;
            for (k, p) in [1.0, P_1].into_iter().enumerate() {
                sum[k] += f64::from(record.shares[k]);
                expected[k] += (-f64::from(p) * depth).exp();
            }
            assert!(record.sin_theta < 0.1, "{method:?} {record:?}");
            n += 1.0;
        }
        for k in 0..2 {
            let bias = (sum[k] - expected[k]) / n;
            println!("{method:?} {k} {bias:.4}");
            assert!(bias.abs() < 0.04, "{method:?} {k} {bias}");
        }
    }
}

#[test]
fn methods_have_names_of_their_own() {
    for method in Method::ALL {
        let same = Method::ALL
            .iter()
            .filter(|other| other.name() == method.name());
        assert_eq!(same.count(), 1);
    }
}
