//! Local multiple scattering as published (Xu 2011 Eq 29 to 33): averages by the separated
//! integral with Zinke's approximations, in 128 texels; their means by prefix sums.

use core::f32::consts::{FRAC_PI_2, PI};

use super::super::frame::{DirectionInFrame, inclination, lag_between};
use super::multiple::{forward_norm, outer_integral};
use crate::dual_scattering::{N_INCLINATIONS, event_separated, published};
use crate::fresnel::Fresnel;
use crate::hair::HairParams;

/// A_b, Delta_b and sigma_b of a fibre over the incident inclination, with the prefix sums of the
/// latter two.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedAverages {
    /// `[inclination][channel]`, evenly over -pi/2..=pi/2 with both ends.
    attenuation: Vec<[f32; 3]>,
    /// `[inclination][Delta_b, sigma_b][channel]`.
    shape: Vec<[[f32; 3]; 2]>,
    /// Integral of `shape`, linear between texels, from -pi/2 on.
    sums: Vec<[[f32; 3]; 2]>,
}

impl PublishedAverages {
    /// Those of `hair` (valid, see [`HairParams::validate`]): Eq 33, Zinke's Eq 14, 16 (its sign
    /// set right) and 17, in full angles. Some 20 ms.
    pub fn new(hair: &HairParams, fresnel: Fresnel) -> PublishedAverages {
        let step = std::f64::consts::PI / (N_INCLINATIONS - 1) as f64;
        let rows: Vec<_> = (0..N_INCLINATIONS)
            .map(|ix| {
                let theta = step * ix as f64 - std::f64::consts::FRAC_PI_2;
                published(&event_separated(theta, hair, fresnel))
            })
            .collect();
        let single = |value: [f64; 3]| value.map(|value| value as f32);
        let shape: Vec<[[f32; 3]; 2]> = rows
            .iter()
            .map(|row| [single(row.shift), single(row.width_2.map(f64::sqrt))])
            .collect();
        let mut sums = vec![[[0.0f32; 3]; 2]];
        for pair in shape.windows(2) {
            let before = sums[sums.len() - 1];
            sums.push(std::array::from_fn(|q| {
                std::array::from_fn(|c| {
                    before[q][c] + 0.5 * step as f32 * (pair[0][q][c] + pair[1][q][c])
                })
            }));
        }
        PublishedAverages {
            attenuation: rows.iter().map(|row| single(row.attenuation)).collect(),
            shape,
            sums,
        }
    }

    /// A_b at `theta`, linear between texels; beyond the ends the ends.
    fn attenuation(&self, theta: f32) -> [f32; 3] {
        let (ix, t) = place(theta);
        let (a, b) = (&self.attenuation[ix], &self.attenuation[ix + 1]);
        std::array::from_fn(|c| (1.0 - t) * a[c] + t * b[c])
    }

    /// Integral of Delta_b and sigma_b from -pi/2 to `theta`; beyond the ends they are constant.
    fn integral(&self, theta: f32) -> [[f32; 3]; 2] {
        let step = PI / (N_INCLINATIONS - 1) as f32;
        let (ix, t) = place(theta);
        let beyond = theta - theta.clamp(-FRAC_PI_2, FRAC_PI_2);
        std::array::from_fn(|q| {
            std::array::from_fn(|c| {
                let (a, b) = (self.shape[ix][q][c], self.shape[ix + 1][q][c]);
                let here = (1.0 - t) * a + t * b;
                self.sums[ix][q][c] + 0.5 * step * t * (a + here) + beyond * here
            })
        })
    }

    /// Means of Delta_b and sigma_b over `middle` +- `half`, `half` > 0 (Eq 31).
    fn means(&self, middle: f32, half: f32) -> [[f32; 3]; 2] {
        let (low, high) = (self.integral(middle - half), self.integral(middle + half));
        std::array::from_fn(|q| std::array::from_fn(|c| (high[q][c] - low[q][c]) / (2.0 * half)))
    }
}

