//! TressFX.

use super::*;

/// Two strands of four points, as version 4 has them.
pub fn tfx_4() -> Vec<u8> {
    let mut bytes = floats(&[4.0]);
    bytes.extend(words(&[2, 4, 160, 288]));
    bytes.resize(160, 0);
    for (ix, [x, y, z]) in [curve(4, 0.0), curve(4, 1.0)]
        .concat()
        .into_iter()
        .enumerate()
    {
        let moves = if ix % 4 < 2 { 0.0 } else { 1.0 };
        bytes.extend(floats(&[x, y, z, moves]));
    }
    bytes.extend(floats(&[0.1, 0.2, 0.3, 0.4]));
    bytes
}

pub fn tfx_3(held: u32) -> Vec<u8> {
    let mut bytes = floats(&[3.0]);
    bytes.extend(words(&[2, 4, 3, held]));
    bytes.resize(144, 0);
    bytes.extend(words(&[296]));
    bytes.resize(296, 0);
    for point in [curve(4, 0.0), curve(4, 1.0)].concat() {
        bytes.extend(floats(&point));
    }
    bytes
}

pub const TFX_2: &str = "version 2.0\nscale 1.0\nrotation 0 0 0\ntranslation 0 0 0\n\
    bothEndsImmovable 1\nmaxNumVerticesInStrand 16\nnumFollowHairsPerGuideHair 4\n\
    maxRadiusAroundGuideHair 0.5\nnumStrands 2\nis sorted 1\n\
    strand 0 numVerts 3 texcoord 0.250000 000000\n-2.28788 107.007 23.5948\n0 1 2\n1 1 2.5\n\
    strand 1 numVerts 4 texcoord 0.5 0.75\n1 0 0\r\n2 0 0\n3 0 0\n4 .5 0\n";

#[test]
fn tressfx_4_comes_back_byte_for_byte() {
    let bytes = tfx_4();
    for up in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
        let groom = import("tfx", &bytes, &cm().with_up(up)).unwrap().groom;
        let stored = Groom::from_bytes(&groom.to_bytes().unwrap()).unwrap();
        let export = export(&stored, "tfx");
        assert!(export.bytes == bytes, "{up:?}");
        assert_eq!((export.notes, export.dropped), (vec![], vec![]));
    }
    let import = import("tfx", &bytes, &ImportOptions::default()).unwrap();
    assert_eq!(import.groom.strand_offsets, [0, 4, 8]);
    assert_eq!(import.groom.source.cm_per_unit, 100.0);
    assert_eq!(data(&import.groom, "root_uv"), [0.1, 0.2, 0.3, 0.4]);
    assert_eq!(
        data(&import.groom, "inverse_mass")[..4],
        [0.0, 0.0, 1.0, 1.0]
    );
    let assumed = notes(&import, NoteKind::Assumed);
    assert!(assumed[0].ends_with("in metres"), "{assumed:?}");
    assert!(
        assumed[1].starts_with("all 2 strands are guides"),
        "{assumed:?}"
    );
    assert_eq!(assumed.len(), 2);
}

#[test]
fn all_arrays_of_tressfx_are_kept() {
    let mut bytes = tfx_4();
    let at = |bytes: &mut Vec<u8>, at: usize, n: u32| {
        bytes[at..at + 4].copy_from_slice(&n.to_le_bytes());
    };
    for (offset_at, n) in [(20, 16), (24, 2), (28, 32)] {
        let end = bytes.len() as u32;
        at(&mut bytes, offset_at, end);
        bytes.extend((0..n).flat_map(|ix| (0.5 + ix as f32).to_le_bytes()));
    }
    let groom = import("tfx", &bytes, &cm()).unwrap().groom;
    assert_eq!(data(&groom, "tfx_thickness"), [0.5, 1.5]);
    assert_eq!(data(&groom, "tfx_color").len(), 32);
    assert_eq!(data(&groom, "tfx_uv").len(), 16);
    assert!(export(&groom, "tfx").bytes == bytes);
    // In another order they are read, and a note says that the file changes.
    at(&mut bytes, 24, 160);
    let import = import("tfx", &bytes, &cm()).unwrap();
    let dropped = notes(&import, NoteKind::Dropped);
    assert!(dropped[0].contains("byte for byte"), "{dropped:?}");
    assert_eq!(data(&import.groom, "tfx_thickness").len(), 2);
}

