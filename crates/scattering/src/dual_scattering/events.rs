//! [`super::event()`] of one fibre at many inclinations, to the same digits.

use std::f64::consts::PI;

use super::azimuth::{AzimuthRule, Halves};
use super::event::{BREATH, Event, event_of_modes};
use super::longitudinal::{full_angle, outgoing};
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe, Model};
use crate::quadrature::GaussLegendre;

/// Panels over cos(theta_d), even in `asinh(c / k)`, `k = sqrt(eta^2 - 1)` and at least this, and
/// Chebyshev nodes of each.
const K_MIN: f64 = 0.02;
const N_PANELS: usize = 6;
const N_CHEBYSHEV: usize = 12;
/// Nodes over half the fibre's width; half angles of an elliptic fibre.
const N_OFFSETS: usize = 96;
const N_TURNS: usize = 32;
/// Nodes of a panel of theta_o and widths of M_t looked at: erfc(6) = 2e-17.
const N_OUTGOING: usize = 8;
const REACH: f64 = 6.0;

/// Averages of one event as [`super::event()`] has them, with q_f and q_b by interpolation.
///
/// Attenuations are within 1e-9 of it, of an elliptic fibre 1e-8 (tested). Some 10 ms
/// to make, of an elliptic fibre 100; 0.1 ms an inclination.
#[derive(Clone, Debug)]
pub struct Events {
    hair: HairParams,
    /// Model `energy` takes q from here, at one inclination and not over all of them.
    azimuth: AzimuthRule,
    /// `1 / k`, and panels per unit of asinh.
    scale: [f64; 2],
    /// `[mode][panel][node]`: q_f per channel, then q_b.
    values: [Vec<[[f64; 6]; N_CHEBYSHEV]>; 3],
    nodes: [f64; N_CHEBYSHEV],
    rule: GaussLegendre,
}

impl Events {
    /// Those of `hair` (valid, see [`HairParams::validate`]).
    pub fn new(hair: &HairParams, fresnel: Fresnel) -> Events {
        let azimuth = AzimuthRule::new(hair, fresnel, N_OFFSETS, N_TURNS);
        let k = ((hair.eta - 1.0) * (hair.eta + 1.0))
            .max(0.0)
            .sqrt()
            .max(K_MIN);
        let length = k.recip().asinh();
        // Chebyshev points of the first kind on -1..=1.
        let nodes = std::array::from_fn(|i| (PI * (i as f64 + 0.5) / N_CHEBYSHEV as f64).cos());
        let at = |lobe, panel: usize, x: f64| {
            let share = (panel as f64 + 0.5 * (x + 1.0)) / N_PANELS as f64;
            let Halves { forward, backward } = azimuth.halves(lobe, k * (length * share).sinh());
            let [a, b, c] = forward;
            let [d, e, f] = backward;
            [a, b, c, d, e, f]
        };
        let values = Lobe::ALL.map(|lobe| {
            (0..N_PANELS)
                .map(|panel| nodes.map(|x| at(lobe, panel, x)))
                .collect()
        });
        Events {
            hair: *hair,
            azimuth,
            scale: [k.recip(), N_PANELS as f64 / length],
            values,
            nodes,
            rule: GaussLegendre::new(N_OUTGOING),
        }
    }

    /// Adds `weight` times q of a mode at `cos_theta_d` in 0..=1: the barycentric formula.
    fn add(&self, mode: usize, cos_theta_d: f64, weight: f64, sums: &mut [f64; 6]) {
        let place = self.scale[1] * (self.scale[0] * cos_theta_d).asinh();
        let panel = (place as usize).min(N_PANELS - 1);
        let x = 2.0 * (place - panel as f64) - 1.0;
        let rows = &self.values[mode][panel];
        let (mut total, mut below) = ([0.0; 6], 0.0);
        for (i, (node, row)) in self.nodes.iter().zip(rows).enumerate() {
            let apart = x - node;
            if apart.abs() < 1e-14 {
                total = *row;
                below = 1.0;
                break;
            }
            // Weights (-1)^i sin((2i+1) pi / 2n), the sine from the node itself.
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let share = sign * (1.0 - node * node).sqrt() / apart;
            below += share;
            for (total, value) in total.iter_mut().zip(row) {
                *total += share * value;
            }
        }
        for (sum, total) in sums.iter_mut().zip(total) {
            *sum += weight * (total / below).max(0.0);
        }
    }

    /// The averages at incident inclination `theta` in +-pi/2.
    pub fn at(&self, theta: f64) -> Event {
        let mut modes = [Halves::default(); 3];
        for (ix, (lobe, mode)) in Lobe::ALL.into_iter().zip(&mut modes).enumerate() {
            if self.hair.model == Model::Energy {
                *mode = self.azimuth.halves(lobe, theta.cos());
                continue;
            }
            let (shift, width) = full_angle(&self.hair, lobe);
            // As event() has it, a breath first, so that no share is 0 / 0.
            let mut sums = [1e-140; 6];
            self.add(ix, theta.cos(), BREATH, &mut sums);
            for node in outgoing(theta, shift, width, REACH, 1.0, &self.rule) {
                self.add(ix, node.cos_theta_d, node.weight, &mut sums);
            }
            let [a, b, c, d, e, f] = sums;
            *mode = Halves {
                forward: [a, b, c],
                backward: [d, e, f],
            };
        }
        event_of_modes(&self.hair, &modes)
    }
}

#[cfg(test)]
mod tests {
    use super::super::event;
    use super::*;

    #[test]
    fn are_those_of_the_quadrature() {
        for (eta, sigma, eccentricity, limit) in [
            (1.55, 0.0, 1.0, 1e-9),
            (1.55, 0.3, 1.0, 1e-9),
            (1.3, 6.0, 1.0, 1e-9),
            (1.0001, 0.3, 1.0, 1e-9),
            (3.0, 50.0, 1.0, 1e-9),
            (1.55, 0.2, 0.8, 1e-8),
        ] {
            let hair = HairParams {
                eta,
                sigma_a: [sigma, 0.3 * sigma, 0.1 * sigma],
                eccentricity,
                caustic_width: 0.05,
                ..HairParams::default()
            };
            let events = Events::new(&hair, Fresnel::Dielectric);
            let mut worst = 0.0f64;
            for theta in [-PI / 2.0, -1.5, -0.6, 0.0, 0.3, 1.1, 1.4, PI / 2.0] {
                let (found, expected) =
                    (events.at(theta), event(theta, &hair, Fresnel::Dielectric));
                for (a, b) in [
                    (found.forward, expected.forward),
                    (found.backward, expected.backward),
                ] {
                    for c in 0..3 {
                        worst = worst.max((a.attenuation[c] - b.attenuation[c]).abs());
                        assert!(a.width_2[c].is_finite() && a.shift[c].is_finite());
                    }
                }
            }
            println!("{eta} {sigma} {eccentricity}: {worst:e}");
            assert!(worst < limit, "{eta} {sigma} {eccentricity}: {worst:e}");
        }
    }
}
