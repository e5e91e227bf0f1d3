//! The fibre error as a filter: its expectation over all frames is a plain L2 norm after a
//! convolution with one zonal kernel, so a fit can minimise it exactly.
//!
//! Let `K` be a fibre's response and `e` the error of a light set against its map. Over all
//! rotations `R` of the frame,
//! ```text
//! E |<e, R K>|^2 = sum over l of |e_l|^2 p_l / (2 l + 1),   p_l = sum over m of |K_lm|^2
//! ```
//! (spherical harmonics are irreducible), `|e_l|` the norm of degree l of `e`. That is
//! `|e * k|^2` for the zonal kernel with factors `k_l = sqrt(p_l / (2 l + 1))` per degree.
//! [`Filter`] holds the `k_l`, averaged over views and scaled to `k_0 = 1`. A spherical Gaussian
//! of any width, a sun included, becomes a smooth radial profile under the filter: [`Profile`].

use std::f64::consts::PI;

use rayon::prelude::*;

use super::cells::srbf_solid_angle;
use super::harmonics::{DEGREES, legendre_table, pair};
use super::response::{MAX_SIN_VIEW, Response};

/// Gauss-Legendre nodes in sin theta_i; resolves degree 48 times a lobe of 0.12 rad.
const NODES: usize = 160;

/// Views averaged over.
const VIEWS: usize = 24;

/// Intervals of a radial profile over the chord, 0..=2.
const CHORDS: usize = 640;

/// Factors per degree; see the module documentation.
#[derive(Clone, Debug)]
pub(super) struct Filter {
    pub factors: [f64; DEGREES],
    /// `(2 l + 1) / (4 pi) P_l(1 - s^2 / 2)` and its derivative in `cos gamma`, at the chords
    /// `s = 2 k / CHORDS`: row k holds DEGREES pairs.
    legendre: Vec<[[f64; 2]; DEGREES]>,
}

impl Filter {
    /// The filter of a mixture of responses: their powers are averaged.
    pub fn new(responses: &[Response]) -> Filter {
        let mut power = [0.0; DEGREES];
        for response in responses {
            let own = mean_power(response);
            for (sum, x) in power.iter_mut().zip(&own) {
                *sum += x / own[0];
            }
        }
        let mut factors = [0.0; DEGREES];
        for (l, factor) in factors.iter_mut().enumerate() {
            *factor = (power[l] / power[0] / (2 * l + 1) as f64).sqrt();
        }
        let legendre = (0..=CHORDS)
            .map(|k| {
                let chord = 2.0 * k as f64 / CHORDS as f64;
                legendre_row(1.0 - 0.5 * chord * chord)
            })
            .collect();
        Filter { factors, legendre }
    }

    /// The radial profile of a spherical Gaussian of amplitude 1 under the filter.
    pub fn profile(&self, lambda: f64) -> Profile {
        let (gaussian, slope) = srbf_degrees(lambda);
        self.profile_of(&gaussian, &slope)
    }

    /// The radial profile of a point of energy 1 under the filter.
    #[cfg(test)]
    pub fn point_profile(&self) -> Profile {
        self.profile_of(&[1.0; DEGREES], &[0.0; DEGREES])
    }

    fn profile_of(&self, degrees: &[f64; DEGREES], slope: &[f64; DEGREES]) -> Profile {
        let mut value = [0.0; DEGREES];
        let mut by_lambda = [0.0; DEGREES];
        for l in 0..DEGREES {
            value[l] = degrees[l] * self.factors[l];
            by_lambda[l] = slope[l] * self.factors[l];
        }
        let nodes = self
            .legendre
            .iter()
            .map(|row| {
                let mut node = [0.0f64; 3];
                for l in 0..DEGREES {
                    node[0] += value[l] * row[l][0];
                    node[1] += value[l] * row[l][1];
                    node[2] += by_lambda[l] * row[l][0];
                }
                node.map(|x| x as f32)
            })
            .collect();
        Profile { nodes }
    }
}

/// A filtered spherical Gaussian as a function of the angle to its axis.
pub(super) struct Profile {
    /// Value, derivative by cos gamma, derivative by ln lambda at equal steps of the chord.
    nodes: Vec<[f32; 3]>,
}

impl Profile {
    /// Value, derivative by `cos gamma` and derivative by `ln lambda` at `cos gamma`.
    pub fn at(&self, cos_gamma: f32) -> [f32; 3] {
        let chord = (2.0 - 2.0 * cos_gamma).max(0.0).sqrt();
        let position = chord * (0.5 * CHORDS as f32);
        let ix = (position as usize).min(CHORDS - 1);
        let f = position - ix as f32;
        let (a, b) = (self.nodes[ix], self.nodes[ix + 1]);
        [
            a[0] + f * (b[0] - a[0]),
            a[1] + f * (b[1] - a[1]),
            a[2] + f * (b[2] - a[2]),
        ]
    }
}

