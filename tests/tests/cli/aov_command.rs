//! `strandlight render --aov`: layers that add up to the picture.

use std::collections::BTreeMap;
use std::path::Path;

use strandlight_cpu as cpu;
use strandlight_formats::{Background, BakedFile, LightSet, Lobe, ProxySection, Scene};
use strandlight_reference::compare::Layer;
use strandlight_runtime::Session;
use strandlight_scene::PreparedScene;
use strandlight_scene::layers::{Content, LAYERS, Written, data_layers};
use strandlight_tests::generated::check_part;
use strandlight_tests::scenes::{curtain, light, write_scene, write_small_scene};
use strandlight_tests::{assert_done, assert_refused, project_root, strandlight};

/// A small scene on disk, with a light that is muted and one of hardly any power.
fn scene_in(folder: &Path) {
    let mut groom = curtain(80, 5, 0.05, 2.0);
    for (ix, point) in groom.points.iter_mut().enumerate() {
        point[2] += 0.05 * (ix / 5 % 7) as f32;
    }
    let lights = vec![
        light([-0.6, 0.0, 0.8], 0.2, [20.0, 8.0, 2.0]),
        light([0.6, 0.0, 0.8], 0.5, [1.0, 2.0, 4.0]),
        light([0.0, 1.0, 0.0], 1.2, [0.3, 0.4, 0.5]),
        light([0.0, 0.0, -1.0], 0.3, [9.0, 9.0, 9.0]),
        light([0.0, -1.0, 0.0], 0.3, [0.002, 0.002, 0.002]),
    ];
    write_small_scene(folder, &groom, lights, |scene| {
        scene.hair.diameter_cm = Some(0.06);
        scene.hair.sigma_a = [0.05, 0.1, 0.2];
        scene.lights.muted = vec![3];
        scene.render.size = [40, 30];
        scene.render.samples = 16;
        scene.render.shadow_maps = 8;
        scene.render.background = Background::Lights;
    });
}

fn layer(path: &Path, name: Option<&str>) -> Vec<[f32; 3]> {
    match Layer::read(path, name) {
        Ok(layer) => layer.rgb,
        Err(error) => panic!("{name:?}: {error}"),
    }
}

fn sum(layers: &[Vec<[f32; 3]>]) -> Vec<[f32; 3]> {
    let n_pixels = layers[0].len();
    let pixel = |ix: usize| [0, 1, 2].map(|c| layers.iter().map(|layer| layer[ix][c]).sum());
    (0..n_pixels).map(pixel).collect()
}

/// Root of the mean squared difference over the root mean square of `b`.
fn relative(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let square = |x: f32| f64::from(x) * f64::from(x);
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    let difference: f64 = pairs.map(|(a, b)| square(a - b)).sum();
    let norm: f64 = b.iter().flatten().map(|&b| square(b)).sum();
    assert!(norm > 0.0, "nothing to compare with");
    (difference / norm).sqrt()
}

/// Without layers of single modes nothing is drawn otherwise than without layers.
#[test]
fn layers_by_term_and_light_leave_the_picture_as_it_is() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let mut scene = Scene::read(at.join("a.toml")).expect("a scene");
    // Strands that are wide on screen are not shaded over their width where parts must add up.
    scene.hair.diameter_cm = Some(0.01);
    write_scene(at, "a.toml", &scene);
    let render = |out: &str, more: &[&str]| {
        let mut command = strandlight();
        command
            .current_dir(at)
            .args(["render", "a.toml", "-o", out]);
        assert_done(command.args(["--backend", "cpu"]).args(more));
        layer(&at.join(out), None)
    };
    let alone = render("alone.exr", &[]);
    assert!(render("layers.exr", &["--aov", "terms,lights"]) == alone);
    let of = |name: &str| layer(&at.join("layers.exr"), Some(name));
    let terms = sum(&["single", "global", "local"].map(of));
    assert!(relative(&terms, &of("total")) < 1e-5);
}

