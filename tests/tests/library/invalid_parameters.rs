//! Parameters outside their ranges are typed errors that name field and value: at the API, in
//! files and in queries. Every field with a range, every way to miss it.

use std::io::Write;
use std::process::Stdio;
use std::sync::Arc;

use serde_json::{Value, json};
use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::params::{Absent, Kind, ParamSpec, SECTIONS, SectionSpec, Shape};
use strandlight_formats::{
    Background, BakedFile, LightSet, LightSetInfo, Scene, SrbfLight, TableFile,
};
use strandlight_scattering::closed_form::Fibre;
use strandlight_scattering::exact::{Light, View};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe, ParamError, Parameter, ParameterShape};
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::{Camera, DEFAULT_FOV_Y};
use strandlight_scene::material::{HairMaterial, LobeTables};
use strandlight_scene::strands::Strands;
use strandlight_scene::tables::ShadingTables;
use strandlight_tests::strandlight;

/// NaN, both infinities, and the next numbers outside `min..=max`.
fn misses(min: f64, max: f64) -> [f64; 5] {
    let nan = f64::NAN;
    [
        nan,
        f64::INFINITY,
        f64::NEG_INFINITY,
        min.next_down(),
        max.next_up(),
    ]
}

type Field<T> = fn(&mut T) -> &mut f64;

/// Every number of a fibre: its name, the parameter it belongs to, its place there.
fn numbers() -> impl Iterator<Item = (&'static str, Parameter, usize)> {
    Parameter::ALL.into_iter().flat_map(|parameter| {
        let names = parameter.numbers().iter().enumerate();
        names.map(move |(ix, name)| (*name, parameter, ix))
    })
}

/// Hair with one number at `value`.
fn hair_with(parameter: Parameter, ix: usize, value: f64) -> HairParams {
    let mut hair = HairParams::default();
    let mut values = parameter.get(&hair);
    values[ix] = value;
    parameter.set(&mut hair, values);
    hair
}

fn check_error(error: ParamError, field: &str, value: f64) {
    assert_eq!(error.field, field);
    assert_eq!(error.value.to_bits(), value.to_bits());
    let message = error.to_string();
    let shown = format!("{value:?}");
    assert!(
        message.contains(field) && message.contains(&shown),
        "{message}"
    );
}

#[test]
fn fibres() {
    let mut n_checked = 0;
    for (field, parameter, ix) in numbers() {
        let [min, max] = parameter.range();
        for good in [min, max] {
            let hair = hair_with(parameter, ix, good);
            assert_eq!(hair.validate(), Ok(()), "{field} {good}");
            assert!(Fibre::new(&hair, &Lobe::ALL, 4).is_ok());
        }
        for bad in misses(min, max) {
            let hair = hair_with(parameter, ix, bad);
            check_error(hair.validate().unwrap_err(), field, bad);
            check_error(Fibre::new(&hair, &Lobe::ALL, 4).unwrap_err(), field, bad);
        }
        n_checked += 1;
    }
    assert!(n_checked >= 12, "{n_checked}");
}

#[test]
fn lights_and_views() {
    const LIGHT: Light = Light {
        theta: 0.1,
        phi: 0.2,
        lambda: 0.3,
    };
    const VIEW: View = View {
        theta: 0.1,
        phi: 0.2,
    };
    const HALF_PI: f64 = std::f64::consts::FRAC_PI_2;
    assert!(LIGHT.validate().is_ok() && VIEW.validate().is_ok());
    let fields: [(&str, Field<Light>, f64, f64); 3] = [
        ("light.theta", |light| &mut light.theta, -HALF_PI, HALF_PI),
        ("light.phi", |light| &mut light.phi, -1e6, 1e6),
        ("light.lambda", |light| &mut light.lambda, 0.001, 10.0),
    ];
    for (field, place, min, max) in fields {
        for bad in misses(min, max) {
            let mut light = LIGHT;
            *place(&mut light) = bad;
            check_error(light.validate().unwrap_err(), field, bad);
        }
    }
    let fields: [(&str, Field<View>, f64, f64); 2] = [
        ("view.theta", |view| &mut view.theta, -HALF_PI, HALF_PI),
        ("view.phi", |view| &mut view.phi, -1e6, 1e6),
    ];
    for (field, place, min, max) in fields {
        for bad in misses(min, max) {
            let mut view = VIEW;
            *place(&mut view) = bad;
            check_error(view.validate().unwrap_err(), field, bad);
        }
    }
}

