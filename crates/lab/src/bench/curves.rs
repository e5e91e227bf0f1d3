//! Plots in the manner of Xu 2011 Fig 3: what the schemes put in place of the exact model.

use strandlight_scattering::circular_gaussian::{circular_gaussian_integral, sharpness};
use strandlight_scattering::exact::{FibreSection, Light, View, azimuthal, energy};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe, ParamError};

use super::configuration::Configuration;
use super::method::{Method, MethodError, MethodTables, OnFibre, Prepared};
use super::plot::{AxisStyle, Figure, Mark, Panel, Series};

/// Name of the exact model's curves.
const EXACT: &str = "exact";
/// Names in the order of their colours.
const COLOURS: [&str; 4] = [EXACT, "paper", "runtime", "quadrature"];

/// Why there are no curves.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CurvesError {
    /// A method cannot be prepared.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// A fibre is refused.
    #[error(transparent)]
    Hair(#[from] ParamError),
}

/// The schemes that are drawn beside the exact model, with the names of their curves.
fn schemes() -> Vec<(Method, &'static str)> {
    vec![(Method::BASE, "paper"), (Method::DEFAULT, "runtime")]
}

/// The figures, each with the stem of its files.
///
/// - `azimuthal`: N_TT and N_TRT over phi. Each is seen by a light of lambda' 0.02 over the
///   light's mass, which blurs exact and approximate curves alike; N_TRT has its w_c.
/// - `azimuthal_error`: what is between them, clipped at 10 % of the peak.
/// - `attenuation`: T over h with the published expansion, and the energies of TT and TRT over
///   sigma_a.
/// - `outer`: N_t cos^2 theta_i / cos^2 theta_d over theta_i with the nodes of each rule.
///
/// # Errors
/// The bundled tables cannot be read.
pub fn figures(tables: &MethodTables) -> Result<Vec<(&'static str, Figure)>, CurvesError> {
    let prepared: Vec<(Prepared, &str)> = schemes()
        .into_iter()
        .map(|(method, name)| (Prepared::new(method, tables), name))
        .collect();
    Ok(vec![
        ("azimuthal", azimuthal_figure(&prepared, false)?),
        ("azimuthal_error", azimuthal_figure(&prepared, true)?),
        ("attenuation", attenuation_figure(&prepared)?),
        ("outer", outer_figure(&prepared)?),
    ])
}

/// The fibre of the curves but for its absorption: the paper's, w_c 0.15.
fn hair(sigma_a: f64) -> HairParams {
    HairParams {
        sigma_a: [sigma_a; 3],
        caustic_width: 0.15,
        ..HairParams::default()
    }
}

/// `n` + 1 points of `f` over `low..=high`.
fn sampled(low: f64, high: f64, n: u32, f: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    (0..=n)
        .map(|i| low + (high - low) * f64::from(i) / f64::from(n))
        .map(|x| (x, f(x)))
        .collect()
}

fn line(name: &str, points: Vec<(f64, f64)>) -> Series {
    Series {
        name: name.to_owned(),
        points,
        ..Series::default()
    }
}

/// How an approximation is drawn: dashed, so that the exact curve shows through.
fn dashed(name: &str, points: Vec<(f64, f64)>) -> Series {
    Series {
        mark: Mark::Dashed,
        ..line(name, points)
    }
}

/// theta_d at which the effective index of `eta` is `eta_eff`.
fn theta_d_of(eta: f64, eta_eff: f64) -> f64 {
    ((eta * eta - 1.0) / (eta_eff * eta_eff - 1.0))
        .sqrt()
        .acos()
}

