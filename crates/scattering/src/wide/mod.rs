//! The closed form for eight lights at a time, on the CPU.
//!
//! What [`crate::closed_form`] computes for one light, the functions here compute for the eight lanes
//! of a vector, under the names of their scalar twins. Scalar code is what the shaders do and
//! stays the judge: tests hold every function here to it.
//!
//! - [`WideLights`]: the lights of a scene; [`single_scattering()`] fills [`Responses`] with what a
//!   [`Place`] answers to those that are wanted, each mode for itself.
//! - [`sample_forward`], [`forward_light`]: what multiple scattering starts from.
//! - [`Stretch`], [`add_to_record`], [`pack_records`]: what hair leaves of a light, in eight voxels.
//! - `local_scattering`, `mean_cosine`, `half_circle`: what the rows of tables of multiple scattering are made of, eight rows
//!   at a time.
//! - [`math`]: elementary and special functions.
//!
//! Functions are generic over the instruction set, a [`Simd`] token, and inlined into their caller.
//! [`dispatch!`] picks AVX2 with FMA, or else what every processor of the target has (SSE2, NEON,
//! simd128 where the page's build says so, or nothing), and runs a closure with its token; it belongs around some work, at least a ray or all lights. Closures that are handed on to other
//! functions (`array::map` among them) lose the instruction set: inside, loops are loops.
//!
//! Differences from the scalar code are within 1e-5 of a value or of a hundredth of the largest one; of rows of tables 2e-5 of
//! the largest, and 1e-7 over the width of the light.
//! The same input gives the same bytes at the same instruction set; sets with a fused multiply-add
//! round otherwise than those without, which would be 20 % slower there if they did not. Single
//! scattering of the default hair takes 113 ns a product (a point and a light, all modes) with AVX2 where
//! one light at a time takes 640, and 194 with SSE2. A painted point's lobes are
//! texels of a fibre of its own ([`crate::closed_form::PointLobes`]).
//!
//! [`dispatch!`]: macro@crate::wide::dispatch

mod azimuthal;
mod azimuthal_r;
mod dispatch;
pub(crate) mod eccentric;
mod fisher;
#[cfg(test)]
pub(crate) mod fixture;
mod frame;
pub(crate) mod half_circle;
mod lights;
mod lobes;
pub(crate) mod local_scattering;
pub mod math;
pub(crate) mod mean_cosine;
mod multiple_scattering;
pub(crate) mod outer_integral;
mod roulette;
pub(crate) mod rows;
mod seen;
mod single_scattering;
mod through;
mod transmittance;

pub use fearless_simd::{Level, Simd, f32x8, i32x8, mask32x8, prelude};

pub use dispatch::dispatch;
pub use frame::{Directions, Place};
pub use lights::WideLights;
pub use multiple_scattering::{
    ForwardAverages, ForwardLights, MOST_DEPTH, ShadowRecords, depths_of_shares, forward_light,
    local_density, sample_forward,
};
pub use roulette::{Peaks, Roulette};
pub use rows::{sums, transpose};
pub use single_scattering::{Response, Responses, single_scattering, single_scattering_at};
pub use through::through_kernel;
pub use transmittance::{RecordSums, Stretch, add_to_record, pack_records};

/// Lanes of a vector.
pub const LANES: usize = 8;

/// Every instruction set of this machine, the best first, and, with the feature `fallback`, none at all.
#[cfg(test)]
pub(crate) fn levels() -> Vec<(&'static str, Level)> {
    let best = Level::new();
    let levels = [
        Some(("best", best)),
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        best.as_sse2().map(|sse2| ("SSE2", sse2.level())),
        #[cfg(feature = "fallback")]
        Some(("none", Level::Fallback(fearless_simd::Fallback::new()))),
    ];
    levels.into_iter().flatten().collect()
}
