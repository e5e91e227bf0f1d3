//! Random light, view and hair: what accuracy is measured on.

use std::f64::consts::{PI, SQRT_2};

use strandlight_scattering::closed_form::{DirectionInFrame, LightInFrame};
use strandlight_scattering::exact::{Light, View};
use strandlight_scattering::{HairParams, Model, PerLobe};

use strandlight_scattering::random::SplitMix64;

/// One spherical Gaussian light of amplitude 1, a view and a fibre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Configuration {
    /// The fibre.
    pub hair: HairParams,
    /// The light.
    pub light: Light,
    /// The direction to the eye.
    pub view: View,
}

impl Configuration {
    /// Light and view as the closed forms take them, in single precision.
    pub fn in_frame(&self) -> (LightInFrame, DirectionInFrame) {
        let light = self.light;
        (
            LightInFrame::from_angles(light.theta as f32, light.phi as f32, light.lambda as f32),
            DirectionInFrame::from_angles(self.view.theta as f32, self.view.phi as f32),
        )
    }
}

/// How configurations are drawn.
///
/// All sets: `alpha_R` uniform in -8..-2 degrees, `alpha_TT = -alpha_R/2`, `alpha_TRT =
/// -3 alpha_R/2`; `beta_R` uniform in 4..12 degrees standard deviation, `beta_TT = beta_R/2`,
/// `beta_TRT = 2 beta_R`; sigma_a log-uniform in 0.03..2; lambda log-uniform in 0.05..1.2; the
/// sines of both inclinations uniform in +-0.98, azimuths uniform; circular fibres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Set {
    /// eta 1.55, w_c 0.15, one sigma_a for all channels.
    Accuracy,
    /// eta uniform in 1.45..1.65, w_c uniform in 0.08..0.3, sigma_a of each channel on its own.
    Wide,
    /// As [`Set::Wide`], of model `energy`.
    Energy,
}

impl Set {
    /// The name in flags and files: `accuracy`, `wide`.
    pub const fn name(self) -> &'static str {
        match self {
            Set::Accuracy => "accuracy",
            Set::Wide => "wide",
            Set::Energy => "energy",
        }
    }

    /// The fibre model.
    pub const fn model(self) -> Model {
        match self {
            Set::Accuracy | Set::Wide => Model::Marschner,
            Set::Energy => Model::Energy,
        }
    }

    /// Configuration `ix` under `seed`; depends on nothing else.
    pub fn draw(self, seed: u64, ix: u64) -> Configuration {
        let random = &mut SplitMix64::of_item(seed, ix);
        let deg = PI / 180.0;
        let alpha = -random.uniform(2.0, 8.0) * deg;
        let beta = random.uniform(4.0, 12.0) * deg * SQRT_2;
        let sigma_a = [(); 3].map(|()| random.log_uniform(0.03, 2.0));
        let eta = random.uniform(1.45, 1.65);
        let caustic_width = random.uniform(0.08, 0.3);
        let lambda = random.log_uniform(0.05, 1.2);
        let [theta_j, theta_o] = [(); 2].map(|()| random.uniform(-0.98, 0.98).asin());
        let [phi_j, phi_o] = [(); 2].map(|()| random.uniform(-PI, PI));
        let wide = self != Set::Accuracy;
        Configuration {
            hair: HairParams {
                eta: if wide { eta } else { 1.55 },
                sigma_a: if wide { sigma_a } else { [sigma_a[0]; 3] },
                shift: PerLobe {
                    r: alpha,
                    tt: -0.5 * alpha,
                    trt: -1.5 * alpha,
                },
                width: PerLobe {
                    r: beta,
                    tt: 0.5 * beta,
                    trt: 2.0 * beta,
                },
                caustic_width: if wide { caustic_width } else { 0.15 },
                model: self.model(),
                ..HairParams::default()
            },
            light: Light {
                theta: theta_j,
                phi: phi_j,
                lambda,
            },
            view: View {
                theta: theta_o,
                phi: phi_o,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_valid_and_fill_their_ranges() {
        for set in [Set::Accuracy, Set::Wide] {
            let (mut low, mut high) = ([f64::INFINITY; 9], [f64::NEG_INFINITY; 9]);
            for ix in 0..5000 {
                let drawn = set.draw(3, ix);
                drawn.hair.validate().unwrap();
                let hair = &drawn.hair;
                let values = [
                    hair.eta,
                    hair.caustic_width,
                    hair.sigma_a[2],
                    hair.shift.r.to_degrees(),
                    hair.width.r.to_degrees() / SQRT_2,
                    drawn.light.lambda,
                    drawn.light.theta.sin(),
                    drawn.view.theta.sin(),
                    drawn.view.phi - drawn.light.phi,
                ];
                for (value, (low, high)) in values.iter().zip(low.iter_mut().zip(&mut high)) {
                    *low = low.min(*value);
                    *high = high.max(*value);
                }
            }
            let mut expected = [
                (1.45, 1.65),
                (0.08, 0.3),
                (0.03, 2.0),
                (-8.0, -2.0),
                (4.0, 12.0),
                (0.05, 1.2),
                (-0.98, 0.98),
                (-0.98, 0.98),
                (-2.0 * PI, 2.0 * PI),
            ];
            if set == Set::Accuracy {
                expected[..2].copy_from_slice(&[(1.55, 1.55), (0.15, 0.15)]);
            }
            for (k, (a, b)) in expected.into_iter().enumerate() {
                let slack = 0.03 * (b - a) + 1e-12;
                assert!((0.0..=slack).contains(&(low[k] - a)), "{k} {} {a}", low[k]);
                assert!(
                    (0.0..=slack).contains(&(b - high[k])),
                    "{k} {} {b}",
                    high[k]
                );
            }
        }
    }

    #[test]
    fn items_are_independent_of_order_and_differ() {
        let late = Set::Wide.draw(0, 7);
        for ix in 0..7 {
            assert_ne!(Set::Wide.draw(0, ix), late);
        }
        assert_eq!(Set::Wide.draw(0, 7), late);
        assert_ne!(Set::Wide.draw(1, 7), late);
        let same = Set::Accuracy.draw(0, 7);
        assert_eq!(same.light, late.light);
        assert!(same.hair.sigma_a.iter().all(|&s| s == same.hair.sigma_a[0]));
    }
}
