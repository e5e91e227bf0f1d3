use strandlight_scattering::{HairParams, Model, Parameter};
use toml::{Table, Value as Toml};

use super::*;
use crate::{
    AddedLight, Background, HairSection, LightAdjust, LutInput, Melanin, MotionSection,
    ProxySection, Scene, WindSection,
};

/// The numbers just outside a range, and those outside every range.
fn misses(numbers: &Numbers) -> [f64; 5] {
    let (below, above) = (numbers.min.next_down(), numbers.max.next_up());
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, below, above]
}

/// Every number of a section: the ends of its range are taken, what is outside is refused by name,
/// and reading gives what was set.
fn numbers_keep_their_ranges<S>(section: &Section<S>) -> usize {
    let mut n_checked = 0;
    for param in section.params {
        let Kind::Numbers(numbers) = param.spec.kind else {
            continue;
        };
        let mut target = (section.plain)();
        let start = param.get(&target).unwrap_or(match numbers.shape {
            Shape::Number | Shape::Whole => Value::Number(numbers.min),
            _ => Value::Vector([numbers.min; 3]),
        });
        for (ix, suffix) in numbers.shape.suffixes().iter().enumerate() {
            for end in [numbers.min, numbers.max] {
                let value = start.clone().with_number(ix, end);
                param
                    .set(&mut target, Some(value.clone()))
                    .expect(param.spec.key);
                assert_eq!(param.get(&target), Some(value), "{}", param.spec.key);
                assert!(section.validate(&target).is_ok(), "{}", param.spec.key);
            }
            for miss in misses(&numbers) {
                let value = start.clone().with_number(ix, miss);
                let message = param
                    .set(&mut target, Some(value))
                    .expect_err(param.spec.key);
                let named = format!("{}{suffix} is {miss},", param.spec.key);
                assert!(message.to_string().contains(&named), "{message}");
            }
            n_checked += 1;
        }
    }
    n_checked
}

#[test]
fn every_number_keeps_its_range() {
    let n_checked = [
        numbers_keep_their_ranges(&LIGHTS),
        numbers_keep_their_ranges(&ADJUST),
        numbers_keep_their_ranges(&ADDED),
        numbers_keep_their_ranges(&HAIR),
        numbers_keep_their_ranges(&VARIATION),
        numbers_keep_their_ranges(&CAMERA),
        numbers_keep_their_ranges(&RENDER),
        numbers_keep_their_ranges(&MOTION),
        numbers_keep_their_ranges(&WIND),
        numbers_keep_their_ranges(&ELLIPSOID),
        numbers_keep_their_ranges(&GROUND),
        numbers_keep_their_ranges(&MESH),
    ];
    assert!(n_checked.into_iter().all(|n| n > 0), "{n_checked:?}");
}

/// The keys of a table and of the tables below, but for those of `stops`.
fn keys_of(table: &Table, at: &str, stops: &[String], keys: &mut Vec<String>) {
    for (name, value) in table {
        let key = format!("{at}{name}");
        match value {
            Toml::Table(below) if !stops.contains(&key) => {
                keys_of(below, &format!("{key}."), stops, keys);
            }
            Toml::Array(list) if list.iter().any(Toml::is_table) => {
                for below in list.iter().filter_map(Toml::as_table) {
                    keys_of(below, &format!("{key}."), stops, keys);
                }
            }
            _ => keys.push(key),
        }
    }
}

/// A key of a scene without a row, or a row without a key, is a parameter that is forgotten
/// somewhere.
#[test]
fn the_rows_are_all_the_keys_of_a_scene() {
    let rows: Vec<String> = keys().collect();
    let mut scene = Scene::new("a.groom", "a.lights");
    scene.tables = Some(crate::TablesSection {
        file: "a.tables".into(),
    });
    scene.lights.panorama = Some("a.panorama".into());
    scene.lights.map = Some("a.exr".into());
    scene.lights.muted = vec![1];
    scene.lights.solo = vec![2];
    scene.lights.adjust = vec![LightAdjust::new(3)];
    scene.lights.added = vec![AddedLight::default()];
    scene.camera = Some(crate::CameraSection::new([0.0, 0.0, 9.0], [0.0; 3]));
    scene.proxies = vec![
        ProxySection::ground(0.0),
        ProxySection::ellipsoid([0.0; 3], [1.0; 3]),
        ProxySection::mesh("head.mesh"),
    ];
    scene.render.background = Background::Color([0.5; 3]);
    scene.render.lut = Some("look.cube".into());
    scene.render.lut_input = LutInput::Srgb;
    for param in HAIR.params {
        // What is left out at its default is written otherwise.
        let (Some(numbers), true) = (param.spec.numbers(), param.spec.group != Group::Color) else {
            continue;
        };
        if numbers.shape == Shape::Number {
            let value = Value::Number(0.5 * (numbers.min + numbers.max));
            param.set(&mut scene.hair, Some(value)).expect("in range");
        }
    }
    scene.variation.seed = 1;
    let mut keys = vec![];
    let colors: [fn(&mut HairSection); 3] = [
        |hair| hair.preset = Some("brown".to_owned()),
        |hair| hair.reflectance = Some([0.5; 3]),
        |hair| {
            (hair.reflectance, hair.melanin) = (None, Some(Melanin::default()));
            // For round hair.
            (hair.model, hair.eccentricity) = (Model::Energy, 1.0);
        },
    ];
    let motions = [
        MotionSection {
            wind: Some(WindSection::default()),
            ..MotionSection::default()
        },
        MotionSection {
            frames: vec!["b".into()],
            fps: Some(12.0),
            ..MotionSection::default()
        },
        MotionSection {
            wind: Some(WindSection::default()),
            ..MotionSection::default()
        },
    ];
    for (color, motion) in colors.into_iter().zip(motions) {
        color(&mut scene.hair);
        scene.motion = Some(motion);
        let file: Table = scene
            .to_toml_string()
            .expect("valid")
            .parse()
            .expect("valid");
        keys_of(&file, "", &rows, &mut keys);
    }
    keys.sort();
    keys.dedup();
    // Which they are is said by the section.
    keys.retain(|key| key != "version" && key != "proxy.kind");
    let mut rows = rows;
    rows.sort();
    rows.dedup();
    assert_eq!(keys, rows);
}

