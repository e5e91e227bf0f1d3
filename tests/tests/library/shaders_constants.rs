//! A constant of a shader has the value of its twin in Rust: one twin each, known by its file.

use std::collections::BTreeMap;
use std::fs;

use strandlight_render::probe::{Function, Scheme};
use strandlight_scattering::Parameter;
use strandlight_scene::shadow_maps::N_PLACES;
use strandlight_scene::stats::TERM_NAMES;
use strandlight_shaders::{MODULES, resolve_with};
use strandlight_tests::project_root;

/// The Rust file with the twins of a shader module's constants, where it is not the file of the
/// same stem in [`CLOSED_FORM`].
const TWIN_FILES: [(&str, &str); 26] = [
    ("lib/bounce", "crates/scene/src/bounce.rs"),
    ("lib/coverage", "crates/cpu/src/list/places.rs"),
    ("lib/grid", "crates/scene/src/volume.rs"),
    ("lib/light", "crates/scene/src/shadow_maps.rs"),
    ("lib/lut", "crates/scene/src/lut.rs"),
    (
        "lib/multiple_tables",
        "crates/scattering/src/multiple_tables/elliptic.rs",
    ),
    ("lib/proxy", "crates/scene/src/proxy.rs"),
    ("lib/tone", "crates/scene/src/tone.rs"),
    ("lib/wind", "crates/scene/src/motion/wind.rs"),
    ("lib/surface_light", "crates/cpu/src/proxy_light.rs"),
    ("pass/bounce", "crates/cpu/src/bounce.rs"),
    ("pass/meshes", "crates/cpu/src/proxies.rs"),
    (
        "pass/multiple_tables",
        "crates/scattering/src/multiple_tables/fill.rs",
    ),
    ("pass/preview", "crates/render/src/passes/preview.rs"),
    ("lib/pieces", "crates/cpu/src/pieces.rs"),
    ("lib/ribbon", "crates/cpu/src/raster/ribbons.rs"),
    ("lib/screen_point", "crates/cpu/src/screen_point.rs"),
    ("lib/view", "crates/scene/src/camera.rs"),
    ("pass/pieces", "crates/render/src/passes/pieces.rs"),
    ("pass/proxies", "crates/cpu/src/proxies.rs"),
    ("pass/shade", "crates/render/src/passes/painted.rs"),
    ("pass/slices", "crates/render/src/passes/lighting/slices.rs"),
    ("pass/shadow_map", "crates/cpu/src/shadow_map.rs"),
    ("pass/transmittance", "crates/cpu/src/transmittance.rs"),
    (
        "lib/group_sums",
        "crates/render/src/passes/visibility/pipelines.rs",
    ),
    (
        "lib/visible_list",
        "crates/render/src/passes/visibility/buffers.rs",
    ),
];

const CLOSED_FORM: &str = "crates/scattering/src/closed_form";

/// Constants whose twin stands in yet another file: module, name, file.
const TWINS_ELSEWHERE: [(&str, &str, &str); 20] = [
    (
        "pass/proxy_light",
        "LANES",
        "crates/render/src/passes/meshes.rs",
    ),
    ("lib/coverage", "CLOSED", "crates/cpu/src/list/pixel.rs"),
    (
        "pass/shade",
        "FIRST_SHADED",
        "crates/render/src/passes/lighting/slices.rs",
    ),
    (
        "pass/shade",
        "N_SHADED",
        "crates/render/src/passes/lighting/slices.rs",
    ),
    (
        "pass/through_shares",
        "FIRST_SHADED",
        "crates/render/src/passes/lighting/slices.rs",
    ),
    (
        "pass/through_shares",
        "N_SHADED",
        "crates/render/src/passes/lighting/slices.rs",
    ),
    ("pass/slices", "MOST_GROUPS", "crates/render/src/limits.rs"),
    (
        "pass/listed_triangles",
        "NEXT_TO_EYE",
        "crates/cpu/src/triangles.rs",
    ),
    (
        "pass/listed_pixels",
        "NO_SURFACE",
        "crates/scene/src/bounce.rs",
    ),
    (
        "pass/listed_triangles",
        "REACH",
        "crates/cpu/src/triangles.rs",
    ),
    (
        "lib/visible_list",
        "TILE",
        "crates/render/src/passes/visibility/mod.rs",
    ),
    (
        "lib/along_segments",
        "LEAST_NORMAL",
        "crates/cpu/src/along_segments.rs",
    ),
    (
        "lib/along_segments",
        "N_PLACES",
        "crates/scene/src/shadow_maps.rs",
    ),
    ("pass/bounce", "NO_SURFACE", "crates/scene/src/bounce.rs"),
    (
        "pass/shade",
        "MAPS_PER_WORD",
        "crates/scene/src/shadow_maps.rs",
    ),
    (
        "pass/shadow_map",
        "MAPS_PER_WORD",
        "crates/scene/src/shadow_maps.rs",
    ),
    (
        "pass/shade",
        "LAST_FORWARD",
        "crates/scattering/src/closed_form/multiple_scattering.rs",
    ),
    (
        "pass/shadow_map",
        "N_PLACES",
        "crates/scene/src/shadow_maps.rs",
    ),
    (
        "pass/through_shares",
        "N_PLACES",
        "crates/scene/src/shadow_maps.rs",
    ),
    (
        "pass/through_shares",
        "MAPS_PER_WORD",
        "crates/scene/src/shadow_maps.rs",
    ),
];

