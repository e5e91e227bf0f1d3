//! glTF 2.0: the triangles of the default scene, of `.glb` and `.gltf` files.
//!
//! Read by hand: the crate `gltf` panics on indices out of range while it checks them.

use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};

use glam::{Mat3, Mat4, Quat, Vec3};
use serde::Deserialize;
use strandlight_formats::{Error, MAX_TRIANGLES, MAX_VERTICES, counted, read_file};

use super::parts::{MAX_BYTES, Parts};

/// Of a file, what its triangles need; names as in the specification.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
#[derive(Default)]
struct Document {
    scene: Option<usize>,
    scenes: Vec<SceneNodes>,
    nodes: Vec<Node>,
    meshes: Vec<Primitives>,
    accessors: Vec<Accessor>,
    buffer_views: Vec<View>,
    buffers: Vec<Buffer>,
    extensions_required: Vec<String>,
}

#[derive(Deserialize)]
struct SceneNodes {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Deserialize)]
struct Node {
    #[serde(default)]
    children: Vec<usize>,
    mesh: Option<usize>,
    skin: Option<usize>,
    matrix: Option<[f32; 16]>,
    #[serde(default)]
    translation: [f32; 3],
    #[serde(default = "no_rotation")]
    rotation: [f32; 4],
    #[serde(default = "no_scale")]
    scale: [f32; 3],
}

const fn no_rotation() -> [f32; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

const fn no_scale() -> [f32; 3] {
    [1.0; 3]
}

#[derive(Deserialize)]
struct Primitives {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: Attributes,
    indices: Option<usize>,
    mode: Option<u32>,
    #[serde(default)]
    targets: Vec<serde_json::Value>,
}

#[derive(Deserialize)]
struct Attributes {
    #[serde(rename = "POSITION")]
    position: Option<usize>,
    #[serde(rename = "NORMAL")]
    normal: Option<usize>,
    #[serde(rename = "TEXCOORD_0")]
    uv: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    #[serde(default)]
    normalized: bool,
    count: usize,
    #[serde(rename = "type")]
    shape: String,
    sparse: Option<serde_json::Value>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
}

#[derive(Deserialize)]
struct Buffer {
    uri: Option<String>,
}

/// Values of `mode`.
const TRIANGLES: u32 = 4;
const TRIANGLE_STRIP: u32 = 5;
const TRIANGLE_FAN: u32 = 6;

/// Values of `componentType`.
const U8: u32 = 5121;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// Extensions of a mesh's look or place in other programs, without which its triangles are the same.
const HARMLESS: [&str; 3] = ["KHR_materials_", "KHR_texture_", "KHR_lights_"];

/// `list[ix]`, or an error that names it.
fn of<'a, T>(list: &'a [T], ix: usize, what: &str) -> Result<&'a T, String> {
    list.get(ix)
        .ok_or_else(|| format!("there is no {what} {ix}"))
}

/// The JSON text and the binary chunk of a file.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), String> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, &[]));
    }
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|word| word.try_into().ok());
        word.map(u32::from_le_bytes)
            .ok_or_else(|| "the file ends within its header".to_owned())
    };
    match word(4)? {
        2 => {}
        version => return Err(format!("it is of glTF version {version}, not 2")),
    }
    let chunk = |at: usize| -> Result<(u32, &[u8], usize), String> {
        let (length, kind) = (word(at)? as usize, word(at + 4)?);
        let data = bytes[at + 8..].get(..length);
        let data = data.ok_or_else(|| "the file ends within a chunk".to_owned())?;
        Ok((kind, data, at + 8 + length))
    };
    let (kind, json, next) = chunk(12)?;
    if kind != u32::from_le_bytes(*b"JSON") {
        return Err("its first chunk is not JSON".to_owned());
    }
    let binary = match next < bytes.len() {
        true => chunk(next)?.1,
        false => &[],
    };
    Ok((json, binary))
}

