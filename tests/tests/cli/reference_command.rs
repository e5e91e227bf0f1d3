//! `strandlight reference` from the outside: what it writes, goes on with and refuses.

use std::fs;
use std::path::Path;

use serde_json::Value;
use strandlight_formats::{
    Background, BakedFile, CameraSection, Groom, LightSet, MotionSection, ProxySection, Scene,
    SrbfLight,
};
use strandlight_images::Map;
use strandlight_reference::compare::{Layer, compare};
use strandlight_scene::paint::{Paint, PaintedPoint};
use strandlight_tests::panoramas::striped;
use strandlight_tests::scenes::{curtain, key_and_sky, write_scene, write_small_scene};
use strandlight_tests::{assert_done, assert_refused, strandlight};

/// A small scene on disk.
fn scene_in(folder: &Path) {
    let groom = curtain(40, 6, 0.1, 0.0);
    write_small_scene(folder, &groom, key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.2);
        scene.render.background = Background::Color([0.1, 0.2, 0.3]);
    });
}

/// `strandlight reference` in `folder` at a small size.
fn reference(folder: &Path, args: &str) -> std::process::Command {
    let mut command = strandlight();
    command
        .current_dir(folder)
        .arg("reference")
        .args(args.split_whitespace())
        .args(["--size", "24x16"]);
    command
}

#[test]
fn keys_of_the_scene_are_overridden() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let text = fs::read_to_string(at.join("a.toml")).expect("a scene");
    let (before, after) = text.split_once("[hair]\n").expect("a section of hair");
    let after: Vec<&str> = after
        .lines()
        .filter(|line| !line.starts_with("eta "))
        .collect();
    let text = format!("{before}[hair]\neta = 1.9\n{}\n", after.join("\n"));
    fs::write(at.join("b.toml"), text).expect("written");
    let path = "--method path --samples 4";
    assert_done(&mut reference(at, &format!("a.toml {path} -o a.exr")));
    let set = "--set hair.eta=1.9";
    assert_done(&mut reference(
        at,
        &format!("a.toml {path} {set} -o set.exr"),
    ));
    assert_done(&mut reference(at, &format!("b.toml {path} -o b.exr")));
    let read = |name: &str| Layer::read(&at.join(name), None).expect("written").rgb;
    assert_eq!(read("set.exr"), read("b.exr"));
    assert_ne!(read("a.exr"), read("b.exr"));
    // It is another scene to go on with.
    let args = format!("a.toml {path} --resume -o set.exr");
    assert_refused(&mut reference(at, &args), &["set.exr"]);
    let args = format!("a.toml {path} --set hair.et=1.9 -o c.exr");
    assert_refused(&mut reference(at, &args), &["hair.et"]);
}

#[test]
fn every_method_writes_layers_and_can_be_gone_on_with() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    scene_in(folder.path());
    for method in ["path", "ray-shoot", "directional"] {
        let run = |args: &str| {
            let args = format!("a.toml --method {method} {args} --json");
            let text = assert_done(&mut reference(folder.path(), &args));
            serde_json::from_str::<Value>(&text).expect("one document")
        };
        let report = run("-o whole.exr --samples 8");
        assert_eq!(report["spp"], 8);
        assert_eq!(report["method"], method);
        run("-o parts.exr --spp 3");
        let report = run("-o parts.exr --samples 5 --resume");
        assert_eq!(report["spp"], 8);
        let read = |name: &str| {
            let bytes = fs::read(folder.path().join(name)).expect("written");
            for channel in ["single.R", "global.G", "local.B", "total.R", "variance.G"] {
                let found = bytes
                    .windows(channel.len())
                    .any(|w| w == channel.as_bytes());
                assert!(found, "{method}: no {channel}");
            }
            exr_rgba(&folder.path().join(name))
        };
        let (whole, parts) = (read("whole.exr"), read("parts.exr"));
        let mut lit = 0;
        for (a, b) in whole.iter().zip(&parts) {
            for c in 0..4 {
                assert!((a[c] - b[c]).abs() <= 1e-5 * a[c].abs(), "{a:?} {b:?}");
            }
            assert_eq!(a[3], 1.0, "over the background");
            lit += usize::from(a[..3] != [0.1, 0.2, 0.3]);
        }
        assert!(lit > 20, "{method}: {lit}");
        // A corner shows the background alone.
        assert_eq!(whole[0], [0.1, 0.2, 0.3, 1.0]);
    }
}