/// As messages show it: fractions as they were written, whole numbers whole.
fn shown(value: f32) -> String {
    match value.fract() == 0.0 {
        true => f64::from(value).to_string(),
        false => value.to_string(),
    }
}

#[test]
fn light_sets() {
    let good = SrbfLight {
        direction: [0.0, 0.0, 1.0],
        lambda: 0.001,
        rgb: [1.0, 0.0, f32::MAX],
    };
    assert!(good.validate().is_ok());
    let outside = |min: f32, max: f32| {
        let (below, above) = (min.next_down(), max.next_up());
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, below, above]
    };
    let mut n_checked = 0;
    let mut refuse = |light: SrbfLight, field: &str, value: f32| {
        let set = LightSet {
            lights: vec![good, light],
            info: LightSetInfo::default(),
        };
        let errors = [
            light.validate().unwrap_err().to_string(),
            set.to_bytes().unwrap_err().to_string(),
        ];
        for (message, key) in errors.iter().zip(["light", "lights[1]"]) {
            let shown = shown(value);
            let named = message.contains(&format!("{key}{field}"));
            assert!(named && message.contains(&shown), "{message}");
        }
        n_checked += 1;
    };
    for bad in outside(0.001, 10.0) {
        refuse(
            SrbfLight {
                lambda: bad,
                ..good
            },
            ".lambda",
            bad,
        );
    }
    for channel in 0..3 {
        for bad in &outside(0.0, f32::MAX)[..4] {
            let mut light = good;
            light.rgb[channel] = *bad;
            refuse(light, ".rgb", *bad);
        }
    }
    for bad in [f32::NAN, f32::INFINITY, 2.0] {
        let mut light = good;
        light.direction[2] = bad;
        refuse(light, " length of direction", bad);
    }
    assert_eq!(n_checked, 20);
}

/// The section of a file that sets number `ix` of `spec` to `value`, and what else it needs.
fn section_text(section: &dyn SectionSpec, spec: &ParamSpec, ix: usize, value: &str) -> String {
    let text = |spec: &ParamSpec, at: Option<(usize, &str)>| {
        let Some(numbers) = spec.numbers() else {
            return format!("{} = \"x\"\n", spec.key);
        };
        // Somewhere inside, and not the same for any two.
        let inside = |ix: usize| match numbers.shape {
            Shape::Whole | Shape::Size => format!("{}", numbers.min.max(1.0)),
            _ => format!(
                "{:?}",
                numbers.min + (0.3 + 0.1 * ix as f64) * (numbers.max - numbers.min)
            ),
        };
        let [a, b, c] = [0, 1, 2].map(|ix| match at {
            Some((changed, value)) if changed == ix => value.to_owned(),
            _ => inside(ix),
        });
        let value = match numbers.shape {
            Shape::Number | Shape::Whole => a,
            Shape::Size => format!("[{a}, {b}]"),
            Shape::Rgb | Shape::Vector => format!("[{a}, {b}, {c}]"),
            Shape::PerLobe => format!("{{ r = {a}, tt = {b}, trt = {c} }}"),
        };
        format!("{} = {value}\n", spec.key)
    };
    let kind = section
        .kind()
        .map_or(String::new(), |kind| format!("kind = \"{kind}\"\n"));
    let others: String = section
        .specs()
        .into_iter()
        .filter(|(other, _)| other.absent == Absent::Refused && other.key != spec.key)
        .map(|(other, _)| text(other, None))
        .collect();
    // A frame rate is that of frames.
    let frames = match spec.key {
        "fps" => "frames = [\"x\"]\n",
        _ => "",
    };
    let heading = section.heading();
    format!(
        "{heading}\n{kind}{frames}{others}{}",
        text(spec, Some((ix, value)))
    )
}

