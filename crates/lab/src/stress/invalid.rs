//! Parameters that must be refused, by name, wherever they come in.

use std::error::Error;

use serde_json::{Value, json};
use strandlight_formats::Scene;
use strandlight_formats::params::{HAIR, Shape};
use strandlight_scattering::closed_form::{DEFAULT_SEGMENTS, Fibre};
use strandlight_scattering::{HairParams, Lobe, Parameter};

use super::point::{Evaluation, Light, Point, hair_json};
use super::report::{Check, Tally};

/// Refuses or accepts a line as `strandlight probe` does; the error is the program's own.
pub type ParseQuery<'a> = &'a (dyn Fn(&str) -> Result<(), Box<dyn Error + Send + Sync>> + Sync);

/// Values that no number takes.
const NEVER: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

/// Finite values outside a range, just beside it and far away.
fn outside([min, max]: [f64; 2]) -> Vec<f64> {
    let above_zero = [0.0, 1e-30, -1e-30].into_iter().filter(|x| *x < min);
    let near = [min.next_down(), max.next_up()];
    let far = [min - 1.0, min - 1e9, max + 1.0, 1e300];
    above_zero.chain(near).chain(far).collect()
}

/// Every number of a fibre: its name, the parameter it belongs to, its place there.
fn numbers() -> impl Iterator<Item = (&'static str, Parameter, usize)> {
    Parameter::ALL.into_iter().flat_map(|parameter| {
        let names = parameter.numbers().iter().enumerate();
        names.map(move |(ix, name)| (*name, parameter, ix))
    })
}

/// Hair with one number at `x`.
fn hair_with(parameter: Parameter, ix: usize, x: f64) -> HairParams {
    let mut hair = HairParams::default();
    let mut values = parameter.get(&hair);
    values[ix] = x;
    parameter.set(&mut hair, values);
    hair
}

/// All of it.
pub fn checks(parse_query: ParseQuery) -> Vec<Check> {
    vec![api(), scenes(), queries(parse_query)]
}

/// Feeds one case: refused with a message that has `needle`, or (no needle) accepted.
fn see<E: ToString>(tally: &mut Tally, answer: Result<(), E>, needle: Option<&str>, inputs: Value) {
    let answer = answer.map_err(|error| error.to_string());
    let good = match (&answer, needle) {
        (Err(error), Some(needle)) => error.contains(needle),
        (Ok(()), None) => true,
        _ => false,
    };
    tally.see(f64::from(u8::from(!good)), || {
        let found = answer.map_or_else(|error| error, |()| "accepted".to_owned());
        let expected = needle.map_or("accepted".to_owned(), |n| format!("an error naming {n}"));
        [json!(found), json!(expected), inputs]
    });
}

const NOTE: &str = "1 where a bad value is accepted or not named, or a good one refused";

fn api() -> Check {
    let mut tally = Tally::new();
    for (name, parameter, ix) in numbers() {
        let mut case = |x: f64, needle: Option<&str>| {
            let hair = hair_with(parameter, ix, x);
            let inputs = json!({ "field": name, "value": x.to_string() });
            let validated = hair.validate();
            see(&mut tally, validated, needle, inputs.clone());
            let fibre = Fibre::new(&hair, &Lobe::ALL, DEFAULT_SEGMENTS);
            let fibre = fibre.map(|_| ());
            see(&mut tally, fibre, needle, inputs);
        };
        for x in outside(parameter.range()).into_iter().chain(NEVER) {
            case(x, Some(name));
        }
        for x in parameter.range() {
            case(x, None);
        }
    }
    tally.check("invalid parameters, API", "-", Some(0.0), NOTE)
}

fn scenes() -> Check {
    let mut tally = Tally::new();
    let files = "version = 1\n[groom]\nfile = \"a\"\n[lights]\nfile = \"b\"\n";
    let mut case = |hair: String, needle: Option<&str>| {
        let text = format!("{files}{hair}");
        let answer = Scene::from_toml(&text).map(|_| ());
        let answer = answer.map_err(|error| error.to_string());
        see(&mut tally, answer, needle, json!({ "toml": hair }));
    };
    case(String::new(), None);
    for param in HAIR.params {
        let Some(numbers) = param.spec.numbers() else {
            continue;
        };
        let section = |ix: usize, x: String| {
            let mut values = [(); 3].map(|()| format!("{:?}", 0.5 * (numbers.min + numbers.max)));
            values[ix] = x;
            let [a, b, c] = values;
            let value = match numbers.shape {
                Shape::PerLobe => format!("{{ r = {a}, tt = {b}, trt = {c} }}"),
                Shape::Rgb | Shape::Vector => format!("[{a}, {b}, {c}]"),
                Shape::Number | Shape::Whole | Shape::Size => a,
            };
            format!("[hair]\n{} = {value}\n", param.spec.key)
        };
        for (ix, suffix) in numbers.shape.suffixes().iter().enumerate() {
            let key = format!("hair.{}{suffix}", param.spec.key);
            for x in outside([numbers.min, numbers.max]) {
                case(section(ix, format!("{x:?}")), Some(&key));
            }
            for word in ["nan", "inf", "-inf"] {
                case(section(ix, word.to_owned()), Some(&key));
            }
            for end in [numbers.min, numbers.max] {
                case(section(ix, format!("{end:?}")), None);
            }
        }
    }
    tally.check("invalid parameters, scene files", "-", Some(0.0), NOTE)
}

fn queries(parse_query: ParseQuery) -> Check {
    let mut tally = Tally::new();
    let good = Point::Single {
        lobe: Lobe::Trt,
        light: Light {
            theta: 0.1,
            phi: 2.0,
            lambda: 0.3,
        },
        theta_o: 0.0,
        phi_o: 0.4,
    }
    .query(&HairParams::default());
    let mut case = |query: String, needle: Option<&str>| {
        let answer = parse_query(&query);
        see(&mut tally, answer, needle, json!({ "line": query }));
    };
    case(good.to_string(), None);
    for (name, parameter, ix) in numbers() {
        for x in outside(parameter.range()) {
            let mut query = good.clone();
            query["hair"] = hair_json(&hair_with(parameter, ix, x));
            case(query.to_string(), Some(name));
        }
    }
    for (part, key, values) in [
        ("light", "lambda", &[0.0, -0.3, 1e-9, 11.0][..]),
        ("light", "theta", &[1.6, -1.6, 1e9]),
        ("view", "theta", &[1.6, -1.6, 1e9]),
        ("view", "phi", &[1e9, -1e9]),
    ] {
        for &x in values {
            let mut query = good.clone();
            query[part][key] = json!(x);
            case(query.to_string(), Some(key));
        }
    }
    // JSON has no NaN and no infinity; a reader that takes them is wrong.
    let text = good.to_string();
    for word in ["NaN", "Infinity", "-Infinity", "1e999", "null", "\"0.3\""] {
        case(text.replace("0.3", word), Some(""));
    }
    tally.check("invalid parameters, queries", "-", Some(0.0), NOTE)
}