#[test]
fn flags_that_a_method_ignores_are_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    scene_in(folder.path());
    for (args, flag) in [
        ("--method path --lights 5", "--lights"),
        (
            "--method directional --density-forward 1",
            "--density-forward",
        ),
        ("--method ray-shoot --energy-safe", "--energy-safe"),
    ] {
        let args = format!("a.toml {args} --samples 1 -o a.exr");
        let output = reference(folder.path(), &args).output().expect("it starts");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{args}: {stderr}");
        let told = format!("{flag} has no effect with --method");
        assert!(stderr.contains(&told), "{args}: {stderr}");
    }
    let args = "a.toml --method path --samples 1 -o a.exr --set render.scattering=local";
    let output = reference(folder.path(), args).output().expect("it starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(
        stderr.contains("render.scattering has no effect"),
        "{stderr}"
    );
}

#[test]
fn energy_safe_hair_has_its_intensities_and_modes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let single = |name: &str, keys: &[&str]| -> f64 {
        let mut command = reference(
            at,
            &format!("a.toml --method path --samples 16 --energy-safe -o {name}.exr"),
        );
        for key in keys {
            command.args(["--set", key]);
        }
        assert_done(&mut command);
        let layer = Layer::read(&at.join(format!("{name}.exr")), Some("single")).expect("a layer");
        layer.rgb.iter().flatten().map(|&x| f64::from(x)).sum()
    };
    let whole = single("whole", &[]);
    let dim = [
        "hair.intensity_r=0.2",
        "hair.intensity_tt=0.2",
        "hair.intensity_trt=0.2",
    ];
    let dim = single("dim", &dim);
    assert!((dim / whole - 0.2).abs() < 0.02, "{dim} {whole}");
    let modes = [r#"["R"]"#, r#"["TT"]"#, r#"["TRT"]"#];
    let modes = modes.map(|mode| single("mode", &[&format!("hair.modes={mode}")]));
    let sum: f64 = modes.iter().sum();
    assert!((sum / whole - 1.0).abs() < 0.1, "{modes:?} {whole}");
    let mut command = reference(
        at,
        "a.toml --method path --samples 1 --energy-safe -o v.exr",
    );
    command.args(["--set", "variation.roughness_strand=0.3"]);
    assert_refused(&mut command, &["a.toml", "variation.roughness_strand"]);
}

#[test]
fn one_sample_says_nothing_of_its_noise() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    for samples in [1, 2] {
        let args = format!("a.toml --method path --samples {samples} -o {samples}.exr");
        assert_done(&mut reference(at, &args));
    }
    let noise = |b: &str| {
        let [a, b] =
            [at.join("2.exr"), at.join(b)].map(|path| Layer::read(&path, None).expect("a picture"));
        compare(&a, &b)
            .expect("comparable")
            .hair
            .relative_rmse_noise
    };
    assert_eq!(noise("1.exr"), None);
    assert!(noise("2.exr").is_some_and(|noise| noise > 0.0));
}

/// Seeds, pixels and samples decide all: parts make the file that one run makes, byte by byte.
#[test]
fn samples_are_added_to_a_file_or_start_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    scene_in(folder);
    for method in ["path", "ray-shoot", "directional"] {
        let run = |threads: &str, args: &str| {
            let args = format!("a.toml --method {method} --lights 16 {args}");
            let mut command = reference(folder, &args);
            assert_done(command.env("RAYON_NUM_THREADS", threads));
        };
        run("1", "--output whole.exr --samples 16");
        // A farm need not know which of its jobs comes first.
        run("3", "-o parts.exr --samples 8 --resume");
        run("1", "-o eight.exr --samples 8");
        let read = |name: &str| fs::read(folder.join(name)).expect("written");
        assert!(read("parts.exr") == read("eight.exr"), "{method}");
        run("2", "-o parts.exr --samples 8 --resume");
        assert!(read("parts.exr") == read("whole.exr"), "{method}");
        assert!(read("parts.exr") != read("eight.exr"), "{method}");
        fs::remove_file(folder.join("parts.exr")).expect("there");
    }
}

