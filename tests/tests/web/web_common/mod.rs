//! A page with a small scene, a web server and a browser to look at it.

pub mod browser;
pub mod picture;
pub mod server;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use strandlight_formats::{
    Background, BakedFile, CameraSection, Groom, LightSet, ProxySection, Scene,
};
use strandlight_tests::project_root;

use strandlight_tests::render_common::{lights, wig};
use strandlight_tests::scenes::ellipsoid;

/// The scene of the page.
pub const SCENE: &str = "small.toml";

/// Writes a scene of some hundred strands around a mesh, with a background that no hair has.
pub fn scene_in(folder: &Path) -> PathBuf {
    let (points, strand_offsets) = wig(200, 12);
    let groom = Groom {
        points,
        strand_offsets,
        ..Groom::default()
    };
    // Beside the scene and elsewhere: the page has them all in one folder.
    std::fs::create_dir(folder.join("light")).expect("a new folder");
    groom.write(&folder.join("a wig.groom")).expect("written");
    let lights = LightSet {
        lights: lights(),
        ..LightSet::default()
    };
    lights
        .write(&folder.join("light/five.lights"))
        .expect("written");
    let head = ellipsoid([5.0, 6.0, 5.0], 12);
    head.write(&folder.join("head.mesh")).expect("written");
    let mut scene = Scene::new("a wig.groom", "light/five.lights");
    scene.proxies = vec![ProxySection::mesh("head.mesh")];
    scene.hair.diameter_cm = Some(0.06);
    scene.camera = Some(CameraSection {
        position: [10.0, 6.0, 52.0],
        target: [0.0, -1.0, 0.0],
        up: [0.0, 1.0, 0.0],
        fov_deg: 40.0,
    });
    scene.render.shadow_maps = 8;
    scene.render.background = Background::Color([0.02, 0.05, 0.3]);
    let path = folder.join(SCENE);
    let text = scene.to_toml_string().expect("a valid scene");
    std::fs::write(&path, text).expect("written");
    path
}

/// The folder that `web/build` makes of [`scene_in`]; built once for all tests of a program.
pub fn page() -> &'static Path {
    static PAGE: OnceLock<PathBuf> = OnceLock::new();
    PAGE.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("web-page");
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(folder.join("scene")).expect("a new folder");
        let scene = scene_in(&folder.join("scene"));
        let out = folder.join("page");
        build(&scene, &out).expect("web/build makes the page");
        out
    })
}

/// The folder that `web/package` makes; made once for all tests of a program.
pub fn package() -> &'static Path {
    static PACKAGE: OnceLock<PathBuf> = OnceLock::new();
    PACKAGE.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("strand-view");
        let _ = std::fs::remove_dir_all(&folder);
        run("web/package", &[&folder]).expect("web/package makes the package");
        folder
    })
}

/// The folder in `folder` that `web/build --threads` makes of the scene that `STRANDLIGHT_SCENE` names, or of [`scene_in`].
pub fn page_with_threads(folder: &Path) -> PathBuf {
    let scene = std::env::var_os("STRANDLIGHT_SCENE").map_or_else(
        || {
            std::fs::create_dir_all(folder.join("scene")).expect("a new folder");
            scene_in(&folder.join("scene"))
        },
        PathBuf::from,
    );
    let out = folder.join("page");
    run("web/build", &[Path::new("--threads"), &scene, &out]).expect("web/build makes the page");
    out
}

/// Runs `web/build`; its words where it fails.
pub fn build(scene: &Path, out: &Path) -> Result<String, String> {
    run("web/build", &[scene, out])
}

/// Runs a command of the project; its words where it fails.
pub fn run(command: &str, arguments: &[&Path]) -> Result<String, String> {
    let output = Command::new(project_root().join(command))
        .args(arguments)
        .output()
        .map_err(|error| error.to_string())?;
    let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    match output.status.success() {
        true => Ok(words(&output.stdout)),
        false => Err(words(&output.stderr)),
    }
}
