//! Seeded random numbers: the same on every machine and for any number of threads.

/// Steps of an additive sequence that fills the unit square evenly (Roberts 2018): 1/g and 1/g^2, g the plastic
/// number (g^3 = g + 1).
pub const R2: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// Turns by this angle, radians, spread directions about an axis evenly.
pub const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// SplitMix64 (Steele, Lea and Flood 2014); the field is its state.
#[derive(Clone, Debug)]
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    /// The generator of item `ix` under `seed`: items are independent of each other and of how
    /// many there are, so they can be drawn in any order.
    pub fn of_item(seed: u64, ix: u64) -> Self {
        let start = SplitMix64(seed).next_u64();
        SplitMix64(SplitMix64(start ^ ix).next_u64())
    }

    /// The next 64 bits.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `low..high`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next_u64() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// Logarithmically uniform in `low..high`, both above 0.
    pub fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        self.uniform(low.ln(), high.ln()).exp()
    }
}
