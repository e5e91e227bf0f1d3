//! Every kind survives writing and reading.

use strandlight_formats::{
    Attribute, Axis, BakedFile, Domain, Error, Groom, LightSet, Scene, Spacing, SrbfLight, Table,
    TableFile,
};

fn groom() -> Groom {
    Groom {
        points: (0..5).map(|i| [i as f32, 2.0, 3.0]).collect(),
        strand_offsets: vec![0, 2, 5],
        attributes: vec![Attribute {
            name: "diameter".to_owned(),
            domain: Domain::Strand,
            components: 1,
            data: vec![0.007, 0.008],
        }],
        ..Groom::default()
    }
}

fn lights() -> LightSet {
    let light = SrbfLight {
        direction: [0.6, 0.0, 0.8],
        lambda: 0.3,
        rgb: [1.0, 2.0, 0.0],
    };
    LightSet {
        lights: vec![light; 3],
        ..LightSet::default()
    }
}

fn table(name: &str) -> Table {
    let axis = |name: &str, count, spacing| Axis {
        name: name.to_owned(),
        min: 1.0,
        max: 10.0,
        count,
        spacing,
    };
    Table {
        name: name.to_owned(),
        axes: vec![
            axis("eta", 3, Spacing::Log),
            axis("theta_d", 2, Spacing::Linear),
        ],
        channels: ["H0", "H2", "H4", "H6"].map(str::to_owned).to_vec(),
        data: (0..24).map(|i| i as f32).collect(),
        max_interpolation_error: 1e-4,
    }
}

fn tables() -> TableFile {
    TableFile {
        fresnel: "dielectric".to_owned(),
        tables: vec![table("H_TT"), table("H_TRT")],
        ..TableFile::default()
    }
}

#[test]
fn all_kinds() {
    let bytes = groom().to_bytes().unwrap();
    assert_eq!(Groom::from_bytes(&bytes).unwrap(), groom());
    let bytes = lights().to_bytes().unwrap();
    assert_eq!(LightSet::from_bytes(&bytes).unwrap(), lights());
    let bytes = tables().to_bytes().unwrap();
    assert_eq!(TableFile::from_bytes(&bytes).unwrap(), tables());
    assert!(matches!(
        Groom::from_bytes(&bytes),
        Err(Error::NotThisKind { .. })
    ));
    let scene = Scene::new("a.groom", "b.lights");
    let text = scene.to_toml_string().unwrap();
    assert_eq!(Scene::from_toml(&text).unwrap(), scene, "{text}");
}

#[test]
fn one_table_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.tables");
    tables().write(&path).unwrap();
    let mut reader = TableFile::open(&path).unwrap();
    assert_eq!(reader.read_table("H_TRT").unwrap(), table("H_TRT"));
    let message = reader.read_table("C").unwrap_err().to_string();
    assert!(
        message.contains("x.tables") && message.contains("H_TT, H_TRT"),
        "{message}"
    );
}

mod random {
    use proptest::prelude::*;
    use strandlight_formats::{
        Attribute, Axis, Background, BakedFile, CameraSection, Domain, FitReport, Groom,
        GroomSource, LightSet, LightSetInfo, Lobe, LutInput, MotionSection, Original, ProxySection,
        Scene, Spacing, SrbfLight, Table, TableFile, TableInfo, TablesSection, ToneMap, UpAxis,
        WindSection,
    };

    fn pairs() -> impl Strategy<Value = Vec<(String, String)>> {
        prop::collection::vec((".{0,8}", ".{0,20}"), 0..3)
    }

    fn number() -> impl Strategy<Value = f32> {
        prop_oneof![-1e5f32..1e5, -1e-30f32..1e-30, Just(0.0), Just(-0.0)]
    }

    prop_compose! {
        fn attribute(n_strands: usize, n_points: usize)(
            domain in prop::sample::select(vec![Domain::Groom, Domain::Strand, Domain::Point]),
            components in 1u32..=4,
        )(
            data in prop::collection::vec(number(), match domain {
                Domain::Groom => 1,
                Domain::Strand => n_strands,
                Domain::Point => n_points,
            } * components as usize),
            domain in Just(domain),
            components in Just(components),
        ) -> Attribute {
            Attribute { name: String::new(), domain, components, data }
        }
    }

