//! Hair that moves: wind on the CPU and on the GPU, and sequences of grooms.

use std::time::Duration;

use glam::Vec3;
use strandlight_formats::{BakedFile, Groom, Scene, WindSection};
use strandlight_render::{Backend, ProgressiveRenderer};
use strandlight_scene::motion::{Motion, Wind, wind};
use strandlight_scene::strands::Strands;
use strandlight_scene::{PreparedScene, files::Files};
use strandlight_tests::render_common::{context, picture_rmse, wig, wig_scene};

fn breeze() -> WindSection {
    WindSection {
        speed: 5.0,
        seed: 3,
        ..WindSection::default()
    }
}

fn in_wind() -> PreparedScene {
    let mut scene = wig_scene(300);
    scene.strands = wind::with_room(&breeze(), (*scene.strands).clone()).into();
    scene
}

#[test]
fn without_wind_the_hair_is_at_rest() {
    let rest = in_wind().strands;
    let calm = WindSection {
        speed: 0.0,
        ..breeze()
    };
    let points = wind::deformed(&Wind::at(&calm, &rest, 3.0), &rest);
    assert_eq!(points, rest.points);
}

#[test]
fn roots_stay_lengths_are_kept_and_tips_move() {
    let rest = in_wind().strands;
    for seconds in [0.0, 1.3, 500_000.0] {
        let blown = wind::strands_at(&breeze(), &rest, seconds).unwrap();
        let (mut worst, mut most): (f32, f32) = (0.0, 0.0);
        for [first, n] in rest.ranges() {
            let range = first as usize..(first + n) as usize;
            let (before, after) = (&rest.points[range.clone()], &blown.points[range]);
            assert_eq!(before[0], after[0]);
            for (a, b) in before.windows(2).zip(after.windows(2)) {
                let length =
                    |p: &[[f32; 4]]| Vec3::from_slice(&p[0]).distance(Vec3::from_slice(&p[1]));
                worst = worst.max((length(b) / length(a) - 1.0).abs());
            }
            let last = n as usize - 1;
            let moved = Vec3::from_slice(&after[last]) - Vec3::from_slice(&before[last]);
            most = most.max(moved.length());
        }
        println!("at {seconds} s: lengths within {worst:.1e}, tips moved up to {most:.1} cm");
        assert!(worst < 1e-3, "{worst}");
        assert!(most > 2.0, "{most}");
    }
}

#[test]
fn the_same_seed_blows_alike_and_time_goes_on() {
    let rest = in_wind().strands;
    let at =
        |section: &WindSection, seconds| wind::deformed(&Wind::at(section, &rest, seconds), &rest);
    assert_eq!(at(&breeze(), 2.0), at(&breeze(), 2.0));
    let other = WindSection {
        seed: 4,
        ..breeze()
    };
    assert_ne!(at(&breeze(), 2.0), at(&other, 2.0));
    let far = |a: &[[f32; 4]], b: &[[f32; 4]]| {
        let apart =
            |(a, b): (&[f32; 4], &[f32; 4])| Vec3::from_slice(a).distance(Vec3::from_slice(b));
        a.iter().zip(b).map(apart).fold(0.0, f32::max)
    };
    let now = at(&breeze(), 2.0);
    // No jumps, where cells end neither: hair goes no faster than the wind.
    for ix in 0..40 {
        let seconds = 2.0 + 0.37 * f64::from(ix);
        let step = far(&at(&breeze(), seconds), &at(&breeze(), seconds + 1e-3));
        assert!(step < 0.5, "{seconds}: {step}");
    }
    assert!(far(&now, &at(&breeze(), 2.5)) > 0.3);
}

#[test]
fn hair_stays_in_the_space_that_was_measured() {
    let rest = in_wind().strands;
    let (low, high) = rest.bounds;
    let (mut n, mut n_out) = (0, 0);
    for ix in 0..10 {
        let points = wind::deformed(
            &Wind::at(&breeze(), &rest, 60.0 + 1.7 * f64::from(ix)),
            &rest,
        );
        for p in &points {
            let p = Vec3::from_slice(p);
            n += 1;
            n_out += usize::from(p.cmplt(low).any() || p.cmpgt(high).any());
        }
    }
    assert!(n_out * 1000 < n, "{n_out} of {n} points");
}

