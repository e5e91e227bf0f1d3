//! The renderer that `strandlight render` uses.

use strandlight_cpu::CpuRenderer;
use strandlight_lab::transmittance::{Method, point_shadows};
use strandlight_render::ProgressiveRenderer;
use strandlight_render::gpu::Context;
use strandlight_runtime::{BackendChoice, Chosen, CpuReason};
use strandlight_scene::{Backend, PreparedScene, RenderError};

use super::args::Args;
use crate::cli::{Failure, note};

/// Puts a scene on a renderer.
pub type Open<'a> = &'a dyn Fn(PreparedScene) -> Result<Box<dyn Backend>, RenderError>;

impl Args {
    /// Does `work` with a renderer on the GPU or the CPU, as the command line asks; with `auto` on
    /// the CPU, and a note that says why, if the GPU cannot do it. Every way to render is decided
    /// here.
    pub fn on_backend<T>(
        &self,
        work: impl Fn(Open) -> Result<T, RenderError>,
    ) -> Result<T, Failure> {
        let on_gpu = |context: &Context| {
            work(&|scene| {
                let mut renderer = ProgressiveRenderer::new(context, scene)?;
                if self.samples.is_none() {
                    renderer.draw_by_list()?;
                }
                Ok(Box::new(renderer))
            })
        };
        let on_cpu = || work(&|scene| Ok(self.on_cpu(scene)));
        let instead = |error: &dyn std::fmt::Display| {
            note!("rendering on the CPU: {error}");
            on_cpu()
        };
        let choice = match self.transmittance {
            Method::Sweep => self.backend.into(),
            // Baselines run on the CPU only.
            _ => BackendChoice::Cpu,
        };
        let done = match choice.decide(Context::new) {
            Ok(Chosen::Cpu(CpuReason::Failed(error))) => instead(&error),
            Ok(Chosen::Cpu(_)) => on_cpu(),
            Ok(Chosen::Gpu(context)) => match (on_gpu(&context), choice) {
                (Err(error), BackendChoice::Auto) => instead(&error),
                (drawn, _) => drawn,
            },
            Err(error) => Err(RenderError::Gpu(error.into())),
        };
        done.map_err(Failure::input)
    }

    fn on_cpu(&self, scene: PreparedScene) -> Box<dyn Backend> {
        let method = self.transmittance;
        Box::new(match method {
            Method::Sweep if self.samples.is_none() => CpuRenderer::new(scene),
            Method::Sweep => CpuRenderer::by_samples(scene),
            _ => {
                let find =
                    Box::new(move |scene: &_, lights: &_| point_shadows(method, scene, lights));
                CpuRenderer::with_shadows(scene, find)
            }
        })
    }
}
