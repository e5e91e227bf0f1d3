//! What Strandlight ships beside its code: baked tables, presets of hair and a sample scene.
//!
//! A program holds only what it names: data that is not used is left out by the linker.
//!
//! ```
//! let blond = strandlight_data::PRESETS.iter().find(|(name, _)| *name == "blond");
//! assert!(blond.is_some_and(|(_, toml)| toml.contains("sigma_a")));
//! ```

/// The default tables as a `.tables` file: dielectric Fresnel term, the ranges of Xu 2011.
pub const DEFAULT_TABLES: &[u8] = include_bytes!("default.tables");

/// The part of [`DEFAULT_TABLES`] that rendering reads, as a `.tables` file.
pub const LEAN_TABLES: &[u8] = include_bytes!("lean.tables");

/// Presets of hair, sorted by name: the name and `[hair]` of a scene as TOML, whose comments give the
/// source of each number.
pub const PRESETS: &[(&str, &str)] = &[
    ("auburn", include_str!("presets/auburn.toml")),
    ("black", include_str!("presets/black.toml")),
    ("blond", include_str!("presets/blond.toml")),
    ("brown", include_str!("presets/brown.toml")),
    ("red", include_str!("presets/red.toml")),
    ("white", include_str!("presets/white.toml")),
    ("xu-fig10-a", include_str!("presets/xu-fig10-a.toml")),
    ("xu-fig10-b", include_str!("presets/xu-fig10-b.toml")),
    ("xu-fig10-c", include_str!("presets/xu-fig10-c.toml")),
    ("xu-fig10-d", include_str!("presets/xu-fig10-d.toml")),
    ("xu-fig10-e", include_str!("presets/xu-fig10-e.toml")),
    ("xu-fig7-a", include_str!("presets/xu-fig7-a.toml")),
    ("xu-fig7-b", include_str!("presets/xu-fig7-b.toml")),
    ("xu-fig7-c", include_str!("presets/xu-fig7-c.toml")),
    ("xu-fig8-a", include_str!("presets/xu-fig8-a.toml")),
    ("xu-fig8-b", include_str!("presets/xu-fig8-b.toml")),
    ("xu-fig9-a", include_str!("presets/xu-fig9-a.toml")),
    ("xu-fig9-b", include_str!("presets/xu-fig9-b.toml")),
    ("xu-fig9-c", include_str!("presets/xu-fig9-c.toml")),
    (
        "zinke-fig8-blond",
        include_str!("presets/zinke-fig8-blond.toml"),
    ),
    (
        "zinke-fig8-brown",
        include_str!("presets/zinke-fig8-brown.toml"),
    ),
    (
        "zinke-fig8-light-blond",
        include_str!("presets/zinke-fig8-light-blond.toml"),
    ),
    (
        "zinke-fig8-red",
        include_str!("presets/zinke-fig8-red.toml"),
    ),
    (
        "zinke-fig9-medium",
        include_str!("presets/zinke-fig9-medium.toml"),
    ),
    (
        "zinke-fig9-narrow",
        include_str!("presets/zinke-fig9-narrow.toml"),
    ),
    (
        "zinke-fig9-wide",
        include_str!("presets/zinke-fig9-wide.toml"),
    ),
];

/// The sample scene, `scene.toml`, which names a groom and a light set beside it.
pub const SAMPLE_SCENE: &str = include_str!("sample/scene.toml");

/// The environment map of the sample scene, lat-long OpenEXR.
pub const SAMPLE_MAP: &[u8] = include_bytes!("sample/studio.exr");

/// What `strandlight` makes the groom of the sample scene by, `@` standing for the folder.
pub const SAMPLE_GROOM: &str =
    "groom generate --style layered --strands 12000 --points-per-strand 40 -o @layered.groom";

/// The same for the mesh of its head and shoulders.
pub const SAMPLE_MESH: &str = "mesh generate -o @bust.mesh";

/// Lights that `strandlight lights` fits to [`SAMPLE_MAP`], as a `.lights` file.
pub const SAMPLE_LIGHTS: &[u8] = include_bytes!("sample/studio.lights");

/// A script that paints the sample scene, JSON.
pub const SAMPLE_SCRIPT: &str = include_str!("sample/painted.json");
