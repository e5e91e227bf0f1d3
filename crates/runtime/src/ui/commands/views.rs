//! Where the user looks from, and at what.

use serde_json::json;
use strandlight_scene::Camera;
use web_time::Instant;

#[cfg(not(target_arch = "wasm32"))]
use crate::inspection::Inspection;
#[cfg(not(target_arch = "wasm32"))]
use crate::light_layer::LightLayer;
use crate::ui::in_view::{InView, in_view, is_amid};
use crate::ui::keys::Side;
use crate::ui::orbit::Bounds;
use crate::ui::workspace::Workspace;
use crate::ui::{orbit, pick};

impl Workspace {
    /// Looks from elsewhere, by a drag that may go on or at once.
    pub(in crate::ui) fn look(&mut self, view: Camera, is_drag: bool) {
        let from = self.viewer.prepared().camera;
        self.views.left(from, is_drag, Instant::now());
        self.set_view(view);
    }

    /// Looks at all hair from a side.
    pub(super) fn look_from(&mut self, side: Side) {
        let bounds = Bounds::of(&self.viewer.prepared().strands);
        let camera = self.viewer.prepared().camera;
        let view = orbit::from_side(&camera, side, bounds, self.aspect());
        self.views.close();
        self.look(view, false);
        self.views.close();
    }

    /// Looks at all hair from the same side where other hair was put into the scene and is out of view, or a speck; and where
    /// the eye is in the middle of it, as it was not in that of `before`. Answers whether it does.
    pub(super) fn frame_other_hair(&mut self, before: Bounds) -> bool {
        let scene = self.viewer.prepared();
        let (camera, bounds) = (scene.camera, Bounds::of(&scene.strands));
        let is_in_middle = is_amid(&camera, bounds) && !is_amid(&camera, before);
        let aspect = self.aspect();
        if in_view(&camera, &scene.strands, aspect) == InView::Hair && !is_in_middle {
            return false;
        }
        let view = orbit::frame(&camera, bounds.centre, bounds.radius, aspect);
        self.views.close();
        self.look(view, false);
        self.views.close();
        true
    }

    /// Width of the picture over its height.
    fn aspect(&self) -> f32 {
        let [width, height] = self.viewer.size().map(|side| side.max(1) as f32);
        width / height
    }

