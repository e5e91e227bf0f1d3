//! Strands in PLY files.

use super::*;

/// A binary file of two strands as hairutil writes it, with colours and strand lengths.
pub fn ply_binary(is_big: bool) -> Vec<u8> {
    let order = if is_big { "big" } else { "little" };
    let mut bytes = format!(
        "ply\nformat binary_{order}_endian 1.0\ncomment by a test\nelement vertex 5\n\
         property float x\nproperty float y\nproperty double z\nproperty uchar red\n\
         property uchar green\nproperty uchar blue\nproperty float thickness\n\
         property list uchar int tags\nelement strand 2\nproperty ushort nsegs\nend_header\n"
    )
    .into_bytes();
    let mut put = |number: &[u8]| match is_big {
        true => bytes.extend(number.iter().rev()),
        false => bytes.extend(number),
    };
    for ix in 0..5u8 {
        put(&f32::from(ix).to_le_bytes());
        put(&0.5f32.to_le_bytes());
        put(&(-2f64).to_le_bytes());
        for color in [0, 51, 255] {
            put(&[color]);
        }
        put(&0.001f32.to_le_bytes());
        put(&[1]);
        put(&7i32.to_le_bytes());
    }
    put(&1u16.to_le_bytes());
    put(&2u16.to_le_bytes());
    bytes
}

/// The ascii file of strands with `header` lines for its vertices, and `rows`.
pub fn ply_ascii(header: &str, n: usize, rows: impl Fn(usize) -> String) -> Vec<u8> {
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {n}\n{header}end_header\n");
    (0..n).for_each(|ix| text += &(rows(ix) + "\n"));
    text.into_bytes()
}

pub const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";

#[test]
fn ply_files_of_strands_are_read() {
    for is_big in [false, true] {
        let import = import("ply", &ply_binary(is_big), &cm()).unwrap();
        assert_eq!(import.groom.strand_offsets, [0, 2, 5]);
        assert_eq!(import.groom.points[3], [3.0, 0.5, -2.0]);
        assert_eq!(data(&import.groom, "color")[..3], [0.0, 0.2, 1.0]);
        assert_eq!(data(&import.groom, "diameter"), [0.001; 5]);
        let left = notes(&import, NoteKind::Dropped);
        assert_eq!(left, ["properties of vertices that are left out: tags"]);
    }
    // By the strand that each vertex names.
    let header = format!("{XYZ}property int curve_id\nproperty float radius\n");
    let rows = |ix: usize| format!("{ix} 1 2 {} 0.01", [7, 7, 3, 3, 3][ix]);
    let by_id = import("ply", &ply_ascii(&header, 5, rows), &cm()).unwrap();
    assert_eq!(by_id.groom.strand_offsets, [0, 2, 5]);
    assert_eq!(data(&by_id.groom, "thickness"), [0.02; 5]);
    assert_eq!(by_id.notes, []);
    let again = |ix: usize| format!("{ix} 1 2 {} 0.01", [7, 7, 3, 3, 7][ix]);
    let error = format_error("ply", &ply_ascii(&header, 5, again));
    assert!(error.contains("strand of vertex 4 is 7"), "{error}");
    // By edges.
    let header = format!("{XYZ}element edge 3\nproperty int vertex1\nproperty int vertex2\n");
    let mut edges = ply_ascii(&header, 5, |ix| format!("{ix} 0 0"));
    edges.extend(b"0 1\n3 2\n3 4\n");
    let by_edges = import("ply", &edges, &cm()).unwrap();
    assert_eq!(by_edges.groom.strand_offsets, [0, 2, 5]);
    let error = format_error(
        "ply",
        &edges[..edges.len() - 4]
            .iter()
            .copied()
            .chain(*b"2 4\n")
            .collect::<Vec<_>>(),
    );
    assert!(error.contains("edge 2 is 2 to 4"), "{error}");
}

#[test]
fn edges_may_stand_before_the_vertices() {
    let file = |n_edges: usize, edges: &str| {
        let rows = "0 0 0\n1 0 0\n2 0 0\n3 0 0\n4 0 0\n";
        format!(
            "ply\nformat ascii 1.0\nelement edge {n_edges}\nproperty int vertex1\n\
             property int vertex2\nelement vertex 5\n{XYZ}end_header\n{edges}{rows}"
        )
        .into_bytes()
    };
    let import = import("ply", &file(3, "0 1\n2 3\n3 4\n"), &cm()).unwrap();
    assert_eq!(import.groom.strand_offsets, [0, 2, 5]);
    let error = format_error("ply", &file(3, "0 1\n2 3\n4 5\n"));
    assert!(error.contains("edge 2 is 4 to 5"), "{error}");
    // Without edges no strand has two points.
    let error = format_error("ply", &file(0, ""));
    assert!(error.contains("number of strands"), "{error}");
}

