//! Real files.

use super::*;

/// Files of `STRANDLIGHT_SAMPLES/hair`: format, strands, points.
const REAL: [(&str, &str, usize, usize); 14] = [
    ("cyuksel_straight.hair", "hair", 10_000, 160_000),
    ("tressfx2_unity/hair_free_16_guide.tfx", "tfx", 3942, 63_072),
    ("tressfx2_unity/hair_front_16_guide.tfx", "tfx", 93, 1488),
    ("tressfx2_unity/hair_pulled_16_guide.tfx", "tfx", 517, 8272),
    ("tressfx2_unity/hair_tail_16_guide.tfx", "tfx", 474, 7584),
    ("tressfx3_bear/bear.tfx", "tfx", 48_113, 192_452),
    ("tressfx3_ponytail/back.tfx", "tfx", 517, 8272),
    ("tressfx3_ponytail/front_top.tfx", "tfx", 876, 14_016),
    ("tressfx3_ponytail/side.tfx", "tfx", 3066, 49_056),
    ("tressfx3_ponytail/tail.tfx", "tfx", 474, 7584),
    ("tressfx4_ratboy/Ratboy_mohawk.tfx", "tfx", 2228, 71_296),
    ("misc/mitsuba_curve.txt", "mitsuba", 1, 5),
    ("misc/mitsuba_curve_doc.txt", "mitsuba", 1, 17),
    ("misc/appleseed_single_strand.txt", "", 0, 0),
];

#[test]
fn real_files_are_read() {
    let Some(folder) = std::env::var_os("STRANDLIGHT_SAMPLES") else {
        return;
    };
    let folder = std::path::PathBuf::from(folder).join("hair");
    for (name, format_name, n_strands, n_points) in REAL {
        let path = folder.join(name);
        let Ok(file) = SourceFile::read(&path) else {
            assert_eq!(format_name, "", "{name}");
            continue;
        };
        assert_eq!(file.format().info().name, format_name, "{name}");
        let import = file.import(&ImportOptions::default()).unwrap();
        let groom = &import.groom;
        assert_eq!(
            (groom.n_strands(), groom.points.len()),
            (n_strands, n_points),
            "{name}"
        );
        let attributes: Vec<&str> = groom.attributes.iter().map(|a| &*a.name).collect();
        let unit = groom.source.cm_per_unit;
        println!("{name}: {format_name}, {n_strands} x {n_points}, {unit} cm, {attributes:?}");
        for note in &import.notes {
            println!("    {note}");
        }
        // Out and in again: the same points, in centimetres and as far as equal strands go.
        let in_cm = file.import(&cm()).unwrap().groom;
        let again = export(&in_cm, format_name);
        let back = self::import(format_name, &again.bytes, &cm())
            .unwrap()
            .groom;
        assert_eq!(back.points, in_cm.points, "{name}");
        let bytes = std::fs::read(&path).unwrap();
        if format_name == "hair" || name.contains("tressfx4") {
            assert!(again.bytes == bytes, "{name}");
        }
    }
    for name in [
        "tressfx4_ratboy/Ratboy_mohawk.tfxbone",
        "tressfx3_bear/bear.tfxproj",
    ] {
        let error = SourceFile::read(&folder.join(name)).unwrap_err();
        assert!(matches!(error, Error::NotThisKind { .. }), "{error}");
    }
}