/// The triangles of all meshes that nodes of the default scene, the first or the file have.
pub fn read(bytes: &[u8], path: &Path, notes: &mut Vec<String>) -> Result<Parts, String> {
    let (json, binary) = chunks(bytes)?;
    let document: Document = serde_json::from_slice(json)
        .map_err(|error| format!("not a readable glTF file: {error}"))?;
    let mut required = document.extensions_required.iter();
    let unknown = required.find(|name| !HARMLESS.iter().any(|start| name.starts_with(start)));
    if let Some(name) = unknown {
        return Err(format!("it requires {name}, which is not read"));
    }
    let mut parts = Parts::default();
    let buffers = buffers(&document, binary, path, &mut parts.files, MAX_BYTES)?;
    let mut reader = Reader {
        document: &document,
        buffers,
        parts,
        n_others: 0,
        is_posed: false,
    };
    reader.nodes()?;
    if reader.n_others > 0 {
        let n = reader.n_others;
        let left_out = counted(
            n,
            "primitive of points or lines was",
            "primitives of points or lines were",
        );
        notes.push(left_out + " left out");
    }
    if reader.is_posed {
        let what = "skins and morph targets are not applied: the mesh is as it was modelled";
        notes.push(what.to_owned());
    }
    Ok(reader.parts)
}

/// What the buffers hold, `most` bytes in all besides `binary`, and the `files` that they are.
fn buffers<'a>(
    document: &Document,
    binary: &'a [u8],
    path: &Path,
    files: &mut Vec<PathBuf>,
    most: u64,
) -> Result<Vec<Cow<'a, [u8]>>, String> {
    let in_all = || format!("buffers may have {most} bytes in all");
    let mut buffers = Vec::new();
    let mut left = most;
    for (ix, buffer) in document.buffers.iter().enumerate() {
        let Some(uri) = &buffer.uri else {
            if ix > 0 {
                return Err(format!("buffer {ix} has no data"));
            }
            buffers.push(Cow::Borrowed(binary));
            continue;
        };
        let bytes = match uri.strip_prefix("data:") {
            Some(rest) => of_text(rest)?,
            None => {
                let file = beside(uri, path)?;
                let bytes = read_file(&file, left).map_err(|error| match error {
                    Error::Value { .. } => format!("{error}; {}", in_all()),
                    error => error.to_string(),
                })?;
                files.push(file);
                bytes
            }
        };
        left = left
            .checked_sub(bytes.len() as u64)
            .ok_or_else(|| format!("buffer {ix} is too long; {}", in_all()))?;
        buffers.push(Cow::Owned(bytes));
    }
    Ok(buffers)
}

struct Reader<'a> {
    document: &'a Document,
    buffers: Vec<Cow<'a, [u8]>>,
    parts: Parts,
    /// Primitives that are no triangles.
    n_others: usize,
    /// Are there skins or morph targets?
    is_posed: bool,
}

