//! An independent double-precision oracle: tables and single scattering by plain quadrature.
//!
//! It shares no code with the crates it judges, only plain data: parameters of a fibre and the
//! records of a file. It is slow, short and written from the equations.

use std::f64::consts::{FRAC_PI_2, PI};

use strandlight_formats::{Axis, Spacing, Table, TableFile, TableInfo};
use strandlight_scattering::{HairParams, Lobe};

/// Nodes and weights of Gauss-Legendre quadrature on -1..1.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..60 {
                let (mut p_0, mut p_1) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (p_0, p_1) = (p_1, ((2.0 * k - 1.0) * x * p_1 - (k - 1.0) * p_0) / k);
                }
                slope = n as f64 * (x * p_1 - p_0) / (x * x - 1.0);
                x -= p_1 / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// exp(-x) I_0(x): the mean of exp(x (cos t - 1)), spectrally exact; the asymptotic series above
/// x = 30, good to 1e-8 there.
pub fn i0e(x: f64) -> f64 {
    if x > 30.0 {
        let y = 1.0 / (8.0 * x);
        let series = 1.0 + y * (1.0 + y * (4.5 + y * (37.5 + y * 459.375)));
        return series / (2.0 * PI * x).sqrt();
    }
    let n = 64;
    let turn = 2.0 * PI / n as f64;
    (0..n)
        .map(|i| (x * ((turn * i as f64).cos() - 1.0)).exp())
        .sum::<f64>()
        / n as f64
}

/// Unpolarised Fresnel reflectance at the true incidence cosine.
pub fn fresnel(eta: f64, cosine: f64, schlick: bool) -> f64 {
    if schlick {
        let f_0 = ((eta - 1.0) / (eta + 1.0)).powi(2);
        return f_0 + (1.0 - f_0) * (1.0 - cosine).powi(5);
    }
    let q = (eta * eta - 1.0 + cosine * cosine).sqrt();
    let r_s = (cosine - q) / (cosine + q);
    let r_p = (eta * eta * cosine - q) / (eta * eta * cosine + q);
    0.5 * (r_s * r_s + r_p * r_p)
}

/// C_k for k = 0..=6 at kappa = 2 / lambda'^2.
pub fn c_k(kappa: f64, phi: f64) -> [f64; 9] {
    let reach = PI.min(7.5 * (2.0 / kappa.max(1e-9)).sqrt());
    // |cos((phi - x) / 2)| has its kink where x = phi - pi, modulo a turn.
    let kink = (phi - PI).rem_euclid(2.0 * PI);
    let kink = if kink > PI { kink - 2.0 * PI } else { kink };
    let mut sums = [0.0; 9];
    let middle = kink.clamp(-reach, reach);
    for (a, b) in [(-reach, middle), (middle, reach)] {
        for &(t, w) in gauss_legendre_64() {
            let x = 0.5 * (a + b) + 0.5 * (b - a) * t;
            let c = ((phi - x) / 2.0).cos().abs();
            let g = 0.5 * (b - a) * w * (kappa * (x.cos() - 1.0)).exp();
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum += g * c.powi(k as i32);
            }
        }
    }
    sums
}

fn gauss_legendre_64() -> &'static [(f64, f64)] {
    static NODES: std::sync::OnceLock<Vec<(f64, f64)>> = std::sync::OnceLock::new();
    NODES.get_or_init(|| gauss_legendre(64))
}

/// H_k for k = 0, 2, 4, 6 at the cosine of theta_d; `p` is 1 (TT) or 2 (TRT).
pub fn h_k(eta: f64, cos_theta_d: f64, p: u32, schlick: bool) -> [f64; 4] {
    let mut sums = [0.0; 4];
    for &(t, w) in gauss_legendre_64() {
        // h = sin(gamma), gamma = pi/2 (1 - s^2) resolves grazing rays at eta near 1.
        let s = 0.5 * (t + 1.0);
        let gamma = FRAC_PI_2 * (1.0 - s * s);
        let weight = 0.5 * w * PI * s * gamma.cos() * 2.0;
        let f = fresnel(eta, cos_theta_d * gamma.cos(), schlick);
        let a = (1.0 - f) * (1.0 - f) * f.powi(p as i32 - 1);
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += weight * a * gamma.sin().powi(2 * k as i32);
        }
    }
    sums
}

/// An axis as the documentation of the tables has it.
fn axis(name: &str, [min, max]: [f64; 2], count: u32, spacing: Spacing) -> Axis {
    Axis {
        name: name.to_owned(),
        min,
        max,
        count,
        spacing,
    }
}

/// What the centres of an axis are even in, rising or falling over the whole of it.
fn evenly(spacing: Spacing, x: f64) -> f64 {
    match spacing {
        Spacing::Linear => x,
        Spacing::Log => x.ln(),
        Spacing::InverseSqrt => {
            let t = 1.0 / (1.0 + x).sqrt();
            0.5 * (t + t.sqrt())
        }
        Spacing::RootSquare => 0.6 * x.sqrt() + 0.4 * x * x,
        Spacing::Reciprocal => {
            let r = 1.0 - 1.0 / x;
            0.5 * (r + r * r)
        }
        Spacing::Concave => 1.3 * x - 0.3 * x * x,
    }
}

