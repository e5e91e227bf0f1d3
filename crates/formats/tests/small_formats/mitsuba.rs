//! Mitsuba's curves.

use super::*;

#[test]
fn mitsuba_curves_come_back() {
    let small = Groom {
        points: vec![
            [1.0, 2.5, -3.0],
            [0.1, 0.0, 1e-7],
            [7.0, 8.0, 9.0],
            [7.0, 8.5, 9.0],
        ],
        strand_offsets: vec![0, 2, 4],
        attributes: vec![attribute("diameter", Domain::Strand, 1, &[0.02, 0.5])],
        ..Groom::default()
    };
    let exported = export(&small, "mitsuba");
    let expected =
        "1 2.5 -3 0.01 # linearcurve\n0.1 0 0.0000001 0.01\n\n7 8 9 0.25\n7 8.5 9 0.25\n";
    assert_eq!(String::from_utf8(exported.bytes).unwrap(), expected);
    assert_eq!((exported.dropped, exported.notes), (vec![], vec![]));

    for groom in [groom(&[2, 5, 30]), groom(&[4; 12])] {
        let bytes = export(&groom, "mitsuba").bytes;
        assert!(
            bytes
                .split(|&byte| byte == b'\n')
                .all(|line| line.len() < 1024)
        );
        let import = import("mitsuba", &bytes, &ImportOptions::default()).unwrap();
        let back = import.groom;
        assert_eq!(
            (&back.points, &back.strand_offsets),
            (&groom.points, &groom.strand_offsets)
        );
        assert_eq!(back.attribute("diameter"), groom.attribute("diameter"));
        assert_eq!(import.notes, []);
        for up in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
            let again = self::import("mitsuba", &bytes, &cm().with_up(up)).unwrap();
            assert!(export(&again.groom, "mitsuba").bytes == bytes, "{up:?}");
        }
    }
    // No thickness at all.
    let mut plain = small;
    plain.attributes.clear();
    let exported = export(&plain, "mitsuba");
    assert!(
        exported
            .bytes
            .starts_with(b"1 2.5 -3 0.004 # linearcurve\n")
    );
    assert!(
        exported.notes[0].text.contains("0.008 cm"),
        "{:?}",
        exported.notes
    );
}

#[test]
fn mitsuba_files_that_say_nothing_are_splines_where_they_can_be() {
    let four = b"-1.0 0 0 1\n-0.3 0 0 1\n 0.3 0 0 1\n 1.0 0 0 3\n";
    let spline = import("mitsuba", four, &ImportOptions::default()).unwrap();
    assert_eq!(spline.groom.points.len(), 5);
    // (p0 + 4 p1 + p2) / 6, and the radii likewise, doubled.
    assert!((spline.groom.points[0][0] + 1.9 / 6.0).abs() < 1e-6);
    let thickness = data(&spline.groom, "thickness");
    assert!((thickness[4] - 2.0 * (1.0 + 4.0 + 3.0) / 6.0).abs() < 1e-6);
    let assumed = notes(&spline, NoteKind::Assumed);
    assert!(assumed[0].contains("B-splines"), "{assumed:?}");
    let fine = ImportOptions::default().with_samples_per_segment(16);
    assert_eq!(
        import("mitsuba", four, &fine).unwrap().groom.points.len(),
        17
    );

    let three = [&four[..], b"\n\n \n0 0 0 0.1\n0 1 0 0.1\n0 2 0 0\n\n"].concat();
    let lines = import("mitsuba", &three, &ImportOptions::default()).unwrap();
    assert_eq!(lines.groom.strand_offsets, [0, 4, 7]);
    let assumed = notes(&lines, NoteKind::Assumed);
    assert!(assumed[0].contains("polylines"), "{assumed:?}");

    let said = [&b"# bsplinecurve\n"[..], &four[..]].concat();
    let said = import("mitsuba", &said, &ImportOptions::default()).unwrap();
    assert_eq!((said.groom.points.len(), said.notes.len()), (5, 0));

    for (text, needle) in [
        (&b"0 0 0 1\n0 1 0\n"[..], "\"0 1 0\" is not a control point"),
        (b"0 0 0 1\n0 1 0 nan\n", "is not a control point"),
        (b"0 0 0 1\n0 1 0 1 1\n", "is not a control point"),
        (b"0 0 0 1\n0 1e9 0 1\n", "strand 0, point 1"),
        (b"0 0 0 1\n\n1 1 1 1\n", "two points or more is 0"),
        (
            b"# bsplinecurve\n0 0 0 1\n1 0 0 1\n",
            "control points of B-spline 0 is 2",
        ),
        (b"", "two points or more is 0"),
    ] {
        let error = format("mitsuba").read(text, &cm()).unwrap_err();
        let message = error.to_string();
        assert!(message.contains(needle), "{message:?} lacks {needle:?}");
    }
}

/// What is damaged in a file that says what it is, the reader tells, wherever it is.
#[test]
fn a_stated_shape_is_known_by_a_damaged_start() {
    let bytes = export(&groom(&[20, 20]), "mitsuba").bytes;
    let text = String::from_utf8(bytes).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let with = |line: usize, by: &str| {
        let mut lines = lines.clone();
        lines[line] = by;
        lines.join("\n")
    };
    let is_known = |text: &str| {
        let file = SourceFile::from_bytes(text.as_bytes());
        file.is_ok_and(|file| file.format().info().name == "mitsuba")
    };
    for (text, is_known_unstated) in [
        // Four floats, so a control point, if not one to render.
        (with(3, "0 nan 0 0.004"), true),
        (with(3, "0 1 0 inf"), true),
        (with(3, "0 1 0"), false),
        (with(3, "0 1 0 -0.004"), false),
    ] {
        assert!(is_known(&text), "{text}");
        let unstated = text.replace(" # linearcurve", "");
        assert_eq!(is_known(&unstated), is_known_unstated, "{unstated}");
    }
    assert!(is_known("# linearcurve\n0 0 0 0.1\n1 nan 1 0.1\n"));
    assert!(!is_known("import curves # linearcurve\n1 2 3 4\nx = 3\n"));
}
