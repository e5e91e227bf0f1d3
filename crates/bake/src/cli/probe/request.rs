//! Queries as JSON says them, checked against their ranges.

use std::f64::consts::FRAC_PI_2;

use serde::Deserialize;
use serde_json::Value;
use serde_json::error::Category;
use strandlight_scattering::dual_scattering::Average;
use strandlight_scattering::exact::Forward;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe, PerLobe};

use super::unique::Unique;

/// A valid query.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// C_k(lambda', phi).
    TableC { k: u32, lambda: f64, phi: f64 },
    /// H_k of TT or TRT; `fresnel` is the tables' where nothing is said.
    TableH {
        lobe: Lobe,
        k: u32,
        eta: f64,
        theta_d: f64,
        fresnel: Option<Fresnel>,
    },
    /// Eq 12.
    Azimuthal {
        lobe: Lobe,
        lambda: f64,
        dphi: f64,
        theta_d: f64,
        hair: HairParams,
    },
    /// Eq 11 of one mode or of all.
    Single {
        lobe: Option<Lobe>,
        light: Light,
        view: Direction,
        hair: HairParams,
    },
    /// Eq 27 of one mode or of all.
    Global {
        lobe: Option<Lobe>,
        forward: Forward,
        view: Direction,
        hair: HairParams,
    },
    /// Eq 29.
    Local {
        forward: Forward,
        view: Direction,
        hair: HairParams,
    },
    /// Eq 32 and what follows from it, at incident inclination `theta_d`.
    Average {
        name: Average,
        theta_d: f64,
        hair: HairParams,
    },
}

/// A spherical Gaussian light of amplitude 1.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Inclination of the centre.
    pub theta: f64,
    /// Azimuth of the centre.
    pub phi: f64,
    /// Bandwidth.
    pub lambda: f64,
}

/// The axis of forward-scattered light; of [`Light`]'s keys the width does not matter.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Axis {
    theta: f64,
    phi: f64,
    lambda: Option<f64>,
}

