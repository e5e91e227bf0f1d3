//! Single values of the shading functions.
//!
//! - [`Query`]: which function, at which point; laid out as the shader's struct of that name.
//!   Azimuthal and single scattering are answered by either [`Scheme`]; that with lobes reads the
//!   [`Optics`](crate::optics::Optics) that come with the queries.
//! - [`evaluate()`]: the answer of the Rust functions.

mod evaluate;

use strandlight_scattering::closed_form::{DirectionInFrame, Fibre};
use strandlight_scattering::dual_scattering::Average;

pub use evaluate::evaluate;

/// Mode of [`Query`] that sums the modes the fibre enables.
pub const MODE_ALL: u32 = 3;

/// One evaluation (128 bytes). What the fields mean depends on `function`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Query {
    /// The fibre.
    pub fibre: Fibre,
    /// The light's centre.
    pub light: DirectionInFrame,
    /// The view direction.
    pub view: DirectionInFrame,
    /// Up to four arguments.
    pub x: f32,
    /// Second argument.
    pub y: f32,
    /// Third argument.
    pub z: f32,
    /// Fourth argument.
    pub w: f32,
    /// Which function: one of [`Function`].
    pub function: u32,
    /// Mode 0 R, 1 TT, 2 TRT, 3 all; or k of C_k.
    pub mode: u32,
    /// Which scheme answers `Azimuthal` and `Single`: one of [`Scheme`].
    pub scheme: u32,
    /// Which of the optics at hand are those of `fibre`; the paper's scheme needs none.
    pub optics: u32,
}

strandlight_scattering::mirrors! {
    Query as "Query" in "pass/probe" {
        fibre, light, view, x, y, z, w, function, mode, scheme, optics,
    }
}

/// The schemes of single scattering.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Scheme {
    /// Lobes in azimuth, nodes on the product of light and M_t: what the renderer evaluates.
    Lobes = 0,
    /// Xu's as published; [`Fibre::segments`] sets its cost.
    Paper = 1,
}

impl Scheme {
    /// All of them, in the order of their numbers.
    pub const ALL: [Scheme; 2] = [Scheme::Lobes, Scheme::Paper];
}

/// The functions that can be probed; arguments and answer of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Function {
    /// C_`mode`(lambda' = x, phi = y) in the first component.
    TableC = 0,
    /// H_0, H_2, H_4, H_6 of `mode` 1 (TT) or 2 (TRT) at eta = x, theta_d = y.
    TableH = 1,
    /// Eq 12 of `mode` at lambda' = x, theta_d = z, azimuths of `view` and `light`: RGB.
    Azimuthal = 2,
    /// Eq 11 of `mode` for the light of width x: RGB.
    Single = 3,
    /// exp(-x^2), erf(x), exp(-y) I_0(y), exp(-y) I_1(y).
    Special = 4,
    /// Product integral of kappa_1 = x, kappa_2 = y, sin_half = z; C_0(x); lobe integral of x, y,
    /// z^2; exp(-x) I_0(x), the fast one.
    CircularGaussian = 5,
    /// 1 - F at eta = x, cosine = y: dielectric, Schlick.
    Fresnel = 6,
    /// theta, cos(theta), cos(phi), sin(phi) of the vector (x, y, z).
    Frame = 7,
    /// The outer integral of `mode` for the light of width x: theta_i and weight of the node in row
    /// y of `GAUSS_HERMITE`, logarithm of the bound, spread.
    OuterNode = 8,
    /// Eq 27 of `mode` for sigma_f = x: RGB.
    Global = 9,
    /// Eq 29 for sigma_f = x: RGB.
    Local = 10,
    /// Local scattering of the light of width x itself, averaged over it: RGB.
    DirectLocal = 11,
    /// Average `mode` of [`SAMPLED_AVERAGES`] at incident inclination x: RGB.
    Average = 12,
    /// Share of a circular Gaussian of sharpness x in a half circle away by an angle of cosine y;
    /// mean cosine at inclination z for sigma_f = w.
    HalfCircle = 13,
}

/// The averages that shading samples, hence those that can be probed; widths as widths.
pub const SAMPLED_AVERAGES: [Average; 5] = [
    Average::AF,
    Average::BetaF,
    Average::Ab,
    Average::DeltaB,
    Average::SigmaB,
];