/// A light that is off keeps its place: in the prepared scene however it was prepared, in the names
/// of layers, and for the viewer. The picture is that of a set without it.
#[test]
fn lights_have_the_numbers_of_the_set_though_some_are_off() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let set = LightSet::read(&at.join("a.lights")).expect("a light set");
    let mut scene = Scene::read(at.join("a.toml")).expect("a scene");
    scene.render.background = Background::Color([0.0; 3]);
    let bits = |rgb: [f32; 3]| rgb.map(f32::to_bits);
    for (name, muted, solo, on) in [
        ("muted", vec![0, 3], vec![], &[1, 2, 4][..]),
        ("solo", vec![], vec![1, 4], &[1, 4]),
        ("both", vec![4], vec![3, 4], &[3]),
    ] {
        (scene.lights.muted, scene.lights.solo) = (muted, solo);
        let file = format!("{name}.toml");
        write_scene(at, &file, &scene);
        let loaded = PreparedScene::load_at(&Scene::read(at.join(&file)).expect("valid"), 0.0);
        let loaded = loaded.expect("all files");
        assert_eq!(loaded.lights.len(), set.lights.len());
        for (ix, (light, of_set)) in loaded.lights.iter().zip(&set.lights).enumerate() {
            assert_eq!(light.lambda, of_set.lambda, "{name}: {ix}");
            let shines = light.rgb.iter().any(|&x| x > 0.0);
            assert_eq!(shines, on.contains(&ix), "{name}: {ix}");
        }
        let session = Session::open(&at.join(&file)).expect("a scene");
        let prepared = session.prepared().expect("all files");
        assert_eq!(prepared.lights, loaded.lights, "{name}");
        assert_eq!(session.assets().light_colors(&session.scene().lights), {
            loaded
                .lights
                .iter()
                .map(|light| light.rgb)
                .collect::<Vec<_>>()
        });

        let mut command = strandlight();
        command
            .current_dir(at)
            .args(["render", &file, "--backend", "cpu"]);
        assert_done(command.args(["-o", "layers.exr", "--aov", "lights"]));
        for ix in 0..set.lights.len() {
            let layer = Layer::read(&at.join("layers.exr"), Some(&format!("light.{ix:03}")));
            assert_eq!(layer.is_ok(), on.contains(&ix), "{name}: {ix}");
        }

        let without = LightSet {
            lights: on.iter().map(|&ix| set.lights[ix]).collect(),
            ..set.clone()
        };
        without.write(&at.join("without.lights")).expect("written");
        let mut other = Scene::new("a.groom", "without.lights");
        (other.hair, other.render) = (scene.hair.clone(), scene.render.clone());
        write_scene(at, "without.toml", &other);
        let picture = |file: &str| {
            let scene = Scene::read(at.join(file)).expect("valid");
            let scene = PreparedScene::load(&scene).expect("all files");
            let picture = cpu::render(&scene, &scene.camera, [40, 30], 16);
            picture.expect("valid").0.rgba
        };
        let (found, expected) = (picture(&file), picture("without.toml"));
        assert!(
            expected
                .iter()
                .any(|pixel| bits([pixel[0], pixel[1], pixel[2]]) != [0; 3])
        );
        assert!(found == expected, "{name}: black lights change the picture");
    }
}

#[test]
fn gpu_layers_add_up_to_the_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    for backend in ["gpu", "cpu"] {
        let file = format!("{backend}.exr");
        let plain = format!("{backend}-plain.exr");
        let render = |args: &[&str]| {
            let mut command = strandlight();
            command
                .current_dir(at)
                .args(["render", "a.toml", "--backend", backend]);
            assert_done(command.args(args))
        };
        let said = render(&["-o", &file, "--aov", "terms,modes,lights"]);
        assert!(said.contains("16 layers"), "{said}");
        render(&["-o", &plain]);
        let read = |name: &str| layer(&at.join(&file), Some(name));
        let beauty = layer(&at.join(&file), None);
        let total = read("total");
        let check = |what: &str, layers: &[&str], whole: &[[f32; 3]]| {
            let layers: Vec<_> = layers.iter().map(|name| read(name)).collect();
            let error = relative(&sum(&layers), whole);
            println!("{backend}: {what}: {error:.1e}");
            assert!(error < 1e-3, "{backend}: {what}: {error}");
        };
        check("background", &["total", "background"], &beauty);
        check("terms", &["single", "global", "local"], &total);
        check(
            "modes of single",
            &["single.R", "single.TT", "single.TRT"],
            &read("single"),
        );
        check(
            "modes of global",
            &["global.R", "global.TT", "global.TRT"],
            &read("global"),
        );
        check(
            "lights",
            &["light.000", "light.001", "light.002", "light.004"],
            &total,
        );
        assert!(
            Layer::read(&at.join(&file), Some("light.003")).is_err(),
            "muted"
        );
        // The picture is the one without layers.
        let alone = layer(&at.join(&plain), None);
        let error = relative(&beauty, &alone);
        println!("{backend}: with and without layers: {error:.1e}");
        assert!(error < 1e-3, "{error}");
        // Every layer has something of its own.
        let modes = [read("single.R"), read("single.TT"), read("single.TRT")];
        for (ix, mode) in modes.iter().enumerate() {
            assert!(relative(mode, &modes[(ix + 1) % 3]) > 0.1);
        }
    }
}

