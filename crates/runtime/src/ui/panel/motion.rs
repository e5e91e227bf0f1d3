//! Hair that moves, and what stands in its light.

use egui::Ui;
use strandlight_formats::params::{MOTION, WIND};
use strandlight_formats::{
    Groom, MAX_PROXIES, MotionSection, ProxySection, Scene, WindSection, counted,
};

use crate::ui::field::{Changes, Field, named, row};
use crate::ui::orbit::Bounds;
use crate::ui::param::Rows;
use crate::ui::scalp;

/// The clock of the motion.
#[derive(Debug, Default)]
pub struct MotionState {
    /// It runs.
    pub is_playing: bool,
    /// Seconds since the start of the motion.
    pub seconds: f64,
    /// The wind that was switched off last.
    off: Option<WindSection>,
}

impl MotionState {
    /// Starts or stops the clock. A motion that is at its `end` restarts.
    pub fn toggle(&mut self, end: Option<f64>) {
        self.is_playing = !self.is_playing;
        if self.is_playing && end.is_some_and(|end| self.seconds >= end) {
            self.seconds = 0.0;
        }
    }

    /// Does the hair of `scene` move? The clock may run on where a scene lost its motion, as by undo.
    pub fn moves(&self, scene: &Scene) -> bool {
        self.is_playing && scene.motion.is_some()
    }

    /// Switches wind on, as it was before, or off. The clock stands until it is started.
    fn set_wind(&mut self, scene: &mut Scene, is_windy: bool) {
        let before = scene.motion.take().and_then(|motion| motion.wind);
        match is_windy {
            true => {
                scene.motion = Some(MotionSection {
                    wind: Some(self.off.clone().unwrap_or_default()),
                    ..MotionSection::default()
                });
            }
            false => self.off = before.or(self.off.take()),
        }
        self.is_playing = false;
    }
}

/// Seconds from the first frame of a sequence to the last; wind has no end.
pub fn end_of(scene: &Scene) -> Option<f64> {
    let motion = scene.motion.as_ref()?;
    let last = motion.frames.len().checked_sub(1)?;
    Some(last as f64 / motion.fps.unwrap_or(MotionSection::DEFAULT_FPS))
}

/// Wind, and the clock.
pub fn show(ui: &mut Ui, scene: &mut Scene, state: &mut MotionState, changes: &mut Changes) {
    let has_frames = (scene.motion.as_ref()).is_some_and(|motion| !motion.frames.is_empty());
    if !has_frames {
        let mut is_windy = scene.motion.is_some();
        let help = "Wind bends the hair; the groom file does not change.";
        named(ui, "Wind", help, |ui| {
            let box_ = ui.checkbox(&mut is_windy, "Enable wind");
            changes.place("Wind toggle", &box_);
            if box_.changed() {
                state.set_wind(scene, is_windy);
                changes.note("Wind");
            }
        });
    }
    let end = end_of(scene);
    let Some(motion) = &mut scene.motion else {
        return;
    };
    row(ui, |ui| {
        let text = if state.is_playing { "Pause" } else { "Play" };
        let button = ui.button(text).on_hover_text("Space");
        changes.place("Play button", &button);
        if button.clicked() {
            state.toggle(end);
        }
        if ui.button("Rewind").on_hover_text("Return to 0 s").clicked() {
            state.seconds = 0.0;
        }
    });
    // Where the clock stands is no edit of the scene.
    let mut of_clock = Changes::default();
    let range = 0.0..=end.unwrap_or(3600.0);
    let slider = 0.0..=end.unwrap_or(20.0);
    Field::new("Time", range, 0.0)
        .unit(" s")
        .slider(slider)
        .help("Animation time in seconds.")
        .show(ui, &mut state.seconds, &mut of_clock);
    changes.places.append(&mut of_clock.places);
    changes.refused = changes.refused.take().or(of_clock.refused);
    if !motion.frames.is_empty() {
        let plain = MotionSection::default();
        let mut rows = Rows {
            section: &MOTION,
            target: motion,
            plain: &plain,
            suffix: "",
        };
        for param in MOTION.params {
            rows.show(ui, param, changes);
        }
        ui.label(counted(motion.frames.len(), "groom", "grooms"));
    }
    if let Some(wind) = &mut motion.wind {
        blow(ui, wind, changes);
    }
}