/// What scenes take the model takes.
#[test]
fn ranges_of_the_hair_lie_in_those_of_the_model() {
    let mut n_checked = 0;
    for param in HAIR.params {
        let (Some((parameter, ..)), Some(numbers)) = (param.model, param.spec.numbers()) else {
            continue;
        };
        for end in [numbers.min, numbers.max] {
            let mut hair = HairSection::default();
            let start = param.get(&hair).expect("a number");
            let value =
                (0..numbers.shape.len()).fold(start, |value, ix| value.with_number(ix, end));
            param.set(&mut hair, Some(value)).expect("in range");
            let params = hair.params();
            params.validate().expect(param.spec.key);
            let moved = HairSection::default().params();
            assert!(
                parameter.differs(&params, &moved) || end == 1.0,
                "{}",
                param.spec.key
            );
        }
        n_checked += 1;
    }
    assert!(n_checked >= 5);
}

#[test]
fn the_default_hair_is_that_of_the_model() {
    let (section, model) = (HairSection::default().params(), HairParams::default());
    for parameter in Parameter::ALL {
        for (a, b) in parameter
            .get(&section)
            .into_iter()
            .zip(parameter.get(&model))
        {
            assert!((a - b).abs() <= 1e-15, "{}: {a} {b}", parameter.name());
        }
    }
}

#[test]
fn words_and_lists_are_checked() {
    let mut hair = HairSection::default();
    let modes = HAIR.param("modes").expect("a row");
    for bad in [vec![], vec!["R", "R"], vec!["R", "TRRT"]] {
        let bad = bad.into_iter().map(str::to_owned).collect();
        assert!(modes.set(&mut hair, Some(Value::Texts(bad))).is_err());
    }
    assert!(modes.set(&mut hair, None).is_err(), "always there");
    assert_eq!(hair, HairSection::default());
    let melanin = HAIR.param("melanin.eumelanin").expect("a row");
    assert_eq!(melanin.get(&hair), None);
    melanin
        .set(&mut hair, Some(Value::Number(1.5)))
        .expect("in range");
    assert_eq!(
        hair.melanin,
        Some(Melanin {
            eumelanin: 1.5,
            pheomelanin: 0.0
        })
    );
    let mut render = (RENDER.plain)();
    for (key, value) in [
        ("tone_map", Value::Text("sepia".to_owned())),
        ("lut", Value::Text(String::new())),
        ("lut_input", Value::Text("log".to_owned())),
        ("samples", Value::Number(1.5)),
        ("size", Value::Numbers(vec![100.0])),
        ("background", Value::Number(1.0)),
    ] {
        let param = RENDER.param(key).expect("a row");
        assert!(param.set(&mut render, Some(value)).is_err(), "{key}");
    }
    assert_eq!(render, (RENDER.plain)());
    assert!(HAIR.param("etta").is_none());
    let model = HAIR.param("model").expect("a row");
    let energy = Some(Value::Text("energy".to_owned()));
    model.set(&mut hair, energy).expect("a word");
    assert_eq!(hair.params().model, Model::Energy);
    hair.eccentricity = 0.9;
    let error = hair.validate().expect_err("round alone").to_string();
    assert!(
        error.contains("hair.eccentricity") && error.contains("0.9"),
        "{error}"
    );
}

/// The page of the book holds the tables between its two marks, as they are now.
#[test]
fn the_reference_of_the_book_is_this() {
    /// From the folder of this file.
    const CITED: &str = "../../../../docs/book/src/reference/scene.md";
    const MARKS: [&str; 2] = ["<!-- params:begin -->", "<!-- params:end -->"];
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("src/params")
        .join(CITED);
    let page = std::fs::read_to_string(&file).expect("part of the project");
    let (head, rest) = page.split_once(MARKS[0]).expect("the first mark");
    let (_, tail) = rest.split_once(MARKS[1]).expect("the second mark");
    let wanted = format!(
        "{head}{}\n\n{}{}{tail}",
        MARKS[0],
        reference_markdown(),
        MARKS[1]
    );
    if std::env::var_os("STRANDLIGHT_UPDATE_DOCS").is_some() {
        std::fs::write(&file, &wanted).expect("writable");
        return;
    }
    assert!(
        page == wanted,
        "{CITED} is not what the parameters say; STRANDLIGHT_UPDATE_DOCS=1 writes it again"
    );
}