#[test]
fn gpu_bends_and_lights_the_hair_as_the_cpu_says() {
    let context = context();
    let mut scene = in_wind();
    let rest = scene.strands.clone();
    scene.size = [96, 72];
    scene.samples = 16;
    let mut progressive = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    for seconds in [0.4, 2.9] {
        progressive
            .set_wind(Some(Wind::at(&breeze(), &rest, seconds)))
            .unwrap();
        while !progressive.advance(Duration::from_secs(1)).unwrap().is_done {}
        let moved = progressive.finish(16).unwrap();
        scene.strands = wind::strands_at(&breeze(), &rest, seconds).unwrap().into();
        let mut fresh = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
        let (expected, _) = fresh.render_to_image(&scene.camera, [96, 72], 16).unwrap();
        let error = picture_rmse(&moved, &expected);
        println!("at {seconds} s: relative RMSE {error:.2e}");
        assert!(error < 0.01, "{error}");
    }
    // And back to rest.
    progressive.set_wind(None).unwrap();
    while !progressive.advance(Duration::from_secs(1)).unwrap().is_done {}
    let calm = progressive.finish(16).unwrap();
    scene.strands = rest;
    let mut fresh = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let (expected, _) = fresh.render_to_image(&scene.camera, [96, 72], 16).unwrap();
    assert!(picture_rmse(&calm, &expected) < 0.01);
}

/// A groom, the same raised by 1 cm, and one of other strands, in memory.
fn files() -> (Scene, Files, Strands) {
    let (points, offsets) = wig(20, 12);
    let groom = Groom {
        points: points.clone(),
        strand_offsets: offsets.clone(),
        ..Groom::default()
    };
    let mut raised = groom.clone();
    for point in &mut raised.points {
        point[1] += 1.0;
    }
    let (other_points, other_offsets) = wig(10, 24);
    let other = Groom {
        points: other_points,
        strand_offsets: other_offsets,
        ..Groom::default()
    };
    let bytes = |groom: &Groom| groom.to_bytes().unwrap();
    let files = Files::in_memory([
        ("a.groom", bytes(&groom)),
        ("b.groom", bytes(&raised)),
        ("other.groom", bytes(&other)),
    ]);
    let text = "version = 1\n[groom]\nfile = 'a.groom'\n[lights]\nfile = 'x.lights'\n[motion]\n\
                frames = ['a.groom', 'b.groom', 'a.groom', 'other.groom', 'none.groom']\nfps = 10\n";
    let strands = Strands::new(&points, &offsets, |_, _| 0.01, true).unwrap();
    (Scene::from_toml(text).unwrap(), files, strands)
}

#[test]
fn sequences_go_straight_from_frame_to_frame() {
    let (scene, files, rest) = files();
    let mut motion = Motion::new(&scene, &files).unwrap();
    for (seconds, height) in [
        (0.0, 0.0),
        (0.05, 0.5),
        (0.1, 1.0),
        (0.175, 0.25),
        (0.0, 0.0),
    ] {
        let moved = motion.strands_at(&rest, seconds).unwrap();
        for (now, before) in moved.points.iter().zip(&rest.points) {
            let off = now[1] - before[1] - height;
            assert!(off.abs() < 1e-4, "{seconds}: {off}");
        }
    }
    assert_eq!(motion.strands_at(&rest, 0.0).unwrap().points, rest.points);
}

#[test]
fn frames_of_other_strands_are_named() {
    let (scene, files, rest) = files();
    let mut motion = Motion::new(&scene, &files).unwrap();
    for (seconds, names) in [
        (0.25, ["frames[3]", "other.groom"]),
        (9.0, ["frames[4]", "none.groom"]),
    ] {
        let error = motion.strands_at(&rest, seconds).unwrap_err().to_string();
        assert!(names.iter().all(|name| error.contains(name)), "{error}");
    }
}