fn blow(ui: &mut Ui, wind: &mut WindSection, changes: &mut Changes) {
    let mut rows = Rows {
        section: &WIND,
        target: wind,
        plain: &WindSection::default(),
        suffix: "",
    };
    for param in WIND.params {
        rows.show(ui, param, changes);
    }
}

/// The list of proxies.
pub fn proxies(
    ui: &mut Ui,
    scene: &mut Scene,
    groom: &Groom,
    bounds: Bounds,
    changes: &mut Changes,
) {
    let reach = Reach::of(bounds, scalp::sphere_of(groom));
    let has_room = scene.proxies.len() < MAX_PROXIES;
    row(ui, |ui| {
        let help = "Matte object that shadows and occludes the hair";
        for (text, added) in [
            ("Add ellipsoid", reach.head()),
            ("Add ground", reach.ground()),
        ] {
            let button = ui.add_enabled(has_room, egui::Button::new(text));
            if button.on_hover_text(help).clicked() {
                scene.proxies.push(added);
                changes.note(text);
            }
        }
    });
    let mut removed = None;
    for (ix, proxy) in scene.proxies.iter_mut().enumerate() {
        ui.push_id(ix, |ui| {
            if one(ui, ix, proxy, &reach, changes) {
                removed = Some(ix);
            }
        });
    }
    if let Some(ix) = removed {
        scene.proxies.remove(ix);
        changes.note("Remove proxy");
    }
}

/// Answers whether it is to go.
fn one(
    ui: &mut Ui,
    ix: usize,
    proxy: &mut ProxySection,
    reach: &Reach,
    changes: &mut Changes,
) -> bool {
    let number = ix + 1;
    let mut is_removed = false;
    row(ui, |ui| {
        let name = match proxy {
            ProxySection::Ellipsoid { .. } => "Ellipsoid",
            ProxySection::Ground { .. } => "Ground",
            ProxySection::Mesh { .. } => "Mesh",
        };
        ui.strong(format!("{name} {number}"));
        is_removed = ui.button("Remove").clicked();
    });
    if let ProxySection::Mesh { mesh, .. } = proxy {
        row(ui, |ui| {
            ui.label("File");
            let name = mesh.file_name().unwrap_or(mesh.as_os_str());
            let label = ui.label(name.to_string_lossy());
            label.on_hover_text(mesh.display().to_string());
        });
    }
    let plain = match proxy {
        ProxySection::Ellipsoid { .. } => reach.head(),
        ProxySection::Ground { .. } => reach.ground(),
        ProxySection::Mesh { mesh, .. } => ProxySection::mesh(&*mesh),
    };
    let section = proxy.section();
    let mut rows = Rows {
        section,
        target: proxy,
        plain: &plain,
        suffix: &format!(" {number}"),
    };
    for param in section.params {
        match (param.spec.key, param.get(&plain)) {
            // Places and lengths are offered where the hair is.
            ("centre" | "height" | "offset", Some(place)) => {
                let dress = |field, ix| reach.place(field, place.number(ix).unwrap_or_default());
                rows.numbers(ui, param, dress, changes);
            }
            ("radii", _) => rows.numbers(ui, param, |field, _| reach.length(field), changes),
            _ => rows.show(ui, param, changes),
        }
    }
    is_removed
}

/// Colours of a head and of a ground to begin with.
const SKIN: [f64; 3] = [0.35, 0.25, 0.2];
const FLOOR: [f64; 3] = [0.3; 3];

/// Lengths around the hair, cm: what a head or a ground there may have.
struct Reach {
    /// Of a head to begin with.
    centre: [f64; 3],
    radius: f64,
    /// Of a ground to begin with.
    lowest: f64,
    of_hair: f64,
    /// Farthest place that is offered.
    far: f64,
}

impl Reach {
    /// Around hair in `bounds` that grows on `scalp`, if that is a sphere.
    fn of(bounds: Bounds, scalp: Option<Bounds>) -> Self {
        let of_hair = f64::from(bounds.radius).max(0.1);
        let head = scalp
            .filter(|scalp| scalp.radius < bounds.radius)
            .unwrap_or(Bounds {
                centre: bounds.centre,
                radius: 0.4 * bounds.radius,
            });
        let from_origin = f64::from(bounds.centre.abs().max_element());
        Reach {
            centre: head.centre.to_array().map(tenth),
            // Roots stay outside.
            radius: tenth(0.98 * head.radius).max(0.1),
            lowest: tenth(bounds.centre.y - bounds.radius),
            of_hair,
            far: round_up(from_origin + 8.0 * of_hair),
        }
    }