/// Constants that Rust has as something else: module, name, value there.
fn values_elsewhere() -> Vec<(&'static str, &'static str, Vec<f64>)> {
    use std::f64::consts::{FRAC_PI_2, PI};
    let counter = |name: &str| {
        let ix = TERM_NAMES.iter().position(|term| *term == name);
        // Points skipped; then of each term the products evaluated, and those skipped.
        vec![(1 + 2 * ix.expect("a term")) as f64]
    };
    let function = |function: Function| vec![f64::from(function as u32)];
    let [width_min, width_max] = Parameter::Width.range();
    let [_, shift_max] = Parameter::Shift.range();
    vec![
        ("lib/constants", "PI", vec![PI]),
        ("lib/constants", "HALF_PI", vec![FRAC_PI_2]),
        ("lib/along_segments", "HALF", vec![f64::from(N_PLACES / 2)]),
        ("lib/paint", "WIDTH_MIN", vec![width_min]),
        ("lib/paint", "WIDTH_MAX", vec![width_max]),
        ("lib/paint", "SHIFT_MAX", vec![shift_max]),
        ("pass/shade", "SINGLE_COUNTER", counter("single")),
        (
            "pass/shade",
            "DIRECT_LOCAL_COUNTER",
            counter("direct local"),
        ),
        ("pass/shade", "GLOBAL_COUNTER", counter("global")),
        ("pass/shade", "LOCAL_COUNTER", counter("local")),
        ("pass/probe", "PAPER", vec![f64::from(Scheme::Paper as u32)]),
        ("pass/probe", "TABLE_C", function(Function::TableC)),
        ("pass/probe", "TABLE_H", function(Function::TableH)),
        ("pass/probe", "AZIMUTHAL", function(Function::Azimuthal)),
        ("pass/probe", "SINGLE", function(Function::Single)),
        ("pass/probe", "SPECIAL", function(Function::Special)),
        (
            "pass/probe",
            "CIRCULAR_GAUSSIAN",
            function(Function::CircularGaussian),
        ),
        ("pass/probe", "FRESNEL", function(Function::Fresnel)),
        ("pass/probe", "FRAME", function(Function::Frame)),
        ("pass/probe", "OUTER_NODE", function(Function::OuterNode)),
        ("pass/probe", "GLOBAL", function(Function::Global)),
        ("pass/probe", "LOCAL", function(Function::Local)),
        (
            "pass/probe",
            "DIRECT_LOCAL",
            function(Function::DirectLocal),
        ),
        ("pass/probe", "AVERAGE", function(Function::Average)),
        ("pass/probe", "HALF_CIRCLE", function(Function::HalfCircle)),
    ]
}

/// Constants that mean nothing to Rust: module, name, why.
const WGSL_ONLY: [(&str, &str, &str); 6] = [
    ("pass/listed_pixels", "NOTHING", "deeper than any hair"),
    (
        "lib/along_segments",
        "MANTISSA_BITS",
        "radiance is packed on the device alone",
    ),
    (
        "lib/along_segments",
        "EXPONENT_BIAS",
        "radiance is packed on the device alone",
    ),
    (
        "pass/preview",
        "FORWARD",
        "nothing but the draft on the device has it",
    ),
    ("pass/noise", "N_THREADS", "size of the workgroup"),
    (
        "pass/through_shares",
        "N_ROWS",
        "the CPU takes the kernel of a map once for all slots",
    ),
];

