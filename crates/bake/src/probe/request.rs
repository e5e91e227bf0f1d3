//! Queries as JSON says them, checked against their ranges.

use std::f64::consts::FRAC_PI_2;
use std::ops::RangeInclusive;

use serde_json::Value;
use serde_json::error::Category;
use strandlight_scattering::dual_scattering::Average;
use strandlight_scattering::exact::Forward;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe, Model, Parameter, ParameterShape};

use super::keys::{Keys, shortened};
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Inclination of the centre.
    pub theta: f64,
    /// Azimuth of the centre.
    pub phi: f64,
    /// Bandwidth.
    pub lambda: f64,
}

/// A direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Inclination.
    pub theta: f64,
    /// Azimuth.
    pub phi: f64,
}

/// The kinds of query, as `q` names them.
const KINDS: [&str; 7] = [
    "table_C",
    "table_H",
    "azimuthal",
    "single",
    "global",
    "local",
    "average",
];

/// Inclinations.
const THETA: RangeInclusive<f64> = -FRAC_PI_2..=FRAC_PI_2;
/// Azimuths: any that f64 wraps exactly enough.
const PHI: RangeInclusive<f64> = -1e6..=1e6;
/// Bandwidths of a light.
const LAMBDA: RangeInclusive<f64> = 0.001..=10.0;
/// Bandwidths on the azimuth: lambda' passes lambda at grazing angles.
const LAMBDA_P: RangeInclusive<f64> = 0.001..=1000.0;
/// Widths of forward-scattered light.
const SIGMA_F: RangeInclusive<f64> = 0.001..=10.0;
/// Indices of refraction of the H tables.
const TABLE_ETA: RangeInclusive<f64> = 1.0..=10.0;

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
    /// One sentence naming the key, by its whole path, the value that is wrong, and what is
    /// accepted.
    pub fn parse(line: &str) -> Result<Request, String> {
        let Unique(value) = serde_json::from_str(line).map_err(|error| match error.classify() {
            Category::Data => error.to_string(),
            _ => format!("not JSON: {error}"),
        })?;
        Request::from_value(&value)
    }

    /// The query that a value says.
    ///
    /// # Errors
    /// As [`Request::parse`].
    pub fn from_value(value: &Value) -> Result<Request, String> {
        let Value::Object(object) = value else {
            return Err("a query is a JSON object".to_owned());
        };
        let q = match object.get("q") {
            Some(Value::String(q)) => q.as_str(),
            Some(other) => {
                let other = shortened(&other.to_string());
                return Err(format!("q is {other}, must be one of {}", KINDS.join(", ")));
            }
            None => return Err(format!("missing field `q`, one of {}", KINDS.join(", "))),
        };
        let keys = |known: &[&str]| {
            let known: Vec<&str> = [&["q"], known].concat();
            Keys::from_query(object, &known)
        };
        match q {
            "table_C" => {
                let keys = keys(&["k", "lambda", "phi"])?;
                Ok(Request::TableC {
                    k: keys.whole("k", &[0, 1, 2, 3, 4, 5, 6])?,
                    lambda: keys.number("lambda", LAMBDA)?,
                    phi: keys.number("phi", PHI)?,
                })
            }
            "table_H" => {
                let keys = keys(&["mode", "k", "eta", "theta_d", "fresnel"])?;
                let with_lobes = |name: &str| Lobe::from_name(name).filter(|&it| it != Lobe::R);
                let fresnel = |keys: &Keys<'_>, key: &str| {
                    keys.named(key, "dielectric or schlick", |name| name.parse().ok())
                };
                Ok(Request::TableH {
                    lobe: keys.named("mode", "TT or TRT", with_lobes)?,
                    k: keys.whole("k", &[0, 2, 4, 6])?,
                    eta: keys.number("eta", TABLE_ETA)?,
                    theta_d: keys.number("theta_d", THETA)?,
                    fresnel: keys.optional("fresnel", fresnel)?,
                })
            }
            "azimuthal" => {
                let keys = keys(&["mode", "lambda", "dphi", "theta_d", "hair"])?;
                Ok(Request::Azimuthal {
                    lobe: keys.named("mode", "R, TT or TRT", Lobe::from_name)?,
                    lambda: keys.number("lambda", LAMBDA_P)?,
                    dphi: keys.number("dphi", PHI)?,
                    theta_d: keys.number("theta_d", THETA)?,
                    hair: hair(&keys)?,
                })
            }
            "single" => {
                let keys = keys(&["mode", "light", "view", "hair"])?;
                let lobe = mode(&keys, "mode")?;
                let light = keys.object("light", &["theta", "phi", "lambda"])?;
                let lambda = light.number("lambda", LAMBDA)?;
                let Direction { theta, phi } = direction(&light)?;
                Ok(Request::Single {
                    lobe,
                    light: Light { theta, phi, lambda },
                    view: view(&keys)?,
                    hair: hair(&keys)?,
                })
            }
            "global" => {
                let keys = keys(&["mode", "light", "view", "sigma_f", "hair"])?;
                Ok(Request::Global {
                    lobe: mode(&keys, "mode")?,
                    forward: forward(&keys)?,
                    view: view(&keys)?,
                    hair: hair(&keys)?,
                })
            }
            "local" => {
                let keys = keys(&["mode", "light", "view", "sigma_f", "hair"])?;
                // One for all modes; the key is read for the sake of `global`'s queries.
                keys.optional("mode", mode)?;
                Ok(Request::Local {
                    forward: forward(&keys)?,
                    view: view(&keys)?,
                    hair: hair(&keys)?,
                })
            }
            "average" => {
                let keys = keys(&["name", "theta_d", "hair"])?;
                let names = format!("one of {}", Average::ALL.map(Average::name).join(", "));
                Ok(Request::Average {
                    name: keys.named("name", &names, Average::from_name)?,
                    theta_d: keys.number("theta_d", THETA)?,
                    hair: hair(&keys)?,
                })
            }
            _ => {
                let q = shortened(&format!("{q:?}"));
                Err(format!("q is {q}, must be one of {}", KINDS.join(", ")))
            }
        }
    }
}

