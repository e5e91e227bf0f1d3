//! Hair that moves, and what stands in its light.

use egui::Ui;
use strandlight_formats::{MAX_PROXIES, MotionSection, ProxySection, Scene, WindSection};

use super::hair::swatch;
use crate::ui::field::{Changes, Field, named, row};
use crate::ui::view::Bounds;

/// The clock of the motion.
#[derive(Debug, Default)]
pub struct MotionState {
    /// It runs.
    pub is_playing: bool,
    /// Seconds since the start of the motion.
    pub seconds: f64,
}

/// Wind, and the clock.
pub fn show(ui: &mut Ui, scene: &mut Scene, state: &mut MotionState, changes: &mut Changes) {
    let has_frames = (scene.motion.as_ref()).is_some_and(|motion| !motion.frames.is_empty());
    if !has_frames {
        let mut is_windy = scene.motion.is_some();
        let help = "Bends the hair; the groom stays as it is.";
        named(ui, "Wind", help, |ui| {
            let box_ = ui.checkbox(&mut is_windy, "blows");
            changes.place("Wind toggle", &box_);
            if box_.changed() {
                scene.motion = is_windy.then(|| MotionSection {
                    wind: Some(WindSection::default()),
                    ..MotionSection::default()
                });
                state.is_playing = is_windy;
                changes.note("Wind");
            }
        });
    }
    let Some(motion) = &mut scene.motion else {
        return;
    };
    row(ui, |ui| {
        let text = if state.is_playing { "Pause" } else { "Play" };
        let button = ui.button(text).on_hover_text("Space");
        changes.place("Play button", &button);
        if button.clicked() {
            state.is_playing = !state.is_playing;
        }
        if ui.button("Start").on_hover_text("Back to 0 s").clicked() {
            state.seconds = 0.0;
        }
    });
    // Where the clock stands is no edit of the scene.
    let mut of_clock = Changes::default();
    Field::new("Time", 0.0..=3600.0, 0.0)
        .unit(" s")
        .slider(0.0..=20.0)
        .help("Seconds since the start of the motion.")
        .show(ui, &mut state.seconds, &mut of_clock);
    if !motion.frames.is_empty() {
        let mut fps = motion.fps.unwrap_or(MotionSection::DEFAULT_FPS);
        if Field::new("Frames a second", 1e-3..=1e3, MotionSection::DEFAULT_FPS)
            .slider(1.0..=60.0)
            .help("How fast the sequence of grooms goes by.")
            .show(ui, &mut fps, changes)
        {
            motion.fps = (fps != MotionSection::DEFAULT_FPS).then_some(fps);
        }
        ui.label(format!("{} grooms", motion.frames.len()));
    }
    if let Some(wind) = &mut motion.wind {
        blow(ui, wind, changes);
    }
}

fn blow(ui: &mut Ui, wind: &mut WindSection, changes: &mut Changes) {
    let plain = WindSection::default();
    Field::new("Wind speed", 0.0..=30.0, plain.speed)
        .unit(" m/s")
        .help("3 is a breeze; hanging hair leans by 45 degrees at about 6.")
        .show(ui, &mut wind.speed, changes);
    Field::new("Gusts", 0.0..=1.0, plain.gust)
        .help("How much the speed comes and goes.")
        .show(ui, &mut wind.gust, changes);
    Field::new("Wind towards", -3600.0..=3600.0, plain.direction_deg)
        .unit("°")
        .slider(-180.0..=180.0)
        .decimals(0)
        .help("Where it blows to: 0 is towards +Z, 90 towards +X.")
        .show(ui, &mut wind.direction_deg, changes);
    Field::new("Stiffness", 0.1..=1000.0, plain.stiffness)
        .unit(" cm")
        .slider(1.0..=40.0)
        .help("Length from the root at which half of the wind acts: longer is stiffer hair.")
        .show(ui, &mut wind.stiffness, changes);
    let mut seed = f64::from(wind.seed);
    if Field::new("Seed", 0.0..=f64::from(u32::MAX), 0.0)
        .slider(0.0..=100.0)
        .decimals(0)
        .help("Another wind for every number.")
        .show(ui, &mut seed, changes)
    {
        wind.seed = seed as u32;
    }
}

/// The list of proxies.
pub fn proxies(ui: &mut Ui, scene: &mut Scene, bounds: Bounds, changes: &mut Changes) {
    let has_room = scene.proxies.len() < MAX_PROXIES;
    row(ui, |ui| {
        let help = "Something matte that stands in the light and hides hair behind it";
        let centre = bounds.centre.to_array().map(tenth);
        let radius = tenth(0.4 * bounds.radius);
        let lowest = tenth(bounds.centre.y - bounds.radius);
        for (text, added) in [
            (
                "Add head",
                ProxySection::Ellipsoid {
                    centre,
                    radii: [radius.max(0.1); 3],
                    tilt_deg: 0.0,
                    albedo: [0.35, 0.25, 0.2],
                },
            ),
            (
                "Add ground",
                ProxySection::Ground {
                    height: lowest,
                    albedo: [0.3; 3],
                },
            ),
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
            if one(ui, ix, proxy, bounds, changes) {
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
    bounds: Bounds,
    changes: &mut Changes,
) -> bool {
    let reach = f64::from(bounds.radius.max(0.1));
    let length = |name: &str, value: &mut f64, low: f64, ui: &mut Ui, changes: &mut Changes| {
        let slider = if low > 0.0 {
            0.05 * reach..=2.0 * reach
        } else {
            -2.0 * reach..=2.0 * reach
        };
        Field::new(
            &format!("{name} {}", ix + 1),
            low..=1e6,
            tenth(value_or(low, reach)),
        )
        .unit(" cm")
        .slider(slider)
        .show(ui, value, changes);
    };
    let mut is_removed = false;
    row(ui, |ui| {
        let name = match proxy {
            ProxySection::Ellipsoid { .. } => "Head",
            ProxySection::Ground { .. } => "Ground",
        };
        ui.strong(format!("{name} {}", ix + 1));
        is_removed = ui.button("Remove").clicked();
    });
    match proxy {
        ProxySection::Ellipsoid {
            centre,
            radii,
            tilt_deg,
            albedo,
        } => {
            for (axis, value) in ["x", "y", "z"].into_iter().zip(centre) {
                length(&format!("Centre {axis}"), value, -1e6, ui, changes);
            }
            for (axis, value) in ["x", "y", "z"].into_iter().zip(radii) {
                length(&format!("Radius {axis}"), value, 1e-3, ui, changes);
            }
            Field::new(&format!("Tilt {}", ix + 1), -180.0..=180.0, 0.0)
                .unit("°")
                .decimals(1)
                .show(ui, tilt_deg, changes);
            swatch(ui, &format!("Albedo {}", ix + 1), albedo, changes);
        }
        ProxySection::Ground { height, albedo } => {
            length("Height", height, -1e6, ui, changes);
            swatch(ui, &format!("Albedo {}", ix + 1), albedo, changes);
        }
    }
    is_removed
}

fn value_or(low: f64, reach: f64) -> f64 {
    if low > 0.0 { 0.4 * reach } else { 0.0 }
}

/// Rounded to a millimetre.
fn tenth(x: impl Into<f64>) -> f64 {
    (x.into() * 10.0).round() / 10.0
}