/// Constants that a shader has in parts: module, names in order, name of the whole in Rust.
const IN_PARTS: [(&str, &[&str], &str); 1] = [(
    "lib/half_circle",
    &["WHOLE_CIRCLE_FIRST", "WHOLE_CIRCLE_SECOND"],
    "WHOLE_CIRCLE_BASIS",
)];

/// Constants of a Rust file: every number of the value, in order. What is no number or array of
/// numbers is left out.
fn rust_constants(text: &str) -> BTreeMap<String, Vec<f64>> {
    let mut found = BTreeMap::new();
    let text = text.split("#[cfg(test)]").next().unwrap_or(text);
    for item in text.split("const ").skip(1) {
        let Some((head, rest)) = item.split_once(" = ") else {
            continue;
        };
        let Some((name, kind)) = head.split_once(": ") else {
            continue;
        };
        let is_name = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let Some((value, _)) = rest.split_once(';').filter(|_| is_name) else {
            continue;
        };
        // The semicolon of an array's type would end it too early.
        let value = if kind.contains('[') {
            rest.split("];\n").next().unwrap_or(value)
        } else {
            value
        };
        let number = |token: &str| {
            if token == "u32::MAX" {
                return Some(f64::from(u32::MAX));
            }
            token.replace('_', "").parse().ok()
        };
        let tokens = value
            .split([',', '[', ']', ' ', '\n'])
            .filter(|token| !token.is_empty());
        let values: Option<Vec<f64>> = tokens.map(number).collect();
        if let Some(values) = values.filter(|values| !values.is_empty()) {
            found.insert(name.to_owned(), values);
        }
    }
    found
}

/// Names of the constants that a shader module defines itself.
fn names(text: &str) -> Vec<&str> {
    text.lines()
        .filter_map(|line| line.strip_prefix("const ")?.split([':', ' ']).next())
        .collect()
}

/// Values of all constants of `module` with its imports, with and without every feature.
fn shader_constants(module: &str) -> BTreeMap<String, Vec<f64>> {
    let mut found = BTreeMap::new();
    for features in [
        &[][..],
        &["PAINTED", "PAINTED_WIDTHS", "PAINTED_SHIFTS", "PROXIES"],
        &["ELLIPTIC_TABLES"],
    ] {
        if ["pass/probe", "pass/bench"].contains(&module) && !features.is_empty() {
            continue;
        }
        let text = resolve_with(module, features).expect("it resolves");
        let parsed = naga::front::wgsl::parse_str(&text).expect("it is valid");
        for (_, constant) in parsed.constants.iter() {
            let mut values = Vec::new();
            flatten(&parsed, constant.init, &mut values);
            if let Some(name) = &constant.name {
                found.insert(name.clone(), values);
            }
        }
    }
    found
}

/// Appends the numbers of a constant expression in order.
fn flatten(module: &naga::Module, of: naga::Handle<naga::Expression>, values: &mut Vec<f64>) {
    use naga::{Expression, Literal};
    match &module.global_expressions[of] {
        Expression::Literal(Literal::F32(x)) => values.push(f64::from(*x)),
        Expression::Literal(Literal::AbstractFloat(x)) => values.push(*x),
        Expression::Literal(Literal::U32(x)) => values.push(f64::from(*x)),
        Expression::Literal(Literal::I32(x)) => values.push(f64::from(*x)),
        Expression::Literal(Literal::AbstractInt(x)) => values.push(*x as f64),
        Expression::Compose { components, .. } => {
            for component in components {
                flatten(module, *component, values);
            }
        }
        Expression::Constant(constant) => flatten(module, module.constants[*constant].init, values),
        other => panic!("{other:?} in a constant"),
    }
}

/// Whether both are the same numbers in single precision.
fn agree(shader: &[f64], rust: &[f64]) -> bool {
    shader.len() == rust.len() && shader.iter().zip(rust).all(|(a, b)| *a as f32 == *b as f32)
}

/// The Rust file with the twins of `module`'s constants.
fn twin_file(module: &str) -> String {
    let found = TWIN_FILES.iter().find(|(name, _)| *name == module);
    found.map_or_else(
        || format!("{CLOSED_FORM}/{}.rs", module.trim_start_matches("lib/")),
        |(_, file)| (*file).to_owned(),
    )
}

