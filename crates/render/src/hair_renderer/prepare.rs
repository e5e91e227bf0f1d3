//! What a host has recorded before its pass.

use super::job::{DirtyFlags, Stepped};
use super::view::{HairView, HostCamera};
use super::{HairError, HairRenderer, PrepareBudget};
use crate::passes::lighting::POINT_CHUNK;
use crate::passes::strand_pass::Host;
use strandlight_scene::RenderError;

impl HairRenderer {
    /// Records into `encoder` what has to run before [`HairRenderer::draw`]: shadows and shading of
    /// what changed, at most as `budget` says, and the projection of the strands. Nothing is
    /// recorded where nothing changed.
    ///
    /// # Errors
    /// A view that hair cannot be drawn in, nothing being changed then; whatever the device
    /// refuses.
    pub fn prepare(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: &HairView,
        budget: PrepareBudget,
    ) -> Result<(), HairError> {
        let camera = HostCamera::new(view)?;
        let context = self.context.clone();
        context.record(encoder, || {
            self.light(view, &camera, budget)?;
            self.place(view, &camera);
            Ok(())
        })
    }

    /// Shades as much as `budget` says.
    fn light(
        &mut self,
        view: &HairView,
        camera: &HostCamera,
        budget: PrepareBudget,
    ) -> Result<(), RenderError> {
        self.set_camera(camera.camera);
        self.set_size(view.size);
        let mut left = match budget {
            PrepareBudget::Complete => u32::MAX,
            PrepareBudget::Steps(steps) => steps.max(1),
        };
        while left > 0 && !self.is_complete() {
            if self.job.is_none() {
                self.begin(DirtyFlags::default(), false, POINT_CHUNK)?;
                if self.front_scale.is_none() && budget != PrepareBudget::Complete {
                    self.preview()?;
                }
            }
            match self.step(POINT_CHUNK)? {
                Some(Stepped::Ran { .. }) => left -= 1,
                // Hosts have no lists.
                Some(Stepped::AwaitsList | Stepped::Listed) => break,
                Some(Stepped::Restarted | Stepped::Done(_)) | None => {}
            }
        }
        Ok(())
    }

    /// Projects the strands for the host's view, unless they are.
    fn place(&mut self, view: &HairView, camera: &HostCamera) {
        let Some(scale) = self.front_scale else {
            return;
        };
        let before = self.hosted.filter(|_| self.is_projected);
        if before == Some((*view, scale)) {
            return;
        }
        let uniform = self.view();
        let is_same = before.is_some_and(|(before, _)| {
            HairView {
                frame: view.frame,
                ..before
            } == *view
        });
        match is_same {
            true => self.ribbons.set_view(&self.context, &uniform),
            false => self.project(&uniform),
        }
        self.ribbons.set_frame(&self.context, view.frame);
        let host = Host {
            depth: camera.depth,
            shift: camera.shift,
            corner: view.origin.map(|x| x as f32),
            scale: 1.0 / scale,
            pad: 0.0,
        };
        self.strand_pass.set_host(&self.context, &host);
        self.hosted = Some((*view, scale));
    }
}