/// A direction.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Direction {
    /// Inclination.
    pub theta: f64,
    /// Azimuth.
    pub phi: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TableC {
    k: u32,
    lambda: f64,
    phi: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TableH {
    mode: String,
    k: u32,
    eta: f64,
    theta_d: f64,
    fresnel: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Azimuthal {
    mode: String,
    lambda: f64,
    dphi: f64,
    theta_d: f64,
    hair: Hair,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Single {
    mode: String,
    light: Light,
    view: Direction,
    hair: Hair,
}

/// Keys of `global` and `local`; the latter is one for all modes.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Multiple {
    mode: Option<String>,
    light: Axis,
    view: Direction,
    sigma_f: f64,
    hair: Hair,
}

#[derive(Deserialize)]
#[serde(rename = "Average", deny_unknown_fields)]
struct AverageKeys {
    name: String,
    theta_d: f64,
    hair: Hair,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Hair {
    eta: f64,
    sigma_a: [f64; 3],
    shift: Modes,
    width: Modes,
    caustic_width: f64,
    #[serde(default = "circular")]
    eccentricity: f64,
}

fn circular() -> f64 {
    1.0
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Modes {
    r: f64,
    tt: f64,
    trt: f64,
}

impl Request {
    /// The fibre whose optics the answer takes.
    pub fn hair(&self) -> Option<&HairParams> {
        match self {
            Request::Azimuthal { hair, .. }
            | Request::Single { hair, .. }
            | Request::Global { hair, .. }
            | Request::Local { hair, .. }
            | Request::Average { hair, .. } => Some(hair),
            Request::TableC { .. } | Request::TableH { .. } => None,
        }
    }

    /// Whether shading reads the averages of multiple scattering for it.
    pub fn needs_averages(&self) -> bool {
        matches!(self, Request::Local { .. } | Request::Average { .. })
    }

    /// The query of one line.
    ///
    /// # Errors
    /// One sentence naming the key and the value that is wrong.
    pub fn parse(line: &str) -> Result<Request, String> {
        let Unique(value) = serde_json::from_str(line).map_err(|error| match error.classify() {
            Category::Data => error.to_string(),
            _ => format!("not JSON: {error}"),
        })?;
        let Value::Object(mut object) = value else {
            return Err("a query is a JSON object".to_owned());
        };
        let q = match object.remove("q") {
            Some(Value::String(q)) => q,
            Some(other) => return Err(format!("q is {other}, not a string")),
            None => return Err("key q is missing".to_owned()),
        };
        let rest = Value::Object(object);
        match q.as_str() {
            "table_C" => {
                let TableC { k, lambda, phi } = take(rest)?;
                if k > 6 {
                    return Err(format!("k is {k}, outside 0..=6"));
                }
                Ok(Request::TableC {
                    k,
                    lambda: within("lambda", lambda, 0.001, 10.0)?,
                    phi: within("phi", phi, -1e6, 1e6)?,
                })
            }
            "table_H" => {
                let TableH {
                    mode,
                    k,
                    eta,
                    theta_d,
                    fresnel,
                } = take(rest)?;
                let lobe = match Lobe::from_name(&mode) {
                    Some(lobe @ (Lobe::Tt | Lobe::Trt)) => lobe,
                    _ => return Err(format!("mode is {mode:?}, not TT or TRT")),
                };
                if !matches!(k, 0 | 2 | 4 | 6) {
                    return Err(format!("k is {k}, not 0, 2, 4 or 6"));
                }
                let fresnel = fresnel
                    .map(|name| {
                        Fresnel::from_name(&name).ok_or_else(|| {
                            format!("fresnel is {name:?}, not dielectric or schlick")
                        })
                    })
                    .transpose()?;
                Ok(Request::TableH {
                    lobe,
                    k,
                    eta: within("eta", eta, 1.0, 10.0)?,
                    theta_d: within("theta_d", theta_d, -FRAC_PI_2, FRAC_PI_2)?,
                    fresnel,
                })
            }
            "azimuthal" => {
                let Azimuthal {
                    mode,
                    lambda,
                    dphi,
                    theta_d,
                    hair,
                } = take(rest)?;
                let lobe = Lobe::from_name(&mode)
                    .ok_or_else(|| format!("mode is {mode:?}, not R, TT or TRT"))?;
                Ok(Request::Azimuthal {
                    lobe,
                    // lambda' passes lambda at grazing angles.
                    lambda: within("lambda", lambda, 0.001, 1000.0)?,
                    dphi: within("dphi", dphi, -1e6, 1e6)?,
                    theta_d: within("theta_d", theta_d, -FRAC_PI_2, FRAC_PI_2)?,
                    hair: hair.params()?,
                })
            }
            "single" => {
                let Single {
                    mode,
                    light,
                    view,
                    hair,
                } = take(rest)?;
                let lobe = mode_of(&mode)?;
                check_direction("light", light.theta, light.phi)?;
                within("light.lambda", light.lambda, 0.001, 10.0)?;
                check_direction("view", view.theta, view.phi)?;
                Ok(Request::Single {
                    lobe,
                    light,
                    view,
                    hair: hair.params()?,
                })
            }
            "average" => {
                let AverageKeys {
                    name,
                    theta_d,
                    hair,
                } = take(rest)?;
                let name = Average::from_name(&name).ok_or_else(|| {
                    let names = Average::ALL.map(Average::name).join(", ");
                    format!("name is {name:?}, not one of {names}")
                })?;
                Ok(Request::Average {
                    name,
                    theta_d: within("theta_d", theta_d, -FRAC_PI_2, FRAC_PI_2)?,
                    hair: hair.params()?,
                })
            }
            "global" | "local" => {
                let Multiple {
                    mode,
                    light,
                    view,
                    sigma_f,
                    hair,
                } = take(rest)?;
                let mode = match (mode, q.as_str()) {
                    (Some(mode), _) => mode,
                    (None, "local") => "all".to_owned(),
                    (None, _) => return Err("missing field `mode`".to_owned()),
                };
                let lobe = mode_of(&mode)?;
                check_direction("light", light.theta, light.phi)?;
                if let Some(lambda) = light.lambda {
                    within("light.lambda", lambda, 0.001, 10.0)?;
                }
                check_direction("view", view.theta, view.phi)?;
                let forward = Forward {
                    theta: light.theta,
                    phi: light.phi,
                    sigma_f: within("sigma_f", sigma_f, 0.01, 3.0)?,
                };
                let hair = hair.params()?;
                Ok(if q == "global" {
                    Request::Global {
                        lobe,
                        forward,
                        view,
                        hair,
                    }
                } else {
                    Request::Local {
                        forward,
                        view,
                        hair,
                    }
                })
            }
            _ => Err(format!("q {q:?} is unknown")),
        }
    }
}

/// The typed form of a query's keys.
fn take<T: for<'a> Deserialize<'a>>(rest: Value) -> Result<T, String> {
    serde_json::from_value(rest).map_err(|error| error.to_string())
}

/// The mode called `name`, `None` for all of them.
fn mode_of(name: &str) -> Result<Option<Lobe>, String> {
    match (name, Lobe::from_name(name)) {
        ("all", _) => Ok(None),
        (_, Some(lobe)) => Ok(Some(lobe)),
        _ => Err(format!("mode is {name:?}, not R, TT, TRT or all")),
    }
}

/// Both angles of a direction must lie in their ranges.
fn check_direction(key: &str, theta: f64, phi: f64) -> Result<(), String> {
    within(&format!("{key}.theta"), theta, -FRAC_PI_2, FRAC_PI_2)?;
    within(&format!("{key}.phi"), phi, -1e6, 1e6)?;
    Ok(())
}

/// `value`, if it lies in its range. Messages have it as `{:?}`, which writes 1e300 and 1e-300 with
/// an exponent.
fn within(key: &str, value: f64, min: f64, max: f64) -> Result<f64, String> {
    if (min..=max).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{key} is {value:?}, outside {min}..={max}"))
    }
}

impl Hair {
    fn params(self) -> Result<HairParams, String> {
        let per_lobe = |Modes { r, tt, trt }| PerLobe { r, tt, trt };
        let hair = HairParams {
            eta: self.eta,
            sigma_a: self.sigma_a,
            shift: per_lobe(self.shift),
            width: per_lobe(self.width),
            caustic_width: self.caustic_width,
            eccentricity: self.eccentricity,
        };
        hair.validate().map_err(|error| error.to_string())?;
        Ok(hair)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HAIR: &str = r#"{"eta":1.55,"sigma_a":[0.2,0.3,0.5],
        "shift":{"r":-0.1,"tt":0.05,"trt":0.15},"width":{"r":0.18,"tt":0.09,"trt":0.36},
        "caustic_width":0.1,"eccentricity":1.0}"#;

    #[test]
    fn the_documented_queries_parse() {
        for line in [
            r#"{"q":"table_C","k":3,"lambda":0.2,"phi":1.0}"#.to_owned(),
            r#"{"q":"table_H","mode":"TT","k":2,"eta":1.55,"theta_d":0.3,"fresnel":"dielectric"}"#
                .to_owned(),
            format!(
                r#"{{"q":"azimuthal","mode":"TRT","lambda":0.2,"dphi":0.5,"theta_d":0.1,"hair":{HAIR}}}"#
            ),
            format!(
                r#"{{"q":"single","mode":"TT","light":{{"theta":0.1,"phi":2.0,"lambda":0.3}},
                "view":{{"theta":0,"phi":0.4}},"hair":{HAIR}}}"#
            ),
            format!(
                r#"{{"q":"global","mode":"all","light":{{"theta":0.1,"phi":2.0,"lambda":0.3}},
                "view":{{"theta":0,"phi":0.4}},"hair":{HAIR},"sigma_f":0.3}}"#
            ),
            format!(
                r#"{{"q":"local","light":{{"theta":0.1,"phi":2.0}},
                "view":{{"theta":0,"phi":0.4}},"hair":{HAIR},"sigma_f":3}}"#
            ),
            format!(r#"{{"q":"average","name":"a_f","theta_d":0.2,"hair":{HAIR}}}"#),
            format!(r#"{{"q":"average","name":"sigma_b","theta_d":-1.5,"hair":{HAIR}}}"#),
        ] {
            Request::parse(&line).unwrap_or_else(|error| panic!("{line}: {error}"));
        }
    }

    #[test]
    fn faults_are_named() {
        for (line, needle) in [
            ("", "not JSON"),
            ("[1]", "object"),
            ("{}", "q is missing"),
            (r#"{"q":3}"#, "not a string"),
            (r#"{"q":"table_D"}"#, "unknown"),
            (r#"{"q":"global"}"#, "light"),
            (
                &format!(
                    r#"{{"q":"global","light":{{"theta":0,"phi":0}},"view":{{"theta":0,"phi":0}},
                    "hair":{HAIR},"sigma_f":0.3}}"#
                ),
                "mode",
            ),
            (
                &format!(
                    r#"{{"q":"global","mode":"T","light":{{"theta":0,"phi":0}},
                    "view":{{"theta":0,"phi":0}},"hair":{HAIR},"sigma_f":0.3}}"#
                ),
                "mode is \"T\"",
            ),
            (
                &format!(
                    r#"{{"q":"local","light":{{"theta":0,"phi":0}},"view":{{"theta":0,"phi":0}},
                    "hair":{HAIR},"sigma_f":0.001}}"#
                ),
                "sigma_f is 0.001",
            ),
            (
                &format!(
                    r#"{{"q":"local","light":{{"theta":0,"phi":0}},"view":{{"theta":2,"phi":0}},
                    "hair":{HAIR},"sigma_f":1}}"#
                ),
                "view.theta is 2",
            ),
            (r#"{"q":"average","name":"a_f"}"#, "theta_d"),
            (
                &format!(r#"{{"q":"average","name":"a_F","theta_d":0,"hair":{HAIR}}}"#),
                "not one of a_f, a_b",
            ),
            (
                &format!(r#"{{"q":"average","name":"a_f","theta_d":1.6,"hair":{HAIR}}}"#),
                "theta_d is 1.6",
            ),
            (r#"{"q":"table_C","k":7,"lambda":0.2,"phi":1.0}"#, "k is 7"),
            (r#"{"q":"table_C","k":-1,"lambda":0.2,"phi":1.0}"#, "-1"),
            (
                r#"{"q":"table_C","k":3,"lambda":20,"phi":1.0}"#,
                "lambda is 20",
            ),
            (r#"{"q":"table_C","k":3,"lambda":0.2}"#, "phi"),
            (r#"{"q":"table_C","k":3,"lambda":0.2,"phi":1.0,"x":1}"#, "x"),
            (
                r#"{"q":"table_H","mode":"R","k":2,"eta":1.5,"theta_d":0}"#,
                "mode",
            ),
            (
                r#"{"q":"table_H","mode":"TT","k":1,"eta":1.5,"theta_d":0}"#,
                "k is 1",
            ),
            (
                r#"{"q":"table_H","mode":"TT","k":2,"eta":1.5,"theta_d":0,"fresnel":"x"}"#,
                "fresnel",
            ),
            (
                r#"{"q":"table_C","k":3,"lambda":0.2,"phi":1.0,"k":4}"#,
                "key \"k\" is there twice",
            ),
            (
                r#"{"q":"single","light":{"theta":0,"theta":0}}"#,
                "key \"theta\" is there twice",
            ),
            (
                r#"{"q":"table_C","k":3,"lambda":1e300,"phi":1.0}"#,
                "lambda is 1e300,",
            ),
            (
                r#"{"q":"table_C","k":3,"lambda":1e-300,"phi":1.0}"#,
                "lambda is 1e-300,",
            ),
            (r#"{"q":"table_C","k":1e300,"lambda":1,"phi":1}"#, "1e+300"),
            (r#"{"q":-1e300}"#, "-1e+300"),
        ] {
            let error = Request::parse(line).unwrap_err();
            assert!(error.contains(needle), "{line}: {error}");
            assert!(error.len() < 200, "{line}: {error}");
        }
    }
}