    prop_compose! {
        fn groom()(lengths in prop::collection::vec(2u32..9, 1..12))(
            points in prop::collection::vec(
                prop::array::uniform3(number()), lengths.iter().sum::<u32>() as usize),
            attributes in prop::collection::vec(
                attribute(lengths.len(), lengths.iter().sum::<u32>() as usize), 0..4),
            lengths in Just(lengths),
            parameters in pairs(),
            cm_per_unit in 1e-6f64..1e6,
            up in prop::sample::select(vec![UpAxis::X, UpAxis::Y, UpAxis::Z]),
            // An unknown format is kept as it is.
            original in prop::option::of(("[!-~]{1,64}", prop::collection::vec(any::<u8>(), 0..200))),
        ) -> Groom {
            let mut strand_offsets = vec![0];
            for length in lengths {
                strand_offsets.push(strand_offsets[strand_offsets.len() - 1] + length);
            }
            let named = attributes.into_iter().enumerate();
            let attributes = named
                .map(|(ix, attribute)| Attribute { name: format!("a_{ix}"), ..attribute })
                .collect();
            let original = original.map(|(format, data)| Original { format, data });
            let source =
                GroomSource { cm_per_unit, up, parameters, original, ..GroomSource::default() };
            Groom { points, strand_offsets, attributes, source }
        }
    }

    prop_compose! {
        fn light()(lat in -1.5f32..1.5, lon in -3.2f32..3.2, lambda in 0.001f32..10.0,
                   rgb in prop::array::uniform3(0f32..1e9)) -> SrbfLight {
            let direction = [lat.cos() * lon.sin(), lat.sin(), lat.cos() * lon.cos()];
            SrbfLight { direction, lambda, rgb }
        }
    }

    prop_compose! {
        fn light_set()(
            lights in prop::collection::vec(light(), 1..60),
            map_hash in "[0-9a-f]{16}",
            map_size: [u32; 2],
            seed: u64,
            requested_count: u32,
            parameters in pairs(),
            figures in prop::option::of(prop::array::uniform6(0f64..2.0)),
        ) -> LightSet {
            let report = figures.map(|f| FitReport {
                rel_l2: f[0],
                energy_ratio: [f[1], f[2], f[3]],
                irradiance_error: f[4],
                fibre_error: f[5],
            });
            let info = LightSetInfo {
                map_hash, map_size, seed, requested_count, parameters, report,
                ..LightSetInfo::default()
            };
            LightSet { lights, info }
        }
    }

    prop_compose! {
        fn axis()(count in 2u32..6, spacing in prop::sample::select(Spacing::ALL),
                  name in "[a-z_]{1,10}") -> Axis {
            let (min, max) = match spacing {
                Spacing::Linear => (-1.5, 7.25),
                Spacing::Log => (0.001, 10.0),
                Spacing::Reciprocal => (1.0, 10.0),
                _ => (0.0, 1.0),
            };
            Axis { name, min, max, count, spacing }
        }
    }

    prop_compose! {
        fn table()(axes in prop::collection::vec(axis(), 1..=3),
                   channels in prop::collection::vec("[a-zA-Z0-9]{1,4}", 1..=8))(
            data in prop::collection::vec(number(),
                axes.iter().map(|axis| axis.count as usize).product::<usize>() * channels.len()),
            axes in Just(axes), channels in Just(channels),
            max_interpolation_error in 0f32..1.0,
        ) -> Table {
            Table { name: String::new(), axes, channels, data, max_interpolation_error }
        }
    }

    prop_compose! {
        fn table_file()(tables in prop::collection::vec(table(), 1..4), parameters in pairs(),
                        schlick: bool) -> TableFile {
            let named = tables.into_iter().enumerate();
            TableFile {
                fresnel: if schlick { "schlick" } else { "dielectric" }.to_owned(),
                tables: named.map(|(ix, t)| Table { name: format!("T_{ix}"), ..t }).collect(),
                info: TableInfo { parameters, ..TableInfo::default() },
            }
        }
    }

