//! Every shader module resolves and passes naga's validator, and its structs have the layout of
//! their mirrors in Rust. Needs no GPU.

use std::mem::{offset_of, size_of};
use std::path::Path;

use naga::valid::{Capabilities, ValidationFlags, Validator};
use strandlight_runtime::optics::ShadingUniform;
use strandlight_runtime::proxy::{ProxyRecord, ProxyRecords};
use strandlight_runtime::shaders::{MODULES, resolve_with};
use strandlight_scattering::closed_form::{
    DirectionInFrame, Fibre, LightInFrame, LobeDecode, PaintedAverages, PaintedDecode, PaintedHair,
    Reflectance, TableAxes, TableAxis,
};

/// The parsed and validated module.
fn module(name: &str) -> naga::Module {
    module_with(name, &[])
}

/// The same with `features`.
fn module_with(name: &str, features: &[&str]) -> naga::Module {
    let text = resolve_with(name, features).unwrap_or_else(|error| panic!("{name}: {error}"));
    let module = naga::front::wgsl::parse_str(&text)
        .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&text)));
    // unpack2x16float is part of WGSL; only adapters below WebGPU lack it.
    let capabilities = Capabilities::SHADER_FLOAT16_IN_FLOAT32;
    Validator::new(ValidationFlags::all(), capabilities)
        .validate(&module)
        .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&text)));
    module
}

#[test]
fn every_module_is_valid() {
    let mut n_checked = 0;
    for (name, _) in MODULES {
        module(name);
        n_checked += 1;
    }
    assert!(
        n_checked >= 10,
        "only {n_checked} shader modules were found"
    );
}

/// With each feature that a line asks for, and with all of them.
#[test]
fn every_feature_is_valid() {
    let lines = MODULES.iter().flat_map(|(_, text)| text.lines());
    let mut features: Vec<&str> = lines
        .filter_map(|line| line.trim().strip_prefix("// #if "))
        .map(str::trim)
        .collect();
    features.sort_unstable();
    features.dedup();
    // Probes ask for a fibre's averages by themselves and are never compiled for painted hair.
    let of_fibres = ["pass/probe", "pass/bench"];
    for (name, _) in MODULES.iter().filter(|(name, _)| !of_fibres.contains(name)) {
        for feature in &features {
            module_with(name, &[feature]);
        }
        module_with(name, &features);
    }
}

/// Shading of painted hair, whatever is painted; of unpainted hair nothing of it.
#[test]
fn painted_shading_is_valid_and_apart() {
    let bound = |module: &naga::Module| {
        let variables = module.global_variables.iter();
        let names = variables.filter(|(_, variable)| variable.binding.is_some());
        let names = names.map(|(_, variable)| variable.name.clone().unwrap_or_default());
        names.collect::<Vec<_>>()
    };
    for features in [
        &["PAINTED"][..],
        &["PAINTED", "PAINTED_WIDTHS"],
        &["PAINTED", "PAINTED_SHIFTS"],
        &["PAINTED", "PAINTED_WIDTHS", "PAINTED_SHIFTS"],
    ] {
        let painted = module_with("pass/shade", features);
        let names = bound(&painted);
        assert!(names.contains(&"paint".to_owned()) && names.contains(&"hair".to_owned()));
        assert!(!names.contains(&"forward".to_owned()), "{names:?}");
    }
    let plain = module("pass/shade");
    assert!(!bound(&plain).contains(&"paint".to_owned()));
    assert!(plain.functions.iter().all(|(_, function)| {
        let name = function.name.as_deref().unwrap_or_default();
        !name.contains("paint")
    }));
}

#[test]
fn modules_are_valid_with_their_features() {
    for name in ["pass/shadow_map", "pass/transmittance"] {
        let n_globals = |features: &[&str]| module_with(name, features).global_variables.len();
        assert_eq!(n_globals(&["PROXIES"]), n_globals(&[]) + 1, "{name}");
    }
}

#[test]
fn every_file_is_a_module() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders");
    let mut n_files = 0;
    for folder in ["lib", "lib/paper", "pass"] {
        let Ok(entries) = std::fs::read_dir(root.join(folder)) else {
            continue;
        };
        for entry in entries {
            let path = entry.unwrap().path();
            if path
                .extension()
                .is_some_and(|extension| extension == "wgsl")
            {
                let name = format!("{folder}/{}", path.file_stem().unwrap().to_str().unwrap());
                assert!(
                    MODULES.iter().any(|(module, _)| *module == name),
                    "{name} is not in the resolver's list"
                );
                n_files += 1;
            }
        }
    }
    assert_eq!(n_files, MODULES.len());
}

