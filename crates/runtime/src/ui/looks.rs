//! Looks that were kept, to be compared with the one that is edited: beside each other in one
//! picture, or one after the other.

use std::path::{Path, PathBuf};

use egui::{ColorImage, Rect, TextureHandle, TextureOptions};
use strandlight_formats::{HairSection, LightsSection, RenderSection, Scene, VariationSection};

use crate::session::Session;
use crate::viewer::Viewer;
use strandlight_scene::Camera;

/// Most looks that are kept; each holds a picture.
pub const MOST: usize = 16;

/// What a look is: all that an artist judges by the eye, and neither groom nor view.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    hair: HairSection,
    variation: VariationSection,
    lights: LightsSection,
    render: RenderSection,
}

impl Look {
    /// That of `scene`.
    pub fn of(scene: &Scene) -> Look {
        let RenderSection { size, samples, .. } = RenderSection::default();
        Look {
            hair: scene.hair.clone(),
            variation: scene.variation.clone(),
            lights: scene.lights.clone(),
            // Those of the scene are no part of it: whatever they are, the look is the same.
            render: RenderSection {
                size,
                samples,
                ..scene.render.clone()
            },
        }
    }

    /// Gives it to `scene`, whose picture keeps its size and samples.
    pub fn put_on(&self, scene: &mut Scene) {
        let (size, samples) = (scene.render.size, scene.render.samples);
        scene.hair = self.hair.clone();
        scene.variation = self.variation.clone();
        scene.lights = self.lights.clone();
        scene.render = RenderSection {
            size,
            samples,
            ..self.render.clone()
        };
    }

    /// Names its files as `after` does, which is the scene `before` saved elsewhere.
    fn move_along(&mut self, before: &Scene, after: &Session) {
        let scene = after.scene();
        let moved = |file: &Path, known: Option<PathBuf>, now: Option<&PathBuf>| {
            let whole = before.folder.join(file);
            match now.filter(|_| known.as_ref() == Some(&whole)) {
                // It may have been in memory, and have another name now.
                Some(now) => now.clone(),
                None if file.is_absolute() => whole,
                None => after.path_in_scene(&whole),
            }
        };
        let lights = &mut self.lights;
        lights.file = moved(
            &lights.file,
            Some(before.lights_path()),
            Some(&scene.lights.file),
        );
        if let Some(panorama) = &mut lights.panorama {
            let now = scene.lights.panorama.as_ref();
            *panorama = moved(panorama, before.panorama_path(), now);
        }
        if let Some(map) = &mut lights.map {
            *map = moved(map, None, None);
        }
        if let Some(lut) = &mut self.render.lut {
            *lut = moved(lut, None, None);
        }
    }
}

/// What a picture of a look is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookView {
    /// From where.
    pub camera: Camera,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// [`Viewer::n_beside_look`].
    n_beside_look: u64,
}

impl LookView {
    /// That of the picture that `viewer` shows.
    pub fn of(viewer: &Viewer) -> LookView {
        LookView {
            camera: viewer.prepared().camera,
            size: viewer.size(),
            n_beside_look: viewer.n_beside_look(),
        }
    }
}

/// A picture of a look.
#[derive(Clone)]
pub struct Shown {
    view: LookView,
    texture: TextureHandle,
}

impl std::fmt::Debug for Shown {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shown").field("view", &self.view).finish()
    }
}

/// A look that was kept.
#[derive(Clone, Debug)]
pub struct Kept {
    /// A letter, for people.
    pub name: String,
    /// The look.
    pub look: Look,
    /// Its picture, until the device is lost.
    pub shown: Option<Shown>,
    /// The view that it could not be drawn for.
    failed: Option<LookView>,
}

/// The looks that were kept.
#[derive(Debug)]
pub struct Looks {
    kept: Vec<Kept>,
    /// The one that is compared.
    chosen: usize,
    /// It is shown beside the one that is edited.
    pub is_wiping: bool,
    /// Where the pictures meet, 0..=1 from the left.
    pub at: f32,
    /// The look before the last swap.
    other: Option<Look>,
    n_made: u32,
}

impl Default for Looks {
    fn default() -> Self {
        Looks {
            kept: Vec::new(),
            chosen: 0,
            is_wiping: false,
            at: 0.5,
            other: None,
            n_made: 0,
        }
    }
}