impl Reader<'_> {
    fn nodes(&mut self) -> Result<(), String> {
        let Document {
            scene,
            scenes,
            nodes,
            meshes,
            ..
        } = self.document;
        let roots = match (scene, scenes.first()) {
            (Some(ix), _) => of(scenes, *ix, "scene")?.nodes.clone(),
            (None, Some(scene)) => scene.nodes.clone(),
            // A library of nodes: those that no other has.
            (None, None) => {
                let mut is_child = vec![false; nodes.len()];
                for child in nodes.iter().flat_map(|node| &node.children) {
                    if let Some(is_child) = is_child.get_mut(*child) {
                        *is_child = true;
                    }
                }
                (0..nodes.len()).filter(|ix| !is_child[*ix]).collect()
            }
        };
        // Nodes are a tree, and a file that says otherwise would be walked for ever.
        let mut is_visited = vec![false; nodes.len()];
        let mut open: Vec<(usize, Mat4)> =
            roots.into_iter().map(|ix| (ix, Mat4::IDENTITY)).collect();
        while let Some((ix, world_from_parent)) = open.pop() {
            let node = of(nodes, ix, "node")?;
            if std::mem::replace(&mut is_visited[ix], true) {
                return Err(format!("node {ix} is there twice"));
            }
            let own = match &node.matrix {
                Some(matrix) => Mat4::from_cols_array(matrix),
                None => Mat4::from_scale_rotation_translation(
                    Vec3::from(node.scale),
                    Quat::from_array(node.rotation),
                    Vec3::from(node.translation),
                ),
            };
            let world_from_node = world_from_parent * own;
            if let Some(mesh) = node.mesh {
                self.is_posed |= node.skin.is_some();
                for primitive in &of(meshes, mesh, "mesh")?.primitives {
                    self.primitive(primitive, world_from_node)?;
                }
            }
            open.extend(node.children.iter().map(|&child| (child, world_from_node)));
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, world: Mat4) -> Result<(), String> {
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        if !(TRIANGLES..=TRIANGLE_FAN).contains(&mode) {
            self.n_others += 1;
            return Ok(());
        }
        let Some(accessor) = primitive.attributes.position else {
            return Err("a primitive has no positions".to_owned());
        };
        self.is_posed |= !primitive.targets.is_empty();
        let positions = self.vectors::<3>(accessor)?;
        let n = positions.len();
        let first = self.parts.positions.len();
        if first + n > MAX_VERTICES {
            return Err(format!("it has more than {MAX_VERTICES} vertices"));
        }
        let place = |p: [f32; 3]| world.transform_point3(Vec3::from(p)).to_array();
        self.parts
            .positions
            .extend(positions.into_iter().map(place));
        // Normals go by the inverse transpose; its cofactors need no inverse.
        let linear = Mat3::from_mat4(world);
        let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
        let mirror = linear.determinant().signum();
        let turn = |n: [f32; 3]| {
            let n = y.cross(z) * n[0] + z.cross(x) * n[1] + x.cross(y) * n[2];
            (mirror * n).to_array()
        };
        if let Some(accessor) = primitive.attributes.normal {
            let normals = self.vectors::<3>(accessor)?;
            self.parts.normals.extend(normals.into_iter().map(turn));
        }
        self.parts.normals.resize(first + n, [0.0; 3]);
        if let Some(accessor) = primitive.attributes.uv {
            let uvs = self.vectors::<2>(accessor)?;
            self.parts.uvs.extend(uvs);
            self.parts.has_uvs = true;
        }
        self.parts.uvs.resize(first + n, [0.0; 2]);
        let corners: Vec<u32> = match primitive.indices {
            Some(accessor) => self.indices(accessor)?,
            None => (0..n as u32).collect(),
        };
        if let Some(ix) = corners.iter().find(|ix| **ix as usize >= n) {
            return Err(format!("a triangle names vertex {ix} of {n}"));
        }
        let triangle = |ix: usize| match mode {
            TRIANGLE_STRIP if ix % 2 == 1 => [ix + 1, ix, ix + 2],
            TRIANGLE_STRIP => [ix, ix + 1, ix + 2],
            TRIANGLE_FAN => [0, ix + 1, ix + 2],
            _ => [3 * ix, 3 * ix + 1, 3 * ix + 2],
        };
        let n_triangles = match mode {
            TRIANGLES => corners.len() / 3,
            _ => corners.len().saturating_sub(2),
        };
        if self.parts.triangles.len() + n_triangles > MAX_TRIANGLES {
            return Err(format!("it has more than {MAX_TRIANGLES} triangles"));
        }
        for ix in 0..n_triangles {
            let [a, b, c] = triangle(ix).map(|ix| first as u32 + corners[ix]);
            // A mirror turns the winding over.
            let triangle = if mirror < 0.0 { [a, c, b] } else { [a, b, c] };
            self.parts.triangles.push(triangle);
        }
        Ok(())
    }

    /// The elements of accessor `ix`, each of `n` numbers, as their bytes.
    fn elements(&self, ix: usize, n: usize) -> Result<Vec<&[u8]>, String> {
        let accessor = of(&self.document.accessors, ix, "accessor")?;
        if accessor.sparse.is_some() {
            return Err(format!("accessor {ix} is sparse, which is not read"));
        }
        let shape = ["SCALAR", "VEC2", "VEC3"][n - 1];
        if accessor.shape != shape {
            return Err(format!("accessor {ix} is not {shape}"));
        }
        let Some(view) = accessor.buffer_view else {
            return Err(format!(
                "accessor {ix} has no data; is the file compressed?"
            ));
        };
        let view = of(&self.document.buffer_views, view, "buffer view")?;
        let outside = || format!("accessor {ix} lies outside its buffer");
        let buffer = of(&self.buffers, view.buffer, "buffer")?;
        let end = view.byte_offset.checked_add(view.byte_length);
        let data = end.and_then(|end| buffer.get(view.byte_offset..end));
        let data = data.ok_or_else(outside)?;
        let element_bytes = n * number_bytes(accessor.component_type)?;
        let stride = view.byte_stride.unwrap_or(element_bytes).max(1);
        // No more than there are bytes, whatever the count says.
        let mut elements = Vec::with_capacity(accessor.count.min(data.len()));
        for element in 0..accessor.count {
            let start = element
                .checked_mul(stride)
                .and_then(|at| at.checked_add(accessor.byte_offset));
            let range = start.and_then(|start| Some(start..start.checked_add(element_bytes)?));
            let bytes = range.and_then(|range| data.get(range));
            elements.push(bytes.ok_or_else(outside)?);
        }
        Ok(elements)
    }

    /// Vectors of `N` floats, or of shares of the largest whole number.
    fn vectors<const N: usize>(&self, ix: usize) -> Result<Vec<[f32; N]>, String> {
        let elements = self.elements(ix, N)?;
        let accessor = of(&self.document.accessors, ix, "accessor")?;
        let number: fn(&[u8]) -> f32 = match (accessor.component_type, accessor.normalized) {
            (F32, _) => |bytes| bytes.try_into().map_or(f32::NAN, f32::from_le_bytes),
            (U8, true) => |bytes| whole(bytes) as f32 / 255.0,
            (U16, true) => |bytes| whole(bytes) as f32 / 65_535.0,
            _ => return Err(format!("accessor {ix} holds numbers that are not read")),
        };
        let size = number_bytes(accessor.component_type)?;
        let vector = |bytes: &[u8]| std::array::from_fn(|ix| number(&bytes[ix * size..][..size]));
        Ok(elements.into_iter().map(vector).collect())
    }

    fn indices(&self, ix: usize) -> Result<Vec<u32>, String> {
        let elements = self.elements(ix, 1)?;
        let accessor = of(&self.document.accessors, ix, "accessor")?;
        match accessor.component_type {
            U8 | U16 | U32 => Ok(elements.into_iter().map(whole).collect()),
            _ => Err(format!("accessor {ix} holds no indices")),
        }
    }
}

