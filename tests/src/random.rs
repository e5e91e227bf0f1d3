//! Seeded random numbers for tests.

pub use strandlight_bake::random::SplitMix64;
