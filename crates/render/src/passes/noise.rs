//! How noisy a picture still is, found without waiting.
//!
//! Whenever the number of passes is a power of two, the picture is compared, at some pixels, with
//! what it was at half as many. Let both halves err independently: then their means, of which one
//! is the earlier picture and the mean of both the later one, differ so that the change has the
//! variance of the later picture's error. Between powers of two the noise is taken to go down with
//! the square root. Of a wig of sub-pixel strands this finds 0.53, 0.35 and 0.146 at 8, 32 and 128
//! samples where the error is 0.67, 0.27 and 0.133.

use super::readback::Readback;
use super::resources::{bind, compute, compute_pass, grow, shader, step, storage, submit, uniform};
use super::stamp::Stamp;
use super::target::Target;
use crate::gpu::Context;
use strandlight_scene::RenderError;

/// Pixels from one that is looked at to the next: shares no factor with usual widths.
const STRIDE: u32 = 13;

/// Mirrored by `Halves` in `shaders/pass/noise.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Halves {
    n_samples: u32,
    n_before: u32,
    n_pixels: u32,
    stride: u32,
}

strandlight_scattering::mirrors! {
    Halves as "Halves" in "pass/noise" { n_samples, n_before, n_pixels, stride }
}

/// The pipeline and what it found.
pub(crate) struct Noise {
    pipeline: wgpu::ComputePipeline,
    halves: wgpu::Buffer,
    earlier: wgpu::Buffer,
    squares: wgpu::Buffer,
    group: Option<wgpu::BindGroup>,
    readback: Readback,
    /// Passes of the picture that the readback is about; none if it is about another picture.
    sent: Option<u32>,
    /// Passes, and the noise there was.
    found: Option<(u32, f32)>,
}

impl Noise {
    pub fn new(context: &Context) -> Result<Noise, RenderError> {
        let halves: Halves = bytemuck::Zeroable::zeroed();
        Ok(Noise {
            pipeline: compute(context, &shader(context, "pass/noise")?, "compare"),
            halves: uniform(context, "halves", &halves),
            earlier: storage(context, "earlier", 0),
            squares: storage(context, "squares", 0),
            group: None,
            readback: Readback::new(context, 16),
            sent: None,
            found: None,
        })
    }

    /// Restarts the picture.
    pub fn restart(&mut self) {
        self.sent = None;
        self.found = None;
    }

    /// The picture is drawn elsewhere.
    pub fn forget_target(&mut self) {
        self.group = None;
        self.restart();
    }

    /// Is it worth to look at a picture of so many passes?
    pub fn is_due(passes: u32) -> bool {
        passes.is_power_of_two()
    }

    /// Looks at `target`, which has so many passes.
    pub fn look(&mut self, context: &Context, target: &Target, passes: u32, stamp: Stamp) {
        let [width, height] = target.size();
        let n_pixels = width * height;
        if n_pixels < STRIDE || !Self::is_due(passes) {
            return;
        }
        let bytes = u64::from(n_pixels / STRIDE) * 16;
        if grow(context, &mut self.earlier, bytes) {
            self.group = None;
        }
        let halves = Halves {
            n_samples: 4 * passes,
            n_before: 2 * passes,
            n_pixels,
            stride: STRIDE,
        };
        context.write(&self.halves, 0, bytemuck::bytes_of(&halves));
        let group = self.group.get_or_insert_with(|| {
            let resources = [&self.halves, target.sums(), &self.earlier, &self.squares];
            let resources = [0, 1, 2, 3].map(|ix| (ix as u32, resources[ix].as_entire_binding()));
            bind(context, &self.pipeline.get_bind_group_layout(0), &resources)
        });
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            step(&mut pass, &self.pipeline, group, [1, 1]);
        });
        self.take();
        // A picture of one pass has no earlier one.
        if passes > 1 && self.readback.send(context, &self.squares, 8, |_| ()) {
            self.sent = Some(passes);
        }
    }

    /// Takes what has arrived.
    pub fn take(&mut self) {
        let Some(squares) = self.readback.take::<[f32; 2]>() else {
            return;
        };
        let Some(passes) = self.sent.take() else {
            return;
        };
        if let [[change, radiance]] = squares[..] {
            let noise = if radiance > 0.0 {
                (change / radiance).sqrt()
            } else {
                0.0
            };
            self.found = Some((passes, noise));
        }
    }

    /// The noise of a picture of so many passes: root mean square of the error over root mean
    /// square of the radiance.
    pub fn of(&self, passes: u32) -> Option<f32> {
        let (before, noise) = self.found?;
        Some(noise * (before as f32 / passes.max(1) as f32).sqrt())
    }
}
