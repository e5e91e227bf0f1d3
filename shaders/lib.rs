//! The WGSL of Strandlight and the resolver of its imports.
//!
//! - [`MODULES`]: the text of every module, by name.
//! - [`resolve_with`]: a module with all that it imports, for a set of features.
//!
//! ```
//! let text = strandlight_shaders::resolve_with("pass/shade", &["PROXIES"])?;
//! assert!(text.contains("fn shade("));
//! # Ok::<(), strandlight_shaders::ShaderError>(())
//! ```
//!
//! A module asks for another with a line of its own, `// #import lib/special`. Each module is
//! inserted once, before the first module that asks for it. Every file under `shaders/` is
//! compiled into the program.
//!
//! Lines between `// #if NAME` and `// #endif` are there where the feature NAME is asked for; those
//! after an `// #else` where it is not. A pipeline without the feature neither compiles nor binds
//! what stands between them. They do not nest.

/// Why a module could not be put together.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ShaderError {
    /// The module is not among [`MODULES`].
    #[error("shader module '{module}', asked for by '{importer}', does not exist")]
    Unknown {
        /// The missing module.
        module: String,
        /// The module with the import line, or `(root)`.
        importer: String,
    },
    /// A module imports itself, directly or not.
    #[error("shader modules import each other in a circle: {0}")]
    Cycle(String),
}

macro_rules! modules {
    ($($name:literal),* $(,)?) => {
        /// Every shader module: its name (path under `shaders/` without `.wgsl`) and its text.
        pub const MODULES: &[(&str, &str)] = &[
            $(($name, include_str!(concat!($name, ".wgsl")))),*
        ];
    };
}

modules!(
    "lib/along_segments",
    "lib/averages",
    "lib/azimuthal",
    "lib/azimuthal_r",
    "lib/bounce",
    "lib/circular_gaussian",
    "lib/constants",
    "lib/coverage",
    "lib/eccentric",
    "lib/fibre",
    "lib/fisher",
    "lib/frame",
    "lib/global_scattering",
    "lib/grid",
    "lib/group_sums",
    "lib/hair_layers",
    "lib/half_circle",
    "lib/irradiance",
    "lib/light",
    "lib/lut",
    "lib/lobes",
    "lib/local_scattering",
    "lib/longitudinal",
    "lib/mean_cosine",
    "lib/multiple_scattering",
    "lib/multiple_tables",
    "lib/panorama",
    "lib/paper/azimuthal",
    "lib/paper/fresnel",
    "lib/outer_integral",
    "lib/paint",
    "lib/painted_averages",
    "lib/painted_lobes",
    "lib/paper/outer_integral",
    "lib/paper/single_scattering",
    "lib/piece",
    "lib/pieces",
    "lib/proxy",
    "lib/ribbon",
    "lib/sampling",
    "lib/screen_point",
    "lib/single_scattering",
    "lib/special",
    "lib/surface_light",
    "lib/tables",
    "lib/through",
    "lib/tone",
    "lib/transmittance",
    "lib/view",
    "lib/visible_list",
    "lib/width_profile",
    "lib/wind",
    "pass/accumulate",
    "pass/bench",
    "pass/bounce",
    "pass/composite",
    "pass/deform",
    "pass/display",
    "pass/listed_picture",
    "pass/listed_pixels",
    "pass/listed_triangles",
    "pass/meshes",
    "pass/multiple_tables",
    "pass/noise",
    "pass/pieces",
    "pass/preview",
    "pass/probe",
    "pass/probe_multiple",
    "pass/probe_paint",
    "pass/probe_painted",
    "pass/project",
    "pass/proxies",
    "pass/proxy_light",
    "pass/ribbons",
    "pass/shade",
    "pass/slices",
    "pass/strands",
    "pass/shadow_map",
    "pass/through_shares",
    "pass/transmittance",
    "pass/visibility",
    "pass/voxelise",
);

/// The text of `module` with all it imports, each once, in dependency order, without any feature.
///
/// # Errors
/// A module that is not there, or imports itself.
pub fn resolve(module: &str) -> Result<String, ShaderError> {
    resolve_with(module, &[])
}

/// [`resolve`] with `features`.
///
/// # Errors
/// As [`resolve`].
pub fn resolve_with(module: &str, features: &[&str]) -> Result<String, ShaderError> {
    resolve_among(MODULES, module, features)
}

