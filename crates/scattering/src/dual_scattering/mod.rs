//! Averages of one scattering event that dual scattering needs (Zinke 2008 section 3, Xu 2011
//! section 4.3), in f64.
//!
//! Light comes along a cone of inclination `theta`, evenly over the half circle of azimuths on the
//! light's side. What leaves into the half circle behind the fibre (`cos(phi_o - phi_light) < 0`,
//! TT's side) is *forward*, the rest *backward*. Per channel, and per mode t where indexed:
//!
//! ```text
//! a_{f,t}  = 1/pi Int_{Omega_f} Int_{-pi/2}^{pi/2} S_t(theta, phi, omega_o) cos(theta) dphi domega_o
//!                                                          Zinke Eq 6, Xu Eq 32; a_b: Zinke Eq 12
//!          = Int M_t cos(theta_o) cos(theta) / cos^2(theta_d) q_{f,t}(theta_d) dtheta_o
//! q_{f,t}  = Int |phi| / pi N_t dphi,    q_{b,t} = Int (1 - |phi| / pi) N_t dphi,  |phi| <= pi
//! a_f      = sum_t a_{f,t}
//! alpha_f  = sum_t a_{f,t} 2 alpha_t / a_f,    beta_f^2 = sum_t a_{f,t} (2 beta_t)^2 / a_f
//! ```
//!
//! - `|phi| / pi` is the share of the light's half circle from which a lag phi leads behind the
//!   fibre (Xu's `2 Int_0^pi phi N`), so no hard edge at `|phi| = pi/2` and no roots of phi(h).
//! - M_t is `g^u(theta; 2 alpha_t - theta_o, 2 beta_t)` of unit mass in the full angle, without the
//!   papers' factor 2. Shifts and widths are those of the full angle `theta + theta_o`: one event
//!   moves light by `2 alpha` and spreads it by `2 beta`; widths are Xu's, `sqrt(2)` times a
//!   standard deviation. "theta_d" of the papers' averages is `theta`, the incident inclination.
//! - `cos(theta_o) cos(theta) / cos^2(theta_d) = (cos s + cos d) / (1 + cos d) <= 1`, s the sum and
//!   d the difference of both inclinations: hence `a_f + a_b <= 1` for every fibre.
//! - TRT is blurred by w_c. For an elliptic fibre its index follows the half angle (Xu Eq 24), and
//!   the averages are those over all turns of the fibre about its axis.
//!
//! [`Model::Energy`](crate::Model::Energy) keeps energy when the path of light is read backwards: light
//! seen from `theta` came by `a_{f,t} = Int S_t cos(theta_i) domega_i = q_{f,t}(theta)` from the forward
//! half, exactly, since M has unit mass and N_t is taken at theta. That stands for the above: the two are
//! one for lobes without shift. q_TRT holds all orders beyond it, half of them forward; `a_f + a_b` is 1
//! without absorption, and S_back has the model's own lobe of width sigma_b, which loses nothing at the
//! ends however wide many events make it.
//!
//! [`event()`] has them by quadrature, [`Events`] for many inclinations of one fibre,
//! [`event_separated`] by Xu's Eq 33, [`mixture`] has the mean and spread of S itself.
//! [`Backscatter`] holds what many events make of them, `A_b`, `Delta_b` and `sigma_b`.
//! [`AverageTable`] is all that over 128 inclinations, made at an edit.

mod azimuth;
mod backscatter;
mod event;
mod events;
mod longitudinal;
mod painted;
mod table;

pub use azimuth::{AzimuthRule, Halves, LagBlur};
pub use backscatter::{Backscatter, all_orders, published, truncated};
pub use event::{Event, Mixture, Moments, event, event_separated, mixture};
pub use events::Events;
pub use painted::{DEFAULT_AVERAGE_LAYERS, DEFAULT_SCALES, PaintedAverageTable};
pub use table::{AverageTable, N_INCLINATIONS};

/// An average that [`AverageTable`] holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Average {
    /// Share of the light that goes on forward, 0..=1.
    AF,
    /// Share that goes back, 0..=1.
    AB,
    /// Mean shift of a forward event, radians.
    AlphaF,
    /// Mean shift of a backward event, radians.
    AlphaB,
    /// Width of a forward event, radians; tables hold its square.
    BetaF,
    /// Width of a backward event, radians; tables hold its square.
    BetaB,
    /// Share that many events send back, single ones left out, 0..=1.
    Ab,
    /// Mean shift of that light, radians.
    DeltaB,
    /// Its width, radians.
    SigmaB,
}

impl Average {
    /// All averages, in the order of a table's columns.
    pub const ALL: [Average; 9] = [
        Average::AF,
        Average::AB,
        Average::AlphaF,
        Average::AlphaB,
        Average::BetaF,
        Average::BetaB,
        Average::Ab,
        Average::DeltaB,
        Average::SigmaB,
    ];

    /// Name in JSON: `a_f`, `alpha_f`, `A_b`, ...
    pub const fn name(self) -> &'static str {
        match self {
            Average::AF => "a_f",
            Average::AB => "a_b",
            Average::AlphaF => "alpha_f",
            Average::AlphaB => "alpha_b",
            Average::BetaF => "beta_f",
            Average::BetaB => "beta_b",
            Average::Ab => "A_b",
            Average::DeltaB => "Delta_b",
            Average::SigmaB => "sigma_b",
        }
    }

    /// The average called `name`.
    pub fn from_name(name: &str) -> Option<Average> {
        Average::ALL.into_iter().find(|it| it.name() == name)
    }

    /// Its value, from what one event and many of them do.
    pub fn of(self, event: &Event, backscatter: &Backscatter) -> [f64; 3] {
        match self {
            Average::AF => event.forward.attenuation,
            Average::AB => event.backward.attenuation,
            Average::AlphaF => event.forward.shift,
            Average::AlphaB => event.backward.shift,
            Average::BetaF => event.forward.width_2.map(f64::sqrt),
            Average::BetaB => event.backward.width_2.map(f64::sqrt),
            Average::Ab => backscatter.attenuation,
            Average::DeltaB => backscatter.shift,
            Average::SigmaB => backscatter.width_2.map(f64::sqrt),
        }
    }
}
