//! A page with a worker shows what a page without one shows, whatever is edited.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::path::Path;
use std::rc::Rc;
use std::time::Duration;

use serde_json::{Map, Value, json};
use strandlight_cpu::InteractiveRenderer;
use strandlight_formats::{BakedFile, Groom, LightSet, Mesh, SrbfLight};
use strandlight_scene::files::Files;
use strandlight_scene::paint::{Brush, BrushEffect};

use super::message::{Batch, Edit, decode};
use super::*;
use crate::choice::{BackendChoice, Chosen, CpuReason};
use crate::interactive::{Display, InteractiveBackend};
use crate::session::Session;
use crate::viewer::Viewer;

const SIZE: [u32; 2] = [40, 30];

/// Strands of some bends, and a head to be without.
fn groom(n_strands: u32, height: f32) -> Vec<u8> {
    let points = (0..n_strands).flat_map(|strand| {
        let x = 0.15 * strand as f32;
        (0..5).map(move |ix| {
            let along = ix as f32 / 4.0;
            [x + 0.3 * along * along, height * along, 0.2 * along]
        })
    });
    let groom = Groom {
        points: points.collect(),
        strand_offsets: (0..=n_strands).map(|strand| 5 * strand).collect(),
        ..Groom::default()
    };
    groom.to_bytes().expect("valid")
}

fn files() -> Files {
    let light = |direction, rgb| SrbfLight {
        direction,
        lambda: 0.5,
        rgb,
    };
    let lights = LightSet {
        lights: vec![
            light([0.0, 1.0, 0.0], [1.0; 3]),
            light([0.0, 0.0, 1.0], [2.0, 1.5, 1.0]),
        ],
        ..LightSet::default()
    };
    let head = |size: f32| {
        let corners = [[0.0, 0.0, -2.0], [size, 0.0, -2.0], [0.0, size, -2.0]];
        let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2]]).expect("a triangle");
        mesh.to_bytes().expect("valid")
    };
    let scene = "version = 1\n[groom]\nfile = 'a.groom'\n[lights]\nfile = 'b.lights'\n[hair]\ndiameter_cm = 0.05\n\
        [[proxy]]\nkind = 'mesh'\nmesh = 'head.mesh'\n";
    Files::in_memory([
        ("a.toml", scene.as_bytes().to_vec()),
        ("a.groom", groom(12, 2.0)),
        ("taller.groom", groom(9, 3.0)),
        ("b.lights", lights.to_bytes().expect("valid")),
        ("head.mesh", head(1.5)),
        ("other.mesh", head(2.5)),
        ("dark.cube", b"LUT_1D_SIZE 2\n0 0 0\n.5 .5 .5\n".to_vec()),
    ])
}

fn session() -> Session {
    Session::open_in(Path::new("a.toml"), files()).expect("a scene")
}

/// Page and worker in one thread. The worker works when the page looks for an answer.
#[derive(Clone, Default)]
struct Loopback(Rc<RefCell<Both>>);

#[derive(Default)]
struct Both {
    worker: Worker,
    answers: VecDeque<Result<Vec<u8>, String>>,
    /// Edits so far, by their names.
    sent: Vec<String>,
}

impl Link for Loopback {
    fn send(&mut self, message: Vec<u8>) {
        let mut both = self.0.borrow_mut();
        if !message.is_empty() {
            let (batch, _): (Batch, _) = decode(&message).expect("a message");
            let name = |edit: &Edit| {
                let text = format!("{edit:?}");
                let end = text.find(|c: char| !c.is_alphanumeric());
                text[..end.unwrap_or(text.len())].to_owned()
            };
            both.sent.extend(batch.edits.iter().map(name));
        }
        both.worker.take(&message);
    }

    fn take(&mut self) -> Option<Result<Vec<u8>, String>> {
        let mut both = self.0.borrow_mut();
        if both.answers.is_empty() && both.worker.is_working() {
            let answer = both.worker.work();
            both.answers.extend(answer.map(Ok));
        }
        both.answers.pop_front()
    }
}

fn viewer(
    open: impl FnOnce(strandlight_scene::PreparedScene) -> Box<dyn InteractiveBackend>,
) -> Viewer {
    let chosen = Chosen::Cpu(CpuReason::Asked);
    let viewer = Viewer::choose_from(BackendChoice::Cpu, chosen, session(), open);
    let mut viewer = viewer.expect("it is shown");
    viewer.set_window(SIZE).expect("a size");
    viewer
}

