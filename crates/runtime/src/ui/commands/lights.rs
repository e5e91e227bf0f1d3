//! Lights that are placed by a click, and light sets in place of each other.

use serde_json::json;

#[cfg(not(target_arch = "wasm32"))]
use crate::opening::Openable;
use crate::ui::pick;
#[cfg(not(target_arch = "wasm32"))]
use crate::ui::questions::name_of;
use crate::ui::workspace::Workspace;

impl Workspace {
    /// Lets the selected light, one that the scene adds, come from where the strand that was clicked reflects it to
    /// the eye.
    pub(super) fn place_highlight(&mut self, place: [f32; 2]) {
        let hit = self.viewer.pick(place);
        let (scene, session) = (self.viewer.prepared(), self.viewer.session());
        let n_set = session.light_set().lights.len();
        let selected = self.state.lights.selected;
        let at = selected.and_then(|ix| (ix as usize).checked_sub(n_set));
        let point = hit.and_then(|position| pick::nearest(&scene.strands, position));
        let direction = point.map(|point| pick::highlight(scene, scene.camera.eye, point));
        self.state.lights.is_placing = false;
        let (Some(at), Some(direction)) = (at, direction) else {
            return self.say("No hair there: click on a strand");
        };
        let label = "Place highlight";
        self.viewer.commit();
        let changed = self.viewer.edit(label, |scene| {
            if let Some(light) = scene.lights.added.get_mut(at) {
                light.point_to(direction.to_array().map(f64::from));
            }
        });
        self.viewer.commit();
        match changed {
            Ok(_) => {
                self.say("The light comes from where the fibre reflects it to the eye");
                self.changed("edit", json!({ "label": label }));
            }
            Err(error) => self.fail(&error.to_string()),
        }
    }

    /// Takes the light set that follows the scene's in its folder, by name, or the one before; after the last comes
    /// the first. Sets that cannot be read are passed over.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn next_light_set(&mut self, is_forward: bool) {
        let now = self.viewer.session().scene().lights_path();
        let found = light_sets_beside(&now);
        let before = found.iter().filter(|path| **path < now).count();
        let is_there = usize::from(found.get(before) == Some(&now));
        let mut others = found[before + is_there..].to_vec();
        others.extend_from_slice(&found[..before]);
        if !is_forward {
            others.reverse();
        }
        let files = self.viewer.session().files();
        let is_light_set = |path: &&std::path::PathBuf| files.lights(path).is_ok();
        let Some(next) = others.iter().find(is_light_set).cloned() else {
            return self.say(&format!("No other light set is beside {}", name_of(&now)));
        };
        self.put_in(Openable::Lights, &next, &next);
    }

    #[cfg(target_arch = "wasm32")]
    pub(super) fn next_light_set(&mut self, _: bool) {
        self.say("Light sets of a folder need strandview on a desktop");
    }
}

/// All light sets in the folder of `file`, by name.
#[cfg(not(target_arch = "wasm32"))]
fn light_sets_beside(file: &std::path::Path) -> Vec<std::path::PathBuf> {
    let folder = match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => std::path::Path::new("."),
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    // Spelled as `file` is, so that it is found among them.
    let mut found: Vec<_> = entries
        .map(|entry| file.with_file_name(entry.file_name()))
        .collect();
    found.retain(|path| path.extension().is_some_and(|of| of == "lights"));
    found.sort_unstable();
    found
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::*;

    #[test]
    fn light_sets_are_those_of_the_folder_by_name() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["c.lights", "a.lights", "b.groom", "b.lights", "lights"] {
            std::fs::write(folder.path().join(name), "").expect("written");
        }
        let found = light_sets_beside(&folder.path().join("b.lights"));
        let names: Vec<_> = found.iter().map(|path| name_of(path)).collect();
        assert_eq!(names, ["a.lights", "b.lights", "c.lights"]);
        assert!(light_sets_beside(&folder.path().join("none/a.lights")).is_empty());
    }
}