/// Bytes of a number.
fn number_bytes(component_type: u32) -> Result<usize, String> {
    match component_type {
        5120 | U8 => Ok(1),
        5122 | U16 => Ok(2),
        U32 | F32 => Ok(4),
        other => Err(format!("there is no componentType {other}")),
    }
}

/// A whole number, its lowest byte first.
fn whole(bytes: &[u8]) -> u32 {
    let digits = bytes.iter().rev();
    digits.fold(0, |number, &byte| number << 8 | u32::from(byte))
}

/// The bytes of a buffer that is its own name, after `data:`.
fn of_text(rest: &str) -> Result<Vec<u8>, String> {
    let coded = rest.split_once(";base64,").map(|(_, coded)| coded);
    let bytes = coded.and_then(base64);
    bytes.ok_or_else(|| "a buffer is no base64".to_owned())
}

/// The file that a buffer names, beside the one at `path`.
fn beside(uri: &str, path: &Path) -> Result<PathBuf, String> {
    let name = decoded(uri)?;
    // Coded or not: no folder above it, no drive and no address.
    let is_beside = Path::new(&name)
        .components()
        .all(|part| matches!(part, Component::Normal(_)));
    if !is_beside || name.contains(':') {
        return Err(format!("buffer {uri:?} is not a file beside it"));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    Ok(folder.join(name))
}

/// The name that `uri` stands for: blanks and letters beyond ASCII are written as `%` and the two hexadecimal digits of each of
/// their bytes.
fn decoded(uri: &str) -> Result<String, String> {
    let mut parts = uri.split('%');
    let mut bytes = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        let digits = part.as_bytes().first_chunk::<2>();
        let byte =
            digits.and_then(|digits| Some(16 * hex_digit(digits[0])? + hex_digit(digits[1])?));
        let byte =
            byte.ok_or_else(|| format!("buffer {uri:?} has a % without two digits after it"))?;
        bytes.push(byte);
        bytes.extend_from_slice(&part.as_bytes()[2..]);
    }
    String::from_utf8(bytes).map_err(|_| format!("buffer {uri:?} is no UTF-8"))
}