#[test]
fn what_differs_from_the_picture_to_resume_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    scene_in(folder);
    let mut map = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n".to_vec();
    map.extend([128, 128, 128, 129].repeat(8 * 16));
    fs::write(folder.join("sky.hdr"), map).expect("written");
    let scene = Scene::read(folder.join("a.toml")).expect("valid");
    let changed = |name: &str, change: &dyn Fn(&mut Scene)| {
        let mut scene = scene.clone();
        change(&mut scene);
        write_scene(folder, name, &scene);
    };
    let mut groom = Groom::read(&folder.join("a.groom")).expect("written");
    groom.points[0][0] += 0.1;
    groom.write(&folder.join("b.groom")).expect("written");
    let mut lights = LightSet::read(&folder.join("a.lights")).expect("written");
    lights.lights[0].rgb[0] *= 2.0;
    lights.write(&folder.join("b.lights")).expect("written");
    changed("groom.toml", &|scene| scene.groom.file = "b.groom".into());
    changed("lights.toml", &|scene| {
        scene.lights.file = "b.lights".into()
    });
    changed("hair.toml", &|scene| scene.hair.eta = 1.6);
    let common = "--method directional --samples 1 --lights 8 -o a.exr";
    assert_done(&mut reference(folder, &format!("a.toml {common}")));
    let before = fs::read(folder.join("a.exr")).expect("written");
    for (args, what) in [
        (format!("groom.toml {common}"), "its groom is"),
        (format!("lights.toml {common}"), "its light set is"),
        (format!("hair.toml {common}"), "its scene is"),
        (
            format!("a.toml {common} --map sky.hdr"),
            "its map is none, not",
        ),
        (
            "a.toml --method directional --samples 1 --lights 9 -o a.exr".to_owned(),
            "its number of --lights is 8, not 9",
        ),
        (
            "a.toml --method path --samples 1 -o a.exr".to_owned(),
            "its method is directional, not path",
        ),
        (format!("a.toml {common} --seed 3"), "its seed is 0, not 3"),
    ] {
        let needles = ["a.exr", "cannot be resumed", what];
        assert_refused(
            &mut reference(folder, &format!("{args} --resume")),
            &needles,
        );
    }
    let by_path = "a.toml --method path --samples 1 -o path.exr";
    assert_done(&mut reference(folder, by_path));
    assert_refused(
        &mut reference(folder, &format!("{by_path} --resume --energy-safe")),
        &["path.exr", "its option --energy-safe is false, not true"],
    );
    // Of a panorama the file's name says nothing.
    let behind = "--set render.background=panorama --set lights.panorama=a.panorama";
    let args = format!("a.toml {common} {behind} -o behind.exr").replace("-o a.exr ", "");
    let panorama = |width| {
        let panorama = striped(width).write(&folder.join("a.panorama"));
        panorama.expect("written");
    };
    panorama(64);
    assert_done(&mut reference(folder, &args));
    assert_done(&mut reference(folder, &format!("{args} --resume")));
    panorama(32);
    let needles = ["behind.exr", "its panorama is"];
    assert_refused(
        &mut reference(folder, &format!("{args} --resume")),
        &needles,
    );
    let mut command = strandlight();
    let other_size = format!("reference a.toml {common} --resume --size 25x16");
    command.current_dir(folder).args(other_size.split(' '));
    assert_refused(&mut command, &["its size is 24x16, not 25x16"]);
    assert_eq!(fs::read(folder.join("a.exr")).expect("still there"), before);
}

