//! Values of the scattering model, for checking it from outside: what `strandlight probe` and the
//! Python module ask.
//!
//! - [`Request`]: a query as JSON says it, checked.
//! - [`Evaluator`]: a [`Method`] ready to answer; the closed forms on the CPU or on a [`Device`], the
//!   exact model, or the published scheme.

mod answer;
mod evaluate;
mod keys;
mod per_fibre;
mod reference;
mod request;
mod unique;

pub use answer::Answer;
pub use evaluate::{Device, Evaluator, Method, ProbeError};
pub use request::{Direction, Light, Request};