/// The value at the centre of texel `ix`: the ends at both ends, the rest by bisection.
pub fn centre(axis: &Axis, ix: u32) -> f64 {
    if ix == 0 {
        return axis.min;
    }
    if ix == axis.count - 1 {
        return axis.max;
    }
    let u = f64::from(ix) / f64::from(axis.count - 1);
    let [first, last] = [axis.min, axis.max].map(|x| evenly(axis.spacing, x));
    let wanted = first + (last - first) * u;
    let (mut low, mut high) = (axis.min, axis.max);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let before = (evenly(axis.spacing, middle) < wanted) == (first < last);
        if before {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// A table whose texel at (row, column) is `texel(row value, column value)`.
fn table(
    name: &str,
    axes: [Axis; 2],
    channels: &[&str],
    texel: impl Fn(f64, f64) -> Vec<f64>,
) -> Table {
    let [rows, columns] = &axes;
    let columns_at: Vec<f64> = (0..columns.count).map(|ix| centre(columns, ix)).collect();
    let mut data = Vec::new();
    for row in 0..rows.count {
        let y = centre(rows, row);
        for &x in &columns_at {
            data.extend(texel(y, x).into_iter().map(|value| value as f32));
        }
    }
    Table {
        name: name.to_owned(),
        channels: channels.iter().map(|&channel| channel.to_owned()).collect(),
        data,
        axes: axes.to_vec(),
        max_interpolation_error: 0.0,
    }
}

/// cos(theta_d) from eta and the column variable of the H tables.
fn cos_theta_d(eta: f64, column: f64, schlick: bool) -> f64 {
    if schlick {
        return column;
    }
    // column = eta c / sqrt(eta^2 - 1 + c^2), solved for c.
    (column * ((eta * eta - 1.0) / (eta * eta - column * column).max(1e-12)).sqrt()).min(1.0)
}

/// The default tables, by quadrature.
pub fn tables(schlick: bool) -> TableFile {
    let choose = [1.0, 8.0, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0];
    let c = table(
        "C",
        [
            axis("kappa", [0.0, 2.0e6], 64, Spacing::InverseSqrt),
            axis("cos_half_phi", [0.0, 1.0], 128, Spacing::RootSquare),
        ],
        &["b1", "b2", "b3", "b4", "b5", "b6", "b7", "b8"],
        |kappa, cos_half| {
            // b_i from powers: c^i (1-c)^(8-i) = sum_j binom(8-i, j) (-1)^j c^(i+j).
            let powers = c_k(kappa, 2.0 * cos_half.acos());
            let scale = 2.0 * PI * i0e(kappa);
            let b = |i: usize| {
                let mut factor = 1.0;
                let mut sum = 0.0;
                for j in 0..=8 - i {
                    sum += factor * powers[i + j];
                    factor *= -((8 - i - j) as f64) / (j as f64 + 1.0);
                }
                choose[i] * sum.max(0.0) / scale
            };
            (1..9).map(b).collect()
        },
    );
    let column = if schlick { "cos_theta_d" } else { "eta_ratio" };
    let h = |name, p| {
        table(
            name,
            [
                axis("eta", [1.0, 10.0], 64, Spacing::Reciprocal),
                axis(column, [0.0, 1.0], 128, Spacing::Concave),
            ],
            &["H0", "H2", "H4", "H6"],
            |eta, column| {
                // At eta = 1 only the limit exists, a function of the column alone.
                let eta = eta.max(1.0 + 1e-9);
                h_k(eta, cos_theta_d(eta, column, schlick), p, schlick).to_vec()
            },
        )
    };
    TableFile {
        fresnel: if schlick { "schlick" } else { "dielectric" }.to_owned(),
        tables: vec![c, h("H_TT", 1), h("H_TRT", 2)],
        info: TableInfo::default(),
    }
}

/// Exact inner integral of Eq 12 per channel, for circular fibres:
/// 1/2 Int A(h) g^c(dphi - phi(p, h); lambda') dh, TRT blurred by a circular Gaussian of w_c.
pub fn azimuthal(lobe: Lobe, kappa: f64, dphi: f64, theta_d: f64, hair: &HairParams) -> [f64; 3] {
    let schlick = false;
    let (sin_d, cos_d) = (theta_d.sin(), theta_d.cos().max(1e-6));
    let eta_p = (hair.eta * hair.eta - sin_d * sin_d).sqrt() / cos_d;
    let p = f64::from(lobe.p());
    let stretch = 1.0 / (1.0 - (sin_d / hair.eta).powi(2)).sqrt();
    let kappa_w = 2.0 / (hair.caustic_width * hair.caustic_width);
    let norm = i0e(kappa_w);
    let mut total = [0.0; 3];
    let n = 400;
    for ix in 0..n {
        // Midpoint rule in gamma with a substitution that is flat at both ends.
        let t = (ix as f64 + 0.5) / n as f64;
        let gamma = FRAC_PI_2 * (1.5 * (2.0 * t - 1.0) - 0.5 * (2.0 * t - 1.0).powi(3));
        let jacobian = FRAC_PI_2 * 3.0 * (1.0 - (2.0 * t - 1.0).powi(2)) / n as f64;
        let h = gamma.sin();
        let inside = (h / eta_p).asin();
        let phi = 2.0 * p * inside - 2.0 * gamma + p * PI;
        let f = fresnel(hair.eta, cos_d * gamma.cos(), schlick);
        let a = match lobe {
            Lobe::R => f,
            Lobe::Tt => (1.0 - f) * (1.0 - f),
            Lobe::Trt => (1.0 - f) * (1.0 - f) * f,
        };
        let lobe_value = if lobe == Lobe::Trt {
            let k_3 =
                (kappa * kappa + kappa_w * kappa_w + 2.0 * kappa * kappa_w * (dphi - phi).cos())
                    .sqrt();
            i0e(k_3) * (k_3 - kappa - kappa_w).exp() / norm
        } else {
            (kappa * ((dphi - phi).cos() - 1.0)).exp()
        };
        for (value, &sigma_a) in total.iter_mut().zip(&hair.sigma_a) {
            let path = 2.0 * p * sigma_a * stretch * inside.cos();
            *value += 0.5 * a * (-path).exp() * lobe_value * gamma.cos() * jacobian;
        }
    }
    total
}

/// Exact Eq 11 for one light of amplitude 1: the circular Gaussian in theta_i kept as it is.
pub fn single(lobe: Lobe, light: (f64, f64, f64), view: (f64, f64), hair: &HairParams) -> [f64; 3] {
    let (theta_j, phi_j, lambda_j) = light;
    let (theta_o, phi_o) = view;
    let beta = 2.0 * hair.width.get(lobe);
    let centre = 2.0 * hair.shift.get(lobe) - theta_o;
    let kappa_j = 2.0 / (lambda_j * lambda_j);
    // The integrand is within e^-40 of nothing outside five widths of either factor.
    let low = (-FRAC_PI_2)
        .max(centre - 5.5 * beta)
        .max(theta_j - 7.0 * lambda_j);
    let high = FRAC_PI_2
        .min(centre + 5.5 * beta)
        .min(theta_j + 7.0 * lambda_j);
    let mut total = [0.0; 3];
    if low >= high {
        return total;
    }
    for &(t, w) in gauss_legendre_64() {
        let theta_i = 0.5 * (low + high) + 0.5 * (high - low) * t;
        let u = (theta_i - centre) / beta;
        let m = (-u * u).exp() / (PI.sqrt() * beta);
        let g = (kappa_j * ((theta_i - theta_j).cos() - 1.0)).exp();
        let theta_d = 0.5 * (theta_o - theta_i);
        let ratio = theta_i.cos() / theta_d.cos();
        let weight = 0.5 * (high - low) * w * m * g * ratio * ratio;
        let kappa = kappa_j * theta_i.cos() * theta_j.cos();
        let inner = azimuthal(lobe, kappa, phi_o - phi_j, theta_d, hair);
        for (value, inner) in total.iter_mut().zip(inner) {
            *value += weight * inner;
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed forms of the inverse, worked out by hand.
    #[test]
    fn centres_are_even_in_what_the_spacing_says() {
        let at = |spacing, range, count, ix| centre(&axis("x", range, count, spacing), ix);
        assert!((at(Spacing::Linear, [1.0, 3.0], 5, 1) - 1.5).abs() < 1e-12);
        assert!((at(Spacing::Log, [0.01, 100.0], 5, 3) - 10.0).abs() < 1e-9);
        // t = 1/4: (t + sqrt t) / 2 = 3/8; from 1 (x = 0) to 3/8 (x = 15), the middle is 11/16.
        let t = (-1.0 + (1.0f64 + 4.0 * 11.0 / 8.0).sqrt()) / 2.0;
        let x = 1.0 / t.powi(4) - 1.0;
        assert!((at(Spacing::InverseSqrt, [0.0, 15.0], 3, 1) - x).abs() < 1e-9);
        // r = 1/2: (r + r^2) / 2 = 3/8 at x = 2; half of it at r = (sqrt(5/2) - 1) / 2.
        let r = (2.5f64.sqrt() - 1.0) / 2.0;
        assert!((at(Spacing::Reciprocal, [1.0, 2.0], 3, 1) - 1.0 / (1.0 - r)).abs() < 1e-12);
        // 1.3 x - 0.3 x^2 = 1/2.
        let x = (1.3 - (1.69f64 - 0.6).sqrt()) / 0.6;
        assert!((at(Spacing::Concave, [0.0, 1.0], 3, 1) - x).abs() < 1e-12);
        let x = at(Spacing::RootSquare, [0.0, 1.0], 3, 1);
        assert!((0.6 * x.sqrt() + 0.4 * x * x - 0.5).abs() < 1e-12);
    }
}