/// The mode at `key`, `None` for all of them.
fn mode(keys: &Keys<'_>, key: &str) -> Result<Option<Lobe>, String> {
    keys.named(key, "R, TT, TRT or all", |name| match name {
        "all" => Some(None),
        name => Lobe::from_name(name).map(Some),
    })
}

/// The angles of a direction.
fn direction(keys: &Keys<'_>) -> Result<Direction, String> {
    Ok(Direction {
        theta: keys.number("theta", THETA)?,
        phi: keys.number("phi", PHI)?,
    })
}

fn view(keys: &Keys<'_>) -> Result<Direction, String> {
    direction(&keys.object("view", &["theta", "phi"])?)
}

/// Forward-scattered light: a `light`, whose width does not matter, of width `sigma_f`.
fn forward(keys: &Keys<'_>) -> Result<Forward, String> {
    let light = keys.object("light", &["theta", "phi", "lambda"])?;
    light.optional("lambda", |light, key| light.number(key, LAMBDA))?;
    let Direction { theta, phi } = direction(&light)?;
    Ok(Forward {
        theta,
        phi,
        sigma_f: keys.number("sigma_f", SIGMA_F)?,
    })
}

/// The keys of a fibre that no query leaves out. The others came later; without them they have
/// their defaults.
const REQUIRED: [Parameter; 5] = [
    Parameter::Eta,
    Parameter::SigmaA,
    Parameter::Shift,
    Parameter::Width,
    Parameter::CausticWidth,
];