    prop_compose! {
        fn scene()(
            groom in "[a-zA-Z0-9 ./_'\"\\\\-]{1,20}",
            lights in "\\PC{1,20}",
            tables in prop::option::of("[a-z]{1,8}\\.tables"),
            numbers in prop::array::uniform8(0f64..1.0),
            diameter_cm in prop::option::of(1e-5f64..10.0),
            modes in prop::sample::subsequence(vec![Lobe::R, Lobe::Tt, Lobe::Trt], 1..=3),
            camera in prop::option::of(prop::array::uniform3(1f64..1e6)),
            size in prop::array::uniform2(1u32..=16_384),
            samples in 1u32..=65536,
            background in prop_oneof![
                Just(Background::Lights), Just(Background::Panorama), Just(Background::None),
                prop::array::uniform3(0f32..1e6).prop_map(Background::Color)],
        ) -> Scene {
            let mut scene = Scene::new(groom, lights);
            scene.tables = tables.map(|file| TablesSection { file: file.into() });
            scene.lights.intensity = 1e6 * numbers[0];
            scene.lights.rotate_deg = 7200.0 * (numbers[1] - 0.5);
            scene.hair.eta = 1.0001 + 1.9 * numbers[2];
            scene.hair.sigma_a = [50.0 * numbers[3], 0.0, 50.0];
            scene.hair.shift_deg.tt = 56.0 * (numbers[4] - 0.5);
            scene.hair.width_deg.trt = 0.05 + 59.9 * numbers[5];
            scene.hair.eccentricity = 0.5 + 1.5 * numbers[6];
            scene.hair.diameter_cm = diameter_cm;
            scene.hair.taper = diameter_cm.map_or(0.0, |cm| cm / 11.0);
            scene.hair.modes = modes;
            scene.camera = camera.map(|position| CameraSection {
                position,
                target: [0.0; 3],
                up: [0.0, -1.0, 0.5],
                fov_deg: 1.0 + 169.0 * numbers[7],
            });
            scene.render.size = size;
            scene.render.samples = samples;
            scene.render.tone_map = if samples % 2 == 0 { ToneMap::None } else { ToneMap::Filmic };
            scene.render.lut = (samples % 3 == 0).then(|| "looks/\u{e9}.cube".into());
            scene.render.lut_input = LutInput::ALL[samples as usize % 3];
            scene.render.background = background;
            scene.lights.panorama = (samples % 2 == 0 || background == Background::Panorama)
                .then(|| "maps/sky.panorama".into());
            scene.lights.map = (samples % 5 == 0).then(|| "maps/\u{e9}.exr".into());
            scene.proxies = (0..samples as usize % 9).map(|ix| ProxySection::Ground {
                height: 1e6 * numbers[ix % 8],
                albedo: [numbers[1], 0.0, 1.0],
            }).collect();
            scene.variation.frizz = numbers[0];
            scene.variation.seed = samples;
            scene.motion = (size[0] % 2 == 0).then(|| MotionSection {
                wind: Some(WindSection { speed: 30.0 * numbers[0], ..WindSection::default() }),
                ..MotionSection::default()
            });
            scene
        }
    }

    proptest! {
        #[test]
        fn grooms(groom in groom()) {
            let bytes = groom.to_bytes().unwrap();
            let read = Groom::from_bytes(&bytes).unwrap();
            prop_assert_eq!(&read, &groom);
            // Equal content, equal bytes; -0.0 equals 0.0 but must keep its sign.
            prop_assert!(read.to_bytes().unwrap() == bytes);
        }

        #[test]
        fn light_sets(set in light_set()) {
            let bytes = set.to_bytes().unwrap();
            let read = LightSet::from_bytes(&bytes).unwrap();
            prop_assert_eq!(&read, &set);
            prop_assert!(read.to_bytes().unwrap() == bytes);
        }

        #[test]
        fn table_files(file in table_file()) {
            let bytes = file.to_bytes().unwrap();
            let read = TableFile::from_bytes(&bytes).unwrap();
            prop_assert_eq!(&read, &file);
            prop_assert!(read.to_bytes().unwrap() == bytes);
        }

        #[test]
        fn scenes(scene in scene()) {
            let text = scene.to_toml_string().unwrap();
            prop_assert_eq!(Scene::from_toml(&text).unwrap(), scene, "{}", text);
        }
    }
}

