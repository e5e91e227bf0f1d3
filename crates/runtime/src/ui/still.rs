//! A picture as a file: of which size, in which format, under which name; or the
//! frames of a turntable, or a picture in layers.

use std::path::PathBuf;

use egui::Ui;

use super::asked::Asked;
use super::field::{Changes, Field, named};
use super::picker::{Picker, Purpose};
#[cfg(not(target_arch = "wasm32"))]
use super::sequence::file_of;
use crate::script::MAX_SCRIPT_FRAMES;
use strandlight_scene::budget::MAX_SIDE;

/// Sizes that are asked for by name.
const SIZES: [(&str, [u32; 2]); 4] = [
    ("HD 1920x1080", [1920, 1080]),
    ("4K UHD 3840x2160", [3840, 2160]),
    ("4K DCI 4096x2160", [4096, 2160]),
    ("8K UHD 7680x4320", [7680, 4320]),
];

/// A picture to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Still {
    /// Its file.
    pub picker: Picker,
    /// Width and height.
    pub size: [u32; 2],
    /// Frames of a full turn about the vertical; 1: a picture.
    pub frames: u32,
    /// With all layers beside the picture, in an OpenEXR file.
    pub has_layers: bool,
}

impl Still {
    /// A picture of `size` to begin with.
    pub fn new(path: String, size: [u32; 2]) -> Self {
        let kinds = ["png", "exr"].map(str::to_owned).to_vec();
        Still {
            picker: Picker::new(Purpose::Save, path, kinds),
            size,
            frames: 1,
            has_layers: false,
        }
    }

    /// Where it goes.
    pub fn path(&self) -> PathBuf {
        self.picker.file()
    }

    /// The files that it makes.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn files(&self) -> Vec<PathBuf> {
        let path = self.path();
        match self.frames {
            1 => vec![path],
            n => (0..n).map(|ix| file_of(&path, ix)).collect(),
        }
    }

    /// Is it one picture in layers?
    pub fn is_layered(&self) -> bool {
        self.has_layers && self.is_exr() && self.frames == 1
    }

    fn is_exr(&self) -> bool {
        let path = self.path();
        path.extension()
            .is_some_and(|x| x.eq_ignore_ascii_case("exr"))
    }
}