impl Query {
    /// `function` with nothing else set.
    pub fn new(function: Function) -> Query {
        Query {
            function: function as u32,
            ..bytemuck::Zeroable::zeroed()
        }
    }

    /// C_`k` at `lambda_p`, `phi`.
    pub fn table_c(k: u32, lambda_p: f32, phi: f32) -> Query {
        Query {
            mode: k,
            x: lambda_p,
            y: phi,
            ..Query::new(Function::TableC)
        }
    }

    /// H of `mode` 1 or 2.
    pub fn table_h(mode: u32, eta: f32, theta_d: f32) -> Query {
        Query {
            mode,
            x: eta,
            y: theta_d,
            ..Query::new(Function::TableH)
        }
    }

    /// The same query to the paper's scheme.
    pub fn by_paper(self) -> Query {
        Query {
            scheme: Scheme::Paper as u32,
            ..self
        }
    }

    /// Whether the answer reads optics.
    pub fn needs_optics(&self) -> bool {
        let by_scheme = [Function::Azimuthal as u32, Function::Single as u32];
        let by_lobes = by_scheme.contains(&self.function) && self.scheme != Scheme::Paper as u32;
        by_lobes || self.function == Function::Global as u32 || self.needs_averages()
    }

    /// Whether the answer reads the averages of multiple scattering.
    pub fn needs_averages(&self) -> bool {
        let functions = [Function::Local, Function::DirectLocal, Function::Average];
        functions.map(|f| f as u32).contains(&self.function)
    }

    /// The same query with these of the optics at hand.
    pub fn with_optics(self, optics: u32) -> Query {
        Query { optics, ..self }
    }

    /// Eq 12 of `mode` 0, 1, 2 at phi_j = 0, phi_o = `dphi`.
    pub fn azimuthal(mode: u32, lambda_p: f32, dphi: f32, theta_d: f32, fibre: Fibre) -> Query {
        Query {
            mode,
            fibre,
            light: DirectionInFrame::from_angles(0.0, 0.0),
            view: DirectionInFrame::from_angles(0.0, dphi),
            x: lambda_p,
            z: theta_d,
            ..Query::new(Function::Azimuthal)
        }
    }

    /// Eq 11 of `mode` 0, 1, 2 or [`MODE_ALL`].
    pub fn single(
        mode: u32,
        light: DirectionInFrame,
        lambda: f32,
        view: DirectionInFrame,
        fibre: Fibre,
    ) -> Query {
        Query {
            mode,
            fibre,
            light,
            view,
            x: lambda,
            ..Query::new(Function::Single)
        }
    }

    /// Eq 27 of `mode` 0, 1, 2 or [`MODE_ALL`], for light of width `sigma_f` in inclination.
    pub fn global(
        mode: u32,
        light: DirectionInFrame,
        sigma_f: f32,
        view: DirectionInFrame,
        fibre: Fibre,
    ) -> Query {
        Query {
            function: Function::Global as u32,
            ..Query::single(mode, light, sigma_f, view, fibre)
        }
    }

    /// Eq 29 for light of width `sigma_f` in inclination.
    pub fn local(
        light: DirectionInFrame,
        sigma_f: f32,
        view: DirectionInFrame,
        fibre: Fibre,
    ) -> Query {
        Query {
            function: Function::Local as u32,
            ..Query::single(0, light, sigma_f, view, fibre)
        }
    }

    /// Local scattering of the light itself.
    pub fn direct_local(
        light: DirectionInFrame,
        lambda: f32,
        view: DirectionInFrame,
        fibre: Fibre,
    ) -> Query {
        Query {
            function: Function::DirectLocal as u32,
            ..Query::single(0, light, lambda, view, fibre)
        }
    }

    /// `average` at incident inclination `theta`; none where shading does not sample it.
    pub fn average(average: Average, theta: f32, fibre: Fibre) -> Option<Query> {
        let ix = SAMPLED_AVERAGES.iter().position(|&it| it == average)?;
        Some(Query {
            mode: ix as u32,
            fibre,
            x: theta,
            ..Query::new(Function::Average)
        })
    }
}