fn with_worker(link: &Loopback) -> Viewer {
    let mut ahead = link.clone();
    send_ahead(&mut ahead, Path::new("a.toml"), session().files()).expect("files");
    viewer(|scene| Box::new(WorkerRenderer::new(scene, Box::new(ahead))))
}

fn without_worker() -> Viewer {
    viewer(|scene| Box::new(InteractiveRenderer::new(scene)))
}

/// The finished picture.
fn picture(viewer: &mut Viewer) -> (Vec<[u8; 4]>, [u32; 2]) {
    for _ in 0..10_000 {
        let progress = viewer.advance(Duration::from_millis(1)).expect("a picture");
        if progress.is_done {
            assert!(progress.is_shown && progress.is_shaded);
            let Display::Pixels(display) = viewer.display() else {
                panic!("a picture in memory");
            };
            return (display.pixels.to_vec(), display.size);
        }
    }
    panic!("the picture is never finished");
}

fn set(viewer: &mut Viewer, values: Value) {
    let values: Map<String, Value> = serde_json::from_value(values).expect("an object");
    viewer.set(&values).expect("in range");
}

type Step = (&'static str, fn(&mut Viewer), &'static [&'static str]);

/// Edits, and what the worker is told of them.
const STEPS: [Step; 21] = [
    ("hair", |v| set(v, json!({ "hair.eta": 1.6 })), &["Hair"]),
    (
        "densities",
        |v| set(v, json!({ "hair.density_forward": 0.5 })),
        &["Densities"],
    ),
    (
        "terms",
        |v| set(v, json!({ "render.scattering": "single" })),
        &["Scattering"],
    ),
    (
        "terms again",
        |v| set(v, json!({ "render.scattering": "total" })),
        &["Scattering"],
    ),
    (
        "lights turned",
        |v| set(v, json!({ "lights.rotate_deg": 40.0 })),
        &["Lights", "LightColors"],
    ),
    (
        "light added",
        |v| {
            set(
                v,
                json!({ "lights.added": [{ "azimuth_deg": 90.0, "color": [1.0, 0.2, 0.1] }] }),
            )
        },
        &["Lights", "LightColors"],
    ),
    (
        "light off",
        |v| set(v, json!({ "lights.muted": [0] })),
        &["LightColors"],
    ),
    (
        "diameter",
        |v| set(v, json!({ "hair.diameter_cm": 0.08 })),
        &["Radii"],
    ),
    (
        "exposure",
        |v| set(v, json!({ "render.exposure": 0.7 })),
        &["Panorama", "Grade"],
    ),
    (
        "background",
        |v| set(v, json!({ "render.background": [0.1, 0.0, 0.2] })),
        &["Panorama", "Grade"],
    ),
    // Another file: the worker gets the scene anew, as seen and lit now.
    (
        "display transform",
        |v| set(v, json!({ "render.lut": "dark.cube" })),
        &[
            "Document",
            "LightColors",
            "Camera",
            "Size",
            "Panorama",
            "Grade",
        ],
    ),
    (
        "ground",
        |v| set(v, json!({ "proxy.0.albedo": [0.9, 0.1, 0.1] })),
        &["Proxies"],
    ),
    (
        "another mesh",
        |v| set(v, json!({ "proxy.0.mesh": "other.mesh" })),
        &["Document", "LightColors", "Camera", "Size", "Proxies"],
    ),
    (
        "view",
        |v| {
            let mut view = v.prepared().camera;
            view.eye.x += 1.0;
            v.set_view(view).expect("a view");
        },
        &["Camera"],
    ),
    (
        "size",
        |v| v.set_window([32, 36]).expect("a size"),
        &["Size"],
    ),
    ("paint", |v| flood(v, [0.9, 0.2, 0.1]), &["Paint"]),
    ("more paint", |v| flood(v, [0.1, 0.2, 2.0]), &["Paint"]),
    ("undone", undo, &["Paint"]),
    (
        "another groom",
        |v| set(v, json!({ "groom.file": "taller.groom" })),
        &["Document", "LightColors", "Camera", "Size"],
    ),
    (
        "groom undone",
        undo,
        &["Document", "LightColors", "Camera", "Size"],
    ),
    (
        "wind",
        |v| {
            set(v, json!({ "motion.wind": { "speed": 3.0 } }));
            v.set_time(0.4).expect("drawable");
        },
        &["Document", "LightColors", "Camera", "Wind", "Size", "Wind"],
    ),
];

fn undo(viewer: &mut Viewer) {
    viewer.undo().expect("drawable");
}

fn flood(viewer: &mut Viewer, sigma_a: [f32; 3]) {
    let brush = Brush {
        effect: BrushEffect::Dye(sigma_a),
        ..Brush::default()
    };
    viewer.flood(&brush).expect("paintable");
}

#[test]
fn every_edit_shows_what_it_shows_without_a_worker() {
    let link = Loopback::default();
    let (mut page, mut plain) = (with_worker(&link), without_worker());
    assert_eq!(picture(&mut page), picture(&mut plain));
    let mut before = picture(&mut plain);
    for (name, act, expected) in STEPS {
        link.0.borrow_mut().sent.clear();
        act(&mut page);
        act(&mut plain);
        let (of_page, of_plain) = (picture(&mut page), picture(&mut plain));
        assert_eq!(link.0.borrow().sent, expected, "{name}");
        assert!(of_page == of_plain, "{name}: another picture");
        assert!(of_page != before, "{name}: nothing has changed");
        before = of_plain;
        // Picks are of the hair as it is shown.
        let (of_page, of_plain) = (page.prepared(), plain.prepared());
        assert_eq!(of_page.strands.points, of_plain.strands.points, "{name}");
    }
}

/// Edits while a picture is made, and before anything was shown.
#[test]
fn edits_at_any_time_end_in_the_same_picture() {
    let (mut page, mut plain) = (with_worker(&Loopback::default()), without_worker());
    for (ix, (_, act, _)) in STEPS.into_iter().enumerate() {
        act(&mut page);
        act(&mut plain);
        for _ in 0..ix % 4 {
            page.advance(Duration::ZERO).expect("a picture");
        }
    }
    let [page, plain] = [&mut page, &mut plain].map(picture);
    assert!(page == plain);
}

#[test]
fn a_page_whose_worker_fails_draws_by_itself() {
    let mut plain = without_worker();
    let of_scene = picture(&mut plain);
    set(&mut plain, json!({ "hair.eta": 1.7 }));
    let edited = picture(&mut plain);
    // Before its first picture, and after.
    for is_late in [false, true] {
        let link = Loopback::default();
        let mut page = with_worker(&link);
        if is_late {
            assert!(picture(&mut page) == of_scene);
        }
        set(&mut page, json!({ "hair.eta": 1.7 }));
        link.0
            .borrow_mut()
            .answers
            .push_back(Err("it is gone".to_owned()));
        let version = page.display().version();
        assert!(picture(&mut page) == edited);
        assert!(!page.renderer().works_alone() && page.display().version() > version);
        // Nothing is sent any more.
        link.0.borrow_mut().sent.clear();
        set(&mut page, json!({ "hair.eta": 1.55 }));
        picture(&mut page);
        assert!(link.0.borrow().sent.is_empty());
    }
}

#[test]
fn what_the_worker_did_is_reported() {
    let (mut page, mut plain) = (with_worker(&Loopback::default()), without_worker());
    picture(&mut page);
    picture(&mut plain);
    let (of_page, of_plain) = (page.report(), plain.report());
    assert_eq!(of_page.stats.products(), of_plain.stats.products());
    assert_eq!(of_page.stats.visible_points, of_plain.stats.visible_points);
    assert_eq!(of_page.stats.points, of_plain.stats.points);
    let names = |viewer: &Viewer| -> Vec<_> {
        let stages = viewer.report().stages.iter();
        stages.map(|stage| stage.name).collect()
    };
    assert_eq!(names(&page), names(&plain));
    assert!(of_page.milliseconds() > 0.0);
}

#[test]
fn broken_messages_are_errors() {
    let sent = Rc::new(RefCell::new(Vec::new()));
    struct Kept(Rc<RefCell<Vec<Vec<u8>>>>);
    impl Link for Kept {
        fn send(&mut self, message: Vec<u8>) {
            self.0.borrow_mut().push(message);
        }
        fn take(&mut self) -> Option<Result<Vec<u8>, String>> {
            None
        }
    }
    let files = files();
    send_ahead(&mut Kept(sent.clone()), Path::new("a.toml"), &files).expect("files");
    let message = sent.borrow()[0].clone();
    for length in (1..200).chain([message.len() / 2, message.len() - 1]) {
        let mut worker = Worker::default();
        worker.take(&message[..length]);
        let answer = worker.work().expect("it says so");
        let (answer, _): (message::Answer, _) = decode(&answer).expect("an answer");
        let failure = answer.failure.expect("an error");
        assert!(failure.contains("message"), "{failure}");
        assert!(!worker.is_working());
    }
    let missing = send_ahead(&mut Kept(sent), Path::new("b.toml"), &files);
    assert!(missing.is_err());
}