    /// A head to begin with.
    fn head(&self) -> ProxySection {
        ProxySection::Ellipsoid {
            centre: self.centre,
            radii: [self.radius; 3],
            tilt_deg: 0.0,
            albedo: SKIN,
        }
    }

    /// A ground to begin with.
    fn ground(&self) -> ProxySection {
        ProxySection::Ground {
            height: self.lowest,
            albedo: FLOOR,
        }
    }

    /// A coordinate, that of the head or ground which is added being `plain`.
    fn place(&self, field: Field, plain: f64) -> Field {
        let around = (2.0 * self.of_hair).ceil();
        field
            .range(-self.far..=self.far)
            .slider(plain.round() - around..=plain.round() + around)
    }

    /// A half axis.
    fn length(&self, field: Field) -> Field {
        field
            .range(0.01..=self.far)
            .slider(tenth(0.05 * self.of_hair).max(0.1)..=(2.0 * self.of_hair).ceil())
    }
}

/// The least of 1, 2, 5, 10, 20, 50 ... that is not below `x`, > 0.
fn round_up(x: f64) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    let steps = [1.0, 2.0, 5.0].map(|step| step * power);
    (steps.into_iter().find(|&step| step >= x)).unwrap_or(10.0 * power)
}

/// Rounded to a millimetre.
fn tenth(x: impl Into<f64>) -> f64 {
    // Zero has no sign.
    (x.into() * 10.0).round() / 10.0 + 0.0
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn what_is_offered_for_a_head_is_of_the_hairs_size() {
        for (x, up) in [(1.0, 1.0), (1.1, 2.0), (130.0, 200.0), (640.0, 1000.0)] {
            assert!((round_up(x) / up - 1.0).abs() < 1e-12, "{x}");
        }
        let bounds = Bounds {
            centre: Vec3::new(0.0, 3.0, -1.0),
            radius: 15.0,
        };
        let reach = Reach::of(bounds, None);
        assert_eq!((reach.far, reach.radius, reach.lowest), (200.0, 5.9, -12.0));
        assert_eq!(reach.centre, [0.0, 3.0, -1.0]);
        let scalp = Bounds {
            centre: Vec3::new(0.0, 9.0, -1.0),
            radius: 10.0,
        };
        let reach = Reach::of(bounds, Some(scalp));
        assert_eq!((reach.radius, reach.centre), (9.8, [0.0, 9.0, -1.0]));
    }

    #[test]
    fn a_sequence_ends_and_starts_anew() {
        let mut scene = Scene::new("a", "b");
        assert_eq!(end_of(&scene), None);
        scene.motion = Some(MotionSection {
            frames: vec!["a".into(); 5],
            fps: Some(8.0),
            ..MotionSection::default()
        });
        let end = end_of(&scene);
        assert_eq!(end, Some(0.5));
        let mut state = MotionState {
            seconds: 0.5,
            ..MotionState::default()
        };
        state.toggle(end);
        assert!(state.is_playing && state.seconds == 0.0);
        state.seconds = 0.2;
        state.toggle(end);
        assert!(!state.is_playing && state.seconds == 0.2);
    }

    #[test]
    fn wind_that_is_switched_off_comes_back_as_it_was() {
        let mut scene = Scene::new("a", "b");
        let mut state = MotionState::default();
        let blows = |scene: &Scene| scene.motion.clone().and_then(|motion| motion.wind);
        state.set_wind(&mut scene, true);
        assert_eq!(blows(&scene), Some(WindSection::default()));
        assert!(!state.is_playing);
        let strong = WindSection {
            speed: 17.0,
            gust: 0.8,
            ..WindSection::default()
        };
        scene.motion = Some(MotionSection {
            wind: Some(strong.clone()),
            ..MotionSection::default()
        });
        state.toggle(None);
        state.set_wind(&mut scene, false);
        assert!(scene.motion.is_none() && !state.is_playing);
        state.set_wind(&mut scene, true);
        assert_eq!(blows(&scene), Some(strong));
        assert!(!state.is_playing);
    }
}