/// Light of the things beside the hair is in a layer of its own, also what they send to the hair, and so is what they
/// cover. Black ones send none.
#[test]
fn gpu_layers_of_the_hair_leave_proxies_out() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let mut scene = Scene::read(at.join("a.toml")).expect("valid");
    for (name, albedo) in [("bright", [0.8, 0.5, 0.3]), ("black", [0.0; 3])] {
        scene.proxies = vec![ProxySection::Ellipsoid {
            centre: [0.8, -2.0, -0.8],
            radii: [1.2; 3],
            tilt_deg: 0.0,
            albedo,
        }];
        write_scene(at, &format!("{name}.toml"), &scene);
    }
    let is_black = |rgb: &[f32; 3]| rgb.iter().all(|&x| x == 0.0);
    for (backend, name) in [
        ("gpu", "bright"),
        ("gpu", "black"),
        ("cpu", "bright"),
        ("cpu", "black"),
    ] {
        let is_bright = name == "bright";
        let file = at.join(format!("{backend}-{name}.exr"));
        let args = [
            "render",
            &format!("{name}.toml"),
            "--backend",
            backend,
            "-o",
        ];
        let mut command = strandlight();
        command.current_dir(at).args(args).arg(&file);
        assert_done(command.args(["--aov", "terms,lights"]));
        let read = |name: &str| layer(&file, Some(name));
        let [total, proxies] = ["total", "proxies"].map(read);
        let check = |layers: &[&str], whole: &[[f32; 3]]| {
            let layers: Vec<_> = layers.iter().map(|name| read(name)).collect();
            let error = relative(&sum(&layers), whole);
            assert!(error < 1e-3, "{backend}: {layers:?}: {error}");
        };
        check(&["single", "global", "local"], &total);
        check(
            &["light.000", "light.001", "light.002", "light.004"],
            &total,
        );
        check(&["total", "proxies", "background"], &layer(&file, None));
        // Where only one of them is, the other is not.
        let channels = channels(&file);
        let [of_hair, of_proxies] = ["coverage.Y", "proxies.Y"].map(|name| &channels[name]);
        for name in ["coverage.Y", "proxies.Y", "A"] {
            let mut shares = channels[name].iter();
            assert!(shares.all(|x| (0.0..=1.0).contains(x)), "{backend}: {name}");
        }
        for name in ["background.R", "background.G", "background.B"] {
            assert!(
                channels[name].iter().all(|&x| x >= 0.0),
                "{backend}: {name}"
            );
        }
        let (mut n_alone, mut n_lit) = ([0, 0], 0);
        for (pixel, (total, proxies)) in total.iter().zip(&proxies).enumerate() {
            if of_hair[pixel] == 0.0 && of_proxies[pixel] == 1.0 {
                assert!(is_black(total), "{backend}: pixel {pixel}: {total:?}");
                assert_eq!(is_black(proxies), !is_bright, "{backend}: pixel {pixel}");
                n_alone[0] += 1;
            }
            if of_hair[pixel] > 0.3 && of_proxies[pixel] == 0.0 {
                n_lit += usize::from(proxies.iter().any(|x| x.abs() > 1e-6));
                n_alone[1] += 1;
            }
        }
        println!(
            "{backend}: {n_alone:?} pixels of the proxy alone, of hair alone, {n_lit} of these lit"
        );
        assert!(
            if is_bright { n_lit > 5 } else { n_lit == 0 },
            "{backend} {name}: {n_lit} lit"
        );
        assert!(n_alone.iter().all(|&n| n > 5), "{backend}: {n_alone:?}");
    }
}