/// Every number of every section.
#[test]
fn scene_files() {
    let mut n_checked = 0;
    for section in SECTIONS {
        // The section of lights has to be there once.
        let lights = match section.name() {
            "lights" => "",
            _ => "[lights]\nfile = 'b'\n",
        };
        for (spec, _) in section.specs() {
            let Kind::Numbers(numbers) = spec.kind else {
                continue;
            };
            // Whole numbers have no NaN and no fractions in TOML.
            let is_whole = matches!(numbers.shape, Shape::Whole | Shape::Size);
            let read = |ix: usize, value: &str| {
                let text = section_text(section, spec, ix, value);
                let text = format!("version = 1\n[groom]\nfile = 'a'\n{lights}{text}");
                Scene::from_toml(&text).map_err(|error| format!("{error}\n{text}"))
            };
            for (ix, suffix) in numbers.shape.suffixes().iter().enumerate() {
                let named = format!("{}{suffix} is ", spec.key);
                let (min, max) = (numbers.min, numbers.max);
                for good in [min, max] {
                    let written = if is_whole {
                        format!("{good}")
                    } else {
                        format!("{good:?}")
                    };
                    // Only the line of sight can still be at fault.
                    if let Err(error) = read(ix, &written) {
                        assert!(error.contains("camera."), "{error}");
                    }
                }
                let bad: Vec<String> = if is_whole {
                    vec![format!("{}", min - 1.0), format!("{}", max + 1.0)]
                } else {
                    // TOML writes these as Rust does, but for the case of NaN.
                    let bad = misses(min, max);
                    bad.iter()
                        .map(|bad| format!("{bad:?}").to_lowercase())
                        .collect()
                };
                for bad in bad {
                    let error = read(ix, &bad).unwrap_err();
                    // What does not fit into a u32 is refused by the reader of the text.
                    let is_named = error.to_lowercase().contains(&format!("{named}{bad},"))
                        || error.contains(spec.key) && (is_whole || error.contains(&named));
                    assert!(is_named, "{named}{bad}: {error}");
                    n_checked += 1;
                }
            }
        }
    }
    assert!(n_checked > 200, "{n_checked}");
    let base = "version = 1\n[groom]\nfile = 'a'\n[lights]\nfile = 'b'\n";
    for bad in [f32::NAN, f32::INFINITY, -1e-3, 1.1e6] {
        let written = format!("{bad:?}").to_lowercase();
        let text = format!("{base}[render]\nbackground = [0.0, {written}, 0.0]");
        let message = Scene::from_toml(&text).unwrap_err().to_string();
        let named = format!("render.background is {},", shown(bad));
        assert!(message.contains(&named), "{named} {message}");
    }
}

/// A scene put together in code is held to the same ranges as one from a file.
#[test]
fn scenes_in_memory() {
    let mut scene = Scene::new("no.groom", "no.lights");
    scene.hair.width_deg.tt = f64::NAN;
    let error = PreparedScene::load(&scene).unwrap_err();
    let message = error.to_string();
    assert!(
        message.contains("hair.width_deg.tt") && message.contains("NaN"),
        "{message}"
    );

    let tables = ShadingTables::from_file(&TableFile::from_bytes(DEFAULT_TABLES).unwrap()).unwrap();
    let none = Arc::new(LobeTables::default());
    let hair = HairParams::default();
    let hair = HairMaterial::new(none, Fresnel::Dielectric, &hair, &[Lobe::R], 4).unwrap();
    let with = |lambda: f32| {
        let points = [[0.0; 3], [0.0, 1.0, 0.0]];
        let strands = Strands::new(&points, &[0, 2], |_, _| 0.01, false).unwrap();
        let camera = Camera::framing(strands.centre, strands.radius, DEFAULT_FOV_Y);
        let light = SrbfLight {
            direction: [0.0, 0.0, 1.0],
            lambda,
            rgb: [1.0; 3],
        };
        let (tables, background) = (tables.clone(), Background::None);
        PreparedScene::from_parts(
            strands,
            vec![light],
            hair.clone(),
            tables,
            camera,
            background,
        )
    };
    assert!(with(0.3).is_ok());
    for bad in [f32::NAN, 0.0, -0.5] {
        let message = with(bad).unwrap_err().to_string();
        let named = format!("light.lambda is {bad},");
        assert!(message.contains(&named), "{named} {message}");
    }
}

