//! The renderer in a thread of its own shows in the end what it shows without, whenever edits come.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use strandlight_cpu::{BackgroundRenderer, CpuRenderer, InteractiveRenderer};
use strandlight_formats::{ProxySection, Scene, WindSection};
use strandlight_scene::motion::Wind;
use strandlight_scene::motion::wind::bent_strands;
use strandlight_scene::{Backend, PreparedScene};
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};

/// Long enough for anything that these scenes wait for.
const LONG: Duration = Duration::from_secs(60);

fn scene() -> PreparedScene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let hair = curtain(20, 6, 0.2, 0.0);
    let at = write_small_scene(folder.path(), &hair, key_and_sky(), |scene| {
        scene.render.size = [48, 32];
        scene.proxies = vec![ProxySection::ellipsoid([2.0, -2.0, 0.0], [1.0, 2.0, 1.0])];
    });
    PreparedScene::load(&Scene::read(&at).expect("a scene")).expect("hair")
}

fn finish(live: &mut BackgroundRenderer) {
    while !live.advance(LONG).expect("a picture").is_done {}
    assert!(live.progress().is_shown && live.progress().is_shaded);
}

type Edit = (&'static str, fn(&mut dyn Backend, &PreparedScene));

/// One of each setter.
const EDITS: [Edit; 11] = [
    ("hair", |live, _| {
        let mut hair = *live.scene().hair.hair();
        hair.eta += 0.05;
        let modes = live.scene().hair.modes().to_vec();
        live.set_hair(&hair, &modes).expect("in range");
    }),
    ("view", |live, scene| {
        let mut camera = scene.camera;
        camera.eye.x += 0.5;
        live.set_camera(camera);
    }),
    ("colours", |live, scene| {
        let rgb: Vec<[f32; 3]> = scene.lights.iter().map(|_| [1.0, 0.5, 0.2]).collect();
        live.set_light_colors(&rgb).expect("as many");
    }),
    ("lights", |live, scene| {
        let mut lights = scene.lights.clone();
        lights.swap(0, 1);
        lights.push(lights[0]);
        live.set_lights(lights).expect("lights");
    }),
    ("densities", |live, _| live.set_densities([0.5, 0.7])),
    ("wind", |live, scene| {
        let wind = Wind::at(&WindSection::default(), &scene.strands, 0.3);
        live.set_wind(Some(wind)).expect("in range");
    }),
    ("widths", |live, scene| {
        let radii: Vec<f32> = scene
            .strands
            .points
            .iter()
            .map(|point| 1.5 * point[3])
            .collect();
        live.set_radii(&radii).expect("as many");
    }),
    ("no wind", |live, _| {
        live.set_wind(None).expect("the strands before");
    }),
    ("exposure", |live, scene| {
        live.set_grade(1.0, scene.display.clone(), scene.background);
    }),
    ("proxies", |live, _| live.set_proxies(Vec::new())),
    ("size", |live, _| live.set_size([40, 30]).expect("a size")),
];

#[test]
fn edits_end_as_they_do_without_a_thread() {
    let scene = scene();
    // How often edits are looked after until the next: never, while something is under way, until all is done.
    for n_looks in [0, 3, usize::MAX] {
        let mut live = BackgroundRenderer::new(scene.clone());
        let mut inline = InteractiveRenderer::new(scene.clone());
        for (name, edit) in EDITS {
            edit(&mut live, &scene);
            edit(&mut inline, &scene);
            assert!(!live.progress().is_done, "{name}");
            for _ in 0..n_looks {
                if live.advance(LONG).expect("a picture").is_done {
                    break;
                }
            }
        }
        finish(&mut live);
        while !inline.advance(Duration::ZERO).expect("a step").is_done {}
        assert_eq!(live.display().size, [40, 30]);
        assert!(
            live.display().pixels == inline.display().pixels,
            "looked after {n_looks} times"
        );
        assert_eq!(live.scene().lights, inline.scene().lights);
        let size = [24, 16];
        let over_nothing = live.over_nothing(size).expect("a picture");
        assert!(over_nothing == inline.over_nothing(size).expect("a picture"));
        let (rendered, _) = live.render(size, 4, &|_| ()).expect("a picture");
        let mut fresh = CpuRenderer::new(inline.scene().clone());
        let (expected, _) = fresh.render(size, 4, &|_| ()).expect("a picture");
        assert!(rendered == expected);
    }
}

/// What was kept of lights that are all off now is that of another view.
#[test]
fn hair_without_light_is_black_from_everywhere() {
    let near = |scene: &PreparedScene| {
        let mut camera = scene.camera;
        camera.eye = camera.eye.lerp(camera.target, 0.7);
        camera
    };
    for n_maps in [0, 24] {
        let mut scene = scene();
        scene.shadow_maps = n_maps;
        let black = vec![[0.0; 3]; scene.lights.len()];
        for are_gone in [false, true] {
            let mut live = InteractiveRenderer::new(scene.clone());
            let mut finish = |edit: &dyn Fn(&mut InteractiveRenderer)| {
                edit(&mut live);
                while !live.advance(Duration::ZERO).expect("a step").is_done {}
                live.display().pixels.to_vec()
            };
            let lit = finish(&|live| live.set_camera(near(&scene)));
            let dark = finish(&|live| match are_gone {
                true => live.set_lights(Vec::new()).expect("no lights"),
                false => live.set_light_colors(&black).expect("as many"),
            });
            assert!(lit != dark);
            // More of the hair.
            let all = finish(&|live| live.set_camera(scene.camera));
            let mut fresh = scene.clone();
            fresh.set_light_colors(&black).expect("as many");
            let mut fresh = InteractiveRenderer::new(fresh);
            while !fresh.advance(Duration::ZERO).expect("a step").is_done {}
            assert!(all == fresh.display().pixels, "{n_maps} maps, {are_gone}");
        }
    }
}

/// Lights that are turned while they are off never show.
#[test]
fn edits_that_are_made_together_are_drawn_together() {
    let scene = scene();
    let black = vec![[0.0; 3]; scene.lights.len()];
    let mut live = BackgroundRenderer::new(scene.clone());
    live.set_light_colors(&black).expect("as many");
    finish(&mut live);
    let dark = live.display().pixels.to_vec();
    for ix in 0..scene.lights.len() {
        let mut lights = scene.lights.clone();
        lights[ix].direction = [0.0, 0.0, 1.0];
        live.set_lights(lights).expect("lights");
        // Time for the thread to look after edits.
        std::thread::sleep(Duration::from_millis(50));
        live.set_light_colors(&black).expect("as many");
        loop {
            let progress = live.advance(LONG).expect("a picture");
            assert!(live.display().pixels == dark, "{ix}");
            if progress.is_done {
                break;
            }
        }
    }
}

/// Whoever sets wind does not wait until strands are bent.
#[test]
fn strands_follow_the_wind_once_the_thread_has_bent_them() {
    let scene = scene();
    let mut live = BackgroundRenderer::new(scene.clone());
    finish(&mut live);
    for seconds in [0.3, 1.7] {
        let before = Arc::clone(&live.scene().strands);
        let wind = Wind::at(&WindSection::default(), &scene.strands, seconds);
        live.set_wind(Some(wind)).expect("in range");
        assert!(Arc::ptr_eq(&live.scene().strands, &before));
        finish(&mut live);
        let bent = bent_strands(&wind, &scene.strands).expect("in range");
        assert!(live.scene().strands.points == bent.points);
        live.set_wind(Some(wind)).expect("in range");
        assert!(live.progress().is_done, "it is the same wind");
    }
    live.set_wind(None).expect("the strands before");
    assert!(Arc::ptr_eq(&live.scene().strands, &scene.strands));
    finish(&mut live);
}

/// While a slider is dragged each frame brings an edit, and there are pictures all the same.
#[test]
fn drags_show_pictures() {
    let scene = scene();
    let mut live = BackgroundRenderer::new(scene.clone());
    finish(&mut live);
    let mut n_pictures = 0;
    for ix in 1..=40 {
        let mut hair = *live.scene().hair.hair();
        hair.sigma_a = [0.2 + 0.01 * f64::from(ix); 3];
        let modes = live.scene().hair.modes().to_vec();
        live.set_hair(&hair, &modes).expect("in range");
        let version = live.display().version;
        live.advance(LONG).expect("a picture");
        n_pictures += usize::from(live.display().version != version);
    }
    assert!(n_pictures >= 5, "{n_pictures} pictures");
    finish(&mut live);
}

/// A turned view is seen as the last picture shows it before its own picture is worked on. Where this thread is late it may have been
/// worked on by then, but hardly each time.
#[test]
fn turned_views_are_seen_before_they_are_worked_on() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let hair = curtain(400, 40, 0.2, 0.0);
    let at = write_small_scene(folder.path(), &hair, key_and_sky(), |scene| {
        scene.render.size = [192, 128];
    });
    let scene = PreparedScene::load(&Scene::read(&at).expect("a scene")).expect("hair");
    let mut live = BackgroundRenderer::new(scene.clone());
    let mut n_seen = 0;
    for ix in 1..=20 {
        finish(&mut live);
        let mut camera = scene.camera;
        camera.eye.x += 0.02 * ix as f32;
        live.set_camera(camera);
        let version = live.display().version;
        let progress = live.advance(LONG).expect("a picture");
        let ran = |name: &str| live.report().stages.iter().any(|stage| stage.name == name);
        if live.display().version != version && ran("reproject") && !ran("list") {
            assert!(progress.is_shown && !progress.is_shaded);
            n_seen += 1;
        }
    }
    assert!(n_seen > 0);
    finish(&mut live);
}

