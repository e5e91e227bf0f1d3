//! NumPy arrays and files of CT2Hair.

use super::*;

/// An array of `shape` of numbers of type `descr`.
pub fn npy(version: u8, descr: &str, shape: &str, array: &[u8]) -> Vec<u8> {
    let mut text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    while (text.len() + 11) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let mut bytes = [&b"\x93NUMPY"[..], &[version, 0]].concat();
    match version {
        1 => bytes.extend((text.len() as u16).to_le_bytes()),
        _ => bytes.extend((text.len() as u32).to_le_bytes()),
    }
    [bytes, text.into_bytes(), array.to_vec()].concat()
}

#[test]
fn numpy_arrays_are_read() {
    let points = [curve(3, 0.0), curve(3, 1.0)].concat();
    let single = floats(points.as_flattened());
    let double: Vec<u8> = points
        .as_flattened()
        .iter()
        .flat_map(|&x| f64::from(x).to_le_bytes())
        .collect();
    for (version, descr, array) in [
        (1, "<f4", &single),
        (2, "<f8", &double),
        (3, "<f4", &single),
    ] {
        let bytes = npy(version, descr, "(2, 3, 3)", array);
        let groom = import("npy", &bytes, &cm()).unwrap().groom;
        assert_eq!(
            (groom.points, groom.strand_offsets),
            (points.clone(), vec![0, 3, 6])
        );
    }
    let half: Vec<u8> = [0x3c00u16, 0xc000, 0, 0x3800, 0, 0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let groom = import(
        "npy",
        &npy(1, "<f2", "(1, 2, 3)", &half),
        &ImportOptions::default(),
    )
    .unwrap()
    .groom;
    assert_eq!(groom.points, [[100.0, -200.0, 0.0], [50.0, 0.0, 0.0]]);

    let file = |descr: &str, shape: &str| npy(1, descr, shape, &single);
    let fortran =
        String::from_utf8_lossy(&npy(1, "<f4", "(2, 3, 3)", b"")[10..]).replace("False", "True ");
    let fortran = [
        &npy(1, "<f4", "(2, 3, 3)", b"")[..10],
        fortran.as_bytes(),
        &single,
    ]
    .concat();
    for (bytes, needle) in [
        (
            file(">f4", "(2, 3, 3)"),
            "type of the array is \">f4\", must be <f2, <f4 or <f8",
        ),
        (file("<i4", "(2, 3, 3)"), "type of the array"),
        (
            file("<f4", "(6, 3)"),
            "shape of the array is (6, 3), must be (strands, points, 3)",
        ),
        (file("<f4", "(2, 3, 4)"), "shape of the array is (2, 3, 4)"),
        (
            file("<f4", "(2, 4, 3)"),
            "an array of shape (2, 4, 3) takes 96 bytes, the file has 72 left (at byte 128)",
        ),
        (
            file("<f4", "(9223372036854775807, 3, 3)"),
            "takes too many bytes",
        ),
        (
            file("<f4", "(0, 9223372036854775807, 3)"),
            "(0, 9223372036854775807, 3) takes",
        ),
        (
            npy(1, "<f4", "(0, 9223372036854775, 3)", b""),
            "two points or more is 0",
        ),
        (
            npy(1, "<f4", "(9223372036854775, 0, 3)", b""),
            "two points or more is 0",
        ),
        (fortran, "order of the array is Fortran"),
        (
            npy(4, "<f4", "(2, 3, 3)", &single),
            "version 4 of the header is unknown",
        ),
        (
            npy(
                1,
                "<f4",
                "(1, 2, 3)",
                &floats(&[0.0, 0.0, 0.0, 0.0, f32::NAN, 0.0]),
            ),
            "strand 0, point 1 is",
        ),
    ] {
        let error = format_error("npy", &bytes);
        assert!(error.contains(needle), "{error:?} lacks {needle:?}");
    }
    let error = SourceFile::from_bytes(
        *b"PK\x03\x04\x14\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x05\0\0\0a.npy",
    );
    let error = error.unwrap_err().to_string();
    assert!(
        error.contains("a NumPy archive (.npz); save its array of strands alone, as .npy"),
        "{error}"
    );
}

/// Strands of these lengths as CT2Hair writes them, in millimetres.
pub fn ct2hair(lengths: &[usize]) -> Vec<u8> {
    let mut bytes = words(&[lengths.len() as u32]);
    for (ix, &n) in lengths.iter().enumerate() {
        bytes.extend(words(&[n as u32]));
        for point in curve(n, ix as f32) {
            bytes.extend(floats(&point));
            bytes.extend(floats(&[0.6, -0.8, 0.0, 0.0]));
        }
    }
    bytes
}

#[test]
fn ct2hair_is_read() {
    let bytes = ct2hair(&[5, 1, 7]);
    let found = import("ct2hair", &bytes, &cm()).unwrap();
    assert_eq!(found.groom.strand_offsets, [0, 5, 12]);
    assert_eq!(found.groom.points[5..], curve(7, 2.0));
    assert_eq!(found.notes.len(), 2);
    let usual = import("ct2hair", &bytes, &ImportOptions::default()).unwrap();
    assert_eq!(usual.groom.source.cm_per_unit, 0.1);
    // Strands that are no numbers, as CT2Hair itself leaves out.
    let mut broken = bytes.clone();
    broken[8..12].copy_from_slice(&f32::NAN.to_le_bytes());
    let found = import("ct2hair", &broken, &cm()).unwrap();
    assert_eq!(found.groom.strand_offsets, [0, 7]);
    let dropped = notes(&found, NoteKind::Dropped);
    assert!(
        dropped[0].starts_with("1 strand with points that are no numbers is"),
        "{dropped:?}"
    );
    for (at, word, needle) in [
        (0, 4, "file ends before the number of points of strand 3"),
        (0, 1, "232 bytes after the last strand"),
        (0, 0x8000_0000, "number of strands is -2147483648"),
        (
            4,
            0x7fff_ffff,
            "2147483647 points of strand 0 take 60129542116 bytes",
        ),
        (8, f32::INFINITY.to_bits(), "strand 0, point 0 is [inf"),
    ] {
        let mut bytes = bytes.clone();
        bytes[at..at + 4].copy_from_slice(&u32::to_le_bytes(word));
        let error = format_error("ct2hair", &bytes);
        assert!(error.contains(needle), "{error:?} lacks {needle:?}");
    }
}
