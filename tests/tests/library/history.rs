//! The history of a document: its steps, and going to any of them.

use std::time::Duration;

use strandlight_formats::Background;
use strandlight_runtime::{BackendChoice, Chosen, CpuReason, Display, Session, Viewer};
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};

fn finished(viewer: &mut Viewer) -> Vec<[u8; 4]> {
    while !viewer
        .advance(Duration::from_millis(5))
        .expect("drawn")
        .is_done
    {}
    match viewer.display() {
        Display::Pixels(display) => display.pixels.to_vec(),
        Display::Texture(_) => panic!("the CPU has no textures"),
    }
}

#[test]
fn every_step_is_gone_to_in_one_go() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = write_small_scene(
        folder.path(),
        &curtain(80, 5, 0.05, 2.0),
        key_and_sky(),
        |s| {
            s.hair.diameter_cm = Some(0.06);
            s.render.size = [40, 30];
            s.render.background = Background::Color([0.1, 0.2, 0.3]);
        },
    );
    let session = Session::open(&path).expect("a scene");
    let chosen = Chosen::Cpu(CpuReason::Asked);
    let mut viewer = Viewer::choose(BackendChoice::Cpu, chosen, session).expect("drawn");
    let mut pictures = vec![finished(&mut viewer)];
    let mut states = vec![viewer.session().state_after(0)];
    for label in ["IOR", "Rotate", "Diameter", "Exposure"] {
        let edited = viewer.edit(label, |scene| match label {
            "IOR" => scene.hair.eta = 1.8,
            "Rotate" => scene.lights.rotate_deg = 90.0,
            "Diameter" => scene.hair.diameter_cm = Some(0.09),
            _ => scene.render.exposure = 1.0,
        });
        edited.expect("valid");
        viewer.commit();
        pictures.push(finished(&mut viewer));
        let n_done = viewer.session().n_done();
        states.push(viewer.session().state_after(n_done));
    }
    let steps: Vec<(String, u64)> = viewer
        .session()
        .steps()
        .map(|(label, state)| (label.to_owned(), state))
        .collect();
    let labels: Vec<&str> = steps.iter().map(|(label, _)| label.as_str()).collect();
    assert_eq!(labels, ["IOR", "Rotate", "Diameter", "Exposure"]);
    assert!(steps.iter().map(|(_, state)| state).eq(&states[1..]));
    // There and back, any number of steps at once; the steps stay.
    for n_done in [0, 4, 1, 3, 2, 0] {
        let change = viewer.go_to(n_done).expect("drawn");
        assert!(change.is_some_and(|change| !change.is_empty()), "{n_done}");
        assert_eq!(viewer.session().n_done(), n_done);
        assert_eq!(viewer.session().state_after(n_done), states[n_done]);
        assert!(finished(&mut viewer) == pictures[n_done], "{n_done}");
        assert_eq!(viewer.session().steps().count(), 4);
    }
    assert!(viewer.go_to(0).expect("drawn").is_none());
    // Beyond the last is the last.
    viewer.go_to(9).expect("drawn");
    assert!(finished(&mut viewer) == pictures[4]);
    // An edit of an older state forgets what followed it, and has a number of its own.
    viewer.go_to(1).expect("drawn");
    viewer
        .edit("Exposure", |scene| scene.render.exposure = 1.0)
        .expect("valid");
    assert_eq!(viewer.session().n_done(), 2);
    assert!(!states.contains(&viewer.session().state_after(2)));
}