/// The controls beside the file.
pub fn show(ui: &mut Ui, still: &mut Still, asked: &Asked<'_>, places: &mut Changes) {
    // What is chosen here is no edit of the scene.
    let mut changes = Changes::default();
    let text = |size: [u32; 2]| format!("{}x{}", size[0], size[1]);
    named(
        ui,
        "Size",
        "Width and height of the picture in pixels",
        |ui| {
            let own = [
                (format!("Window {}", text(asked.window)), asked.window),
                (
                    format!("Scene {}", text(asked.scene_size)),
                    asked.scene_size,
                ),
            ];
            let others = SIZES.map(|(name, size)| (name.to_owned(), size));
            let all: Vec<(String, [u32; 2])> = own.into_iter().chain(others).collect();
            let current = all.iter().find(|(_, size)| *size == still.size);
            let shown = current.map_or_else(|| text(still.size), |(name, _)| name.clone());
            let combo = egui::ComboBox::from_id_salt("picture size")
                .width(170.0)
                .selected_text(shown)
                .show_ui(ui, |ui| {
                    for (name, size) in &all {
                        if ui.selectable_label(still.size == *size, name).clicked() {
                            still.size = *size;
                        }
                    }
                });
            changes.place("Picture size", &combo.response);
        },
    );
    named(ui, "Format", "What the name of the file ends with", |ui| {
        for (is_exr, name) in [(false, "PNG"), (true, "OpenEXR")] {
            let help = match is_exr {
                false => "As it is displayed, 8 bits a channel",
                true => "Linear radiance, 16 or 32 bits a channel",
            };
            let choice = ui.selectable_label(still.is_exr() == is_exr, name);
            changes.place(format!("{name} format"), &choice);
            if choice.on_hover_text(help).clicked() {
                let extension = if is_exr { "exr" } else { "png" };
                let path = PathBuf::from(&still.picker.path).with_extension(extension);
                still.picker.path = path.display().to_string();
            }
        }
    });
    let side = 1.0..=f64::from(MAX_SIDE);
    for (ix, name) in ["Width", "Height"].into_iter().enumerate() {
        let mut value = f64::from(still.size[ix]);
        let default = f64::from(asked.window[ix]);
        if Field::new(name, side.clone(), default)
            .unit(" px")
            .decimals(0)
            .logarithmic()
            .show(ui, &mut value, &mut changes)
        {
            still.size[ix] = value as u32;
        }
    }
    let mut frames = f64::from(still.frames);
    if Field::new("Turntable frames", 1.0..=f64::from(MAX_SCRIPT_FRAMES), 1.0)
        .decimals(0)
        .slider(1.0..=240.0)
        .logarithmic()
        .help(
            "More than 1: frames of a full turn of the camera about the vertical. Their number takes the place of \
             %04d or #### in the name, or stands before its end.",
        )
        .show(ui, &mut frames, &mut changes)
    {
        still.frames = frames as u32;
    }
    let can_be_layered = still.is_exr() && still.frames == 1;
    named(
        ui,
        "Layers",
        "Besides the picture: its parts by mode and by term, depth, tangent and more, as `render --aov` writes them; \
         OpenEXR, one picture",
        |ui| {
            let mut is_layered = still.is_layered();
            let checkbox = egui::Checkbox::without_text(&mut is_layered);
            let checkbox = ui.add_enabled(can_be_layered, checkbox);
            changes.place("Layers", &checkbox);
            if checkbox.changed() {
                still.has_layers = is_layered;
            }
        },
    );
    places.places.append(&mut changes.places);
    places.refused = places.refused.take().or(changes.refused);
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::*;

    #[test]
    fn a_name_without_an_ending_has_that_of_the_kind_chosen_last() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let mut still = Still::new(at("a-001.png").display().to_string(), [8, 8]);
        let mut typed = |path: &str, wanted: &str| {
            path.clone_into(&mut still.picker.path);
            still.picker.press();
            assert_eq!(still.path(), at(wanted), "{path}");
            still.is_exr()
        };
        assert!(!typed("b", "b.png"));
        assert!(typed("b.EXR", "b.EXR"));
        assert!(typed("c", "c.exr"));
        assert!(!typed("c.png", "c.png"));
        assert!(!typed("d", "d.png"));
        still.frames = 2;
        assert_eq!(still.files(), [at("d.0000.png"), at("d.0001.png")]);
    }

    /// All that a frame writes.
    fn texts(shape: &egui::Shape, found: &mut Vec<String>) {
        match shape {
            egui::Shape::Text(text) => found.push(text.galley.text().to_owned()),
            egui::Shape::Vec(shapes) => shapes.iter().for_each(|shape| texts(shape, found)),
            _ => {}
        }
    }

    #[test]
    fn the_range_of_sizes_is_the_one_that_is_taken() {
        let mut still = Still::new("a.png".to_owned(), [8, 8]);
        let asked = Asked {
            scene: "a",
            places: &[],
            window: [8, 8],
            scene_size: [8, 8],
        };
        let ctx = egui::Context::default();
        let output = ctx.run_ui(egui::RawInput::default(), |ui| {
            show(ui, &mut still, &asked, &mut Changes::default());
        });
        let mut found = Vec::new();
        for shape in &output.shapes {
            texts(&shape.shape, &mut found);
        }
        output.drop_without_applying_deltas();
        let wanted = format!("1..{MAX_SIDE} px");
        let n = found.iter().filter(|text| **text == wanted).count();
        assert_eq!(n, 2, "{found:?}");
    }
}