fn exr_rgba(path: &Path) -> Vec<[f32; 4]> {
    let image = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| vec![[0.0f32; 4]; size.width() * size.height()],
        |pixels: &mut Vec<[f32; 4]>, at, (r, g, b, a): (f32, f32, f32, f32)| {
            pixels[at.y() * 24 + at.x()] = [r, g, b, a];
        },
    );
    image.expect("readable").layer_data.channel_data.pixels
}

#[test]
fn the_map_lights_as_its_lights_do() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    scene_in(folder.path());
    // An even sky as a Radiance map and as one very wide light.
    let mut map = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n".to_vec();
    map.extend([128, 128, 128, 129].repeat(8 * 16));
    let sky = Map::decode(&map).expect("a map");
    let level = sky.pixels()[0][0];
    fs::write(folder.path().join("sky.hdr"), map).expect("written");
    let lights = LightSet {
        lights: vec![SrbfLight {
            direction: [0.0, 1.0, 0.0],
            lambda: 10.0,
            rgb: [level * 1.02; 3],
        }],
        ..LightSet::default()
    };
    lights
        .write(&folder.path().join("a.lights"))
        .expect("written");
    let mut scene = Scene::read(folder.path().join("a.toml")).expect("valid");
    scene.render.background = Background::None;
    write_scene(folder.path(), "b.toml", &scene);
    let common = "b.toml --method directional --samples 64";
    assert_done(&mut reference(folder.path(), &format!("{common} -o a.exr")));
    assert_done(&mut reference(
        folder.path(),
        &format!("{common} -o b.exr --map sky.hdr"),
    ));
    let mean = |name: &str| {
        let pixels = exr_rgba(&folder.path().join(name));
        let hair = pixels.iter().map(|p| p[1]).sum::<f32>();
        hair / pixels.len() as f32
    };
    let (lights, map) = (mean("a.exr"), mean("b.exr"));
    assert!(
        map > 0.0 && (lights / map - 1.0).abs() < 0.03,
        "{lights} {map}"
    );
    // Tinted and scaled, too.
    let tinted = "--set lights.tint=[0.25,0.5,0] --set lights.intensity=3";
    for (method, name) in [("", "c.exr"), ("--map sky.hdr", "d.exr")] {
        assert_done(&mut reference(
            folder.path(),
            &format!("{common} -o {name} {tinted} {method}"),
        ));
    }
    let sum = |name: &str| {
        let pixels = exr_rgba(&folder.path().join(name));
        let hair = pixels.iter();
        hair.fold([0.0_f32; 3], |sum, p| [0, 1, 2].map(|c| sum[c] + p[c]))
    };
    let (lights, map) = (sum("c.exr"), sum("d.exr"));
    assert!((mean("d.exr") / mean("b.exr") - 1.5).abs() < 0.03);
    for channel in 0..2 {
        let ratio = lights[channel] / map[channel];
        assert!((ratio - 1.0).abs() < 0.03, "{lights:?} {map:?}");
    }
    assert_eq!((lights[2], map[2]), (0.0, 0.0));
}

/// The groom of [`scene_in`] dyed all over, with widths as well or without.
fn dyed(folder: &Path, width_scale: f32) {
    let mut groom = Groom::read(&folder.join("a.groom")).expect("written");
    let point = PaintedPoint {
        sigma_a: [2.0, 0.02, 0.02],
        weight: 1.0,
        width_scale,
        shift_scale: 1.0,
        ..PaintedPoint::NONE
    };
    let points = vec![point; groom.points.len()];
    Paint { points }.write_to(&mut groom);
    groom.write(&folder.join("a.groom")).expect("written");
}