/// The lobes, or (`errors`) how far the schemes' are from the exact ones.
fn azimuthal_figure(prepared: &[(Prepared, &str)], errors: bool) -> Result<Figure, CurvesError> {
    let hair = hair(0.2);
    let lambda_p = 0.02;
    let kappa = sharpness(lambda_p);
    let mass = circular_gaussian_integral(kappa);
    let degrees = |d: f64| (d.to_radians(), format!("theta_d = {d} deg"));
    let index = |n: f64| {
        let theta_d = theta_d_of(hair.eta, n);
        let text = format!("eta' = {n}, theta_d = {:.1} deg", theta_d.to_degrees());
        (theta_d, text)
    };
    let mut cases = vec![];
    cases.extend([0.0, 30.0, 60.0].map(|d| (Lobe::Tt, degrees(d))));
    cases.extend([degrees(0.0), degrees(30.0), index(1.95)].map(|at| (Lobe::Trt, at)));
    cases.extend([index(2.05), degrees(60.0), degrees(75.0)].map(|at| (Lobe::Trt, at)));

    let mut panels = Vec::new();
    for (lobe, (theta_d, text)) in cases {
        let centre = if lobe == Lobe::Tt { 180.0 } else { 0.0 };
        let (low, high) = (centre - 180.0, centre + 180.0);
        let over_phi =
            |f: &dyn Fn(f64) -> f64| sampled(low, high, 360, |phi| f(phi.to_radians()) / mass);
        let term = Fresnel::Dielectric;
        let exact = over_phi(&|phi| azimuthal(lobe, lambda_p, phi, theta_d, &hair, term)[0]);
        let peak = exact.iter().fold(0.0f64, |peak, point| peak.max(point.1));
        let mut series = Vec::new();
        for (method, name) in prepared {
            let on_fibre = method.on_fibre(&hair)?;
            let mut found = over_phi(&|phi: f64| {
                let rgb = on_fibre.azimuthal(lobe, kappa as f32, phi as f32, theta_d as f32);
                f64::from(rgb[0])
            });
            if errors {
                for (found, exact) in found.iter_mut().zip(&exact) {
                    found.1 = 100.0 * (found.1 - exact.1) / peak;
                }
                series.push(line(name, found));
            } else {
                series.push(dashed(name, found));
            }
        }
        let y = if errors {
            AxisStyle::linear("% of the peak").within(-10.0, 10.0)
        } else {
            series.insert(0, line(EXACT, exact));
            AxisStyle::linear("1/rad")
        };
        panels.push(Panel {
            title: format!("N_{}, {text}", lobe.name()),
            x: AxisStyle::linear("phi, degrees")
                .within(low, high)
                .every(90.0),
            y,
            series,
        });
    }
    let what = if errors { ", error" } else { "" };
    Ok(Figure {
        title: format!(
            "Azimuthal scattering{what}: eta {}, sigma_a {}, w_c {}",
            hair.eta, hair.sigma_a[0], hair.caustic_width
        ),
        panels,
        columns: 3,
        colours: COLOURS.to_vec(),
    })
}

fn attenuation_figure(prepared: &[(Prepared, &str)]) -> Result<Figure, CurvesError> {
    let eta = hair(0.0).eta;
    let mut panels = Vec::new();
    for theta_d in [0.0f64, 60.0] {
        let mut series = Vec::new();
        for sigma_a in [0.2, 0.6, 1.0, 2.0] {
            let section =
                FibreSection::new(eta, [sigma_a; 3], theta_d.to_radians(), Fresnel::Dielectric);
            let s = 2.0 * section.sigma_eff[0];
            let y = 1.0 / (section.eta_eff * section.eta_eff);
            let exact = |h: f64| (-s * (1.0 - h * h * y).sqrt()).exp();
            let taylor = |h: f64| {
                let z = h * h * y;
                (-s).exp() * (1.0 + 0.5 * s * z * (1.0 + 0.25 * (1.0 + s) * z))
            };
            series.push(line("exact", sampled(0.0, 1.0, 100, exact)));
            series.push(dashed("paper", sampled(0.0, 1.0, 100, taylor)));
        }
        panels.push(Panel {
            title: format!("T at sigma_a 0.2, 0.6, 1, 2, theta_d = {theta_d} deg"),
            x: AxisStyle::linear("h").within(0.0, 1.0),
            y: AxisStyle::linear("T").within(0.0, 1.0),
            series,
        });
        for lobe in [Lobe::Tt, Lobe::Trt] {
            panels.push(energy_panel(lobe, theta_d, prepared)?);
        }
    }
    Ok(Figure {
        title: format!("Attenuation: eta {eta}"),
        panels,
        columns: 3,
        colours: COLOURS.to_vec(),
    })
}

/// Error of the energy over sigma_a, at `theta_d` in degrees.
fn energy_panel(
    lobe: Lobe,
    theta_d: f64,
    prepared: &[(Prepared, &str)],
) -> Result<Panel, CurvesError> {
    let mut series = Vec::new();
    for (method, name) in prepared {
        let mut points = Vec::new();
        for step in 0..=48 {
            let sigma_a = 0.01 * 10f64.powf(f64::from(step) / 16.0);
            let hair = hair(sigma_a);
            let at = theta_d.to_radians();
            let exact = energy(lobe, at, &hair, Fresnel::Dielectric)[0];
            // A light that is constant in azimuth sees the energy.
            let found = method
                .on_fibre(&hair)?
                .azimuthal(lobe, 1e-6, 1.0, at as f32)[0];
            // Less than a millionth is negligible.
            if exact > 1e-6 {
                points.push((sigma_a, 100.0 * (f64::from(found) / exact - 1.0)));
            }
        }
        series.push(line(name, points));
    }
    Ok(Panel {
        title: format!(
            "Error of the energy of {}, theta_d = {theta_d} deg",
            lobe.name()
        ),
        x: AxisStyle::log("sigma_a"),
        y: AxisStyle::linear("%").within(-30.0, 10.0),
        series,
    })
}