/// Library modules are pure: no bindings, no entry points.
#[test]
fn library_modules_bind_nothing() {
    for (name, _) in MODULES.iter().filter(|(name, _)| name.starts_with("lib/")) {
        let module = module(name);
        for (_, variable) in module.global_variables.iter() {
            let is_private = variable.space == naga::AddressSpace::Private;
            assert!(is_private && variable.binding.is_none(), "{name} binds");
        }
        assert!(module.entry_points.is_empty(), "{name} has an entry point");
    }
}

/// Members (name, offset) and size of a struct of `module`.
fn layout(module: &naga::Module, name: &str) -> (Vec<(String, u32)>, u32) {
    let (_, found) = module
        .types
        .iter()
        .find(|(_, item)| item.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("no struct {name}"));
    let naga::TypeInner::Struct { members, span } = &found.inner else {
        panic!("{name} is no struct");
    };
    let members = members
        .iter()
        .map(|member| (member.name.clone().unwrap_or_default(), member.offset))
        .collect();
    (members, *span)
}

macro_rules! same_layout {
    ($module:expr, $name:ident { $($field:ident),* }) => {
        same_layout!($module, stringify!($name), $name { $($field),* })
    };
    ($module:expr, $wgsl:expr, $name:ident { $($field:ident),* }) => {{
        let (members, size) = layout($module, $wgsl);
        let mirror = vec![$((stringify!($field).to_owned(), offset_of!($name, $field) as u32)),*];
        assert_eq!(members, mirror, "members of {}", stringify!($name));
        assert_eq!(size as usize, size_of::<$name>(), "size of {}", stringify!($name));
    }};
}

#[test]
fn structs_have_the_layout_of_their_mirrors() {
    let proxies = module("lib/proxy");
    same_layout!(
        &proxies,
        "Proxy",
        ProxyRecord {
            to_unit,
            from_unit,
            albedo,
            kind
        }
    );
    let size = size_of::<ProxyRecords>() as u32;
    assert_eq!(layout(&proxies, "Proxies").1, size);
    let module = module("lib/paper/single_scattering");
    same_layout!(
        &module,
        Fibre {
            sigma_a,
            eta,
            alpha,
            caustic_width,
            beta,
            segments,
            eta_mean,
            eta_swing,
            modes,
            nodes
        }
    );
    same_layout!(
        &module,
        DirectionInFrame {
            theta,
            cos_theta,
            cos_phi,
            sin_phi
        }
    );
    same_layout!(&module, LightInFrame { direction, lambda });
    let single = self::module("lib/single_scattering");
    same_layout!(
        &single,
        LobeDecode {
            warp,
            last,
            lambda_scale,
            amplitude_scale,
            first_row,
            eta_first,
            eta_scale,
            last_row
        }
    );
    same_layout!(
        &self::module("lib/painted_lobes"),
        PaintedDecode {
            warp,
            last,
            lambda_scale,
            amplitude_scale,
            last_layer,
            layer_scale,
            decay,
            padding
        }
    );
    same_layout!(
        &self::module("lib/painted_averages"),
        PaintedAverages {
            last_layer,
            layer_scale,
            last_width,
            last_shift,
            scale_first,
            scale_range,
            padding_0,
            padding_1
        }
    );
    same_layout!(
        &module_with("lib/paint", &["PAINTED"]),
        PaintedHair {
            fibre,
            reflectance,
            tt,
            trt,
            averages
        }
    );
    same_layout!(
        &single,
        "Shading",
        ShadingUniform {
            fibre,
            reflectance,
            tt,
            trt
        }
    );
    same_layout!(
        &single,
        Reflectance {
            coefficients,
            scale,
            padding_0,
            padding_1,
            padding_2
        }
    );
    same_layout!(
        &module,
        TableAxis {
            min,
            max,
            warp_min,
            scale,
            last,
            spacing,
            padding_0,
            padding_1
        }
    );
    same_layout!(
        &module,
        TableAxes {
            c_rows,
            c_columns,
            h_rows,
            h_columns,
            schlick,
            padding_0,
            padding_1,
            padding_2
        }
    );
}
