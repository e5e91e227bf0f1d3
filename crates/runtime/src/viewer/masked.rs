//! The mask that is shown over the picture.

use strandlight_scene::RenderError;
use strandlight_scene::interactive::PictureProgress;

use super::Viewer;
use crate::mask_view::Below;

impl Viewer {
    /// Shows hair that is protected from brushes tinted, in a layer over the picture, or no longer.
    pub fn set_mask_shown(&mut self, is_shown: bool) {
        self.mask_view.set_wanted(is_shown);
    }

    /// The layer over the picture that is shown: sRGB times alpha. None where it is not wanted, and before it is known what the
    /// picture shows; while the view turns it has half as many columns and rows.
    pub fn mask_display(&self) -> Option<strandlight_cpu::DisplayPixels<'_>> {
        self.mask_view.display()
    }

    /// Is the layer made for the view that is shown? If not, it is that of the view before, moved.
    #[cfg(feature = "ui")]
    pub(crate) fn is_mask_of_view(&self) -> bool {
        self.mask_view.is_of_view()
    }

    /// Makes the layer anew where mask or picture changed. It waits for the picture to be shown: until then the view may
    /// be turning.
    pub(super) fn follow_mask(&mut self, progress: &PictureProgress) -> Result<(), RenderError> {
        if !self.mask_view.is_wanted() {
            return Ok(());
        }
        let (size, number) = (self.size(), self.n_outdated);
        let is_still = progress.is_shown && progress.is_shaded && !size.contains(&0);
        if is_still && self.mask_view.wants(number) {
            let scene = self.scene_of_mask()?;
            #[cfg(not(target_arch = "wasm32"))]
            self.mask_view.start(number, scene, size);
            #[cfg(target_arch = "wasm32")]
            {
                let picker = self.picker.of(&scene.strands);
                let offsets = &self.session.groom().strand_offsets;
                self.mask_view.find(number, &scene, size, offsets, picker)?;
            }
        }
        #[cfg(not(target_arch = "wasm32"))]
        {
            let picker = self.picker.of(&self.renderer.scene().strands);
            let offsets = &self.session.groom().strand_offsets;
            self.mask_view.take(offsets, picker)?;
        }
        let below = Below {
            number,
            size,
            camera: self.renderer.scene().camera,
            is_shown: progress.is_shown,
        };
        self.mask_view.tint(below, self.session.mask());
        Ok(())
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn scene_of_mask(&mut self) -> Result<strandlight_scene::PreparedScene, RenderError> {
        self.moved_scene()
    }

    #[cfg(target_arch = "wasm32")]
    fn scene_of_mask(&mut self) -> Result<strandlight_scene::PreparedScene, RenderError> {
        Ok(self.renderer.scene().clone())
    }
}
