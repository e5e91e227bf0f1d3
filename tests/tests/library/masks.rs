//! A mask keeps brushes of scripts off hair, and is in no picture.

use serde_json::{Value, json};
use strandlight_cpu::CpuRenderer;
use strandlight_runtime::script::Script;
use strandlight_runtime::{ScriptError, Session, Viewer};
use strandlight_scene::Picture;
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};

const SIZE: [u32; 2] = [24, 16];

fn run(viewer: &mut Viewer<CpuRenderer>, steps: Value) -> Picture {
    let script = Script::from_json(&steps.to_string()).expect("valid");
    let done = script.run(viewer, |_, _| Ok::<(), ScriptError>(()));
    done.expect("valid steps");
    viewer.frame(SIZE, 4).expect("a picture").0
}

#[test]
fn masks_limit_the_brushes_of_scripts_and_change_no_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = write_small_scene(
        folder.path(),
        &curtain(12, 10, 0.4, 4.0),
        key_and_sky(),
        |_| (),
    );
    let session = Session::open(&scene).expect("a scene");
    let viewer = Viewer::on(session, |scene| Ok(Box::new(CpuRenderer::new(scene))));
    let mut viewer = viewer.expect("drawable");
    let bare = run(&mut viewer, json!([]));

    // The tips, by the part of the strands that a brush works on.
    let tips = json!({"effect": {"protect": 1}, "mask": {"from": 0.5, "to": 1, "soft": 0}});
    let masked = run(&mut viewer, json!([{ "flood": tips }]));
    assert!(masked == bare, "a mask is in no picture");
    assert!(viewer.session().is_masked());
    assert!(viewer.prepared().paint().is_none(), "no painted shading");
    let protected = viewer.session().mask().expect("a mask").points.clone();
    assert!(protected.contains(&0.0) && protected.contains(&1.0));

    let dye = json!({"flood": {"effect": {"dye": [3, 0.2, 0.1]}}});
    let dyed = run(&mut viewer, json!([dye]));
    assert!(dyed != bare);
    let weights = |viewer: &Viewer<CpuRenderer>| -> Vec<f32> {
        let paint = viewer.session().paint().expect("painted");
        paint.points.iter().map(|point| point.weight).collect()
    };
    let opposite: Vec<f32> = protected.iter().map(|mask| 1.0 - mask).collect();
    assert_eq!(weights(&viewer), opposite);

    // The other way round, an eraser finds nothing; without a mask it does.
    let erase = json!({"flood": {"effect": "erase"}});
    let invert = json!({"flood": {"effect": "invert_protection"}});
    let same = run(&mut viewer, json!([invert, erase]));
    assert!(same == dyed);
    let stroke = json!({"stroke": {"brush": {"effect": {"protect": 0}, "radius_cm": 1, "softness": 0},
                                   "path": [[0, 3, 0]]}});
    run(&mut viewer, json!([stroke]));
    let released = viewer.session().mask().expect("a mask").points.clone();
    assert!(released != opposite && viewer.session().is_masked());
    run(
        &mut viewer,
        json!([{"flood": {"effect": {"protect": 0}}}, erase]),
    );
    assert!(!viewer.session().is_masked());
    assert!(weights(&viewer).iter().all(|&weight| weight == 0.0));
    // The steps before: eraser, mask cleared, stroke. Each is one.
    run(&mut viewer, json!([{"undo": 3}]));
    assert_eq!(weights(&viewer), opposite);
    let mask = viewer.session().mask().expect("a mask");
    assert_eq!(mask.points, opposite);
}