#[test]
fn paint_is_drawn_by_every_method() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    scene_in(folder);
    let mean = |name: &str| -> [f32; 3] {
        let pixels = exr_rgba(&folder.join(name));
        let hair = pixels.iter().filter(|p| p[..3] != [0.1, 0.2, 0.3]);
        hair.fold([0.0; 3], |sum, p| [0, 1, 2].map(|c| sum[c] + p[c]))
    };
    let ratios = || {
        ["path", "ray-shoot", "directional"].map(|method| {
            let args = format!("a.toml --method {method} --samples 16 -o {method}.exr");
            assert_done(&mut reference(folder, &args));
            let [red, green, _] = mean(&format!("{method}.exr"));
            red / green
        })
    };
    let bare = ratios();
    for width_scale in [1.0, 1.5] {
        dyed(folder, width_scale);
        for (dyed, bare) in ratios().into_iter().zip(bare) {
            assert!(dyed < 0.8 * bare, "{width_scale}: {dyed} {bare}");
        }
    }
    // Pictures of other paint are not gone on with.
    dyed(folder, 1.0);
    assert_refused(
        &mut reference(
            folder,
            "a.toml --method path --samples 1 --resume -o path.exr",
        ),
        &["path.exr", "inputs"],
    );
    // What fibres lose depends on their widths alone.
    let args = "a.toml --method path --samples 1 --energy-safe -o safe.exr";
    assert_done(&mut reference(folder, args));
    dyed(folder, 1.5);
    assert_refused(&mut reference(folder, args), &["a.toml", "--energy-safe"]);
}

#[test]
fn proxies_are_drawn_by_every_method() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    scene_in(folder);
    let mut scene = Scene::read(folder.join("a.toml")).expect("valid");
    scene.proxies = vec![ProxySection::Ground {
        height: -6.0,
        albedo: [0.5; 3],
    }];
    write_scene(folder, "b.toml", &scene);
    for method in ["path", "ray-shoot", "directional"] {
        let run = |args: &str| {
            let args = format!("b.toml --method {method} {args}");
            assert_done(&mut reference(folder, &args));
        };
        run("-o whole.exr --samples 8");
        run("-o parts.exr --samples 3");
        run("-o parts.exr --samples 5 --resume");
        let [whole, parts] = ["whole.exr", "parts.exr"].map(|name| exr_rgba(&folder.join(name)));
        for (a, b) in whole.iter().zip(&parts) {
            assert!(
                (0..4).all(|c| (a[c] - b[c]).abs() <= 1e-5 * a[c].abs()),
                "{a:?} {b:?}"
            );
        }
        // A lower corner shows the ground, an upper one the background.
        assert_eq!(whole[0], [0.1, 0.2, 0.3, 1.0]);
        let [red, _, blue, alpha] = whole[24 * 15];
        assert!(
            red > 0.2 && red > 0.7 * blue && alpha == 1.0,
            "{red} {blue}"
        );
        let bytes = fs::read(folder.join("whole.exr")).expect("written");
        let has = |name: &str| bytes.windows(name.len()).any(|w| w == name.as_bytes());
        assert!(has("proxies.R") && has("proxies.Y"));
    }
    // A picture without the ground is another.
    let args = "a.toml --method path -o whole.exr --samples 1 --resume";
    assert_refused(&mut reference(folder, args), &["whole.exr", "method"]);
    let args = "a.toml --method directional -o whole.exr --samples 1 --resume";
    assert_refused(&mut reference(folder, args), &["whole.exr", "inputs"]);
}