/// What cannot be drawn is told whenever somebody asks, and a scene that can is drawn then.
#[test]
fn errors_are_told_until_they_are_mended() {
    let mut scene = scene();
    // So large that it takes samples, of which there are none.
    (scene.size, scene.samples) = ([6000, 6000], 0);
    let mut live = BackgroundRenderer::new(scene);
    while let Ok(progress) = live.advance(LONG) {
        assert!(!progress.is_done && !progress.is_shown);
    }
    for _ in 0..3 {
        let error = live.advance(Duration::ZERO).expect_err("no samples");
        assert!(error.to_string().contains("samples"), "{error}");
    }
    live.set_size([24, 16]).expect("a size");
    finish(&mut live);
    assert_eq!(live.display().size, [24, 16]);
}

/// A side of zero: nothing is drawn, and nobody waits.
#[test]
fn hidden_windows_rest() {
    let mut live = BackgroundRenderer::new(scene());
    live.set_size([0, 16]).expect("a size");
    assert!(live.advance(LONG).expect("nothing").is_done);
    live.set_size([24, 16]).expect("a size");
    finish(&mut live);
    assert_eq!(live.display().size, [24, 16]);
}

/// Nothing is drawn of a scene before somebody looks: its size may not be the window's.
#[test]
fn large_scenes_are_drawn_in_the_size_of_the_window() {
    let mut large = scene();
    // By samples it would take minutes.
    (large.size, large.samples) = ([8000, 6000], 64);
    let mut live = BackgroundRenderer::new(large.clone());
    live.set_size([24, 16]).expect("a size");
    finish(&mut live);
    assert_eq!(live.display().size, [24, 16]);
    live.set_scene(large).expect("a scene");
    assert!(!live.progress().is_shown && !live.progress().is_done);
    live.set_size([40, 30]).expect("a size");
    finish(&mut live);
    assert_eq!(live.display().size, [40, 30]);
}