#[test]
fn groups_of_lights_and_fewer_modes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let mut scene = Scene::read(at.join("a.toml")).expect("valid");
    scene.hair.modes = vec![Lobe::R, Lobe::Trt];
    scene.render.background = Background::None;
    scene.render.scattering = strandlight_formats::Scattering::Single;
    write_scene(at, "b.toml", &scene);
    let args = [
        "render",
        "b.toml",
        "-o",
        "b.exr",
        "--backend",
        "cpu",
        "--json",
    ];
    let said = assert_done(strandlight().current_dir(at).args(args).args([
        "--aov",
        "modes,lights",
        "--light-group",
        "warm=0,3",
    ]));
    let report: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    let expected = [
        "total",
        "single.R",
        "single.TRT",
        "light.warm",
        "light.rest",
        "coverage",
    ];
    assert_eq!(report["layers"], serde_json::json!(expected));
    let read = |name: &str| layer(&at.join("b.exr"), Some(name));
    let total = read("total");
    assert!(relative(&sum(&[read("light.warm"), read("light.rest")]), &total) < 1e-3);
    assert!(relative(&sum(&[read("single.R"), read("single.TRT")]), &total) < 1e-3);
}

/// All channels of a file.
fn channels(path: &Path) -> BTreeMap<String, Vec<f32>> {
    let image = exr::prelude::read_first_flat_layer_from_file(path).expect("an OpenEXR file");
    let list = image.layer_data.channel_data.list.iter();
    let values = |channel: &exr::prelude::AnyChannel<exr::prelude::FlatSamples>| {
        channel.sample_data.values_as_f32().collect()
    };
    list.map(|channel| (channel.name.to_string(), values(channel)))
        .collect()
}

#[test]
fn gpu_data_layers_are_of_the_strands_beside_the_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let mut scene = Scene::read(at.join("a.toml")).expect("valid");
    scene.render.background = Background::None;
    write_scene(at, "b.toml", &scene);
    let render = |backend: &str, file: &str, aov: &str| {
        let args = ["render", "b.toml", "-o", file, "--aov", aov, "--json"];
        let said = assert_done(
            strandlight()
                .current_dir(at)
                .args(args)
                .args(["--backend", backend]),
        );
        let report: serde_json::Value = serde_json::from_str(&said).expect("JSON");
        (report["layers"].clone(), channels(&at.join(file)))
    };
    let (names, found) = render("cpu", "all.exr", "data,terms");
    let mut expected = vec!["total", "single", "global", "local"];
    expected.extend(data_layers().map(|(layer, _)| layer.name));
    assert_eq!(names, serde_json::json!(expected));
    for (layer, _) in data_layers() {
        for name in layer.channels {
            assert!(found.contains_key(*name), "{name}");
        }
    }
    assert!(found.contains_key("R") && found.contains_key("single.R"));
    // The same whatever draws the light, and whatever else is asked for.
    let (names, some) = render("gpu", "some.exr", "position,depth,depth");
    assert_eq!(
        names,
        serde_json::json!(["total", "depth", "coverage", "position"])
    );
    assert!(!some.contains_key("tangent.X") && !some.contains_key("strand_id.Y"));
    for name in ["depth.Z", "P.X", "P.Y", "P.Z"] {
        assert!(some[name] == found[name], "{name}");
    }

    assert!(found["coverage.Y"] == found["A"]);
    let (mut n_hair, mut n_free) = (0, 0);
    for (pixel, &coverage) in found["coverage.Y"].iter().enumerate() {
        let of = |name: &str| found[name][pixel];
        let id = of("strand_id.Y");
        if coverage > 0.95 {
            assert!(id >= 0.0, "pixel {pixel}");
        }
        if id < 0.0 {
            n_free += 1;
            assert_eq!(id, -1.0);
            assert_eq!([of("depth.Z"), of("tangent.X"), of("P.X")], [0.0; 3]);
            continue;
        }
        n_hair += 1;
        // Strands are 0.05 cm apart from x = -2 on; a pixel is about 0.2 cm wide.
        let expected = (of("P.X") + 2.0) / 0.05;
        assert!((id - expected).abs() < 4.0, "{id} {expected}");
        assert_eq!(id.fract(), 0.0);
        assert!((0.0..80.0).contains(&id));
        // From y = 2 at the root to -2 at the tip, in waves.
        let along = of("root_distance.Y");
        let expected = (2.0 - of("P.Y")) / 4.0;
        assert!((along - expected).abs() < 0.06, "{along} {expected}");
        let tangent = ["tangent.X", "tangent.Y", "tangent.Z"].map(of);
        let length: f32 = tangent.iter().map(|x| x * x).sum();
        assert!((length - 1.0).abs() < 1e-5, "{tangent:?}");
        assert!(tangent[1] < -0.9, "{tangent:?}");
    }
    assert!(n_hair > 200 && n_free > 200, "{n_hair} {n_free}");
}