/// `(2 l + 1) / (4 pi) P_l(x)` and its derivative.
fn legendre_row(x: f64) -> [[f64; 2]; DEGREES] {
    let mut row = [[0.0; 2]; DEGREES];
    let (mut p, mut before) = ([1.0, 0.0], [0.0, 0.0]);
    for (l, entry) in row.iter_mut().enumerate() {
        let scale = (2 * l + 1) as f64 / (4.0 * PI);
        *entry = [p[0] * scale, p[1] * scale];
        // Bonnet: (l + 1) P_{l+1} = (2 l + 1) x P_l - l P_{l-1}, and P'_{l+1} = P'_{l-1} +
        // (2 l + 1) P_l.
        let n = l as f64;
        let next = [
            ((2.0 * n + 1.0) * x * p[0] - n * before[0]) / (n + 1.0),
            before[1] + (2.0 * n + 1.0) * p[0],
        ];
        before = p;
        p = next;
    }
    row
}

/// Legendre coefficients of `exp(2 (x - 1) / lambda^2)`: `2 pi int P_l(x) exp(...) dx` for each
/// degree, and their derivative by `ln lambda`.
///
/// With k = 2 / lambda^2 they are `Omega A_l(k)`, Omega the solid angle and `A_l = i_l / i_0`
/// ratios of modified spherical Bessel functions, by their continued fraction downwards.
pub(super) fn srbf_degrees(lambda: f64) -> ([f64; DEGREES], [f64; DEGREES]) {
    let k = 2.0 / (lambda * lambda);
    let omega = srbf_solid_angle(lambda);
    // r_l = i_{l+1} / i_l = 1 / ((2 l + 3) / k + r_{l+1}); started far above it converges from
    // any value: the start forgets 1 / (1 + l / k) per step.
    let start = DEGREES + 60 + (4.0 * k.sqrt()).min(4000.0) as usize;
    let mut ratio = 0.0;
    let mut ratios = [0.0; DEGREES + 1];
    for l in (0..start).rev() {
        ratio = 1.0 / ((2 * l + 3) as f64 / k + ratio);
        if l <= DEGREES {
            ratios[l] = ratio;
        }
    }
    let mut a = [1.0; DEGREES + 1];
    for l in 0..DEGREES {
        a[l + 1] = a[l] * ratios[l];
    }
    // d Omega / d k = Omega (coth-like): Omega = 2 pi (1 - e^{-2k}) / k.
    let omega_slope = 2.0 * PI * (2.0 * (-2.0 * k).exp() / k) - omega / k;
    let mut value = [0.0; DEGREES];
    let mut slope = [0.0; DEGREES];
    for l in 0..DEGREES {
        // i_l' = (l / k) i_l + i_{l+1}.
        let a_slope = l as f64 / k * a[l] + a[l + 1] - a[l] * a[1];
        value[l] = omega * a[l];
        // d / d ln lambda = -2 k d / d k.
        slope[l] = -2.0 * k * (omega_slope * a[l] + omega * a_slope);
    }
    (value, slope)
}

/// Mean over views of `p_l`, the power of degree l of a response.
fn mean_power(response: &Response) -> [f64; DEGREES] {
    let (nodes, weights) = gauss_legendre(NODES);
    let (view_nodes, view_weights) = gauss_legendre(VIEWS);
    let azimuth: Vec<[f64; DEGREES]> = (0..3).map(|t| fourier(response, t)).collect();
    // a_t(x) for each view and mode, weights included.
    let longitudinal: Vec<Vec<f64>> = view_nodes
        .iter()
        .flat_map(|v| {
            let theta_o = (MAX_SIN_VIEW * v).asin();
            let nodes = &nodes;
            let weights = &weights;
            (0..3).map(move |t| {
                nodes
                    .iter()
                    .zip(weights)
                    .map(|(x, w)| w * response.longitudinal(t, x.asin(), theta_o))
                    .collect()
            })
        })
        .collect();

    let legendre: Vec<Vec<f64>> = nodes.iter().map(|x| legendre_table(*x)).collect();
    let by_degree: Vec<f64> = (0..DEGREES)
        .into_par_iter()
        .map(|l| {
            let mut power = 0.0;
            for m in 0..=l {
                let p: Vec<f64> = legendre.iter().map(|table| table[pair(l, m)]).collect();
                // Real harmonics: cos m phi carries sqrt(2), its square 2; sin m phi has nothing.
                let twice = if m == 0 { 1.0 } else { 2.0 };
                for (own, weight) in longitudinal.chunks_exact(3).zip(&view_weights) {
                    let coefficient: f64 = own
                        .iter()
                        .zip(&azimuth)
                        .map(|(a, n)| n[m] * a.iter().zip(&p).map(|(a, p)| a * p).sum::<f64>())
                        .sum();
                    power += 0.5 * weight * twice * coefficient * coefficient;
                }
            }
            power
        })
        .collect();
    let mut power = [0.0; DEGREES];
    power.copy_from_slice(&by_degree);
    power
}