/// Pictures can be asked for, and the renderer be gone, while it works.
#[test]
fn pictures_are_rendered_while_others_are_under_way() {
    let scene = scene();
    let size = [24, 16];
    let mut fresh = CpuRenderer::new(scene.clone());
    let (expected, _) = fresh.render(size, 4, &|_| ()).expect("a picture");
    for n_looks in 0..6 {
        let mut live = BackgroundRenderer::new(scene.clone());
        for _ in 0..n_looks {
            live.advance(LONG).expect("a picture");
        }
        let (rendered, _) = live.render(size, 4, &|_| ()).expect("a picture");
        assert!(rendered == expected, "after {n_looks} looks");
        live.set_densities([0.5, 0.5]);
        live.advance(Duration::ZERO).expect("a picture");
    }
}

/// A picture that fades in goes on where an edit changes nothing.
#[test]
fn edits_that_change_nothing_leave_pictures_alone() {
    let scene = scene();
    let edited = |is_repeated: bool| {
        let mut live = InteractiveRenderer::new(scene.clone());
        let mut hair = *scene.hair.hair();
        for eta in [1.5, 1.4] {
            hair.eta = eta;
            live.set_hair(&hair, scene.hair.modes()).expect("in range");
            while !live.advance(Duration::ZERO).expect("a step").is_done {
                if is_repeated {
                    live.set_hair(&hair, scene.hair.modes()).expect("in range");
                    live.set_wind(None).expect("none");
                }
            }
        }
        live.display().pixels.to_vec()
    };
    assert!(edited(true) == edited(false));
}

/// Shadow maps stay those of the lights as they were set, whatever their colours become.
#[test]
fn pictures_over_nothing_have_the_maps_that_are_shown() {
    let scene = scene();
    let mut live = InteractiveRenderer::new(scene.clone());
    let mut rgb: Vec<[f32; 3]> = scene.lights.iter().map(|light| light.rgb).collect();
    rgb[0] = [0.0; 3];
    live.set_light_colors(&rgb).expect("as many");
    while !live.advance(Duration::ZERO).expect("a step").is_done {}
    let shown = live.over_nothing(scene.size).expect("a picture");
    // It is drawn anew.
    live.render([24, 16], 4, &|_| ()).expect("a picture");
    let again = live.over_nothing(scene.size).expect("a picture");
    assert!(again == shown);
}

#[test]
fn the_share_of_a_picture_that_is_done_grows_to_all() {
    let shares = Mutex::new(Vec::new());
    let mut renderer = CpuRenderer::new(scene());
    let note = |share| shares.lock().expect("no panic").push(share);
    renderer.render([48, 32], 4, &note).expect("a picture");
    let shares = shares.into_inner().expect("no panic");
    assert!(shares.is_sorted(), "{shares:?}");
    assert_eq!(shares.last(), Some(&1.0));
}