/// The fibre at `hair`.
fn hair(keys: &Keys<'_>) -> Result<HairParams, String> {
    let mut known = Parameter::ALL.map(Parameter::name).to_vec();
    known.push("model");
    let keys = keys.object("hair", &known)?;
    let mut hair = HairParams::default();
    let accepted = Model::ALL.map(Model::name).join(" or ");
    let model = keys.optional("model", |keys, key| {
        keys.named(key, &accepted, Model::from_name)
    })?;
    hair.model = model.unwrap_or_default();
    for parameter in Parameter::ALL {
        let [low, high] = parameter.range();
        let read = |keys: &Keys<'_>, name: &str| match parameter.shape() {
            ParameterShape::Number => Ok([keys.number(name, low..=high)?; 3]),
            ParameterShape::Rgb => keys.rgb(name, low..=high),
            ParameterShape::PerLobe => {
                let modes = keys.object(name, &["r", "tt", "trt"])?;
                let number = |mode: &str| modes.number(mode, low..=high);
                Ok([number("r")?, number("tt")?, number("trt")?])
            }
        };
        let values = match REQUIRED.contains(&parameter) {
            true => Some(read(&keys, parameter.name())?),
            false => keys.optional(parameter.name(), read)?,
        };
        if let Some(values) = values {
            parameter.set(&mut hair, values);
        }
    }
    hair.validate().map_err(|error| format!("hair: {error}"))?;
    Ok(hair)
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
    fn the_model_is_read_and_checked() {
        let parse = |model: &str, eccentricity: &str| {
            let hair = HAIR.replace(
                r#""eccentricity":1.0"#,
                &format!(r#""eccentricity":{eccentricity},"model":{model}"#),
            );
            Request::parse(&format!(
                r#"{{"q":"average","name":"a_f","theta_d":0.2,"hair":{hair}}}"#
            ))
        };
        for model in Model::ALL {
            let request = parse(&format!("{:?}", model.name()), "1.0").unwrap();
            assert_eq!(request.hair().unwrap().model, model);
        }
        for (model, eccentricity, needle) in [
            (
                r#""kajiya""#,
                "1.0",
                "hair.model is \"kajiya\", must be marschner or energy",
            ),
            ("3", "1.0", "hair.model is 3"),
            (r#""energy""#, "0.9", "eccentricity of model energy is 0.9"),
        ] {
            let error = parse(model, eccentricity).unwrap_err();
            assert!(error.contains(needle), "{error}");
        }
    }

    #[test]
    fn faults_are_named() {
        for (line, needle) in [
            ("", "not JSON"),
            ("[1]", "object"),
            ("{}", "missing field `q`, one of table_C"),
            (r#"{"q":3}"#, "q is 3, must be one of table_C"),
            (
                r#"{"q":"table_D"}"#,
                "q is \"table_D\", must be one of table_C, table_H, azimuthal, single, global, \
                 local, average",
            ),
            (r#"{"q":"global"}"#, "missing field `mode`"),
            (r#"{"q":"local"}"#, "missing field `light`"),
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
                    "hair":{HAIR},"sigma_f":0.0001}}"#
                ),
                "sigma_f is 0.0001",
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
                "must be one of a_f, a_b",
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
                "key k is there twice",
            ),
            (
                r#"{"q":"single","light":{"theta":0,"theta":0}}"#,
                "key light.theta is there twice",
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

    /// Every key of every query: missing, of another type, out of range, misspelt. The message has
    /// its whole path, and the value and what is accepted where there is one.
    #[test]
    fn messages_name_the_whole_path_the_value_and_what_is_accepted() {
        let queries = [
            r#"{"q":"table_C","k":3,"lambda":0.2,"phi":1.0}"#.to_owned(),
            r#"{"q":"table_H","mode":"TT","k":2,"eta":1.55,"theta_d":0.3}"#.to_owned(),
            format!(
                r#"{{"q":"azimuthal","mode":"TRT","lambda":0.2,"dphi":0.5,"theta_d":0.1,"hair":{HAIR}}}"#
            ),
            format!(
                r#"{{"q":"single","mode":"TT","light":{{"theta":0.1,"phi":2.0,"lambda":0.3}},
                "view":{{"theta":0,"phi":0.4}},"hair":{HAIR}}}"#
            ),
            format!(
                r#"{{"q":"global","mode":"all","light":{{"theta":0.1,"phi":2.0}},
                "view":{{"theta":0,"phi":0.4}},"hair":{HAIR},"sigma_f":0.3}}"#
            ),
            format!(
                r#"{{"q":"local","light":{{"theta":0.1,"phi":2.0}},
                "view":{{"theta":0,"phi":0.4}},"hair":{HAIR},"sigma_f":3}}"#
            ),
            format!(r#"{{"q":"average","name":"a_f","theta_d":0.2,"hair":{HAIR}}}"#),
        ];
        let mut n_checked = 0;
        for text in &queries {
            let query: Value = serde_json::from_str(text).unwrap();
            let mut paths = Vec::new();
            places("", &query, &mut paths);
            for path in paths.iter().filter(|path| *path != "q") {
                let pointer = format!("/{}", path.replace('.', "/"));
                let (parent, key) = pointer.rsplit_once('/').unwrap();
                let parent_path = parent.trim_start_matches('/').replace('/', ".");
                let place = match parent_path.as_str() {
                    "" => String::new(),
                    path => format!("{path}: "),
                };
                let refused = |change: &dyn Fn(&mut Value)| {
                    let mut query = query.clone();
                    change(query.pointer_mut(parent).unwrap());
                    Request::parse(&query.to_string()).unwrap_err()
                };
                let missing = |object: &mut Value| {
                    object.as_object_mut().unwrap().remove(key);
                };
                if path != "hair.eccentricity" {
                    let message = format!("{place}missing field `{key}`");
                    assert_eq!(refused(&missing), message, "{text}");
                }
                let wrong = refused(&|object| object[key] = Value::Bool(true));
                let message = format!("{path} is true, must be ");
                assert!(wrong.starts_with(&message), "{wrong}");
                assert!(wrong.len() > message.len() + 3, "{wrong}");
                let misspelt = refused(&|object| object["thing"] = Value::from(1));
                let message = format!("{place}unknown field `thing`, expected ");
                assert!(misspelt.starts_with(&message), "{misspelt}");
                assert!(misspelt.contains(key), "{misspelt}");
                if query.pointer(&pointer).unwrap().is_number() {
                    let outside = refused(&|object| object[key] = Value::from(1e9));
                    let named = outside.starts_with(&format!("{path} is 1000000000.0, "));
                    let range = outside.contains("..=") || outside.contains("one of 0");
                    assert!(named && range, "{outside}");
                }
                n_checked += 1;
            }
        }
        // Keys of the query, of light and view, and 15 of each of 5 fibres.
        assert_eq!(
            n_checked,
            (3 + 4 + 5 + 4 + 5 + 4 + 3) + (3 + 2) + 4 + 4 + 5 * 12
        );
        let rgb = HAIR.replace("0.3,0.5]", "\"x\",0.5]");
        let error = format!(r#"{{"q":"average","name":"a_f","theta_d":0.2,"hair":{rgb}}}"#);
        let error = Request::parse(&error).unwrap_err();
        assert_eq!(
            error,
            "hair.sigma_a[1] is \"x\", must be a number in 0..=50"
        );
    }

    /// Paths of all keys, those of objects included.
    fn places(path: &str, value: &Value, paths: &mut Vec<String>) {
        let Value::Object(object) = value else { return };
        for (key, value) in object {
            let path = match path {
                "" => key.clone(),
                path => format!("{path}.{key}"),
            };
            places(&path, value, paths);
            paths.push(path);
        }
    }
}