#[test]
fn ply_files_that_say_nothing_have_strands_of_100_points() {
    // As GaussianHaircut writes them: strands far from each other.
    let row = |ix: usize| format!("{} {} 0.5 0 0 0", ix / 100, (ix % 100) as f32 * 0.002);
    let header = format!("{XYZ}property float nx\nproperty float ny\nproperty float nz\n");
    let import = import(
        "ply",
        &ply_ascii(&header, 300, row),
        &ImportOptions::default(),
    )
    .unwrap();
    assert_eq!(import.groom.strand_offsets, [0, 100, 200, 300]);
    assert_eq!(import.groom.source.cm_per_unit, 100.0);
    let assumed = notes(&import, NoteKind::Assumed);
    assert!(assumed[0].ends_with("100 points each"), "{assumed:?}");

    let error = format_error("ply", &ply_ascii(&header, 250, row));
    assert!(error.contains("number of vertices is 250"), "{error}");
    // A cloud of points.
    let cloud = |ix: usize| {
        format!(
            "{} {} {} 0 0 0",
            ix * 7919 % 101,
            ix * 104_729 % 97,
            ix % 13
        )
    };
    let error = format_error("ply", &ply_ascii(&header, 300, cloud));
    assert!(error.contains("that do not lie along strands"), "{error}");
}

#[test]
fn meshes_and_splats_are_refused_by_name() {
    let mesh = "ply\nformat ascii 1.0\nelement vertex 3\n\
        property float x\nproperty float y\nproperty float z\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert_eq!(FileKind::of(mesh.as_bytes()).name(), "a PLY mesh");
    let error = SourceFile::from_bytes(mesh).unwrap_err().to_string();
    assert!(
        error.contains("it is a PLY mesh; hair is imported from"),
        "{error}"
    );
    let error = format_error("ply", mesh.as_bytes());
    assert!(error.contains("PLY file is a mesh of 1 faces"), "{error}");
    let header = format!("{XYZ}property float f_dc_0\nproperty float rot_0\n");
    let error = format_error(
        "ply",
        &ply_ascii(&header, 100, |ix| format!("{ix} 0 0 0 0")),
    );
    assert!(error.contains("Gaussian splats"), "{error}");
}

#[test]
fn lies_of_ply_are_named() {
    let text = |old: &str, new: &str| {
        let header = format!("{XYZ}property int strand_id\n");
        let file = ply_ascii(&header, 2, |ix| format!("{ix} 0 0 1"));
        String::from_utf8(file)
            .unwrap()
            .replace(old, new)
            .into_bytes()
    };
    assert!(import("ply", &text("", ""), &cm()).is_ok());
    for (bytes, needle) in [
        (text("ascii", "rot13"), "is not a format of PLY"),
        (text("format ascii 1.0\n", ""), "the header has no format"),
        (text("vertex 2", "vertex -2"), "is not an element"),
        (text("vertex 2", "vertex 4000000000"), "number of points is"),
        (
            text("vertex 2", "vertex 3"),
            "file ends after 2 of 3 items of element vertex",
        ),
        (text("element vertex 2\n", ""), "is not below an element"),
        (
            text("end_header", &format!("element vertex 5\n{XYZ}end_header")),
            "\"element vertex 5\" is not an element of a new name",
        ),
        (
            text("property float z", "property quad z"),
            "is not a property",
        ),
        (
            text("property float z", "property float w"),
            "element vertex lacks x, y and z",
        ),
        (
            text("end_header", "end"),
            "\"end\" is not a line of a PLY header",
        ),
        (
            text("0 0 0 1", "0 0 x 1"),
            "\"0 0 x 1\" is not an item of element vertex",
        ),
        (text("0 0 0 1", "0 1e38 0 1"), "strand 0, point 0"),
    ] {
        let few = cm().with_max_points(100);
        let error = format("ply").read(&bytes, &few).unwrap_err().to_string();
        assert!(error.contains(needle), "{error:?} lacks {needle:?}");
    }
    let good = ply_binary(false);
    let mut long = good.clone();
    let n = long.len();
    long[n - 2] = 3;
    let error = format_error("ply", &long);
    assert!(
        error.contains("the strands have 6 points in all, the file has 5 vertices"),
        "{error}"
    );
}