#[test]
fn every_constant_has_the_value_of_its_twin() {
    let elsewhere = values_elsewhere();
    let (mut checked, mut used) = (0, 0);
    for (module, text) in MODULES {
        let (names, values) = (names(text), shader_constants(module));
        for name in names {
            let here = |of: &str, it: &str| of == *module && it == name;
            let entries = usize::from(WGSL_ONLY.iter().any(|it| here(it.0, it.1)))
                + usize::from(elsewhere.iter().any(|it| here(it.0, it.1)))
                + usize::from(TWINS_ELSEWHERE.iter().any(|it| here(it.0, it.1)))
                + usize::from(
                    IN_PARTS
                        .iter()
                        .any(|it| it.0 == *module && it.1.contains(&name)),
                );
            assert!(entries <= 1, "{module}: {name} is listed twice");
            used += entries;
            let shader = &values[name];
            if WGSL_ONLY.iter().any(|it| here(it.0, it.1)) {
                continue;
            }
            checked += 1;
            if let Some((_, _, value)) = elsewhere.iter().find(|it| here(it.0, it.1)) {
                assert!(
                    agree(shader, value),
                    "{module}: {name} is {shader:?}, in Rust {value:?}"
                );
                continue;
            }
            let parts = IN_PARTS
                .iter()
                .find(|it| it.0 == *module && it.1.contains(&name));
            let (shader, twin) = match parts {
                Some((_, parts, whole)) => (
                    parts
                        .iter()
                        .flat_map(|&part| values[part].clone())
                        .collect(),
                    *whole,
                ),
                // In Rust the paper's scheme has a module of its own.
                None => (shader.clone(), name.strip_prefix("PAPER_").unwrap_or(name)),
            };
            let file = TWINS_ELSEWHERE.iter().find(|it| here(it.0, it.1));
            let file = file.map_or_else(|| twin_file(module), |it| it.2.to_owned());
            let rust = fs::read_to_string(project_root().join(&file));
            let rust = rust_constants(&rust.unwrap_or_else(|error| {
                panic!("{module}: {name} has its twin in {file}, {error}")
            }));
            let rust = rust.get(twin);
            let rust = rust.unwrap_or_else(|| panic!("{module}: {name} has no twin in {file}"));
            assert!(
                agree(&shader, rust),
                "{module}: {name} is {shader:?}, in {file} {rust:?}"
            );
        }
    }
    let listed = WGSL_ONLY.len() + elsewhere.len() + TWINS_ELSEWHERE.len();
    let parts: usize = IN_PARTS.iter().map(|it| it.1.len()).sum();
    assert_eq!(
        used,
        listed + parts,
        "a list names a constant that is not there"
    );
    assert!(checked >= 80, "only {checked} constants found");
    assert!(WGSL_ONLY.iter().all(|(_, _, why)| !why.is_empty()));
}

/// Passes leave room for the jitter by `MAX_JITTER` of `lib/ribbon`.
#[test]
fn no_pass_is_moved_further_than_the_shaders_leave_room_for() {
    let bound = shader_constants("lib/ribbon")["MAX_JITTER"][0];
    let moves = (0..10_000).flat_map(strandlight_scene::sampling::pass_jitter);
    let most = moves.map(|by| f64::from(by.abs())).fold(0.0, f64::max);
    assert!(most <= bound && most > 0.9 * bound, "{most} {bound}");
}

#[test]
fn a_different_constant_is_seen() {
    let text = "/// A const value = 7;\npub(crate) const C: f32 = 3.544_907_7;\nconst D: [[f32; 2]; 2] = [\n    \
                [1.0, -2e-3],\n    [3.0, 4.0],\n];\npub const E: u32 = u32::MAX;\nconst F: f32 = C + 1.0;\n";
    let found = rust_constants(text);
    assert_eq!(found["C"], [3.544_907_7]);
    assert_eq!(found["D"], [1.0, -2e-3, 3.0, 4.0]);
    assert_eq!(found["E"], [4_294_967_295.0]);
    assert!(!found.contains_key("F") && found.len() == 3, "{found:?}");
    assert_eq!(
        names("const A: f32 = 1.5;\n    const B = 2;\nconst C = vec2f(1.0);\n"),
        ["A", "C"]
    );
    assert!(agree(&[0.1], &[0.1_f32.into()]));
    assert!(
        !agree(&[0.002], &[2e-9]) && !agree(&[1.0, 2.0], &[1.0]) && !agree(&[1.0], &[1.0, 1.0])
    );
}