/// `int N_t cos(m phi) dphi` over a turn.
fn fourier(response: &Response, t: usize) -> [f64; DEGREES] {
    const STEPS: usize = 1024;
    let mut out = [0.0; DEGREES];
    for k in 0..STEPS {
        let phi = 2.0 * PI * k as f64 / STEPS as f64;
        let value = response.azimuthal(t, phi.cos()) * 2.0 * PI / STEPS as f64;
        for (m, sum) in out.iter_mut().enumerate() {
            *sum += value * (m as f64 * phi).cos();
        }
    }
    out
}

/// Nodes and weights of Gauss-Legendre quadrature on [-1, 1] (Newton from Chebyshev's angles).
fn gauss_legendre(count: usize) -> (Vec<f64>, Vec<f64>) {
    let mut nodes = vec![0.0; count];
    let mut weights = vec![0.0; count];
    for k in 0..count {
        let mut x = (PI * (k as f64 + 0.75) / (count as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut p, mut before) = (1.0, 0.0);
            for n in 0..count {
                let n = n as f64;
                (p, before) = (((2.0 * n + 1.0) * x * p - n * before) / (n + 1.0), p);
            }
            slope = count as f64 * (x * p - before) / (x * x - 1.0);
            x -= p / slope;
        }
        nodes[k] = x;
        weights[k] = 2.0 / ((1.0 - x * x) * slope * slope);
    }
    (nodes, weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::sphere::fibonacci;

    #[test]
    fn gaussian_degrees_match_quadrature() {
        let (nodes, weights) = gauss_legendre(400);
        for lambda in [0.15, 0.4, 1.0, 2.5] {
            let (degrees, slope) = srbf_degrees(lambda);
            let (above, _) = srbf_degrees(lambda * 1.0001);
            let (below, _) = srbf_degrees(lambda / 1.0001);
            for l in [0, 1, 2, 7, 20, 48] {
                let sum: f64 = nodes
                    .iter()
                    .zip(&weights)
                    .map(|(x, w)| {
                        let p = legendre_row(*x)[l][0] * 4.0 * PI / (2 * l + 1) as f64;
                        w * 2.0 * PI * p * (2.0 * (x - 1.0) / (lambda * lambda)).exp()
                    })
                    .sum();
                assert!(
                    (sum - degrees[l]).abs() < 1e-12 * degrees[0],
                    "{lambda} {l}: {sum} {}",
                    degrees[l]
                );
                let difference = (above[l] - below[l]) / (2.0 * 1.0001f64.ln());
                assert!((difference - slope[l]).abs() < 1e-6 * degrees[0]);
            }
        }
        // A sun: all degrees nearly alike.
        let (sun, _) = srbf_degrees(0.005);
        assert!((sun[48] / sun[0] - (-48.0 * 49.0 / 4.0 * 0.005f64.powi(2)).exp()).abs() < 1e-4);
    }

    #[test]
    fn profiles_sum_their_degrees() {
        let filter = Filter::new(&[Response::default()]);
        assert!((filter.factors[0] - 1.0).abs() < 1e-12);
        for l in 1..DEGREES {
            assert!(filter.factors[l] <= filter.factors[l - 1] * 1.05);
        }
        // The integral over the sphere is degree 0 alone.
        let count = 4000;
        for lambda in [0.01, 0.3, 2.0] {
            let profile = filter.profile(lambda);
            let sum: f64 = (0..count)
                .map(|ix| f64::from(profile.at(fibonacci(ix, count, 0.0)[0] as f32)[0]))
                .sum();
            let integral = sum * 4.0 * PI / count as f64;
            let ratio = integral / srbf_solid_angle(lambda);
            assert!((ratio - 1.0).abs() < 2e-3, "{lambda}: {ratio}");
        }
    }

    #[test]
    fn profile_slopes_match_differences() {
        let filter = Filter::new(&[Response::default()]);
        let lambda = 0.4;
        let (mid, above, below) = (
            filter.profile(lambda),
            filter.profile(lambda * 1.01),
            filter.profile(lambda / 1.01),
        );
        let scale = mid.at(1.0)[0];
        for x in [-0.9f32, 0.0, 0.5, 0.9, 0.99] {
            let h = 2e-3;
            let by_cos = (mid.at(x + h)[0] - mid.at(x - h)[0]) / (2.0 * h);
            assert!((by_cos - mid.at(x)[1]).abs() < 0.02 * scale, "{x}");
            let by_lambda = (above.at(x)[0] - below.at(x)[0]) / (2.0 * 1.01f32.ln());
            assert!((by_lambda - mid.at(x)[2]).abs() < 0.005 * scale, "{x}");
        }
    }
}
