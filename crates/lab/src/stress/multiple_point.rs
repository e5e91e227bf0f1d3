//! Points where multiple scattering is evaluated.

use std::f64::consts::{FRAC_PI_2, PI};

use serde_json::{Value, json};
use strandlight_render::probe::{Function, MODE_ALL, Query};
use strandlight_scattering::HairParams;
use strandlight_scattering::closed_form::{DirectionInFrame, Fibre};

use super::draw::{LAMBDA, Random};
use super::point::{Evaluation, hair_json, inclination, single};

/// What is evaluated.
pub(super) const FUNCTIONS: [Function; 3] =
    [Function::Global, Function::Local, Function::DirectLocal];

/// Light and view; the light's width is sigma_f, or its lambda where it is unscattered.
#[derive(Clone, Copy)]
pub(super) struct Point {
    pub(super) function: Function,
    light: [f64; 2],
    width: f64,
    view: [f64; 2],
}

impl Point {
    pub(super) fn draw(random: &mut Random) -> Point {
        let mut direction = || {
            let theta = match random.pick(&[0, 1, 2]) {
                0 => random.pick(&[-FRAC_PI_2, -1.57, 0.0, 1.57, FRAC_PI_2]),
                _ => random.uniform(-1.0, 1.0).asin(),
            };
            [inclination(theta), single(random.uniform(-PI, PI))]
        };
        let (light, mut view) = (direction(), direction());
        if random.chance(0.2) {
            // The same azimuth, the opposite one, and the edge of the half circle.
            view[1] = single(light[1] + random.pick(&[0.0, FRAC_PI_2, PI]));
        }
        let width = match random.pick(&[0, 1, 2, 3]) {
            0 => random.pick(&LAMBDA),
            _ => random.log_uniform(LAMBDA[0], LAMBDA[1]),
        };
        Point {
            function: random.pick(&FUNCTIONS),
            light,
            width: single(width),
            view,
        }
    }
}

impl Evaluation for Point {
    const NEEDS_MULTIPLE: bool = true;

    fn probe(&self, fibre: Fibre) -> Query {
        let [light, view] = [self.light, self.view]
            .map(|[theta, phi]| DirectionInFrame::from_angles(theta as f32, phi as f32));
        Query {
            function: self.function as u32,
            ..Query::single(MODE_ALL, light, self.width as f32, view, fibre)
        }
    }

    fn query(&self, hair: &HairParams) -> Value {
        let [[theta_j, phi_j], [theta_o, phi_o]] = [self.light, self.view];
        let (name, hair) = (name(self.function), hair_json(hair));
        let view = json!({ "theta": theta_o, "phi": phi_o });
        match self.function {
            // No query asks for it.
            Function::DirectLocal => json!({
                "function": name,
                "light": { "theta": theta_j, "phi": phi_j, "lambda": self.width },
                "view": view,
                "hair": hair,
            }),
            _ => json!({
                "q": name,
                "mode": "all",
                "light": { "theta": theta_j, "phi": phi_j },
                "sigma_f": self.width,
                "view": view,
                "hair": hair,
            }),
        }
    }
}

pub(super) fn name(function: Function) -> &'static str {
    match function {
        Function::Global => "global",
        Function::Local => "local",
        _ => "direct_local",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_query_asks_for_names_none() {
        for function in FUNCTIONS {
            let point = Point {
                function,
                light: [0.1, 0.2],
                width: 0.3,
                view: [0.4, 0.5],
            };
            let inputs = point.query(&HairParams::default());
            match function {
                Function::DirectLocal => {
                    assert_eq!(inputs["function"], "direct_local");
                    assert!(inputs["q"].is_null(), "{inputs}");
                    assert_eq!(inputs["light"]["lambda"], 0.3);
                }
                _ => assert_eq!(inputs["q"], name(function)),
            }
        }
    }
}