type Change<T> = fn(&mut T);

#[test]
fn promises_are_checked_before_writing() {
    let changes: [(Change<Groom>, &str); 7] = [
        (|groom| groom.points[3][1] = f32::NAN, "point 1 of strand 1"),
        (|groom| groom.points[0][0] = 2e5, "point 0 of strand 0"),
        (|groom| groom.strand_offsets[1] = 1, "points of strand 0"),
        (|groom| groom.strand_offsets[2] = 6, "last strand offset"),
        (
            |groom| groom.attributes[0].name = "Diameter".to_owned(),
            "attribute name",
        ),
        (
            |groom| groom.attributes[0].data.push(1.0),
            "floats of attribute diameter",
        ),
        (|groom| groom.attributes[0].data[1] = -1.0, "diameter"),
    ];
    for (change, part) in changes {
        let mut groom = groom();
        change(&mut groom);
        let message = groom.to_bytes().unwrap_err().to_string();
        assert!(message.contains(part), "{message:?} lacks {part:?}");
    }
    let changes: [(Change<SrbfLight>, &str); 4] = [
        (
            |light| light.direction = [0.6, 0.0, 0.7],
            "lights[1] length of direction",
        ),
        (|light| light.lambda = 0.0005, "lights[1].lambda"),
        (|light| light.rgb[1] = -1e-9, "lights[1].rgb"),
        (|light| light.rgb[2] = f32::INFINITY, "lights[1].rgb"),
    ];
    for (change, part) in changes {
        let mut set = lights();
        change(&mut set.lights[1]);
        let message = set.to_bytes().unwrap_err().to_string();
        assert!(message.contains(part), "{message:?} lacks {part:?}");
    }
}

#[test]
fn scene_errors_name_key_value_and_range() {
    let base = "version = 1\n[groom]\nfile = 'a'\n[lights]\nfile = 'b'\n";
    assert!(Scene::from_toml(base).is_ok());
    for (more, parts) in [
        ("[hair]\neta = 0.5", ["hair.eta", "0.5", "1.0001..=3"]),
        (
            "[hair]\nwidth_deg = { r = 0, tt = 1, trt = 1 }",
            ["hair.width_deg.r", "0", "0.05..=60"],
        ),
        ("[hair]\nmodes = []", ["hair.modes", "[]", "each once"]),
        (
            "[hair]\nmodes = ['R', 'R']",
            ["hair.modes", "[R, R]", "each once"],
        ),
        ("[hair]\nmodes = ['TRRT']", ["line 7", "TRRT", "`TRT`"]),
        ("[render]\nbackground = 'sky'", ["line 7", "sky", "lights"]),
        ("[render]\nsize = [0, 1]", ["render.size", "0", "1..=16384"]),
        ("[render]\nsamples = -1", ["line 7", "-1", "whole number"]),
        (
            "[camera]\nposition = [0, 0, 1]\ntarget = [0, 0, 1]",
            ["camera.target", "[0.0, 0.0, 1.0]", "away"],
        ),
        (
            "[camera]\nposition = [0, 9, 0]\ntarget = [0, 0, 0]",
            [
                "camera.up",
                "[0.0, 1.0, 0.0]",
                "must be a direction that is not along the line of sight",
            ],
        ),
        ("[hair]\nfrizz = 1", ["line 7", "frizz", "eta"]),
        ("[fog]\ndensity = 1", ["line 6", "fog", "camera"]),
    ] {
        let message = Scene::from_toml(&format!("{base}{more}"))
            .unwrap_err()
            .to_string();
        for part in parts {
            assert!(message.contains(part), "{message:?} lacks {part:?}");
        }
    }
    let message = Scene::from_toml("version = 3\nnew = 1")
        .unwrap_err()
        .to_string();
    assert!(message.contains("version 3"), "{message}");
    let message = Scene::from_toml("version = 1").unwrap_err().to_string();
    assert!(message.contains("groom"), "{message}");
}
