//! The menus of the bar: files, and the view.

use std::path::{Component, Path, PathBuf};

use egui::{Button, RichText, Ui};

use super::field::Changes;
use super::fitted::fitted_menu;
use super::keys::{self, Command, Side};
use super::questions::Answer;
use super::settings::Settings;
use super::theme;
#[cfg(not(target_arch = "wasm32"))]
use crate::inspection::Inspection;
#[cfg(not(target_arch = "wasm32"))]
use crate::light_layer::LightLayer;
use crate::viewer::Viewer;

/// Most files that are offered.
const MOST_SHOWN: usize = 8;

/// What the menus know of.
pub struct MenuInput<'a> {
    /// Scene and picture.
    pub viewer: &'a Viewer,
    /// Files that were open.
    pub settings: &'a Settings,
    /// Are there views before and after this one?
    pub can_look: [bool; 2],
    /// The light whose own values are shown.
    #[cfg_attr(
        target_arch = "wasm32",
        expect(dead_code, reason = "pages inspect nothing")
    )]
    pub selected_light: Option<u32>,
}

/// Shows the menus; what is chosen comes to `commands` and `answer`.
pub fn show(
    ui: &mut Ui,
    input: &MenuInput<'_>,
    changes: &mut Changes,
    commands: &mut Vec<Command>,
    answer: &mut Option<Answer>,
) {
    let session = input.viewer.session();
    let mut entry = |ui: &mut Ui, text: &str, is_enabled, command: Command| {
        let button = Button::new(text).shortcut_text(keys::shortcut(ui.ctx(), command));
        let button = ui.add_enabled(is_enabled, button);
        changes.place(format!("{text} entry"), &button);
        if button.clicked() {
            commands.push(command);
            ui.close();
        }
    };
    let has_files = cfg!(not(target_arch = "wasm32"));
    let file = fitted_menu(ui, "File", |ui| {
        ui.set_min_width(220.0);
        if has_files {
            entry(ui, "Open ...", true, Command::Open);
            let recent: Vec<_> = input.settings.recent().map(ToOwned::to_owned).collect();
            if !recent.is_empty() {
                ui.label(RichText::new("Recent").small().color(theme::WEAK));
            }
            let recent_shown = &recent[..recent.len().min(MOST_SHOWN)];
            for (path, name) in recent_shown.iter().zip(names_apart(recent_shown)) {
                let button = ui.button(name);
                if button.on_hover_text(path.display().to_string()).clicked() {
                    *answer = Some(Answer::Open(path.clone()));
                    ui.close();
                }
            }
            if !recent.is_empty() {
                entry(ui, "Forget these", true, Command::ForgetRecent);
            }
            entry(ui, "The sample", true, Command::Sample);
            ui.separator();
        }
        let is_modified = session.is_modified() || session.is_unsaved();
        entry(ui, "Save", is_modified, Command::Save);
        entry(ui, "Save as ...", true, Command::SaveAs);
        entry(ui, "Reload", !session.is_unsaved(), Command::Reload);
        ui.separator();
        entry(ui, "Save picture", true, Command::Screenshot);
        if has_files {
            entry(ui, "Save picture as ...", true, Command::Still);
        }
        ui.separator();
        entry(ui, "Help", true, Command::Help);
        entry(ui, "Close", true, Command::Close);
    });
    // What a menu holds is left to submenus where it would not fit into a low window.
    let mut submenus = Vec::new();
    let view = fitted_menu(ui, "View", |ui| {
        ui.set_min_width(200.0);
        entry(ui, "Frame all hair", true, Command::Frame);
        entry(ui, "Scene's camera", true, Command::Home);
        let is_moved = input.viewer.is_view_moved();
        entry(ui, "Save view", is_moved, Command::SaveView);
        entry(ui, "View before", input.can_look[0], Command::ViewBack);
        entry(ui, "View after", input.can_look[1], Command::ViewForward);
        ui.separator();
        let menu = ui.menu_button("Look from", |ui| {
            for (side, name) in Side::ALL {
                entry(ui, name, true, Command::Look(side));
            }
        });
        submenus.push(("Look from menu", menu.response));
        ui.separator();
        #[cfg(not(target_arch = "wasm32"))]
        {
            let text = match input.viewer.ground_truth() {
                None => "Go on to ground truth",
                Some(_) => "Stop at the fast picture",
            };
            entry(ui, text, true, Command::GroundTruth);
            ui.separator();
            let now = input.viewer.inspection();
            if now.is_some() {
                entry(ui, "Picture", true, Command::Inspect(None));
            }
            let mut inspect = |ui: &mut Ui, text: &str, inspection| {
                let is_other = now != Some(inspection);
                entry(ui, text, is_other, Command::Inspect(Some(inspection)));
            };
            let menu = ui.menu_button("Show", |ui| {
                for (inspection, name) in Inspection::ALL {
                    inspect(ui, name, inspection);
                }
            });
            submenus.push(("Show menu", menu.response));
            let menu = ui.menu_button("Parts of the light", |ui| {
                for inspection in Inspection::of_arriving_light() {
                    inspect(ui, &inspection.name(), inspection);
                }
                match input.selected_light.map(LightLayer::Light) {
                    Some(light) => inspect(ui, &light.name(), Inspection::Layer(light)),
                    None => {
                        ui.label(RichText::new("One light: select it").color(theme::WEAK));
                    }
                }
            });
            submenus.push(("Parts of the light menu", menu.response));
            ui.separator();
        }
        entry(ui, "Panel", true, Command::Panel);
    });
    changes.place("File menu", &file);
    changes.place("View menu", &view);
    for (name, response) in submenus {
        changes.place(name, &response);
    }
}

/// The names of files, after as many of their folders as it takes to tell them from the others.
fn names_apart(paths: &[PathBuf]) -> Vec<String> {
    let end_of = |path: &Path, n: usize| -> PathBuf {
        let mut parts: Vec<Component<'_>> = path.components().rev().take(n).collect();
        parts.reverse();
        parts.into_iter().collect()
    };
    let names = paths.iter().map(|path| {
        let most = path.components().count();
        let is_alone = |n: &usize| {
            let end = end_of(path, *n);
            !(paths.iter()).any(|other| other != path && end_of(other, *n) == end)
        };
        let n = (1..most).find(is_alone).unwrap_or(most);
        end_of(path, n).display().to_string()
    });
    names.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_one_name_are_told_apart_by_their_folders() {
        let paths = [
            "/a/x/scene.toml",
            "/b/x/scene.toml",
            "/y/scene.toml",
            "/a/x/b.toml",
            "/scene.toml",
        ];
        let wanted = [
            ["a", "x", "scene.toml"].as_slice(),
            &["b", "x", "scene.toml"],
            &["y", "scene.toml"],
            &["b.toml"],
        ];
        let names = names_apart(&paths.map(PathBuf::from));
        for (name, wanted) in names.iter().zip(wanted) {
            let wanted: PathBuf = wanted.iter().collect();
            assert_eq!(*name, wanted.display().to_string());
        }
        assert_eq!(names.len(), 5);
        assert!(names[4].ends_with("scene.toml") && names[4].len() > "scene.toml".len());
        assert!(names_apart(&[]).is_empty());
    }
}