/// The texel left of `theta` and how far on it is, 0..=1.
fn place(theta: f32) -> (usize, f32) {
    let last = (N_INCLINATIONS - 1) as f32;
    let x = ((theta / PI + 0.5) * last).clamp(0.0, last);
    let ix = (x as usize).min(N_INCLINATIONS - 2);
    (ix, x - ix as f32)
}

/// M^L (Eq 29): psi_f of width `sigma_f` around `light` over S_back cos(theta_i), linear RGB, with
/// psi_f and the Gaussian of S_back of unit mass; `segments` of the piecewise linear rule.
pub fn local_scattering(
    light: &DirectionInFrame,
    view: &DirectionInFrame,
    sigma_f: f32,
    averages: &PublishedAverages,
    segments: u32,
) -> [f32; 3] {
    let lag = lag_between(view.cos_phi, view.sin_phi, light.cos_phi, light.sin_phi);
    // Eq 30.
    let overlap = (PI - 2.0 * lag.sin_half.atan2(lag.cos_half)) / (PI * PI);
    let middle = 0.5 * (light.theta - view.theta);
    let [shift, width] = averages.means(middle, 0.5 * sigma_f);
    let scale = overlap * forward_norm(light, sigma_f);
    std::array::from_fn(|c| {
        let shape = [0.5 * shift[c], 0.5 * width[c].max(1e-3)];
        let [total] = outer_integral(light, sigma_f, view, shape, segments, |theta_i| {
            let theta = 0.5 * (theta_i - view.theta);
            let ratio = theta_i.cos().max(0.0) / inclination(theta).cos_theta_d;
            [averages.attenuation(theta)[c] * ratio * ratio]
        });
        scale * total
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_those_of_the_texels() {
        let averages = PublishedAverages::new(&HairParams::default(), Fresnel::Dielectric);
        for (middle, half) in [(0.2f32, 0.3f32), (-1.3, 0.05), (0.9, 1.5)] {
            let found = averages.means(middle, half);
            let n = 4000;
            for (q, found) in found.iter().enumerate() {
                for (c, found) in found.iter().enumerate() {
                    let values = (0..n).map(|i| {
                        let theta = middle + half * (2.0 * (i as f32 + 0.5) / n as f32 - 1.0);
                        let (ix, t) = place(theta);
                        let (a, b) = (averages.shape[ix][q][c], averages.shape[ix + 1][q][c]);
                        f64::from((1.0 - t) * a + t * b)
                    });
                    let error = f64::from(*found) - values.sum::<f64>() / f64::from(n);
                    assert!(error.abs() < 1e-4, "{middle} {half} {q} {c} {error}");
                }
            }
        }
    }

    #[test]
    fn a_narrow_cone_takes_the_averages_of_its_axis() {
        // sigma_f far below sigma_b: psi_f is a line, and the integral its value there.
        let averages = PublishedAverages::new(&HairParams::default(), Fresnel::Dielectric);
        let (theta_j, theta_o) = (0.2f32, 0.1f32);
        let light = DirectionInFrame::from_angles(theta_j, 0.0);
        let view = DirectionInFrame::from_angles(theta_o, 1.0);
        let found = local_scattering(&light, &view, 0.01, &averages, 64);
        let theta = 0.5 * (theta_j - theta_o);
        let (ix, _) = place(theta);
        for c in 0..3 {
            let [shift, width] = averages.shape[ix].map(|value| value[c]);
            let z = (theta_j - shift + theta_o) / width;
            let g = (-z * z).exp() / (PI.sqrt() * width);
            let expected =
                (PI - 1.0) / (PI * PI) * averages.attenuation(theta)[c] * g * theta_j.cos()
                    / (theta.cos() * theta.cos());
            assert!(
                (found[c] / expected - 1.0).abs() < 0.02,
                "{} {expected}",
                found[c]
            );
        }
    }
}