#[test]
fn older_tressfx_goes_out_as_version_4() {
    for (held, masses) in [(0, [0.0, 0.0, 1.0, 1.0]), (1, [0.0; 4])] {
        let old = import("tfx", &tfx_3(held), &ImportOptions::default()).unwrap();
        assert_eq!(old.groom.source.cm_per_unit, 1.0);
        let assumed = notes(&old, NoteKind::Assumed);
        assert!(assumed[0].contains("version 3"), "{assumed:?}");
        assert!(
            assumed[1].contains("3 follow hairs around each"),
            "{assumed:?}"
        );
        let bytes = export(&old.groom, "tfx").bytes;
        assert_eq!(bytes.len(), 160 + 2 * 4 * 16);
        // In metres, as files of version 4 are; to the rounding of that.
        let new = import("tfx", &bytes, &ImportOptions::default()).unwrap();
        let new = new.groom;
        assert_eq!(old.groom.points, [curve(4, 0.0), curve(4, 1.0)].concat());
        for (new, old) in new.points.iter().zip(&old.groom.points) {
            for (new, old) in new.iter().zip(old) {
                assert!((new - old).abs() <= 1e-6 * old.abs(), "{new} {old}");
            }
        }
        assert_eq!(data(&new, "inverse_mass")[4..], masses);
    }
}

#[test]
fn tressfx_text_is_read() {
    let text = import("tfx", TFX_2.as_bytes(), &ImportOptions::default()).unwrap();
    let groom = &text.groom;
    assert_eq!(groom.strand_offsets, [0, 3, 7]);
    assert_eq!(groom.points[0], [-2.28788, 107.007, 23.5948]);
    assert_eq!(groom.points[6], [4.0, 0.5, 0.0]);
    assert_eq!(data(groom, "root_uv"), [0.25, 0.0, 0.5, 0.75]);
    assert_eq!(data(groom, "inverse_mass"), [0.0; 7]);
    assert_eq!(notes(&text, NoteKind::Dropped), [""; 0]);

    let with = |old: &str, new: &str| TFX_2.replace(old, new).into_bytes();
    let moved = import("tfx", &with("scale 1.0", "scale 2.5"), &cm()).unwrap();
    assert_eq!(
        notes(&moved, NoteKind::Dropped),
        ["`scale 2.5` of the file is not applied"]
    );
    let read = |bytes: &[u8]| {
        let error = format("tfx").read(bytes, &cm());
        error.unwrap_err().to_string()
    };
    for (bytes, needle) in [
        (
            with("2.0", "7.0"),
            "\"version 7.0\" is not a version of TressFX text",
        ),
        (
            with("numStrands 2", "numStrands 3"),
            "file has 2 strands, but says numStrands 3",
        ),
        (with("numStrands 2\n", ""), "does not say numStrands"),
        (with("numStrands 2", "numStrands x"), "is not a count"),
        (
            with("numVerts 3", "numVerts 4"),
            "\"strand 1 numVerts 4 texcoord 0.5 0.75\" is not a point",
        ),
        (
            with("numVerts 3", "numVerts 2"),
            "\"1 1 2.5\" is not `strand I numVerts N",
        ),
        (
            with("numVerts 4", "numVerts 4000000000"),
            "file ends after 4 of 4000000000 points of strand 1",
        ),
        (with("0 1 2\n", "0 1\n"), "\"0 1\" is not a point, `x y z`"),
        (with("0 1 2\n", "0 nan 2\n"), "\"0 nan 2\" is not a point"),
        (with("0 1 2\n", "0 2e9 2\n"), "strand 0, point 1 is"),
    ] {
        let message = read(&bytes);
        assert!(message.contains(needle), "{message:?} lacks {needle:?}");
    }
}

