//! The Rust functions behind a [`Query`].

use strandlight_scattering::closed_form::paper::{
    self, transmittance_dielectric, transmittance_schlick,
};
use strandlight_scattering::closed_form::{
    AverageTexel, DirectionInFrame, GAUSS_HERMITE, LightInFrame, Shading, Tables,
    azimuthal_elliptic_of_two, azimuthal_r, azimuthal_trt, azimuthal_tt, bessel_i0e,
    bessel_i0e_fast, bessel_i1e, c_0, direct_local_scattering, elliptic_lag, erf_pair,
    further_orders, global_scattering, global_scattering_mode, half_circle, inclination,
    lag_between, lobe_integral, local_scattering, mean_cosine, outer_node, outer_rule,
    product_integral, sample_averages, sample_lobes, single_scattering, single_scattering_mode,
    table_cell,
};

use super::{Function, MODE_ALL, Query, Scheme};
use crate::optics::Optics;

/// The answer of the Rust functions to `query`; unused components are 0. NaN where the query's
/// optics are not among `optics` and the scheme needs them.
pub fn evaluate(query: &Query, tables: &Tables, optics: &[Optics]) -> [f32; 4] {
    let q = query;
    let rgb = |[r, g, b]: [f32; 3]| [r, g, b, 0.0];
    match q.function {
        f if f == Function::TableC as u32 => [tables.c_k(q.mode, q.x, q.y), 0.0, 0.0, 0.0],
        f if f == Function::TableH as u32 => tables.h(q.mode == 2, q.x, q.y),
        f if f == Function::Azimuthal as u32 || f == Function::Single as u32 => {
            if q.scheme == Scheme::Paper as u32 {
                return rgb(by_paper(q, tables));
            }
            match optics.get(q.optics as usize) {
                Some(optics) => rgb(by_lobes(q, &optics.shading(*tables))),
                None => [f32::NAN; 4],
            }
        }
        f if f == Function::Global as u32 => match optics.get(q.optics as usize) {
            Some(optics) => rgb(global(q, &optics.shading(*tables))),
            None => [f32::NAN; 4],
        },
        _ if q.needs_averages() => match optics.get(q.optics as usize) {
            Some(optics) if !optics.averages.is_empty() => rgb(by_averages(q, &optics.averages)),
            _ => [f32::NAN; 4],
        },
        f if f == Function::HalfCircle as u32 => {
            let cosine = mean_cosine(q.z, q.z.cos().max(0.0), q.w);
            [half_circle(q.x, q.y), cosine, 0.0, 0.0]
        }
        f if f == Function::Special as u32 => {
            let pair = erf_pair(q.x);
            [pair.gauss, pair.erf, bessel_i0e(q.y), bessel_i1e(q.y)]
        }
        f if f == Function::CircularGaussian as u32 => {
            let product = product_integral(q.x, q.y, q.z);
            let lobe = lobe_integral(q.x, q.y, q.z * q.z);
            [product, c_0(q.x), lobe, bessel_i0e_fast(q.x)]
        }
        f if f == Function::Fresnel as u32 => [
            transmittance_dielectric(q.x, q.y),
            transmittance_schlick(q.x, q.y),
            0.0,
            0.0,
        ],
        f if f == Function::OuterNode as u32 => {
            let mode = q.mode.min(2) as usize;
            let (alpha, beta) = (q.fibre.alpha[mode], q.fibre.beta[mode]);
            let rule = outer_rule(q.light.theta, q.x, q.view.theta, alpha, beta);
            let row = (q.y as usize).min(GAUSS_HERMITE.len() - 1);
            let node = outer_node(&rule, GAUSS_HERMITE[row]);
            [node.theta_i, node.weight, rule.ln_bound, rule.spread]
        }
        _ => {
            let direction = DirectionInFrame::from_vector([q.x, q.y, q.z]);
            [
                direction.theta,
                direction.cos_theta,
                direction.cos_phi,
                direction.sin_phi,
            ]
        }
    }
}

fn light(q: &Query) -> LightInFrame {
    LightInFrame {
        direction: q.light,
        lambda: q.x,
    }
}

fn global(q: &Query, shading: &Shading) -> [f32; 3] {
    if q.mode == MODE_ALL {
        return global_scattering(&q.light, &q.view, q.x, shading);
    }
    global_scattering_mode(q.mode, &q.light, &q.view, q.x, shading)
}

fn by_averages(q: &Query, averages: &[AverageTexel]) -> [f32; 3] {
    if q.function == Function::Local as u32 {
        return local_scattering(&q.light, &q.view, q.x, averages);
    }
    if q.function == Function::DirectLocal as u32 {
        return direct_local_scattering(&light(q), &q.view, averages);
    }
    let at = sample_averages(averages, q.x);
    match q.mode {
        0 => at.a_f,
        1 => at.beta_f_2.map(f32::sqrt),
        2 => at.attenuation_b,
        3 => at.shift_b,
        _ => at.width_b_2.map(f32::sqrt),
    }
}

fn by_paper(q: &Query, tables: &Tables) -> [f32; 3] {
    let (light, view, fibre) = (light(q), &q.view, &q.fibre);
    if q.function == Function::Single as u32 {
        if q.mode == MODE_ALL {
            return paper::single_scattering(&light, view, fibre, tables);
        }
        return paper::single_scattering_mode(q.mode, &light, view, fibre, tables);
    }
    let kappa = 2.0 / (q.x * q.x);
    let at = inclination(q.z);
    let lag = lag_between(view.cos_phi, view.sin_phi, q.light.cos_phi, q.light.sin_phi);
    let row = table_cell(&tables.axes.h_rows, fibre.eta);
    match q.mode {
        0 => [paper::azimuthal_r(kappa, &lag, &at, fibre, tables); 3],
        1 => paper::azimuthal_tt(kappa, &lag, &at, fibre, row, tables),
        _ => paper::azimuthal_trt(kappa, &lag, &at, fibre, row, tables),
    }
}

fn by_lobes(q: &Query, shading: &Shading) -> [f32; 3] {
    let (light, view) = (light(q), &q.view);
    if q.function == Function::Single as u32 {
        if q.mode == MODE_ALL {
            return single_scattering(&light, view, shading);
        }
        return single_scattering_mode(q.mode, &light, view, shading);
    }
    let kappa = 2.0 / (q.x * q.x);
    let at = inclination(q.z);
    let lag = lag_between(view.cos_phi, view.sin_phi, q.light.cos_phi, q.light.sin_phi);
    let cos_theta_d = at.cos_theta_d;
    match q.mode {
        0 => [azimuthal_r(kappa, &lag, &at, shading.reflectance, &shading.tables); 3],
        1 => {
            let lobes = sample_lobes(&shading.tt, shading.fibre.eta, cos_theta_d);
            azimuthal_tt(kappa, &lag, &lobes)
        }
        _ => {
            let fibre = shading.fibre;
            if fibre.is_elliptic() {
                let lag = elliptic_lag(view, &q.light, &lag);
                return azimuthal_elliptic_of_two(kappa, &lag, cos_theta_d, fibre, &shading.trt);
            }
            let lobes = sample_lobes(&shading.trt, fibre.eta, cos_theta_d);
            let value = azimuthal_trt(kappa, &lag, &lobes);
            // None of model `marschner`.
            let further = further_orders(fibre, cos_theta_d);
            let even = bessel_i0e_fast(kappa);
            std::array::from_fn(|channel| value[channel] + even * further[channel])
        }
    }
}