impl Looks {
    /// All of them.
    pub fn kept(&self) -> &[Kept] {
        &self.kept
    }

    /// The one that is compared.
    pub fn chosen(&self) -> Option<&Kept> {
        self.kept.get(self.chosen)
    }

    /// Which that is.
    pub fn chosen_ix(&self) -> usize {
        self.chosen
    }

    /// Compares another one.
    pub fn choose(&mut self, ix: usize) {
        if ix != self.chosen {
            (self.chosen, self.other) = (ix, None);
        }
    }

    /// Keeps a look, which is compared from then on; answers its name.
    pub fn keep(&mut self, look: Look, shown: Option<Shown>) -> String {
        let letter = char::from(b'A' + (self.n_made % 26) as u8);
        let name = match self.n_made / 26 {
            0 => letter.to_string(),
            round => format!("{letter}{round}"),
        };
        self.n_made += 1;
        if self.kept.len() == MOST {
            self.kept.remove(0);
        }
        self.kept.push(Kept {
            name: name.clone(),
            look,
            shown,
            failed: None,
        });
        self.choose(self.kept.len() - 1);
        name
    }

    /// Drops one.
    pub fn remove(&mut self, ix: usize) {
        if ix < self.kept.len() {
            self.kept.remove(ix);
        }
        self.chosen = self.chosen.min(self.kept.len().saturating_sub(1));
        self.other = None;
        self.is_wiping &= !self.kept.is_empty();
    }

    /// The look to go to from `now`: the one that is compared, or from that the one that was edited.
    /// The one that is left is come back to by the next swap.
    pub fn swap(&mut self, now: Look) -> Option<(String, Look)> {
        let kept = self.chosen()?;
        let is_there = kept.look == now;
        let next = match (is_there, &self.other) {
            (true, Some(other)) => ("the look before".to_owned(), other.clone()),
            (true, None) => return None,
            (false, _) => (format!("look {}", kept.name), kept.look.clone()),
        };
        if !is_there {
            self.other = Some(now);
        }
        Some(next)
    }

    /// Names files as `after` does, which is the scene `before` saved elsewhere.
    pub fn move_along(&mut self, before: &Scene, after: &Session) {
        let kept = self.kept.iter_mut().map(|kept| &mut kept.look);
        for look in kept.chain(&mut self.other) {
            look.move_along(before, after);
        }
    }

    /// Takes up a picture of the one called `name`.
    pub fn show(&mut self, name: &str, shown: Shown) {
        if let Some(kept) = self.kept.iter_mut().find(|kept| kept.name == name) {
            kept.shown = Some(shown);
        }
    }

    /// The one called `name` cannot be drawn for this view.
    pub fn fail(&mut self, name: &str, view: LookView) {
        if let Some(kept) = self.kept.iter_mut().find(|kept| kept.name == name) {
            kept.failed = Some(view);
        }
    }

    /// Forgets pictures, which were on a device that is lost.
    pub fn forget_pictures(&mut self) {
        for kept in &mut self.kept {
            kept.shown = None;
        }
    }

    /// The picture to the left of the line, if there is one of this view.
    pub fn left(&self, view: &LookView) -> Option<&Shown> {
        let shown = self.chosen()?.shown.as_ref()?;
        (self.is_wiping && shown.view == *view).then_some(shown)
    }

    /// Has the look that is compared to be drawn for this view?
    pub fn wants(&self, view: &LookView) -> bool {
        self.is_wiping
            && !view.size.contains(&0)
            && self.left(view).is_none()
            && (self.chosen()).is_some_and(|kept| kept.failed != Some(*view))
    }
}

impl Shown {
    /// A picture in memory, sRGB times alpha, as a texture.
    pub fn new(egui: &egui::Context, view: LookView, pixels: &[[u8; 4]]) -> Option<Shown> {
        let sides = view.size.map(|side| side as usize);
        if pixels.len() != sides[0] * sides[1] || pixels.is_empty() {
            return None;
        }
        let colors = pixels
            .iter()
            .map(|&[r, g, b, a]| egui::Color32::from_rgba_premultiplied(r, g, b, a));
        let image = ColorImage::new(sides, colors.collect());
        let texture = egui.load_texture("look", image, TextureOptions::NEAREST);
        Some(Shown { view, texture })
    }