#[test]
fn hair_is_where_it_is_at_the_time() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    scene_in(folder);
    let mut groom = Groom::read(&folder.join("a.groom")).expect("written");
    for point in &mut groom.points {
        point[0] += 1.0;
    }
    groom.write(&folder.join("b.groom")).expect("written");
    let mut scene = Scene::read(folder.join("a.toml")).expect("valid");
    scene.camera = Some(CameraSection {
        position: [0.0, -2.5, 20.0],
        target: [0.0, -2.5, 0.0],
        up: [0.0, 1.0, 0.0],
        fov_deg: 30.0,
    });
    scene.groom.file = "b.groom".into();
    write_scene(folder, "moved.toml", &scene);
    scene.groom.file = "a.groom".into();
    scene.motion = Some(MotionSection {
        frames: vec!["a.groom".into(), "b.groom".into()],
        fps: Some(1.0),
        ..MotionSection::default()
    });
    write_scene(folder, "moving.toml", &scene);
    let picture = |args: &str| {
        let args = format!("{args} --method directional --samples 8 -o a.exr");
        assert_done(&mut reference(folder, &args));
        exr_rgba(&folder.join("a.exr"))
    };
    let covered = |pixels: &[[f32; 4]]| -> f32 {
        let at = |(ix, p): (usize, &[f32; 4])| match p[..3] == [0.1, 0.2, 0.3] {
            true => 0.0,
            false => (ix % 24) as f32,
        };
        let n = pixels.iter().filter(|p| p[..3] != [0.1, 0.2, 0.3]).count();
        pixels.iter().enumerate().map(at).sum::<f32>() / n as f32
    };
    let (start, end) = (picture("moving.toml"), picture("moving.toml --time 1"));
    let moved = covered(&end) - covered(&start);
    // 16 pixels are 10.7 cm high.
    assert!((1.0..2.0).contains(&moved), "{moved} pixels");
    let expected = picture("moved.toml");
    let apart = end.iter().flatten().zip(expected.iter().flatten());
    let apart = apart.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(apart < 1e-3, "{apart}");
    assert_refused(
        &mut reference(folder, "moving.toml --method path --time 2e6 -o b.exr"),
        &["--time", "0..=1000000"],
    );
}

#[test]
fn elliptic_hair_is_rendered_by_all_methods() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    scene_in(folder);
    let mut scene = Scene::read(folder.join("a.toml")).expect("valid");
    scene.hair.eccentricity = 0.8;
    write_scene(folder, "elliptic.toml", &scene);
    for method in ["path", "directional", "ray-shoot"] {
        let [round, elliptic] = ["a", "elliptic"].map(|name| {
            let args = format!("{name}.toml --method {method} --samples 2 -o {name}.exr");
            assert_done(&mut reference(folder, &args));
            exr_rgba(&folder.join(format!("{name}.exr")))
        });
        assert!(elliptic.iter().flatten().all(|x| x.is_finite()));
        assert!(round != elliptic, "{method}");
    }
}

#[test]
fn what_cannot_be_used_is_refused_and_nothing_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    scene_in(folder);
    let refused = |args: &str, needles: &[&str]| {
        assert_refused(&mut reference(folder, args), needles);
    };
    refused("a.toml --method none -o a.exr", &["method"]);
    refused("a.toml --method path -o a.png", &["a.png", ".exr"]);
    refused("a.toml --method path -o a.exr --samples 0", &["--samples"]);
    refused(
        "a.toml --method directional -o a.exr --lights 0",
        &["lights"],
    );
    refused(
        "a.toml --method ray-shoot -o a.exr --density-back 1.5",
        &["density"],
    );
    refused("b.toml --method path -o a.exr", &["b.toml"]);
    refused("a.toml --method path -o none/a.exr", &["none/a.exr"]);
    refused("a.toml --method path -o a.exr --map a.groom", &["a.groom"]);
    let mut scene = Scene::read(folder.join("a.toml")).expect("valid");
    scene.hair.eccentricity = 0.8;
    write_scene(folder, "elliptic.toml", &scene);
    assert!(!folder.join("a.exr").exists());

    // A picture of something else stays as it is.
    assert_done(&mut reference(
        folder,
        "a.toml --method directional -o a.exr --samples 1",
    ));
    let before = fs::read(folder.join("a.exr")).expect("written");
    let common = "--method directional -o a.exr --samples 1 --resume";
    refused(&format!("elliptic.toml {common}"), &["a.exr", "inputs"]);
    refused(&format!("a.toml {common} --seed 1"), &["a.exr", "seed"]);
    refused(&format!("a.toml {common} --lights 7"), &["a.exr", "inputs"]);
    refused(
        "a.toml --method path -o a.exr --resume",
        &["a.exr", "method"],
    );
    assert_eq!(fs::read(folder.join("a.exr")).expect("still there"), before);
    fs::write(folder.join("a.exr"), &before[..before.len() / 2]).expect("written");
    refused(&format!("a.toml {common}"), &["a.exr", "OpenEXR"]);
}
