//! The renderer that `strandlight render` uses.

use strandlight_cpu::CpuRenderer;
use strandlight_lab::transmittance::{Method, point_shadows};
use strandlight_render::ProgressiveRenderer;
use strandlight_render::gpu::Context;
use strandlight_scene::{Backend, PreparedScene, RenderError};

use super::args::{Args, Choice};
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
        let on_gpu = || {
            let context = Context::new().map_err(|error| RenderError::Gpu(error.into()))?;
            work(&|scene| Ok(Box::new(ProgressiveRenderer::new(&context, scene)?)))
        };
        let on_cpu = || work(&|scene| Ok(self.on_cpu(scene)));
        let done = match self.backend {
            // Baselines run on the CPU only.
            _ if self.transmittance != Method::Sweep => on_cpu(),
            Choice::Cpu => on_cpu(),
            Choice::Gpu => on_gpu(),
            // It draws what the CPU draws, more slowly.
            Choice::Auto if is_software() => on_cpu(),
            Choice::Auto => on_gpu().or_else(|error| {
                note!("rendering on the CPU: {error}");
                on_cpu()
            }),
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

/// Is a software rasteriser the only adapter?
fn is_software() -> bool {
    Context::new().is_ok_and(|context| context.is_software())
}