/// Sets the number at `pointer` in `query`.
fn with(query: &Value, pointer: &str, value: f64) -> String {
    let mut query = query.clone();
    *query.pointer_mut(pointer).expect("the key is there") = json!(value);
    query.to_string()
}

#[test]
fn queries() {
    let mut hair = json!({});
    for parameter in Parameter::ALL {
        let [a, b, c] = parameter.get(&HairParams::default());
        hair[parameter.name()] = match parameter.shape() {
            ParameterShape::Number => json!(a),
            ParameterShape::Rgb => json!([a, b, c]),
            ParameterShape::PerLobe => json!({"r": a, "tt": b, "trt": c}),
        };
    }
    let azimuthal = json!({
        "q": "azimuthal", "mode": "TT", "lambda": 0.2, "dphi": 0.5, "theta_d": 0.1, "hair": hair,
    });
    let single = json!({
        "q": "single", "mode": "all", "light": {"theta": 0.1, "phi": 2.0, "lambda": 0.3},
        "view": {"theta": 0.0, "phi": 0.4}, "hair": hair,
    });
    let half_pi = std::f64::consts::FRAC_PI_2;
    // Query, place in it, name in the message, range.
    let mut fields = vec![
        (&azimuthal, "/lambda".to_owned(), "lambda", 0.001, 1000.0),
        (&azimuthal, "/dphi".to_owned(), "dphi", -1e6, 1e6),
        (
            &azimuthal,
            "/theta_d".to_owned(),
            "theta_d",
            -half_pi,
            half_pi,
        ),
        (
            &single,
            "/light/theta".to_owned(),
            "light.theta",
            -half_pi,
            half_pi,
        ),
        (&single, "/light/phi".to_owned(), "light.phi", -1e6, 1e6),
        (
            &single,
            "/light/lambda".to_owned(),
            "light.lambda",
            0.001,
            10.0,
        ),
        (
            &single,
            "/view/theta".to_owned(),
            "view.theta",
            -half_pi,
            half_pi,
        ),
        (&single, "/view/phi".to_owned(), "view.phi", -1e6, 1e6),
    ];
    for (field, parameter, _) in numbers() {
        let [min, max] = parameter.range();
        let place = field.replace(['.', '['], "/").replace(']', "");
        for query in [&azimuthal, &single] {
            fields.push((query, format!("/hair/{place}"), field, min, max));
        }
    }
    let mut lines = vec![azimuthal.to_string(), single.to_string()];
    let mut expected = Vec::new();
    for (query, place, field, min, max) in &fields {
        let step = 1e-9 * (max - min);
        for bad in [min - step, max + step, -1e300, 1e300] {
            lines.push(with(query, place, bad));
            expected.push((*field, bad));
        }
    }
    let mut child = strandlight()
        .arg("probe")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let text = lines.join("\n") + "\n";
    let writer = std::thread::spawn(move || stdin.write_all(text.as_bytes()));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap().unwrap();
    let answers: Vec<Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(answers.len(), 2 + expected.len());
    for answer in &answers[..2] {
        assert!(answer["value"].is_array(), "{answer}");
    }
    for (answer, (field, bad)) in answers[2..].iter().zip(expected) {
        let message = answer["error"].as_str().unwrap_or_default();
        let value = message
            .split_once(&format!("{field} is "))
            .and_then(|(_, rest)| rest.split_once(", outside"))
            .and_then(|(value, _)| value.parse::<f64>().ok());
        // The reader of JSON may miss the last digit.
        let close = value.is_some_and(|value| (value / bad - 1.0).abs() < 1e-12);
        assert!(close, "{field} {bad}: {answer}");
    }
}
