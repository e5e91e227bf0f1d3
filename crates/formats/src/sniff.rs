//! What a file is, by its first bytes: so that a file in the wrong place is called by its name.

use FileKind::{Foreign, Map, Picture};

use crate::container::{Kind, MAGIC};
pub use crate::groom_format::SNIFF_BYTES;
use crate::groom_format::{FormatInfo, Sniff};
use crate::groom_formats::{extension_list, sniff_groom};

/// What a file seems to be.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FileKind {
    /// Nothing in it.
    Empty,
    /// One of our binary files.
    Ours(Kind),
    /// One of our binary files, of a kind that this program does not know.
    OursUnknown,
    /// A scene: TOML with a section or key of ours.
    Scene,
    /// Hair in a format that is imported: see [`GROOM_FORMATS`](crate::GROOM_FORMATS).
    Hair(&'static FormatInfo),
    /// Curves, meshes or whole scenes of another program.
    Foreign(&'static str),
    /// A LUT, as a `.cube` file.
    Cube,
    /// An OpenEXR or Radiance picture.
    Map(&'static str),
    /// A picture that no light can be taken from.
    Picture(&'static str),
    /// Text of no known form.
    Text,
    /// Bytes of no known form.
    Unknown,
}

/// A `.npz` file.
const NUMPY_ARCHIVE: &str = "a NumPy archive (.npz)";

/// First bytes, as they are, and what starts so.
const SIGNATURES: [(&[u8], FileKind); 22] = [
    (b"Ogawa", Foreign("an Alembic archive (Ogawa), unfinished")),
    (
        b"\x89HDF\r\n\x1a\n",
        Foreign("an HDF5 file, as old Alembic archives are"),
    ),
    // Not a USD package (.usdz), of which the format itself knows.
    (b"PK\x03\x04", Foreign("a zip archive")),
    (b"glTF", Foreign("a glTF file (binary)")),
    (b"ply\n", Foreign("a PLY mesh")),
    (b"ply\r", Foreign("a PLY mesh")),
    (b"\x7fNSJ", Foreign("a Houdini geometry (.bgeo)")),
    (b"Bgeo", Foreign("a Houdini geometry (old .bgeo)")),
    (b"scf1", Foreign("a Houdini geometry (.bgeo.sc)")),
    (b"PGEOMETRY", Foreign("a Houdini geometry (old .geo)")),
    (b"Kaydara FBX Binary", Foreign("an FBX file")),
    (b"; FBX ", Foreign("an FBX file (text)")),
    (b"BLENDER", Foreign("a Blender file")),
    (b"//Maya ASCII", Foreign("a Maya scene")),
    (b"FOR4", Foreign("a Maya scene or cache (binary)")),
    (b"FOR8", Foreign("a Maya scene or cache (binary)")),
    (b"<?xml", Foreign("an XML file")),
    (b"\xef\xbb\xbf<?xml", Foreign("an XML file")),
    (b"\x76\x2f\x31\x01", Map("an OpenEXR picture")),
    (b"#?", Map("a Radiance .hdr picture")),
    (b"\x89PNG\r\n\x1a\n", Picture("a PNG picture")),
    (b"\xff\xd8\xff", Picture("a JPEG picture")),
];

impl FileKind {
    /// What a file is that starts with `start`: its first [`SNIFF_BYTES`], or all of it. Never
    /// fails and reads no more than that.
    pub fn of(start: &[u8]) -> FileKind {
        let start = &start[..start.len().min(SNIFF_BYTES)];
        if start.is_empty() {
            return FileKind::Empty;
        }
        if start.starts_with(&MAGIC) {
            return Kind::from_signature(start).map_or(FileKind::OursUnknown, FileKind::Ours);
        }
        if let Some(format) = sniff_groom(start, Sniff::Sure) {
            return FileKind::Hair(format.info());
        }
        if is_npz(start) {
            return Foreign(NUMPY_ARCHIVE);
        }
        if let Some((_, kind)) = SIGNATURES
            .iter()
            .find(|(signature, _)| start.starts_with(signature))
        {
            return *kind;
        }
        if is_tressfx_settings(start) {
            return Foreign("a TressFX settings file");
        }
        match FileKind::unsigned_kind(start) {
            FileKind::Text | FileKind::Unknown => {
                let format = sniff_groom(start, Sniff::Likely);
                format.map_or_else(
                    || FileKind::unsigned_kind(start),
                    |format| FileKind::Hair(format.info()),
                )
            }
            known => known,
        }
    }

    /// What a file without a signature is.
    fn unsigned_kind(start: &[u8]) -> FileKind {
        // The cut may run through a letter of several bytes.
        let text = match std::str::from_utf8(start) {
            Ok(text) => text,
            Err(error) if error.error_len().is_none() && error.valid_up_to() > 0 => {
                std::str::from_utf8(&start[..error.valid_up_to()]).unwrap_or_default()
            }
            Err(_) => return FileKind::Unknown,
        };
        let is_text = |c: char| !c.is_control() || c.is_ascii_whitespace();
        if text.chars().all(is_text) {
            text_kind(text)
        } else {
            FileKind::Unknown
        }
    }

    /// The file in words, with its article.
    pub const fn name(self) -> &'static str {
        match self {
            FileKind::Empty => "empty",
            FileKind::Ours(Kind::Tables) => "a tables file",
            FileKind::Ours(Kind::Lights) => "a light set",
            FileKind::Ours(Kind::Groom) => "a groom",
            FileKind::Ours(Kind::Mesh) => "a mesh",
            FileKind::Ours(Kind::Panorama) => "a panorama",
            FileKind::OursUnknown => "a file of a kind unknown to this program",
            FileKind::Scene => "a scene",
            FileKind::Hair(format) => format.title,
            FileKind::Cube => "a LUT (.cube)",
            Foreign(name) | Map(name) | Picture(name) => name,
            FileKind::Text => "some other text",
            FileKind::Unknown => "of an unknown format",
        }
    }

    /// What can be done with such a file; empty where nothing is known.
    fn advice(self) -> String {
        let advice = match self {
            FileKind::Ours(Kind::Tables) => "a scene names it as tables.file",
            FileKind::Ours(Kind::Lights) => "a scene names it as lights.file",
            FileKind::Ours(Kind::Groom) => "a scene names it as groom.file",
            FileKind::Ours(Kind::Mesh) => "a scene names it in a [[proxy]] of kind mesh",
            FileKind::Ours(Kind::Panorama) => "a scene names it as lights.panorama",
            FileKind::OursUnknown => "a newer version may read it",
            FileKind::Scene => "`strandlight render` draws it",
            FileKind::Cube => "a scene names it as render.lut",
            FileKind::Hair(_) => "`strandlight groom import` makes a groom of it",
            Foreign("an OBJ file" | "a glTF file (binary)" | "a glTF file (JSON)") => {
                "`strandlight mesh import` makes a mesh of it for a [[proxy]]"
            }
            Foreign("a JSON file") => "`strandlight lights import` reads a light set as JSON",
            Foreign(NUMPY_ARCHIVE) => "save its array of strands alone, as .npy",
            Foreign(_) => {
                let list = extension_list(|format| format.can.reads);
                let what = "hair is imported from";
                return format!("{what} {list} files only: export its curves as one of these");
            }
            Map(_) => "`strandlight lights` makes a light set of an environment map",
            Picture(_) => "environment maps are OpenEXR or Radiance .hdr",
            FileKind::Empty | FileKind::Text | FileKind::Unknown => "",
        };
        advice.to_owned()
    }

    /// Name and advice: `it is a groom; a scene names it as groom.file`.
    pub fn describe(self) -> String {
        match (self.name(), &*self.advice()) {
            (name, "") => format!("it is {name}"),
            (name, advice) => format!("it is {name}; {advice}"),
        }
    }

    /// Is it known to be something else than text or bytes of no known form?
    pub const fn is_known(self) -> bool {
        !matches!(self, FileKind::Text | FileKind::Unknown)
    }
}

/// Is it a zip archive whose first file is a NumPy array?
fn is_npz(start: &[u8]) -> bool {
    let name_length = start
        .get(26..28)
        .map(|word| u16::from_le_bytes([word[0], word[1]]));
    let name = name_length.and_then(|length| start.get(30..30 + usize::from(length)));
    start.starts_with(b"PK\x03\x04") && name.is_some_and(|name| name.ends_with(b".npy"))
}

/// TressFX's settings (`.tfxproj`, `.tfxsim`) start as its text does, but have no strands.
fn is_tressfx_settings(start: &[u8]) -> bool {
    let version = start.strip_prefix(b"version ");
    version.is_some_and(|rest| rest.first().is_some_and(u8::is_ascii_digit))
}

fn text_kind(text: &str) -> FileKind {
    let trimmed = text.trim_start_matches('\u{feff}').trim_start();
    if trimmed.starts_with('{') {
        return match trimmed.contains("\"asset\"") {
            true => Foreign("a glTF file (JSON)"),
            false => Foreign("a JSON file"),
        };
    }
    let list = trimmed.strip_prefix('[').map(str::trim_start);
    if list.is_some_and(|list| list.starts_with("\"fileversion\"")) {
        return Foreign("a Houdini geometry (.geo)");
    }
    let lines = || {
        text.lines()
            .map(str::trim)
            .filter(|line| !line.is_empty() && !line.starts_with('#'))
    };
    // Prose may show a scene in a block of code.
    let is_markdown = lines().any(|line| line.starts_with("```"));
    if !is_markdown && lines().any(is_line_of_a_scene) {
        return FileKind::Scene;
    }
    if lines().any(is_size_of_cube) {
        return FileKind::Cube;
    }
    if lines().next().is_some() && lines().any(is_vertex) && lines().take(8).all(is_line_of_obj) {
        return Foreign("an OBJ file");
    }
    FileKind::Text
}

/// A header or a dotted key of the sections that every scene has.
fn is_line_of_a_scene(line: &str) -> bool {
    ["groom", "lights"].into_iter().any(|section| {
        let bare = line.strip_prefix('[').map(str::trim_start);
        let header = bare.and_then(|rest| rest.strip_prefix(section));
        let key = line.strip_prefix(section).map(str::trim_start);
        header.is_some_and(|rest| rest.trim_start().starts_with(']'))
            || key.is_some_and(|rest| rest.starts_with(['.', '=']))
    })
}

/// What every `.cube` file has.
fn is_size_of_cube(line: &str) -> bool {
    let line = line.trim_start_matches('\u{feff}');
    let word = line.split_whitespace().next();
    word.is_some_and(|word| ["LUT_1D_SIZE", "LUT_3D_SIZE"].contains(&word))
}

fn is_line_of_obj(line: &str) -> bool {
    let keyword = line.split_whitespace().next().unwrap_or_default();
    let keywords = [
        "v", "vn", "vt", "vp", "f", "l", "p", "o", "g", "s", "mtllib", "usemtl",
    ];
    keywords.contains(&keyword)
}

fn is_vertex(line: &str) -> bool {
    let mut words = line.split_whitespace();
    words.next() == Some("v") && words.filter(|word| word.parse::<f32>().is_ok()).count() >= 3
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Version, strands and points a strand, as TressFX 3 and 4 start.
    fn tressfx(version: f32, n_points: u32) -> Vec<u8> {
        let mut header = version.to_le_bytes().to_vec();
        header.extend(2228u32.to_le_bytes());
        header.extend(n_points.to_le_bytes());
        header.resize(296, 0);
        header
    }

    /// A zip archive of `a.npy`.
    fn npz() -> Vec<u8> {
        let mut bytes = b"PK\x03\x04".to_vec();
        bytes.resize(26, 0);
        bytes.extend(b"\x05\0\0\0a.npy");
        bytes
    }

    #[test]
    fn files_are_called_by_their_names() {
        let ours = |kind: Kind| [&MAGIC[..], &kind.tag(), &[1, 0, 0, 0]].concat();
        let mut n_checked = 0;
        for (start, name) in [
            (ours(Kind::Groom), "a groom"),
            (ours(Kind::Lights), "a light set"),
            (ours(Kind::Tables), "a tables file"),
            (ours(Kind::Mesh), "a mesh"),
            (ours(Kind::Panorama), "a panorama"),
            ([&MAGIC[..], b"NEWS"].concat(), "unknown to this program"),
            (b"HAIR\x10\x27\0\0".to_vec(), "a .hair file"),
            (b"hair\x10\x27\0\0".to_vec(), "a .hair file"),
            (b"Ogawa\xff\0\x01".to_vec(), "an Alembic archive (Ogawa)"),
            (b"\x89HDF\r\n\x1a\n\0".to_vec(), "HDF5"),
            (b"#usda 1.0\ndef Xform".to_vec(), "a USD file"),
            (b"PXR-USDC\0\x08".to_vec(), "a USD file"),
            (b"PK\x03\x04\0\0".to_vec(), "a zip archive"),
            (
                b"version 2.0\nnumStrands 1\n".to_vec(),
                "a TressFX .tfx file",
            ),
            (b"version 3.0\ndamping 0.1\n".to_vec(), "TressFX settings"),
            (tressfx(3.0, 4), "a TressFX .tfx file"),
            (tressfx(4.0, 32), "a TressFX .tfx file"),
            (b"<?xml version=\"1.0\"?>".to_vec(), "an XML file"),
            (b"\xef\xbb\xbf<?xml ".to_vec(), "an XML file"),
            (b"# a cube\nv 0 0 1.5\nv 1 0 0\n".to_vec(), "an OBJ file"),
            (b"mtllib a.mtl\no hair\nv 0 0 1\n".to_vec(), "an OBJ file"),
            (b"ply\nformat ascii 1.0\n".to_vec(), "a PLY file of strands"),
            (
                b"ply\nelement vertex 3\nelement face 1\n".to_vec(),
                "a PLY mesh",
            ),
            (npz(), "a NumPy archive"),
            (b"\x93NUMPY\x01\0".to_vec(), "a NumPy array"),
            (b"0 1 2 0.1\n0 2 2 0.1\n".to_vec(), "a Mitsuba curve file"),
            (
                b"0 1 2 0.1\n0 nan 2 0.1\n0 2 2 0.1\n".to_vec(),
                "a Mitsuba curve file",
            ),
            (
                b"# hair\nShape \"curve\" \"point3 P\"".to_vec(),
                "a pbrt scene",
            ),
            (b"glTF\x02\0\0\0".to_vec(), "glTF file (binary)"),
            (b"{\"asset\": {}}".to_vec(), "glTF file (JSON)"),
            (b"{\"lights\": []}".to_vec(), "a JSON file"),
            (b"\x7fNSJb\0".to_vec(), "Houdini"),
            (b"[\n\t\"fileversion\",\"18\"".to_vec(), "Houdini"),
            (b"\x76\x2f\x31\x01\x02\0\0\0".to_vec(), "an OpenEXR picture"),
            (b"#?RADIANCE\n".to_vec(), "a Radiance .hdr picture"),
            (b"\x89PNG\r\n\x1a\n".to_vec(), "a PNG picture"),
            (b"\xff\xd8\xff\xe0".to_vec(), "a JPEG picture"),
            (b"version = 1\n[groom]\nfile = 'a'".to_vec(), "a scene"),
            (b"version=1\ngroom.file='a'".to_vec(), "a scene"),
            (b"# hair\nversion = 1\n[ lights ]\n".to_vec(), "a scene"),
            (
                b"# a look\nLUT_3D_SIZE 33\n0 0 0\n".to_vec(),
                "a LUT (.cube)",
            ),
            (b"\xef\xbb\xbfLUT_1D_SIZE 2\r\n".to_vec(), "a LUT (.cube)"),
            (b"1 0\n2\n-20 8 10 0.5\n".to_vec(), "some other text"),
            (b"hair is not a header".to_vec(), "some other text"),
            (
                b"# A tool\n```toml\n[groom]\nfile = 'a'\n```\n".to_vec(),
                "some other text",
            ),
            (b"version = 1".to_vec(), "some other text"),
            (vec![0; 300], "of an unknown format"),
            (tressfx(3.0, 5), "of an unknown format"),
            (b"\xff\xfe\0".to_vec(), "of an unknown format"),
            (Vec::new(), "empty"),
        ] {
            let found = FileKind::of(&start);
            assert!(
                found.name().contains(name),
                "{:?} is {found:?}, not {name}",
                start.escape_ascii().to_string()
            );
            n_checked += 1;
        }
        assert_eq!(n_checked, 50);
    }

    #[test]
    fn text_that_is_cut_within_a_letter_is_text() {
        let mut text = "# ".to_owned() + &"x".repeat(SNIFF_BYTES - 3);
        text.push('\u{e9}');
        text += "\n[groom]\n";
        assert_eq!(FileKind::of(text.as_bytes()), FileKind::Text);
    }

    #[test]
    fn what_can_be_done_is_said() {
        for (start, needle) in [
            (&b"Bgeo"[..], "imported from .hair, .abc"),
            (b"HAIR", "groom import"),
            (b"glTF", "mesh import"),
            (b"#?RADIANCE", "strandlight lights"),
            (b"\x89PNG\r\n\x1a\n", "OpenEXR or Radiance"),
            (b"[groom]", "render"),
        ] {
            let text = FileKind::of(start).describe();
            assert!(text.starts_with("it is a"), "{text}");
            assert!(text.contains(needle), "{text}");
        }
        assert_eq!(FileKind::of(b"").describe(), "it is empty");
    }
}
