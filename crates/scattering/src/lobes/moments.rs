//! Cosine moments of N_TT and N_TRT and of the lobes that stand for them.
//!
//! Both are even about `phi_t` (pi for TT, 0 for TRT), so a function on the circle is its moments
//! `m_n = Int N(phi_t + psi) cos(n psi) dpsi`. A blur by a circular Gaussian of sharpness kappa
//! multiplies `m_n` by `I_n(kappa) / I_0(kappa)`, so errors of the *inner integral* (Xu 2011
//! Eq 12) for any light are weighted sums of errors of moments; no caustic, no quadrature in phi.

use crate::wide::{Level, dispatch};

use crate::circular_gaussian::sharpness;
use crate::fresnel::Fresnel;
use crate::hair::Lobe;
use crate::quadrature::GaussLegendre;

/// One above the highest moment compared. A light of width 0.05 keeps `exp(-n^2 / 1600)` of
/// moment n; what is left of N_t at n = 160 is below 1e-3 wherever eta' > 1.2.
const N_HARMONICS: usize = 160;
/// From these on every second and every fourth moment stands for its neighbours too.
const SECOND_FROM: usize = 40;
const FOURTH_FROM: usize = 80;
/// Number of moments kept.
pub const N_MOMENTS: usize =
    SECOND_FROM + (FOURTH_FROM - SECOND_FROM) / 2 + (N_HARMONICS - FOURTH_FROM) / 4;

/// Moments of the orders [`ORDERS`]; the first is `m_0` = 1.
pub type Moments = [f64; N_MOMENTS];

/// The orders kept, rising from 0.
pub const ORDERS: [usize; N_MOMENTS] = orders();

const fn orders() -> [usize; N_MOMENTS] {
    let mut orders = [0; N_MOMENTS];
    let (mut ix, mut order) = (0, 0);
    while ix < N_MOMENTS {
        orders[ix] = order;
        order += stride(order);
        ix += 1;
    }
    orders
}

/// How many orders the kept order `n` stands for.
pub const fn stride(n: usize) -> usize {
    if n < SECOND_FROM {
        1
    } else if n < FOURTH_FROM {
        2
    } else {
        4
    }
}

/// Nodes in gamma: `cos(n psi)` turns at most 2 n (pi/2) times pi over 0..pi/2.
const N_NODES: usize = 256;

/// What a fibre of index `eta` keeps and where it sends it, seen at `alpha = asin(1 / eta')`, by
/// nodes in the offset angle gamma.
///
/// In these coordinates the azimuths depend on alpha alone and eta enters only through the
/// parallel polarisation of the Fresnel term, so everything varies slowly along eta. Any pair of
/// eta >= 1 and alpha in 0..pi/2 has a value, also where alpha > asin(1/eta), which no theta_d
/// reaches: the dielectric term continues analytically.
#[derive(Clone, Debug)]
pub struct Section {
    /// Offset from phi_t of the path through each node.
    psi: Vec<f64>,
    /// Length inside the fibre over 2 and less the shortest of all.
    path: Vec<f64>,
    /// Transmission without absorption times the node's weight, common factors left out.
    kept: Vec<f64>,
}

impl Section {
    /// The section for TT or TRT (R has no lobes; it is taken as TT); `rule` of any size.
    pub fn new(lobe: Lobe, fresnel: Fresnel, eta: f64, alpha: f64, rule: &GaussLegendre) -> Self {
        let a = alpha.sin();
        let trt = lobe == Lobe::Trt;
        let mut section = Section {
            psi: Vec::new(),
            path: Vec::new(),
            kept: Vec::new(),
        };
        for (gamma, weight) in rule.on(0.0, std::f64::consts::FRAC_PI_2) {
            let (sin, cos) = gamma.sin_cos();
            let sin_t = a * sin;
            let cos_t = (1.0 - sin_t * sin_t).sqrt();
            let through = transmittance_over_sin_alpha(fresnel, eta, alpha, cos, cos_t);
            let kept = through * through * cos * weight;
            let gamma_t = sin_t.asin();
            if trt {
                section.psi.push(4.0 * gamma_t - 2.0 * gamma);
                section.path.push(2.0 * cos_t);
                section.kept.push(kept * (1.0 - through * a).max(0.0));
            } else {
                section.psi.push(2.0 * gamma_t - 2.0 * gamma);
                section.path.push(cos_t);
                section.kept.push(kept);
            }
        }
        let shortest = section.path.iter().copied().fold(f64::INFINITY, f64::min);
        section.path.iter_mut().for_each(|path| *path -= shortest);
        section
    }

