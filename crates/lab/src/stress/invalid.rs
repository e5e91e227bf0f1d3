//! Parameters that must be refused, by name, wherever they come in.

use serde_json::{Value, json};
use strandlight_formats::Scene;
use strandlight_scattering::closed_form::{DEFAULT_SEGMENTS, Fibre};
use strandlight_scattering::{HairParams, Lobe};

use super::point::{Light, Point, hair_json};
use super::report::{Check, Tally};

/// Refuses or accepts a line as `strandlight probe` does.
pub type ParseQuery<'a> = &'a (dyn Fn(&str) -> Result<(), String> + Sync);

/// What is set: a field, how it is named in messages, values outside its range, its ends.
struct Field {
    name: &'static str,
    set: fn(&mut HairParams, f64),
    bad: &'static [f64],
    ends: [f64; 2],
    /// Key and number in a scene file, where the unit is the same.
    scene_key: &'static str,
}

const NAN: f64 = f64::NAN;
const INFINITY: f64 = f64::INFINITY;

const FIELDS: [Field; 10] = [
    Field {
        name: "eta",
        set: |hair, x| hair.eta = x,
        bad: &[1.0, 0.9, 0.0, -1.55, 3.01, 1e300],
        ends: [1.0001, 3.0],
        scene_key: "eta",
    },
    Field {
        name: "sigma_a",
        set: |hair, x| hair.sigma_a[1] = x,
        bad: &[-1e-9, -1.0, 50.1],
        ends: [0.0, 50.0],
        scene_key: "sigma_a",
    },
    Field {
        name: "shift.r",
        set: |hair, x| hair.shift.r = x,
        bad: &[-0.6, 0.6],
        ends: [-0.5, 0.5],
        scene_key: "shift_deg",
    },
    Field {
        name: "shift.tt",
        set: |hair, x| hair.shift.tt = x,
        bad: &[-0.6, 0.6],
        ends: [-0.5, 0.5],
        scene_key: "",
    },
    Field {
        name: "shift.trt",
        set: |hair, x| hair.shift.trt = x,
        bad: &[-0.6, 0.6],
        ends: [-0.5, 0.5],
        scene_key: "",
    },
    Field {
        name: "width.r",
        set: |hair, x| hair.width.r = x,
        bad: &[-0.1, 0.0, 1e-30, 1.6],
        ends: [0.001, 1.5],
        scene_key: "width_deg",
    },
    Field {
        name: "width.tt",
        set: |hair, x| hair.width.tt = x,
        bad: &[-0.1, 0.0, 1e-30, 1.6],
        ends: [0.001, 1.5],
        scene_key: "",
    },
    Field {
        name: "width.trt",
        set: |hair, x| hair.width.trt = x,
        bad: &[-0.1, 0.0, 1e-30, 1.6],
        ends: [0.001, 1.5],
        scene_key: "",
    },
    Field {
        name: "caustic_width",
        set: |hair, x| hair.caustic_width = x,
        bad: &[-0.1, 0.0, 1e-30, 1.6],
        ends: [0.01, 1.5],
        scene_key: "caustic_width_deg",
    },
    Field {
        name: "eccentricity",
        set: |hair, x| hair.eccentricity = x,
        bad: &[-1.0, 0.0, 0.4, 2.1],
        ends: [0.5, 2.0],
        scene_key: "eccentricity",
    },
];

/// Values that no field takes.
const NEVER: [f64; 3] = [NAN, INFINITY, -INFINITY];

/// All of it.
pub fn checks(parse_query: ParseQuery) -> Vec<Check> {
    vec![api(), scenes(), queries(parse_query)]
}

/// Feeds one case: refused with a message that has `needle`, or (no needle) accepted.
fn see(tally: &mut Tally, answer: Result<(), String>, needle: Option<&str>, inputs: Value) {
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
    for field in &FIELDS {
        let mut case = |x: f64, needle: Option<&str>| {
            let mut hair = HairParams::default();
            (field.set)(&mut hair, x);
            let inputs = json!({ "field": field.name, "value": x.to_string() });
            let validated = hair.validate().map_err(|error| error.to_string());
            see(&mut tally, validated, needle, inputs.clone());
            let fibre = Fibre::new(&hair, &Lobe::ALL, DEFAULT_SEGMENTS);
            let fibre = fibre.map(|_| ()).map_err(|error| error.to_string());
            see(&mut tally, fibre, needle, inputs);
        };
        for &x in field.bad.iter().chain(&NEVER) {
            case(x, Some(field.name));
        }
        for x in field.ends {
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
    for field in &FIELDS {
        let key = field.scene_key;
        let section = |x: String| match key {
            "sigma_a" => format!("[hair]\nsigma_a = [0.1, {x}, 0.2]\n"),
            "shift_deg" | "width_deg" => {
                format!("[hair]\n{key} = {{ r = {x}, tt = 3.0, trt = 9.0 }}\n")
            }
            _ => format!("[hair]\n{key} = {x}\n"),
        };
        if key.is_empty() {
            continue;
        }
        let is_angle = key.ends_with("_deg");
        let degrees = |x: f64| if is_angle { x.to_degrees() } else { x };
        for &x in field.bad {
            case(section(format!("{:?}", degrees(x))), Some(key));
        }
        for word in ["nan", "inf", "-inf"] {
            case(section(word.to_owned()), Some(key));
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
    for field in &FIELDS {
        for &x in field.bad {
            let mut hair = HairParams::default();
            (field.set)(&mut hair, x);
            let mut query = good.clone();
            query["hair"] = hair_json(&hair);
            case(query.to_string(), Some(field.name));
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