#[test]
fn unequal_strands_are_resampled_for_tressfx() {
    let mut uneven = groom(&[3, 9, 5]);
    let uv = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
    uneven
        .attributes
        .push(attribute("root_uv", Domain::Strand, 2, &uv));
    let held = [vec![0.0, 0.0, 1.0], vec![0.0; 9], vec![1.0; 5]].concat();
    uneven
        .attributes
        .push(attribute("inverse_mass", Domain::Point, 1, &held));
    let exported = export(&uneven, "tfx");
    assert_eq!(exported.dropped, ["diameter"]);
    let said: Vec<_> = exported.notes.iter().map(|note| &*note.text).collect();
    assert_eq!(
        said,
        ["strands of 3 to 9 points are resampled to 16 points each"]
    );
    let back = import("tfx", &exported.bytes, &ImportOptions::default())
        .unwrap()
        .groom;
    assert_eq!(back.strand_offsets, [0, 16, 32, 48]);
    assert_eq!(data(&back, "root_uv"), uv);
    assert!(
        data(&back, "inverse_mass")
            .iter()
            .all(|&mass| mass == 0.0 || mass == 1.0)
    );
    assert_eq!(back.points[0], uneven.points[0]);
    let end = |points: &[[f32; 3]], ix: usize| points[ix].map(|x| (x * 1e4).round());
    assert_eq!(end(&back.points, 31), end(&uneven.points, 11));
    // Whatever there is, a strand has 4 to 64 points.
    for (n, expected) in [(2, 4), (4, 4), (5, 8), (64, 64), (100, 64)] {
        let bytes = export(&groom(&[n]), "tfx").bytes;
        assert_eq!(bytes[8..12], words(&[expected]), "{n}");
    }
}

#[test]
fn lies_of_tressfx_are_named() {
    let with = |good: Vec<u8>, at: usize, word: u32| {
        let mut bytes = good;
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        bytes
    };
    for (bytes, needle) in [
        (
            with(tfx_4(), 4, 3),
            "positions take 192 bytes, the file has 144 left (at byte 160)",
        ),
        (
            with(tfx_4(), 4, u32::MAX),
            "number of points is 17179869180",
        ),
        (with(tfx_4(), 8, u32::MAX), "number of points is 8589934590"),
        (with(tfx_4(), 8, 0), "strands with two points or more is 0"),
        (with(tfx_4(), 8, 1), "strands with two points or more is 0"),
        (with(tfx_4(), 12, 0), "file has no positions (at byte 12)"),
        (
            with(tfx_4(), 12, 100),
            "offset 100 of the positions is not behind the header",
        ),
        (
            with(tfx_4(), 16, 300),
            "root_uv take 16 bytes, the file has 4 left",
        ),
        (
            with(tfx_4(), 16, u32::MAX),
            "offset 4294967295 of the root_uv",
        ),
        (
            with(tfx_4(), 160, f32::NAN.to_bits()),
            "strand 0, point 0 is [NaN",
        ),
        (
            with(tfx_4(), 172, f32::INFINITY.to_bits()),
            "attribute inverse_mass[0] is inf",
        ),
        (with(tfx_3(0), 160, 300), "marks some strands as guides"),
        (
            with(tfx_3(0), 0, 5f32.to_bits()),
            "of no version of TressFX",
        ),
    ] {
        let read = format("tfx").read(&bytes, &cm());
        let error = read.and_then(|import| import.groom.validate()).unwrap_err();
        let message = error.to_string();
        assert!(message.contains(needle), "{message:?} lacks {needle:?}");
    }
}
