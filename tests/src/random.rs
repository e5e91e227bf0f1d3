//! Seeded random numbers for tests.

pub use strandlight_scattering::random::SplitMix64;
