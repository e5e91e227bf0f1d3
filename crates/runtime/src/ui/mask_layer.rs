//! The mask over the picture, as a texture.

use egui::{ColorImage, Rect, TextureHandle, TextureOptions, Ui, pos2};
use strandlight_cpu::DisplayPixels;

/// The texture of the layer that is shown.
#[derive(Default)]
pub struct MaskLayer {
    texture: Option<(u64, TextureHandle)>,
    /// What the log was told last: whether it is shown, and made for the view that is.
    pub told: (bool, bool),
}

impl std::fmt::Debug for MaskLayer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut shown = f.debug_struct("MaskLayer");
        shown
            .field("version", &self.version())
            .finish_non_exhaustive()
    }
}

impl MaskLayer {
    /// Version of the layer that was shown last.
    pub fn version(&self) -> Option<u64> {
        self.texture.as_ref().map(|(version, _)| *version)
    }

    /// Lays `display` over the picture in `rect`.
    pub fn show(&mut self, ui: &Ui, display: Option<DisplayPixels<'_>>, rect: Rect) {
        let Some(display) = display else {
            self.texture = None;
            return;
        };
        let size = display.size.map(|side| side as usize);
        let image = || ColorImage::from_rgba_premultiplied(size, display.pixels.as_flattened());
        match &mut self.texture {
            Some((version, _)) if *version == display.version => {}
            Some((version, texture)) => {
                *version = display.version;
                texture.set(image(), TextureOptions::NEAREST);
            }
            none => {
                let texture = ui
                    .ctx()
                    .load_texture("mask", image(), TextureOptions::NEAREST);
                *none = Some((display.version, texture));
            }
        }
        if let Some((_, texture)) = &self.texture {
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            let painter = ui.painter().with_clip_rect(rect);
            painter.image(texture.id(), rect, whole, egui::Color32::WHITE);
        }
    }

    /// Forgets what was on a device that is lost.
    pub fn forget(&mut self) {
        self.texture = None;
    }
}