fn hex_digit(digit: u8) -> Option<u8> {
    char::from(digit)
        .to_digit(16)
        .and_then(|value| value.try_into().ok())
}

/// Decodes base64; `None` where it is none.
fn base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=');
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    let (mut bits, mut n_bits) = (0u32, 0);
    for digit in text.bytes() {
        let value = match digit {
            b'A'..=b'Z' => digit - b'A',
            b'a'..=b'z' => digit - b'a' + 26,
            b'0'..=b'9' => digit - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        n_bits += 6;
        if n_bits >= 8 {
            n_bits -= 8;
            bytes.push((bits >> n_bits & 0xff) as u8);
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_buffers_are_decoded_and_stay_in_their_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        std::fs::create_dir(at.join("sub")).expect("made");
        let names = ["a b.bin", "Zöpfe#1.bin", "100%.bin"];
        for name in names.iter().chain(&["secret.bin"]) {
            std::fs::write(at.join("sub").join(name), name).expect("written");
        }
        std::fs::write(at.join("secret.bin"), "above").expect("written");
        let path = at.join("sub/a.gltf");
        let read = |uri: &str| {
            let file = beside(uri, &path)?;
            std::fs::read(file).map_err(|error| error.to_string())
        };
        for (uri, name) in [
            ("a%20b.bin", names[0]),
            ("a b.bin", names[0]),
            ("Z%C3%B6pfe%231.bin", names[1]),
            ("Z%c3%b6pfe#1.bin", names[1]),
            ("100%25.bin", names[2]),
        ] {
            assert_eq!(*read(uri).expect(uri), *name.as_bytes(), "{uri}");
        }
        for (uri, needle) in [
            ("../secret.bin", "is not a file beside it"),
            ("%2e%2e%2fsecret.bin", "is not a file beside it"),
            ("%2Fetc%2Fpasswd", "is not a file beside it"),
            ("c%3Asecret.bin", "is not a file beside it"),
            ("%ff.bin", "is no UTF-8"),
            ("100%.bin", "a % without two digits"),
            ("a%2", "a % without two digits"),
            ("a%+1.bin", "a % without two digits"),
            ("a%é.bin", "a % without two digits"),
        ] {
            let error = read(uri).expect_err(uri);
            assert!(error.contains(needle), "{uri}: {error}");
        }
    }

    #[test]
    fn buffers_are_bounded_together() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        std::fs::write(at.join("a.bin"), [7; 10]).expect("written");
        let read = |uris: &[&str], most: u64| {
            let buffers_of = uris.iter().map(|uri| Buffer {
                uri: Some((*uri).to_owned()),
            });
            let document = Document {
                buffers: buffers_of.collect(),
                ..Document::default()
            };
            let mut files = Vec::new();
            let read = buffers(&document, &[], &at.join("a.gltf"), &mut files, most);
            read.map(|read| (read.len(), files))
        };
        // Three bytes.
        let text = "data:;base64,AAAA";
        let twice = ["a.bin", "a.bin"];
        let files = vec![at.join("a.bin"); 2];
        assert_eq!(read(&twice, 20), Ok((2, files)));
        assert_eq!(read(&["a.bin", text], 13).map(|read| read.0), Ok(2));
        for (uris, most, needle) in [
            (twice, 19, "a.bin"),
            (["a.bin", text], 12, "buffer 1 is too long"),
            ([text, "a.bin"], 12, "a.bin"),
        ] {
            let error = read(&uris, most).expect_err(needle);
            assert!(error.contains(needle), "{needle}: {error}");
            let in_all = format!("buffers may have {most} bytes in all");
            assert!(error.contains(&in_all), "{error}");
        }
    }
}
