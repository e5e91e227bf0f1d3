//! Answers queries by double-precision quadrature of the exact model.

use std::sync::Arc;

use strandlight_scattering::c_integrals::c_closed_form;
use strandlight_scattering::dual_scattering::{Events, all_orders};
use strandlight_scattering::exact::{Light, View, azimuthal, global, local, single};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::h_moments::MomentRule;
use strandlight_scattering::table_layout::h_column;
use strandlight_scattering::{HairParams, Lobe};

use super::answer::Answer;
use super::per_fibre::PerFibre;
use super::request::Request;

/// Nodes over the fibre's width for H_k: 1e-10 for eta from 1.0001 on.
const H_NODES: usize = 64;

/// The exact model with its quadrature rules.
pub struct Reference {
    moments: MomentRule,
    events: PerFibre<Events>,
}

impl Reference {
    /// Prepares the rules.
    pub fn new() -> Reference {
        Reference {
            moments: MomentRule::new(H_NODES),
            events: PerFibre::default(),
        }
    }

    /// The averages of `hair`.
    fn events(&self, hair: &HairParams, fresnel: Fresnel) -> Arc<Events> {
        self.events.of(hair, || Events::new(hair, fresnel))
    }

    /// The exact answer; `fresnel` is the tables' term, used where a request names none.
    pub fn answer(&self, request: &Request, fresnel: Fresnel) -> Answer {
        match request {
            Request::TableC { k, lambda, phi } => {
                let all = c_closed_form(2.0 / (lambda * lambda), *phi);
                Answer::Number(all[*k as usize % 7])
            }
            Request::TableH {
                lobe,
                k,
                eta,
                theta_d,
                fresnel: asked,
            } => {
                let fresnel = asked.unwrap_or(fresnel);
                let column = h_column(*eta, theta_d.cos(), fresnel == Fresnel::Dielectric);
                let both = self.moments.moments(fresnel, *eta, column);
                let moments = if *lobe == Lobe::Tt { both.tt } else { both.trt };
                Answer::Number(moments[*k as usize / 2 % 4])
            }
            Request::Azimuthal {
                lobe,
                lambda,
                dphi,
                theta_d,
                hair,
            } => rgb(
                *lobe == Lobe::R,
                azimuthal(*lobe, *lambda, *dphi, *theta_d, hair, fresnel),
            ),
            Request::Single {
                lobe,
                light,
                view,
                hair,
            } => {
                let light = Light {
                    theta: light.theta,
                    phi: light.phi,
                    lambda: light.lambda,
                };
                let view = View {
                    theta: view.theta,
                    phi: view.phi,
                };
                let value = |lobe| single(lobe, light, view, hair, fresnel);
                rgb(*lobe == Some(Lobe::R), sum(*lobe, value))
            }
            Request::Global {
                lobe,
                forward,
                view,
                hair,
            } => {
                let view = View {
                    theta: view.theta,
                    phi: view.phi,
                };
                let value = |lobe| global(lobe, *forward, view, hair, fresnel);
                rgb(*lobe == Some(Lobe::R), sum(*lobe, value))
            }
            Request::Local {
                forward,
                view,
                hair,
            } => {
                let view = View {
                    theta: view.theta,
                    phi: view.phi,
                };
                let events = self.events(hair, fresnel);
                let back = |theta| all_orders(&events.at(theta));
                Answer::Rgb(local(*forward, view, back))
            }
            Request::Average {
                name,
                theta_d,
                hair,
            } => {
                let event = self.events(hair, fresnel).at(*theta_d);
                Answer::Rgb(name.of(&event, &all_orders(&event)))
            }
        }
    }
}

/// Values of one mode, or the sum over all.
fn sum(lobe: Option<Lobe>, value: impl Fn(Lobe) -> [f64; 3]) -> [f64; 3] {
    let lobes = lobe.as_ref().map_or(&Lobe::ALL[..], std::slice::from_ref);
    let mut sum = [0.0; 3];
    for &lobe in lobes {
        for (sum, value) in sum.iter_mut().zip(value(lobe)) {
            *sum += value;
        }
    }
    sum
}

/// One number for R, which no absorption enters; RGB for the rest.
fn rgb(is_r: bool, value: [f64; 3]) -> Answer {
    if is_r {
        Answer::Number(value[0])
    } else {
        Answer::Rgb(value)
    }
}
