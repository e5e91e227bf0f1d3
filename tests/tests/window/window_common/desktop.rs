//! What windows are opened on and with.

use std::io::{BufRead, BufReader};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, OnceLock, PoisonError};

use strandlight_tests::{assert_done, project_root, strandlight};

/// An X server without a screen to look at.
pub struct Desktop {
    server: Child,
    pub(super) display: String,
    /// Of the runtime files that windows want.
    folder: tempfile::TempDir,
}

/// Servers start and end one after the other: of two at once one may take away the socket of the other.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

impl Desktop {
    pub fn start() -> Desktop {
        let _turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1600x1000x24"])
            // Between two windows it would start anew, and refuse one that opens meanwhile.
            .args(["-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("window tests need Xvfb, xdotool and ImageMagick (Debian: xvfb xdotool imagemagick)");
        let mut number = String::new();
        let stdout = server.stdout.take().expect("it is piped");
        BufReader::new(stdout)
            .read_line(&mut number)
            .expect("Xvfb names its display");
        let number = number.trim();
        assert!(!number.is_empty(), "Xvfb did not start");
        UnixStream::connect(format!("/tmp/.X11-unix/X{number}")).expect("Xvfb listens");
        Desktop {
            server,
            display: format!(":{number}"),
            folder: tempfile::tempdir().expect("a folder"),
        }
    }

    /// A file that the program keeps from one start to the next.
    pub fn state(&self, name: &str) -> String {
        let path = self.folder.path().join("state/strandlight").join(name);
        std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// `command` with this display and no other.
    pub fn on(&self, mut command: Command) -> Command {
        command
            .env("DISPLAY", &self.display)
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            // Nor a desktop with dialogs of its own.
            .env_remove("DBUS_SESSION_BUS_ADDRESS")
            .env("XDG_RUNTIME_DIR", self.folder.path())
            // What is remembered is the test's own.
            .env("XDG_STATE_HOME", self.folder.path().join("state"))
            .env("XDG_CONFIG_HOME", self.folder.path().join("config"))
            .env("XDG_CACHE_HOME", self.folder.path().join("cache"))
            // Shaders that a software driver compiled are not: they take seconds, most of a test.
            .env("MESA_SHADER_CACHE_DIR", shader_cache())
            .env("WINIT_X11_SCALE_FACTOR", "1");
        command
    }
}

impl Drop for Desktop {
    fn drop(&mut self) {
        let _turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Where Mesa's drivers keep compiled shaders for all windows.
fn shader_cache() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("shader-cache")
}

/// A scene of some hundred strands under eight lights, in a folder of its own.
pub struct SmallScene {
    pub folder: tempfile::TempDir,
    pub path: PathBuf,
}

impl SmallScene {
    pub fn new() -> SmallScene {
        // Made once for all tests of the program.
        static MADE: OnceLock<[Vec<u8>; 2]> = OnceLock::new();
        let [groom, lights] = MADE.get_or_init(Self::make);
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let path = at("small.toml");
        for (file, bytes) in [
            (at("small.groom"), &groom[..]),
            (at("small.lights"), &lights[..]),
            (path.clone(), Self::text("").as_bytes()),
        ] {
            std::fs::write(file, bytes).expect("it can be written");
        }
        SmallScene { folder, path }
    }

    /// The bytes of its groom and of its lights.
    fn make() -> [Vec<u8>; 2] {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let mut groom = strandlight();
        groom.args(["groom", "generate", "--style", "wavy", "--strands", "300"]);
        groom.args(["--points-per-strand", "8", "-o"]);
        assert_done(groom.arg(at("small.groom")));
        let map = project_root().join("data/sample/studio.exr");
        let mut lights = strandlight();
        lights.arg("lights").arg(map).args(["--count", "8", "-o"]);
        assert_done(lights.arg(at("small.lights")));
        ["small.groom", "small.lights"].map(|name| std::fs::read(at(name)).expect("it is there"))
    }

    /// The scene's file with more keys in `[hair]`.
    pub fn text(hair: &str) -> String {
        format!(
            "version = 1\n[groom]\nfile = 'small.groom'\n[lights]\nfile = 'small.lights'\n\
             [hair]\npreset = 'blond'\n{hair}\n\
             [render]\nsize = [400, 300]\nsamples = 8\nshadow_maps = 4\nexposure = 1.0\n"
        )
    }

    /// What the file holds now.
    pub fn read(&self) -> strandlight_formats::Scene {
        strandlight_formats::Scene::read(&self.path).expect("a scene")
    }
}
