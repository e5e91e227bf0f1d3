//! Where the functions under test are evaluated.

use std::f64::consts::FRAC_PI_2;

use serde_json::{Value, json};
use strandlight_render::probe::Query;
use strandlight_scattering::closed_form::{DirectionInFrame, Fibre};
use strandlight_scattering::{HairParams, Lobe, Model, Parameter, ParameterShape};

/// One evaluation; every number is a single-precision one, so that all sides get the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Point {
    /// The inner integral, Eq 12.
    Azimuthal {
        /// Mode.
        lobe: Lobe,
        /// Width lambda' of the light in azimuth.
        lambda_p: f64,
        /// phi_o - phi_j.
        dphi: f64,
        /// (theta_o - theta_i) / 2.
        theta_d: f64,
    },
    /// Single scattering of one light of amplitude 1, Eq 11.
    Single {
        /// Mode.
        lobe: Lobe,
        /// The light.
        light: Light,
        /// Inclination of the view.
        theta_o: f64,
        /// Azimuth of the view.
        phi_o: f64,
    },
}

/// A spherical Gaussian light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Inclination of its centre.
    pub theta: f64,
    /// Azimuth of its centre.
    pub phi: f64,
    /// Bandwidth.
    pub lambda: f64,
}

/// What is evaluated on both sides.
pub trait Evaluation: Send + Sync {
    /// Does its function read the averages of multiple scattering?
    const NEEDS_MULTIPLE: bool;

    /// As the probe of the runtime takes it.
    fn probe(&self, fibre: Fibre) -> Query;

    /// As a query of `strandlight probe`.
    fn query(&self, hair: &HairParams) -> Value;
}

/// Points that share a fibre. What depends on the fibre alone is prepared once a group.
#[derive(Clone, Debug, PartialEq)]
pub struct Group<P = Point> {
    /// The fibre.
    pub hair: HairParams,
    /// The points.
    pub points: Vec<P>,
}

/// `x` in single precision.
pub fn single(x: f64) -> f64 {
    f64::from(x as f32)
}

/// An inclination in single precision, inside +-pi/2.
pub fn inclination(theta: f64) -> f64 {
    single(theta).clamp(-FRAC_PI_2, FRAC_PI_2)
}

impl Point {
    /// The mode.
    pub fn lobe(&self) -> Lobe {
        match self {
            Point::Azimuthal { lobe, .. } | Point::Single { lobe, .. } => *lobe,
        }
    }

    /// Integral of the light over the circle or the sphere: what an answer is proportional to
    /// where the light is narrow.
    pub fn light_mass(&self) -> f64 {
        use strandlight_scattering::circular_gaussian as c;
        match self {
            Point::Azimuthal { lambda_p, .. } => {
                c::circular_gaussian_integral(c::sharpness(*lambda_p))
            }
            Point::Single { light, .. } => sphere_mass(light.lambda),
        }
    }
}

impl Evaluation for Point {
    const NEEDS_MULTIPLE: bool = false;

    fn probe(&self, fibre: Fibre) -> Query {
        let direction =
            |theta: f64, phi: f64| DirectionInFrame::from_angles(theta as f32, phi as f32);
        match *self {
            Point::Azimuthal {
                lobe,
                lambda_p,
                dphi,
                theta_d,
            } => Query::azimuthal(
                lobe.p(),
                lambda_p as f32,
                dphi as f32,
                theta_d as f32,
                fibre,
            ),
            Point::Single {
                lobe,
                light,
                theta_o,
                phi_o,
            } => Query::single(
                lobe.p(),
                direction(light.theta, light.phi),
                light.lambda as f32,
                direction(theta_o, phi_o),
                fibre,
            ),
        }
    }

    fn query(&self, hair: &HairParams) -> Value {
        match self {
            Point::Azimuthal {
                lobe,
                lambda_p,
                dphi,
                theta_d,
            } => json!({
                "q": "azimuthal", "mode": lobe.name(), "lambda": lambda_p, "dphi": dphi,
                "theta_d": theta_d, "hair": hair_json(hair),
            }),
            Point::Single {
                lobe,
                light,
                theta_o,
                phi_o,
            } => json!({
                "q": "single", "mode": lobe.name(),
                "light": { "theta": light.theta, "phi": light.phi, "lambda": light.lambda },
                "view": { "theta": theta_o, "phi": phi_o },
                "hair": hair_json(hair),
            }),
        }
    }
}

/// Integral of a spherical Gaussian of amplitude 1: `pi lambda^2 (1 - exp(-4 / lambda^2))`.
pub fn sphere_mass(lambda: f64) -> f64 {
    let square = lambda * lambda;
    -std::f64::consts::PI * square * (-4.0 / square).exp_m1()
}

/// The fibre as `strandlight probe` reads it.
pub fn hair_json(hair: &HairParams) -> Value {
    let value = |parameter: Parameter| {
        let [a, b, c] = parameter.get(hair);
        match parameter.shape() {
            ParameterShape::Number => json!(a),
            ParameterShape::Rgb => json!([a, b, c]),
            ParameterShape::PerLobe => json!({ "r": a, "tt": b, "trt": c }),
        }
    };
    let entries = Parameter::ALL.map(|parameter| (parameter.name().to_owned(), value(parameter)));
    let mut entries: serde_json::Map<String, Value> = entries.into_iter().collect();
    if hair.model != Model::default() {
        entries.insert("model".to_owned(), hair.model.name().into());
    }
    Value::Object(entries)
}
