//! Random numbers as a pure function of (seed, index, purpose).

use glam::Vec3;

/// What a random number is for; different purposes are independent.
#[derive(Clone, Copy, Debug)]
#[repr(u64)]
pub enum Purpose {
    RootU = 1,
    RootV,
    Length,
    Flyaway,
    Direction,
    Shell,
    Phase,
    Wander,
    Amplitude,
    Frequency,
    Disc,
    Clump,
    Thin,
    Interpolate,
}

/// A source of random numbers.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    seed: u64,
}

/// Finaliser of splitmix64 (Steele, Lea, Flood 2014): every output bit depends on every input bit.
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Noise {
    pub const fn new(seed: u64) -> Self {
        Noise { seed }
    }

    fn bits(self, index: u32, purpose: Purpose, dimension: u32) -> u64 {
        let key = (u64::from(index) << 32) | u64::from(dimension);
        mix(mix(mix(self.seed ^ 0x9e37_79b9_7f4a_7c15).wrapping_add(purpose as u64)) ^ key)
    }

    /// Uniform in 0..1.
    pub fn unit(self, index: u32, purpose: Purpose, dimension: u32) -> f32 {
        // 24 bits fill the significand of an f32 exactly.
        (self.bits(index, purpose, dimension) >> 40) as f32 / (1_u32 << 24) as f32
    }

    /// Uniform in -1..1.
    pub fn signed(self, index: u32, purpose: Purpose, dimension: u32) -> f32 {
        2.0 * self.unit(index, purpose, dimension) - 1.0
    }

    /// Uniform in the cube -1..1.
    pub fn vector(self, index: u32, purpose: Purpose) -> Vec3 {
        Vec3::new(
            self.signed(index, purpose, 0),
            self.signed(index, purpose, 1),
            self.signed(index, purpose, 2),
        )
    }

    /// A smooth curve through 0..1 for `t` in 0..=1: three sinusoids of random phase, about -1..1.
    pub fn curve(self, index: u32, purpose: Purpose, dimension: u32, t: f32) -> f32 {
        let mut sum = 0.0;
        for octave in 0..3_u32 {
            let phase = self.unit(index, purpose, 16 + 8 * dimension + octave);
            let cycles = 0.7 * (1 + octave) as f32;
            let weight = 0.6 / (1 + octave) as f32;
            sum += weight * (std::f32::consts::TAU * (cycles * t + phase)).sin();
        }
        sum
    }
}