    /// Moments at each effective absorption of `sigmas` (per radius).
    pub fn moments(&self, sigmas: &[f64]) -> Vec<Moments> {
        let n = self.psi.len();
        let kept: Vec<Vec<f64>> = sigmas
            .iter()
            .map(|sigma| {
                let mut kept: Vec<f64> = (0..n)
                    .map(|i| self.kept[i] * (-2.0 * sigma * self.path[i]).exp())
                    .collect();
                let total: f64 = kept.iter().sum();
                kept.iter_mut().for_each(|kept| *kept /= total);
                kept
            })
            .collect();
        let mut moments = vec![[0.0; N_MOMENTS]; sigmas.len()];
        // cos(n psi) by its recurrence.
        let step: Vec<f64> = self.psi.iter().map(|psi| 2.0 * psi.cos()).collect();
        let mut here = vec![1.0; n];
        let mut before: Vec<f64> = step.iter().map(|step| 0.5 * step).collect();
        // Plain loops in wider vectors: the same sums, and so the same bits.
        dispatch!(Level::new(), _simd => {
            let mut ix = 0;
            for order in 0..N_HARMONICS {
                if ix < N_MOMENTS && ORDERS[ix] == order {
                    for (moments, kept) in moments.iter_mut().zip(&kept) {
                        moments[ix] = dot(kept, &here);
                    }
                    ix += 1;
                }
                advance(&mut here, &mut before, &step);
            }
        });
        moments
    }
}

/// A rule that resolves the highest of [`ORDERS`].
pub fn section_rule() -> GaussLegendre {
    GaussLegendre::new(N_NODES)
}

/// `(1 - F) / sin(alpha)` at the offset angle gamma of cosine `cos`; `cos_t` = cos(gamma_t).
fn transmittance_over_sin_alpha(
    fresnel: Fresnel,
    eta: f64,
    alpha: f64,
    cos: f64,
    cos_t: f64,
) -> f64 {
    let a = alpha.sin();
    match fresnel {
        Fresnel::Dielectric => {
            // cos(theta_d) = a k and eta' cos(gamma_t) cos(theta_d) = k cos(gamma_t), any k.
            let c = a * cos;
            let n = eta * eta * c;
            let (s, p) = (c + cos_t, n + cos_t);
            2.0 * cos_t * cos * (1.0 / (s * s) + eta * eta / (p * p))
        }
        Fresnel::Schlick => {
            let cos_theta_d = (alpha.tan() * ((eta - 1.0) * (eta + 1.0)).sqrt()).clamp(1e-6, 1.0);
            fresnel.transmittance(eta, cos_theta_d * cos) / a.max(1e-6)
        }
    }
}

/// From cosines of one order, and those before, to the next.
#[inline(always)]
fn advance(here: &mut [f64], before: &mut [f64], step: &[f64]) {
    for ((here, before), step) in here.iter_mut().zip(before).zip(step) {
        let next = step * *here - *before;
        *before = *here;
        *here = next;
    }
}

/// Sum of products in eight partial sums.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (chunks_a, rest_a) = a.as_chunks::<8>();
    let (chunks_b, rest_b) = b.as_chunks::<8>();
    for (a, b) in chunks_a.iter().zip(chunks_b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// `I_n(kappa) / I_0(kappa)`, n in [`ORDERS`], of circular Gaussians of widths `lambda` > 0.
///
/// Ratios of neighbours by their continued fraction downwards, started with Amos's bound (1974):
/// good to 1e-7. Several at once, since each is a chain of divisions.
pub fn gaussian_moments<const K: usize>(lambda: [f64; K]) -> [Moments; K] {
    const START: usize = N_HARMONICS + 8;
    let order = START as f64;
    // ratio = I_(n+1) / I_n; fall = 1 / kappa.
    let fall = lambda.map(|lambda| (1.0 / sharpness(lambda)).max(1e-12));
    let mut ratio = fall.map(|fall| {
        let kappa = 1.0 / fall;
        kappa / (order + 0.5 + ((order + 1.5).powi(2) + kappa * kappa).sqrt())
    });
    let mut ratios = [[0.0; K]; N_HARMONICS];
    for n in (0..START).rev() {
        for k in 0..K {
            ratio[k] = 1.0 / (2.0 * (n + 1) as f64 * fall[k] + ratio[k]);
        }
        if n < N_HARMONICS {
            ratios[n] = ratio;
        }
    }
    let mut moments = [[1.0; N_MOMENTS]; K];
    let mut here = [1.0; K];
    for ix in 1..N_MOMENTS {
        for row in &ratios[ORDERS[ix - 1]..ORDERS[ix]] {
            for k in 0..K {
                here[k] *= row[k];
            }
        }
        for k in 0..K {
            moments[k][ix] = here[k];
        }
    }
    moments
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::special::bessel_i_scaled;

    #[test]
    fn orders_rise_and_stand_for_all() {
        assert_eq!(
            (ORDERS[0], ORDERS[39], ORDERS[40], ORDERS[41]),
            (0, 39, 40, 42)
        );
        assert_eq!(
            ORDERS.iter().map(|&n| stride(n)).sum::<usize>(),
            N_HARMONICS
        );
    }

    #[test]
    fn gaussian_moments_are_ratios_of_bessel_functions() {
        for lambda in [0.003, 0.02, 0.1, 0.7, 3.0, 20.0] {
            let kappa = sharpness(lambda);
            let exact = bessel_i_scaled(N_HARMONICS, kappa);
            let [found] = gaussian_moments([lambda]);
            for (found, n) in found.iter().zip(ORDERS) {
                let error = (found - exact[n] / exact[0]).abs();
                assert!(error < 1e-7, "{lambda} {n} {error}");
            }
        }
    }
}