    /// Paints the part of it that lies left of `split` (a share of `rect`).
    pub fn paint(&self, painter: &egui::Painter, rect: Rect, split: f32) {
        let right = rect.left() + split * rect.width();
        let left = Rect::from_min_max(rect.min, egui::pos2(right, rect.bottom()));
        let whole = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
        painter
            .with_clip_rect(left.intersect(painter.clip_rect()))
            .image(self.texture.id(), rect, whole, egui::Color32::WHITE);
    }

    /// Paints its middle in `rect`.
    pub fn paint_small(&self, painter: &egui::Painter, rect: Rect) {
        let [width, height] = self.view.size.map(|side| side as f32);
        let wanted = rect.width() / rect.height();
        let (u, v) = match width / height > wanted {
            true => (wanted * height / width, 1.0),
            false => (1.0, width / height / wanted),
        };
        let middle = Rect::from_center_size(egui::pos2(0.5, 0.5), egui::vec2(u, v));
        painter.image(self.texture.id(), rect, middle, egui::Color32::WHITE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(eta: f64) -> Look {
        let mut scene = Scene::new("a", "b");
        scene.hair.eta = eta;
        Look::of(&scene)
    }

    #[test]
    fn looks_are_swapped_to_and_fro() {
        let mut looks = Looks::default();
        assert!(looks.swap(look(1.5)).is_none());
        assert_eq!(looks.keep(look(1.4), None), "A");
        assert!(looks.swap(look(1.4)).is_none(), "it is the same");
        let (name, to) = looks.swap(look(1.6)).expect("A");
        assert_eq!((name.as_str(), to.clone()), ("look A", look(1.4)));
        let (_, back) = looks.swap(to).expect("the one before");
        assert_eq!(back, look(1.6));
        // Edited further, it is left for A again, and come back to.
        let (_, to) = looks.swap(look(1.7)).expect("A");
        assert_eq!(looks.swap(to).expect("back").1, look(1.7));
        assert_eq!(looks.keep(look(1.7), None), "B");
        assert_eq!(looks.chosen().expect("B").name, "B");
        looks.remove(1);
        assert_eq!(looks.chosen().expect("A").name, "A");
        for _ in 0..2 * MOST {
            looks.keep(look(1.3), None);
        }
        assert_eq!((looks.kept().len(), looks.chosen_ix()), (MOST, MOST - 1));
        looks.is_wiping = true;
        while !looks.kept().is_empty() {
            looks.remove(0);
        }
        assert!(!looks.is_wiping && looks.chosen().is_none());
    }

    #[test]
    fn a_look_leaves_shape_view_and_size_alone() {
        let mut scene = Scene::new("a", "b");
        scene.render.size = [30, 20];
        let other = look(1.8);
        other.put_on(&mut scene);
        assert_eq!((scene.hair.eta, scene.render.size), (1.8, [30, 20]));
        assert_eq!(scene.groom.file.to_str(), Some("a"));
    }

    #[test]
    fn size_and_samples_are_no_part_of_a_look() {
        let mut scene = Scene::new("a", "b");
        let mut looks = Looks::default();
        looks.keep(Look::of(&scene), None);
        scene.hair.eta = 1.7;
        let (_, kept) = looks
            .swap(Look::of(&scene))
            .expect("the look that was kept");
        kept.put_on(&mut scene);
        scene.render.samples += 1;
        scene.render.size = [30, 20];
        let (_, back) = looks.swap(Look::of(&scene)).expect("the look before");
        back.put_on(&mut scene);
        assert_eq!((scene.hair.eta, scene.render.size), (1.7, [30, 20]));
    }

    #[test]
    fn a_look_that_cannot_be_drawn_is_tried_again_for_another_view() {
        let mut looks = Looks::default();
        let name = looks.keep(Look::of(&Scene::new("a", "b")), None);
        looks.is_wiping = true;
        let camera = Camera {
            eye: glam::Vec3::Z,
            target: glam::Vec3::ZERO,
            up: glam::Vec3::Y,
            fov_y: 0.5,
        };
        let view = LookView {
            camera,
            size: [40, 30],
            n_beside_look: 0,
        };
        assert!(looks.wants(&view));
        looks.fail(&name, view);
        assert!(!looks.wants(&view));
        let edited = LookView {
            n_beside_look: 1,
            ..view
        };
        assert!(looks.wants(&edited));
    }
}
