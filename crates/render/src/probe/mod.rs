//! Single values of the shading functions, on the CPU and on the GPU.
//!
//! - [`Query`], [`evaluate()`]: which function at which point, and the answer of the Rust functions;
//!   those of [`strandlight_scene::probe`].
//! - [`GpuProbe`]: the answers of the WGSL functions themselves, on the adapter.

mod bench;
mod gpu;
mod multiple;
mod painted;

pub use bench::{GpuBench, MAX_VIEWS, Workload};
pub use gpu::GpuProbe;
pub use multiple::{MultipleQuestion, gpu_multiple_answers};
pub use painted::{
    PaintQuestion, gpu_paint_answers, gpu_painted_lobes, paint_answer, painted_lobes,
};
pub use strandlight_scene::probe::{Function, MODE_ALL, Query, SAMPLED_AVERAGES, Scheme, evaluate};

/// The structs here that shaders mirror.
pub(crate) fn layouts() -> Vec<strandlight_scattering::layout::Layout> {
    [multiple::LAYOUTS, painted::LAYOUTS].concat()
}