    pub(super) fn set_view(&mut self, view: Camera) {
        match self.viewer.set_view(view) {
            Ok(()) => self.changed("view", json!({})),
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// Makes the view the scene's camera.
    pub(in crate::ui) fn save_view(&mut self) {
        match self.viewer.save_view() {
            Ok(change) if change.is_empty() => {
                self.say("The view already matches the scene's camera")
            }
            Ok(_) => {
                self.say("Saved the view as the scene's camera");
                self.changed("edit", json!({ "label": "Save view" }));
            }
            Err(error) => self.fail(&error.to_string()),
        }
    }

    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn toggle_ground_truth(&mut self) {
        let is_wanted = self.viewer.ground_truth().is_none();
        self.viewer.set_ground_truth(is_wanted);
        (self.truth, self.truth_error) = (None, None);
        self.log
            .write("ground_truth", json!({ "is_wanted": is_wanted }));
        self.say(match is_wanted {
            true => "The finished picture goes on to ground truth while nothing changes",
            false => "Back to the fast picture",
        });
    }

    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn inspect(&mut self, inspection: Option<Inspection>) {
        self.viewer.set_inspection(inspection);
        self.is_inspection_noted = false;
        let name = inspection.map(Inspection::name);
        self.log.write("inspect", json!({ "inspection": name }));
        if inspection == Some(Inspection::Error) && self.viewer.ground_truth().is_none() {
            self.say("The error is told on the way to ground truth: G");
        } else {
            self.say(name.as_deref().unwrap_or("The picture"));
        }
    }

    /// The light that is shown alone is the one that is selected; without it, the picture is shown.
    #[cfg(not(target_arch = "wasm32"))]
    pub(in crate::ui) fn inspect_selected(&mut self) {
        let Some(Inspection::Layer(LightLayer::Light(shown))) = self.viewer.inspection() else {
            return;
        };
        let n_lights = self.viewer.prepared().lights.len();
        let selected = self.state.lights.selected;
        let selected = selected.filter(|&light| (light as usize) < n_lights);
        if selected != Some(shown) {
            let layer = selected.map(LightLayer::Light);
            self.inspect(layer.map(Inspection::Layer));
        }
    }

    /// Tells the log once when what is drawn apart from the picture is shown.
    #[cfg(not(target_arch = "wasm32"))]
    pub(in crate::ui) fn note_inspection(&mut self) {
        let is_shown = self.viewer.is_inspection_shown();
        if let (Some(inspection), true, false) =
            (self.viewer.inspection(), is_shown, self.is_inspection_noted)
        {
            self.log
                .write("inspected", json!({ "inspection": inspection.name() }));
            // The legend was laid out before.
            self.window.request_redraw();
        }
        self.is_inspection_noted = is_shown;
    }

    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn inspect_next(&mut self) {
        let all = Inspection::ALL.map(|(inspection, _)| inspection);
        let next = match self.viewer.inspection() {
            None => all.first(),
            Some(now) => all.iter().skip_while(|&&it| it != now).nth(1),
        };
        self.inspect(next.copied());
    }

    /// R, TT and TRT, the terms, transmittance and the light that is selected, one after the other.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn inspect_next_layer(&mut self) {
        let selected = self.state.lights.selected.map(LightLayer::Light);
        let mut all = Inspection::of_arriving_light().chain(selected.map(Inspection::Layer));
        let now = self.viewer.inspection();
        let next = match now.filter(|now| now.is_drawn_apart()) {
            None => all.next(),
            Some(now) => all.skip_while(|&it| it != now).nth(1),
        };
        self.inspect(next);
    }

    #[cfg(target_arch = "wasm32")]
    pub(super) fn inspect_next_layer(&mut self) {
        self.inspect_next();
    }

    #[cfg(target_arch = "wasm32")]
    pub(super) fn inspect_next(&mut self) {
        self.say("Only strandview on a desktop shows more than the picture");
    }

    #[cfg(target_arch = "wasm32")]
    pub(super) fn toggle_ground_truth(&mut self) {
        self.say("Ground truth needs strandview on a desktop");
    }

    /// Selects the light that adds most where the picture was clicked.
    pub(in crate::ui) fn pick(&mut self, place: [f32; 2]) {
        let hit = self.viewer.pick(place);
        let (scene, session) = (self.viewer.prepared(), self.viewer.session());
        let section = &session.scene().lights;
        let mut lights = session.assets().turned_lights(section);
        for (light, rgb) in lights
            .iter_mut()
            .zip(session.assets().light_colors(section))
        {
            light.rgb = rgb;
        }
        let found = hit
            .and_then(|position| pick::nearest(&scene.strands, position))
            .and_then(|point| pick::brightest(scene, &lights, scene.camera.eye, point));
        let light = found.map(|found| found.light);
        self.log.write("picked", json!({ "light": light }));
        let state = &mut self.state.lights;
        state.is_picking = false;
        state.picked = Some(match found {
            Some(found) => {
                state.selected = Some(found.light as u32);
                state.reveal = true;
                format!(
                    "Light {} contributes most there: about {:.0} % of single scattering.",
                    found.light,
                    100.0 * found.share
                )
            }
            None => "No lit hair there: click on a strand.".to_owned(),
        });
    }

    /// Brings the strand under the mouse to the middle of the picture.
    pub(in crate::ui) fn look_at(&mut self, place: [f32; 2]) {
        let Some(target) = self.viewer.pick(place) else {
            return;
        };
        let camera = self.viewer.prepared().camera;
        let moved = Camera {
            eye: camera.eye + target - camera.target,
            target,
            ..camera
        };
        self.views.close();
        self.look(moved, false);
        self.views.close();
    }
}