fn outer_figure(prepared: &[(Prepared, &str)]) -> Result<Figure, CurvesError> {
    let hair = hair(0.2);
    let mut panels = Vec::new();
    for (theta_j, theta_o) in [(-10.0f64, 20.0f64), (-60.0, 75.0)] {
        for (lobe, phi) in [
            (Lobe::R, 0.0),
            (Lobe::R, 180.0),
            (Lobe::Tt, 180.0),
            (Lobe::Trt, 0.0f64),
        ] {
            let drawn = Configuration {
                hair,
                light: Light {
                    theta: theta_j.to_radians(),
                    phi: 0.0,
                    lambda: 0.5,
                },
                view: View {
                    theta: theta_o.to_radians(),
                    phi: phi.to_radians(),
                },
            };
            let text = format!(
                "{}, phi {phi}, theta_j {theta_j}, theta_o {theta_o} deg",
                lobe.name()
            );
            panels.push(outer_panel(&drawn, lobe, text, prepared)?);
        }
    }
    Ok(Figure {
        title:
            "Outer integrand N cos^2(theta_i)/cos^2(theta_d) of a light of lambda 0.5, with nodes"
                .to_owned(),
        panels,
        columns: 4,
        colours: COLOURS.to_vec(),
    })
}

fn outer_panel(
    drawn: &Configuration,
    lobe: Lobe,
    title: String,
    prepared: &[(Prepared, &str)],
) -> Result<Panel, CurvesError> {
    let (light, view, hair) = (drawn.light, drawn.view, &drawn.hair);
    let dphi = view.phi - light.phi;
    let kappa_at = |theta_i: f64| {
        (sharpness(light.lambda) * light.theta.cos() * theta_i.cos().max(0.0)).max(1e-6)
    };
    let theta_d = |theta_i: f64| 0.5 * (view.theta - theta_i);
    let ratio = |theta_i: f64| (theta_i.cos() / theta_d(theta_i).cos()).powi(2);
    let over_theta =
        |f: &dyn Fn(f64) -> f64| sampled(-90.0, 90.0, 180, |degrees| f(degrees.to_radians()));
    let exact = over_theta(&|theta_i| {
        let lambda_p = (2.0 / kappa_at(theta_i)).sqrt();
        let term = Fresnel::Dielectric;
        let rgb = azimuthal(lobe, lambda_p, dphi, theta_d(theta_i), hair, term);
        ratio(theta_i) * rgb[0]
    });
    let top = exact.iter().fold(0.0f64, |top, point| top.max(point.1));
    let mut series = vec![line(EXACT, exact)];
    // The bump that the integrand is weighted by, as high as the panel.
    let mean = 2.0 * hair.shift.get(lobe) - view.theta;
    let width = 2.0 * hair.width.get(lobe);
    let bump = over_theta(&|theta_i| {
        let z = (theta_i - mean) / width;
        let s = (0.5 * (theta_i - light.theta)).sin();
        (-z * z - 2.0 * sharpness(light.lambda) * s * s).exp()
    });
    let peak = bump.iter().fold(1e-300f64, |top, point| top.max(point.1));
    let bump = bump.into_iter().map(|(x, y)| (x, top * y / peak));
    series.push(dashed("light x M_t", bump.collect()));
    let (light_32, view_32) = drawn.in_frame();
    for (method, name) in prepared {
        let on_fibre: OnFibre = method.on_fibre(hair)?;
        let value = |theta_i: f64| {
            let (kappa, at) = (kappa_at(theta_i) as f32, theta_d(theta_i) as f32);
            let rgb = on_fibre.azimuthal(lobe, kappa, dphi as f32, at);
            ratio(theta_i) * f64::from(rgb[0])
        };
        series.push(dashed(name, over_theta(&value)));
        let nodes = on_fibre.outer_nodes(lobe, &light_32, &view_32);
        series.push(Series {
            mark: Mark::Points,
            points: nodes
                .into_iter()
                .map(|theta_i| (f64::from(theta_i).to_degrees(), value(f64::from(theta_i))))
                .collect(),
            ..line(name, Vec::new())
        });
    }
    Ok(Panel {
        title,
        x: AxisStyle::linear("theta_i, degrees")
            .within(-90.0, 90.0)
            .every(45.0),
        y: AxisStyle::linear(""),
        series,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effective_indices_are_found_again() {
        for eta_eff in [1.95, 2.0, 2.05] {
            let section = FibreSection::new(
                1.55,
                [0.0; 3],
                theta_d_of(1.55, eta_eff),
                Fresnel::Dielectric,
            );
            assert!((section.eta_eff - eta_eff).abs() < 1e-12);
        }
        assert!(theta_d_of(1.55, 1.95) < theta_d_of(1.55, 2.05));
    }
}
