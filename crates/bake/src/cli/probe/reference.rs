//! Answers queries by double-precision quadrature of the exact model.

use strandlight_scattering::Lobe;
use strandlight_scattering::c_integrals::c_closed_form;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::h_moments::MomentRule;
use strandlight_scattering::table_layout::h_column;

use super::Answer;
use super::request::Request;

/// Nodes over the fibre's width for H_k: 1e-10 for eta from 1.0001 on.
const H_NODES: usize = 64;

/// The exact model with its quadrature rules.
pub struct Reference {
    moments: MomentRule,
}

impl Reference {
    /// Prepares the rules.
    pub fn new() -> Reference {
        Reference {
            moments: MomentRule::new(H_NODES),
        }
    }

    /// The exact answer; `fresnel` is the tables' term, used where a request names none.
    pub fn answer(&self, request: &Request, fresnel: Fresnel) -> Result<Answer, String> {
        Ok(match request {
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
            Request::Azimuthal { .. } | Request::Single { .. } => {
                return Err("method reference has no scattering yet".to_owned());
            }
        })
    }
}
