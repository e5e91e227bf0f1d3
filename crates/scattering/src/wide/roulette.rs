//! What hardly counts is left to chance.

use core::f32::consts::PI;

use crate::closed_form::{DirectionInFrame, LightInFrame, Shading, single_scattering_mode};

/// By mode: places of the lights that it answers to, and about how much.
pub(super) type Expected = [Vec<(u32, f32)>; 3];

/// Leaves out most of what hardly counts, and counts the rest of it for that: right in the mean.
#[derive(Clone, Copy, Debug)]
pub struct Roulette {
    /// What is expected to be less than this share of all is left to chance.
    pub tolerance: f32,
    /// Of the fibre.
    pub peaks: Peaks,
    /// Another number, other chances; neighbouring numbers share them out evenly.
    pub seed: u32,
}

/// Largest response of each mode over what its longitudinal lobe alone lets expect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks(pub(super) [f32; 3]);

impl Peaks {
    /// Of a fibre, by a light that moves around it.
    pub fn of(shading: &Shading) -> Peaks {
        const LAMBDA: f32 = 0.15;
        const N_AZIMUTHS: u32 = 12;
        let mut peaks = [0.0f32; 3];
        for (mode, peak) in peaks.iter_mut().enumerate() {
            let (alpha, beta) = (shading.fibre.alpha[mode], shading.fibre.beta[mode]);
            let expected = LAMBDA * LAMBDA / (LAMBDA * LAMBDA + 4.0 * beta * beta).sqrt();
            for theta_o in [-0.8f32, 0.0, 0.8] {
                for ix in 0..=N_AZIMUTHS {
                    let phi = PI * ix as f32 / N_AZIMUTHS as f32;
                    let (theta, view) =
                        (2.0 * alpha - theta_o, [theta_o.sin(), theta_o.cos(), 0.0]);
                    let light = [
                        theta.sin(),
                        theta.cos() * phi.cos(),
                        theta.cos() * phi.sin(),
                    ];
                    let light = LightInFrame::from_vector(light, LAMBDA);
                    let view = DirectionInFrame::from_vector(view);
                    let rgb = single_scattering_mode(mode as u32, &light, &view, shading);
                    *peak = rgb
                        .into_iter()
                        .fold(*peak, |peak, x| peak.max(x / expected));
                }
            }
        }
        Peaks(peaks)
    }
}

impl Roulette {
    /// What is expected to be less than this is left to chance.
    pub(super) fn least(&self, expected: &Expected) -> f32 {
        let mut sum = 0.0;
        for (places, peak) in expected.iter().zip(self.peaks.0) {
            for (_, expected) in places {
                sum += peak * expected;
            }
        }
        self.tolerance * sum
    }

    /// A number in 0..1, of a sequence over `seed` that is spread evenly, for each light and mode.
    pub(super) fn draw(&self, light: u32, mode: u32) -> f32 {
        /// Parts of 1 in 2^32: the golden ratio and sqrt(2), less their whole parts.
        const GOLDEN: u32 = 0x9e37_79b9;
        const ROOT_2: u32 = 0x6a09_e667;
        let at = self
            .seed
            .wrapping_mul(GOLDEN)
            .wrapping_add((3 * light + mode).wrapping_mul(ROOT_2));
        (at >> 8) as f32 * (1.0 / 16_777_216.0)
    }
}
