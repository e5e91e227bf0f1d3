//! Scenes whose strands vary: nothing is done for nothing, edits recompute what depends on them, and
//! moving hair keeps its shape.

use glam::Vec3;
use strandlight_cpu as cpu;
use strandlight_formats::{BakedFile, Groom, MotionSection, Scene, VariationSection, WindSection};
use strandlight_scene::{Picture, PreparedScene};
use strandlight_tests::render_common::{keep, picture_rmse};
use strandlight_tests::scenes::{curtain, key_and_sky, write_scene, write_small_scene};

const SIZE: [u32; 2] = [48, 32];

fn prepared(folder: &std::path::Path, change: impl FnOnce(&mut Scene)) -> PreparedScene {
    let hair = curtain(40, 8, 0.1, 0.0);
    let at = write_small_scene(folder, &hair, key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.08);
        change(scene);
    });
    PreparedScene::load(&Scene::read(at).expect("valid")).expect("a scene")
}

fn picture(scene: &PreparedScene) -> Picture {
    cpu::render(scene, &scene.camera, SIZE, 16)
        .expect("a picture")
        .0
}

#[test]
fn a_scene_that_does_not_vary_is_drawn_as_before_and_has_no_paint() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let plain = prepared(folder.path(), |_| ());
    let idle = prepared(folder.path(), |scene| {
        scene.variation.seed = 9;
        scene.variation.lock_size_cm = 0.5;
        scene.variation.frizz_length_cm = 0.2;
    });
    assert!(plain.paint().is_none() && idle.paint().is_none());
    assert!(idle.hair.paint().is_none() && idle.has_one_fibre());
    assert_eq!(idle.strands, plain.strands);
    let before = picture(&plain);
    assert!(picture(&idle) == before);
    // It is a comparison: each amount alone makes a difference.
    type Change = fn(&mut VariationSection);
    let changes: [(Change, bool); 9] = [
        (|it| it.melanin_strand = 0.3, true),
        (|it| it.melanin_lock = 0.3, true),
        (|it| it.redness_strand = 0.5, true),
        (|it| it.redness_lock = 0.5, true),
        (|it| it.roughness_strand = 0.3, true),
        (|it| it.roughness_lock = 0.3, true),
        (|it| it.grey = 0.2, true),
        (|it| it.clump = 0.5, false),
        (|it| it.frizz = 0.5, false),
    ];
    for (ix, (change, is_painted)) in changes.into_iter().enumerate() {
        let varied = prepared(folder.path(), |scene| change(&mut scene.variation));
        assert_eq!(varied.paint().is_some(), is_painted, "{ix}");
        assert_eq!(varied.strands == plain.strands, is_painted, "{ix}");
        let has_widths = varied.hair.paint().is_some_and(|kinds| kinds.widths);
        assert_eq!(has_widths, ix == 4 || ix == 5, "{ix}");
        let found = picture(&varied);
        keep(&format!("varied-{ix}"), &found);
        let error = picture_rmse(&found, &before);
        println!("{ix}: {:.2} %", 100.0 * error);
        assert!(error > 0.002, "{ix}: {error}");
    }
}

#[test]
fn varied_hair_is_drawn_alike_by_any_number_of_threads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [one, three] = [1, 3].map(|n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
        pool.expect("threads").install(|| {
            let scene = prepared(folder.path(), |scene| {
                let it = &mut scene.variation;
                (it.melanin_strand, it.melanin_lock, it.clump, it.frizz) = (0.3, 0.3, 0.5, 0.5);
            });
            picture(&scene)
        })
    });
    assert!(one == three);
}

#[test]
fn wind_bends_varied_hair_and_sequences_keep_its_shape() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let bent = |scene: &mut Scene| {
        (scene.variation.clump, scene.variation.frizz) = (0.4, 0.4);
        scene.variation.lock_size_cm = 0.5;
    };
    let rest = prepared(folder.path(), bent);
    let windy = |scene: &mut Scene| {
        bent(scene);
        scene.motion = Some(MotionSection {
            wind: Some(WindSection::default()),
            ..MotionSection::default()
        });
    };
    let blown = prepared(folder.path(), windy);
    let first = |scene: &PreparedScene| scene.strands.points[0];
    assert_eq!(first(&blown), first(&rest), "roots stay");
    assert_ne!(blown.strands.points, rest.strands.points);
    // A sequence: the groom, and the groom elsewhere.
    let hair = curtain(40, 8, 0.1, 0.0);
    let mut away = hair.clone();
    for point in &mut away.points {
        point[0] += 2.0;
    }
    let write = |name: &str, groom: &Groom| {
        groom.write(&folder.path().join(name)).expect("written");
    };
    write("0.groom", &hair);
    write("1.groom", &away);
    let mut scene = Scene::new("a.groom", "a.lights");
    scene.hair.diameter_cm = Some(0.08);
    bent(&mut scene);
    scene.motion = Some(MotionSection {
        frames: vec!["0.groom".into(), "1.groom".into()],
        fps: Some(1.0),
        wind: None,
    });
    let at = write_scene(folder.path(), "moving.toml", &scene);
    let scene = Scene::read(at).expect("valid");
    for (seconds, distance) in [(0.0, 0.0), (0.5, 1.0), (1.0, 2.0)] {
        let moved = PreparedScene::load_at(&scene, seconds).expect("a scene");
        let pairs = moved.strands.points.iter().zip(&rest.strands.points);
        assert_eq!(moved.strands.points.len(), rest.strands.points.len());
        for (found, expected) in pairs {
            let place = Vec3::from_slice(expected) + distance * Vec3::X;
            let error = Vec3::from_slice(found).distance(place);
            assert!(error < 1e-4, "{seconds}: {error}");
        }
    }
}
