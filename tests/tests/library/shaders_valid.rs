//! Every shader module resolves and passes naga's validator, and its structs have the layout of
//! their mirrors in Rust. Needs no GPU.

use std::collections::BTreeSet;
use std::path::Path;

use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Handle, TypeInner};
use strandlight_scattering::layout::{Field, Layout};
use strandlight_shaders::{MODULES, resolve_with};

/// Probes ask for a fibre's averages by themselves and are never compiled for painted hair.
const OF_FIBRES: [&str; 2] = ["pass/probe", "pass/bench"];

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

/// The features that lines ask for.
fn features() -> Vec<&'static str> {
    let lines = MODULES.iter().flat_map(|(_, text)| text.lines());
    let mut features: Vec<&str> = lines
        .filter_map(|line| line.trim().strip_prefix("// #if "))
        .map(str::trim)
        .collect();
    features.sort_unstable();
    features.dedup();
    features
}

/// With each feature that a line asks for, and with all of them.
#[test]
fn every_feature_is_valid() {
    let features = features();
    assert!(features.len() >= 4, "only {features:?}");
    for (name, _) in MODULES.iter().filter(|(name, _)| !OF_FIBRES.contains(name)) {
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

/// Only shading that looks multiple scattering up binds tables, and then no averages.
#[test]
fn shading_by_tables_binds_what_it_reads() {
    let used = |features: &[&str]| {
        let module = module_with("pass/shade", features);
        let flags = ValidationFlags::all();
        let mut validator = Validator::new(flags, Capabilities::SHADER_FLOAT16_IN_FLOAT32);
        let info = validator.validate(&module).expect("it is valid");
        let bound = module.global_variables.iter().filter(|(handle, variable)| {
            variable.binding.is_some() && !info.get_entry_point(0)[*handle].is_empty()
        });
        let names = bound.map(|(_, variable)| variable.name.clone().unwrap_or_default());
        names.collect::<BTreeSet<_>>()
    };
    let [plain, tabled] = [used(&[]), used(&["TABLES"])];
    let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
    let of_tables: BTreeSet<String> = names(&["tables", "rows", "direct", "linear"]);
    assert_eq!(&tabled - &plain, of_tables);
    assert_eq!(&plain - &tabled, names(&["averages"]));
    let elliptic = used(&["TABLES", "ELLIPTIC_TABLES"]);
    assert_eq!(&elliptic - &tabled, names(&["elliptic"]));
}

#[test]
fn modules_are_valid_with_their_features() {
    for name in ["pass/shadow_map", "pass/transmittance"] {
        let n_globals = |features: &[&str]| module_with(name, features).global_variables.len();
        assert_eq!(n_globals(&["PROXIES"]), n_globals(&[]) + 1, "{name}");
        assert_eq!(n_globals(&["MESHES"]), n_globals(&[]) + 1, "{name}");
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
            use naga::AddressSpace::{Private, WorkGroup};
            let is_own = matches!(variable.space, Private | WorkGroup);
            assert!(is_own && variable.binding.is_none(), "{name} binds");
        }
        assert!(module.entry_points.is_empty(), "{name} has an entry point");
    }
}

/// Every struct in Rust that says that a struct of a shader mirrors it.
fn mirrors() -> Vec<Layout> {
    let [scattering, runtime] = [
        strandlight_scattering::closed_form::layouts(),
        strandlight_render::layouts(),
    ];
    assert!(scattering.len() >= 10 && runtime.len() >= 15);
    [scattering, runtime].concat()
}

/// Module `name` without features, with each feature that its lines or those of its imports ask
/// for, and with all of them.
fn variants(name: &str) -> Vec<naga::Module> {
    let features = if OF_FIBRES.contains(&name) {
        Vec::new()
    } else {
        features()
    };
    let mut variants = vec![module(name), module_with(name, &features)];
    variants.extend(features.iter().map(|feature| module_with(name, &[feature])));
    variants
}

/// What a type is made of, below arrays and vectors: the name of a struct or of a scalar as Rust
/// has it.
fn element(module: &naga::Module, of: Handle<naga::Type>) -> String {
    let scalar = match &module.types[of].inner {
        TypeInner::Array { base, .. } => return element(module, *base),
        TypeInner::Struct { .. } => {
            return module.types[of].name.clone().expect("structs have names");
        }
        TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => scalar,
        TypeInner::Vector { scalar, .. } | TypeInner::Matrix { scalar, .. } => scalar,
        other => panic!("{other:?} in a buffer"),
    };
    let kind = match scalar.kind {
        naga::ScalarKind::Float => "f",
        naga::ScalarKind::Sint => "i",
        naga::ScalarKind::Uint => "u",
        other => panic!("{other:?} in a buffer"),
    };
    format!("{kind}{}", 8 * scalar.width)
}

/// Names of all structs in uniform and storage buffers of `module`, those inside others too. Arrays
/// of scalars and vectors have no fields that could be taken for one another.
fn bound_structs(module: &naga::Module) -> BTreeSet<String> {
    let mut open: Vec<Handle<naga::Type>> = module
        .global_variables
        .iter()
        .filter(|(_, variable)| {
            matches!(
                variable.space,
                AddressSpace::Uniform | AddressSpace::Storage { .. }
            )
        })
        .map(|(_, variable)| variable.ty)
        .collect();
    let mut found = BTreeSet::new();
    while let Some(of) = open.pop() {
        match &module.types[of].inner {
            TypeInner::Array { base, .. } => open.push(*base),
            TypeInner::Struct { members, .. } => {
                found.insert(element(module, of));
                open.extend(members.iter().map(|member| member.ty));
            }
            _ => {}
        }
    }
    found
}

/// What is wrong with the mirror of struct `name` of `module`, if anything: none or several are
/// registered; or sizes, or names, order, offsets, sizes or elements of fields differ. Padding may
/// be cut otherwise: the size and all other offsets hold it.
fn fault(module: &naga::Module, name: &str, mirrors: &[Layout]) -> Option<String> {
    let named: Vec<&Layout> = mirrors.iter().filter(|it| it.wgsl == name).collect();
    let [mirror] = named[..] else {
        return Some(format!("{name} has {} mirrors in Rust", named.len()));
    };
    let (_, found) = module
        .types
        .iter()
        .find(|(_, item)| item.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("no struct {name}"));
    let TypeInner::Struct { members, span } = &found.inner else {
        panic!("{name} is no struct");
    };
    if *span as usize != mirror.size {
        return Some(format!("{name} has {span} bytes, in Rust {}", mirror.size));
    }
    let in_rust = |name: String| {
        let mirror = mirrors.iter().find(|mirror| mirror.wgsl == name);
        mirror.map_or(name, |mirror| mirror.name.to_owned())
    };
    let shader = members.iter().map(|member| {
        let size = module.types[member.ty].inner.size(module.to_ctx());
        let element = in_rust(element(module, member.ty));
        let name = member.name.clone().unwrap_or_default();
        (name, member.offset as usize, size as usize, element)
    });
    let shader: Vec<_> = shader.filter(|it| !it.0.starts_with("pad")).collect();
    let rust = mirror.fields.iter().filter(|field| !field.is_padding());
    let rust: Vec<_> = rust
        .map(|it| {
            (
                it.name.to_owned(),
                it.offset,
                it.size,
                it.element().to_owned(),
            )
        })
        .collect();
    (shader != rust).then(|| format!("{name}: {shader:?}, in Rust {rust:?}"))
}

/// The list of mirrors need not be kept: what a shader binds and no one registered fails here.
#[test]
fn every_struct_in_a_buffer_has_the_layout_of_its_mirror() {
    let mirrors = mirrors();
    let mut held = BTreeSet::new();
    for (name, _) in MODULES.iter().filter(|(name, _)| name.starts_with("pass/")) {
        for module in variants(name) {
            for bound in bound_structs(&module) {
                assert_eq!(fault(&module, &bound, &mirrors), None, "{name}");
                held.insert(bound);
            }
        }
    }
    assert!(held.len() >= 20, "only {} structs found", held.len());
    for mirror in &mirrors {
        assert!(
            held.contains(mirror.wgsl),
            "no shader binds {}, the mirror of {}",
            mirror.wgsl,
            mirror.name
        );
        let text = MODULES.iter().find(|(name, _)| *name == mirror.module);
        let head = format!("struct {} {{", mirror.wgsl);
        assert!(
            text.is_some_and(|(_, text)| text.contains(&head)),
            "{} does not define {}",
            mirror.module,
            mirror.wgsl
        );
    }
}

#[test]
fn a_wrong_or_missing_mirror_is_found() {
    let mirrors = mirrors();
    let shade = module("pass/shade");
    let at = mirrors.iter().position(|mirror| mirror.wgsl == "Grid");
    let at = at.expect("a mirror of Grid");
    let grid = mirrors[at];
    assert_eq!(fault(&shade, "Grid", &mirrors), None);
    let seen = |wrong: Layout| {
        let mut mirrors = mirrors.clone();
        mirrors[at] = wrong;
        fault(&shade, "Grid", &mirrors).is_some()
    };
    let with = |change: &dyn Fn(&mut Vec<Field>)| {
        let mut fields = grid.fields.to_vec();
        change(&mut fields);
        let fields = fields.leak();
        seen(Layout { fields, ..grid })
    };
    assert!(!with(&|_| ()));
    assert!(with(&|fields| fields[1].name = "side"));
    assert!(with(&|fields| fields[1].offset = 16));
    assert!(with(&|fields| fields[1].size = 12));
    assert!(with(&|fields| fields.swap(4, 5)));
    assert!(with(&|fields| {
        fields.remove(3);
    }));
    // A float for the number of segments.
    assert!(with(&|fields| {
        let mut float = fields[1];
        (float.name, float.offset) = (fields[3].name, fields[3].offset);
        fields[3] = float;
    }));
    assert!(!with(&|fields| {
        fields.pop();
    }));
    assert!(seen(Layout {
        size: grid.size + 16,
        ..grid
    }));
    assert!(seen(Layout {
        wgsl: "Lattice",
        ..grid
    }));
    let twice = [mirrors.clone(), vec![grid]].concat();
    assert!(fault(&shade, "Grid", &twice).is_some_and(|fault| fault.contains("2 mirrors")));
}