/// The tables of the reference: layers of light, and of data.
fn reference() -> [String; 2] {
    let code = |names: &[&str]| {
        let names: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
        names.join(", ")
    };
    let mut light = "| channels | written | content |\n|---|---|---|\n".to_owned();
    let mut data = "| channels | name | content | without hair |\n|---|---|---|---|\n".to_owned();
    for layer in &LAYERS {
        let channels = code(layer.channels);
        let unit = layer.unit.map_or(String::new(), |unit| format!(", {unit}"));
        let content = format!("{}{unit}", layer.help);
        if let Content::Data(_) = layer.content {
            let background = layer.background.expect("a value");
            data += &format!(
                "| {channels} | `{}` | {content} | {background} |\n",
                layer.name
            );
            continue;
        }
        let written = match layer.written {
            Written::Always => "always".to_owned(),
            Written::WithBackground => "unless the background is `none`".to_owned(),
            Written::WithProxies => "in scenes with proxies".to_owned(),
            Written::Splits(splits) => {
                code(&splits.iter().map(|split| split.name()).collect::<Vec<_>>())
            }
            other => panic!("{other:?}"),
        };
        light += &format!("| {channels} | {written} | {content} |\n");
    }
    [light, data]
}

#[test]
fn the_reference_is_made_from_the_table_of_layers() {
    let page = project_root().join("docs/book/src/reference/aov.md");
    let [light, data] = reference();
    check_part(&page, "layers", &light);
    check_part(&page, "data layers", &data);
}

/// Layers of data beside the colours.
#[test]
fn layers_without_colour_are_compared_by_their_channel_or_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let run = |line: &str| {
        let mut command = strandlight();
        command.current_dir(at).args(line.split(' '));
        command
    };
    let render = "render a.toml --backend cpu --size 24x16 --aov depth,tangent -o a.exr";
    assert_done(&mut run(render));
    let said = assert_done(&mut run("compare a.exr a.exr --layer depth"));
    assert!(said.contains("24x16 pixels compared"), "{said}");
    let needle = "layer tangent has no colour to compare: its channels are X, Y, Z";
    assert_refused(&mut run("compare a.exr a.exr --layer tangent"), &[needle]);
    let none = "no layer none; the file has (plain), ";
    assert_refused(&mut run("compare a.exr a.exr --layer none"), &[none]);
}

#[test]
fn what_cannot_be_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    for (args, needles) in [
        (
            &["-o", "a.png", "--aov", "terms"][..],
            &["a.png", ".exr"][..],
        ),
        (&["-o", "a.exr", "--aov", "colours"], &["colours"]),
        (
            &["-o", "a.exr", "--aov", "terms,deph"],
            &["deph", "did you mean depth?"],
        ),
        (&["-o", "a.png", "--aov", "data"], &["a.png", ".exr"]),
        (&["-o", "a.exr", "--light-group", "a=0"], &["--aov"]),
        (
            &["-o", "a.exr", "--aov", "lights", "--light-group", "a=9"],
            &["group a", "light 9"],
        ),
        (
            &[
                "-o",
                "a.exr",
                "--aov",
                "lights",
                "--light-group",
                "a=0",
                "--light-group",
                "b=0",
            ],
            &["group b", "light 0", "in a group already"],
        ),
        (
            &[
                "-o",
                "a.exr",
                "--aov",
                "lights",
                "--light-group",
                "a=0",
                "--light-group",
                "a=1",
            ],
            &["group a", "twice"],
        ),
        (
            &["-o", "a.exr", "--aov", "lights", "--light-group", "rest=0"],
            &["rest"],
        ),
        (
            &[
                "-o",
                "a.exr",
                "--aov",
                "terms,modes,lights",
                "--size",
                "8192x1024",
            ],
            &["layers", "bytes", "--size"],
        ),
    ] {
        let mut command = strandlight();
        assert_refused(
            command
                .current_dir(at)
                .args(["render", "a.toml", "--backend", "cpu"])
                .args(args),
            needles,
        );
        assert!(!at.join("a.exr").exists());
    }
}
