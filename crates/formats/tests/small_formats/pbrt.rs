//! pbrt's curves.

use super::*;

#[test]
fn pbrt_curves_come_back_byte_for_byte() {
    let small = Groom {
        points: vec![[0.0, 0.0, 0.0], [3.0, 6.0, -1.5]],
        strand_offsets: vec![0, 2],
        attributes: vec![attribute("diameter", Domain::Point, 1, &[0.02, 0.01])],
        ..Groom::default()
    };
    let expected = "Shape \"curve\" \"string type\" \"cylinder\" \"string basis\" \"bezier\" \
        \"integer degree\" 3 \"float width0\" 0.02 \"float width1\" 0.01 \"point3 P\" [\n\
        0 0 0\n1 2 -0.5\n2 4 -1\n3 6 -1.5\n]\n";
    let exported = export(&small, "pbrt");
    assert_eq!(String::from_utf8(exported.bytes).unwrap(), expected);
    assert_eq!((exported.dropped, exported.notes), (vec![], vec![]));

    let groom = groom(&[2, 5, 30]);
    let bytes = export(&groom, "pbrt").bytes;
    for up in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
        let import = import("pbrt", &bytes, &cm().with_up(up)).unwrap();
        assert_eq!(import.notes, []);
        assert_eq!(import.groom.strand_offsets, groom.strand_offsets);
        assert!(up != UpAxis::Y || import.groom.points == groom.points);
        assert!(export(&import.groom, "pbrt").bytes == bytes, "{up:?}");
        let [old, new] = [&groom, &import.groom].map(|groom| data(groom, "diameter"));
        assert!(
            old.iter()
                .zip(new)
                .all(|(old, new)| (old - new).abs() < 1e-7)
        );
    }
    // Thick in the middle: lost, and said.
    let mut bent = groom;
    bent.attributes[0].data[3] = 0.5;
    let said = &export(&bent, "pbrt").notes[0].text;
    assert!(said.starts_with("the widths of 1 strand are"), "{said}");
}

#[test]
fn pbrt_scenes_are_looked_through_for_curves() {
    let scene = "# a scene\nLookAt 0 0 5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 45\n\
        WorldBegin\nAttributeBegin\nTranslate 0 1 0\nMaterial \"hair\" \"rgb sigma_a\" [1 2 3]\n\
        Shape \"sphere\" \"float radius\" 2\n\
        Shape \"curve\" \"bool fast\" [ true ] \"point3 P\" [ 0 0 0 0 1 0 # a comment ]\n 1 2 0 1 3 0 ]\n\
        \"string basis\" [\"bspline\"] \"float width\" [ 0.5 ]\n\
        Shape \"curve\" \"integer degree\" [2] \"point P\" [0 0 0 2 4 0 4 0 0] \"float width1\" 0.25\n\
        AttributeEnd\nInclude \"more.pbrt\"\n";
    let found = import("pbrt", scene.as_bytes(), &ImportOptions::default()).unwrap();
    assert_eq!(found.groom.strand_offsets, [0, 5, 10]);
    // (p0 + 4 p1 + p2) / 6
    let first = found.groom.points[0];
    assert!(
        (first[0] - 1.0 / 6.0).abs() < 1e-6 && (first[1] - 1.0).abs() < 1e-6,
        "{first:?}"
    );
    assert_eq!(found.groom.points[9], [4.0, 0.0, 0.0]);
    let thickness = data(&found.groom, "thickness");
    assert_eq!((thickness[0], thickness[5], thickness[9]), (0.5, 1.0, 0.25));
    let dropped = notes(&found, NoteKind::Dropped);
    for needle in [
        "1 transforms are not applied",
        "1 other shapes",
        "1 included files",
    ] {
        assert!(
            dropped.iter().any(|note| note.contains(needle)),
            "{dropped:?}"
        );
    }
    let curve = |parameters: &str| format!("Shape \"curve\" {parameters}");
    for (text, needle) in [
        (curve(""), "a curve has no points P (at byte 0)"),
        (
            curve("\"point3 P\" [0 0 0 1 1 1 2 2 2]"),
            "curve 0 is 3 points, must be 1 + 3 n",
        ),
        (
            curve("\"point3 P\" [0 0 0 1]"),
            "P has 4 numbers, not three a point",
        ),
        (
            curve("\"point3 P\" [0 0 x]"),
            "\"x\" is no number (at byte 30)",
        ),
        (curve("\"point3 P\" [0 0 0"), "file ends within a parameter"),
        (
            curve("\"point3 P"),
            "a quote is not closed on its line (at byte 14)",
        ),
        (
            curve("\"point3 P\" [0 0 0 1 1 1] \"integer degree\" 2"),
            "2 points of degree 2",
        ),
        (
            curve("\"point3 P\" [0 0 0 1 1 1] \"integer degree\" 1"),
            "degree 1, must be degree 2 or 3",
        ),
        (
            curve("\"point3 P\" [0 0 0] \"string basis\" \"catmull\""),
            "neither bezier nor bspline",
        ),
        (
            curve("\"point3 P\" [0 0 0 1 1 1 2 2 2 1e9 3 3]"),
            "strand 0, point ",
        ),
        ("WorldBegin\n".to_owned(), "two points or more is 0"),
    ] {
        let error = format_error("pbrt", text.as_bytes());
        assert!(error.contains(needle), "{error:?} lacks {needle:?}");
    }
}