/// As [`resolve_with`], among the given modules.
///
/// # Errors
/// As [`resolve`].
pub fn resolve_among(
    modules: &[(&str, &str)],
    module: &str,
    features: &[&str],
) -> Result<String, ShaderError> {
    let chosen: Vec<(&str, String)> = modules
        .iter()
        .map(|(name, source)| (*name, choose(source, features)))
        .collect();
    let chosen: Vec<(&str, &str)> = chosen
        .iter()
        .map(|(name, source)| (*name, source.as_str()))
        .collect();
    let mut text = String::new();
    let mut done = Vec::new();
    let mut open = Vec::new();
    insert(&chosen, module, &mut done, &mut open, &mut text)?;
    Ok(text)
}

/// The lines of `source` that are there with `features`.
fn choose(source: &str, features: &[&str]) -> String {
    let mut text = String::with_capacity(source.len());
    let mut is_there = true;
    for line in source.lines() {
        match directive(line) {
            Some(("if", name)) => is_there = features.contains(&name),
            Some(("else", _)) => is_there = !is_there,
            Some(("endif", _)) => is_there = true,
            _ if is_there => {
                text.push_str(line);
                text.push('\n');
            }
            _ => {}
        }
    }
    text
}

/// The word after `// #` and what follows it.
fn directive(line: &str) -> Option<(&str, &str)> {
    let rest = line.trim().strip_prefix("//")?.trim_start();
    let rest = rest.strip_prefix('#')?;
    Some(match rest.split_once(' ') {
        Some((word, name)) => (word, name.trim()),
        None => (rest, ""),
    })
}

/// The module an import line names.
fn import_of(line: &str) -> Option<&str> {
    match directive(line)? {
        ("import", name) => Some(name),
        _ => None,
    }
}

/// Appends `module` after what it imports. `open` is the chain of modules being inserted; its
/// length is bounded by the number of modules, since a repeated name is a cycle.
fn insert(
    modules: &[(&str, &str)],
    module: &str,
    done: &mut Vec<String>,
    open: &mut Vec<String>,
    text: &mut String,
) -> Result<(), ShaderError> {
    if done.iter().any(|name| name == module) {
        return Ok(());
    }
    if open.iter().any(|name| name == module) {
        let chain = open.iter().map(String::as_str).chain([module]);
        return Err(ShaderError::Cycle(chain.collect::<Vec<_>>().join(" -> ")));
    }
    let Some((_, source)) = modules.iter().find(|(name, _)| *name == module) else {
        return Err(ShaderError::Unknown {
            module: module.to_owned(),
            importer: open.last().map_or("(root)", String::as_str).to_owned(),
        });
    };
    open.push(module.to_owned());
    for import in source.lines().filter_map(import_of) {
        insert(modules, import, done, open, text)?;
    }
    open.pop();
    text.push_str(source);
    if !source.ends_with('\n') {
        text.push('\n');
    }
    done.push(module.to_owned());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &[(&str, &str)] = &[
        ("a", "// #import b\n// #import c\nA"),
        ("b", "// #import c\nB\n"),
        ("c", "C\n"),
        ("self", "// #import self\n"),
        ("x", "// #import y\n"),
        ("y", "// #import x\n"),
        ("lost", "//   #import nowhere\n"),
        (
            "both",
            "// #if RED\n// #import a\nred\n// #else\ngrey\n// #endif\nend\n",
        ),
    ];

    #[test]
    fn each_module_comes_once_and_before_its_users() {
        let text = resolve_among(SMALL, "a", &[]).unwrap();
        let code: Vec<_> = text
            .lines()
            .filter(|line| !line.starts_with("//"))
            .collect();
        assert_eq!(code, ["C", "B", "A"]);
    }

    #[test]
    fn features_choose_lines() {
        let code = |features: &[&str]| resolve_among(SMALL, "both", features).unwrap();
        assert_eq!(code(&[]), "grey\nend\n");
        assert!(code(&["RED"]).ends_with("A\n// #import a\nred\nend\n"));
    }

    #[test]
    fn faults_are_typed() {
        assert_eq!(
            resolve_among(SMALL, "x", &[]),
            Err(ShaderError::Cycle("x -> y -> x".to_owned()))
        );
        assert!(matches!(
            resolve_among(SMALL, "self", &[]),
            Err(ShaderError::Cycle(_))
        ));
        assert_eq!(
            resolve_among(SMALL, "lost", &[]),
            Err(ShaderError::Unknown {
                module: "nowhere".to_owned(),
                importer: "lost".to_owned()
            })
        );
        assert!(matches!(
            resolve("pass/none"),
            Err(ShaderError::Unknown { .. })
        ));
    }
}
