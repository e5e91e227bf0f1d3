//! The map behind the hair in pictures of the CPU, against a direct evaluation.

use strandlight_cpu::CpuRenderer;
use strandlight_formats::{Background, BakedFile, Scene};
use strandlight_reference::Backdrop;
use strandlight_scene::{Backend, Picture, PreparedScene};
use strandlight_tests::panoramas::{seen, striped};
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};

const SIZE: [u32; 2] = [60, 40];

fn draw(scene: &PreparedScene) -> Picture {
    let drawn = CpuRenderer::new(scene.clone()).render(SIZE, 16, &|_| ());
    drawn.expect("a picture").0
}

#[test]
fn pictures_show_the_map_where_it_is() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let map = striped(128);
    map.write(&folder.path().join("a.panorama"))
        .expect("written");
    let hair = curtain(30, 8, 0.1, 2.0);
    let at = write_small_scene(folder.path(), &hair, key_and_sky(), |scene| {
        scene.lights.panorama = Some("a.panorama".into());
        scene.render.background = Background::Panorama;
    });
    let mut scene = Scene::read(&at).expect("a scene");
    let mut n_empty = 0;
    for (degrees, intensity, tint) in [
        (0.0, 1.0, [1.0; 3]),
        (77.0, 2.5, [1.0, 0.5, 0.25]),
        (-400.0, 0.1, [2.0, 1.0, 0.0]),
    ] {
        (scene.lights.rotate_deg, scene.lights.intensity) = (degrees, intensity);
        scene.lights.tint = tint;
        // Of lights alone.
        scene.lights.muted = vec![0];
        let mut prepared = PreparedScene::load(&scene).expect("hair");
        let whole = draw(&prepared);
        let behind = Backdrop::of(&prepared, SIZE);
        prepared.background = Background::None;
        let alone = draw(&prepared);
        let (right, up, forward) = prepared.camera.axes();
        let axes = [right, up, forward].map(|axis| axis.as_dvec3());
        let half = 0.5 * f64::from(SIZE[1]);
        let focal = half / (0.5 * f64::from(prepared.camera.fov_y)).tan();
        for (ix, (found, hair)) in whole.rgba.iter().zip(&alone.rgba).enumerate() {
            let x = (ix as u32 % SIZE[0]) as f64 + 0.5 - 0.5 * f64::from(SIZE[0]);
            let y = half - (ix as u32 / SIZE[0]) as f64 - 0.5;
            let way = axes[0] * x + axes[1] * y + axes[2] * focal;
            let radiance = seen(&map, degrees, way.normalize().to_array());
            n_empty += usize::from(hair[3] == 0.0);
            assert_eq!(found[3], 1.0);
            for c in 0..3 {
                let there = radiance[c] * intensity * tint[c];
                let wanted = f64::from(hair[c]) + f64::from(1.0 - hair[3]) * there;
                let most = 1e-4 * (1.0 + wanted);
                let off = (f64::from(found[c]) - wanted).abs();
                assert!(off < most, "{degrees}: pixel {ix}: {} {wanted}", found[c]);
            }
        }
        // What ground truth is composed over is the same.
        assert_eq!(behind, {
            prepared.background = Background::Panorama;
            Backdrop::of(&prepared, SIZE)
        });
    }
    assert!(n_empty > 1000, "{n_empty} pixels show nothing but the map");
}

#[test]
fn a_map_that_is_not_seen_is_not_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let hair = curtain(3, 4, 0.1, 2.0);
    let at = write_small_scene(folder.path(), &hair, key_and_sky(), |scene| {
        scene.lights.panorama = Some("gone.panorama".into());
    });
    let mut scene = Scene::read(&at).expect("a scene");
    for background in [
        Background::Lights,
        Background::None,
        Background::Color([0.5; 3]),
    ] {
        scene.render.background = background;
        let prepared = PreparedScene::load(&scene).expect("no map is needed");
        assert_eq!(prepared.panorama, None);
    }
    scene.render.background = Background::Panorama;
    let error = PreparedScene::load(&scene).expect_err("there is none");
    let error = error.to_string();
    for needle in ["lights.panorama", "gone.panorama"] {
        assert!(error.contains(needle), "{error}");
    }
    // Another kind of file in its place is called by its name.
    scene.lights.panorama = Some("a.lights".into());
    let error = PreparedScene::load(&scene).expect_err("a light set");
    assert!(error.to_string().contains("not a panorama"), "{error}");
}
