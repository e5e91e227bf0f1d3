//! `mesh import`, and what else knows meshes, from the outside.

use std::fmt::Write;
use std::fs;

use serde_json::Value;
use strandlight_formats::ProxySection;
use strandlight_tests::scenes::{curtain, ellipsoid, key_and_sky, write_small_scene};
use strandlight_tests::{assert_done, assert_refused, strandlight};

/// A ball of 2 cm as an OBJ file in inches, without normals.
fn obj() -> String {
    let ball = ellipsoid([1.0 / 2.54; 3], 12);
    let mut text = "# a ball\n".to_owned();
    for [x, y, z] in &ball.positions {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for corners in &ball.triangles {
        let [a, b, c] = corners.map(|ix| ix + 1);
        let _ = writeln!(text, "f {a} {b} {c}");
    }
    text
}

#[test]
fn a_mesh_is_imported_inspected_verified_and_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("ball.txt"), obj()).expect("written");
    let run = |line: &str| assert_done(strandlight().current_dir(at).args(line.split(' ')));
    let said = run("mesh import ball.txt --unit in -o ball.mesh");
    // Some at the poles have no area.
    assert!(
        said.contains("ball.mesh: mesh 1.0, 312 vertices, 5"),
        "{said}"
    );
    let info: Value = serde_json::from_str(&run("inspect ball.mesh --json")).expect("JSON");
    assert_eq!(info["kind"], "mesh");
    assert_eq!(info["parameters"]["cm_per_unit"], "2.54");
    assert!(
        (info["size"][1].as_f64().expect("a number") - 2.0).abs() < 1e-5,
        "{info}"
    );
    assert!(run("verify ball.mesh").contains("ball.mesh: mesh, ok"));
    write_small_scene(at, &curtain(20, 6, 0.2, 3.0), key_and_sky(), |scene| {
        scene.proxies = vec![ProxySection::mesh("ball.mesh")];
        scene.render.size = [24, 16];
    });
    let draw = |out: &str| format!("render a.toml --backend cpu --quiet -o {out}");
    run(&draw("with.png"));
    run("reference a.toml --method path --samples 1 --quiet -o truth.exr");
    // Its own file in the mesh's place.
    fs::copy(at.join("ball.txt"), at.join("ball.mesh")).expect("copied");
    let mut refused = strandlight();
    let line = draw("not.png");
    refused.current_dir(at).args(line.split(' '));
    assert_refused(&mut refused, &["proxy[0].mesh", "ball.mesh", "mesh import"]);
    let mut refused = strandlight();
    refused
        .current_dir(at)
        .args(["mesh", "import", "a.groom", "-o", "x.mesh"]);
    assert_refused(&mut refused, &["a.groom", "not an OBJ or glTF"]);
}

#[test]
fn a_buffer_of_a_gltf_file_is_no_output() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let corners = [[0.0f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let bytes: Vec<u8> = corners
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    fs::write(at.join("a b.bin"), &bytes).expect("written");
    let text = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"uri": "a%20b.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}]}"#;
    fs::write(at.join("a.gltf"), text).expect("written");
    let import = |output: &str| {
        let mut command = strandlight();
        let args = ["mesh", "import", "a.gltf", "-o", output];
        command.current_dir(at).args(args);
        command
    };
    assert_refused(&mut import("a b.bin"), &["a b.bin", "is an input"]);
    assert_eq!(fs::read(at.join("a b.bin")).expect("kept"), bytes);
    assert_done(&mut import("other.bin"));
}
