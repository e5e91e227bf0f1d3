//! `.hair` files: every combination of flags comes back byte for byte.

use proptest::prelude::*;
use strandlight_formats::{
    Attribute, BakedFile, Domain, Error, ExportOptions, Groom, ImportOptions, NoteKind, Result,
    SourceFile, UpAxis, groom_format,
};

/// Bits of the header's flags.
mod flag {
    pub const SEGMENTS: u32 = 1;
    pub const POINTS: u32 = 2;
    pub const THICKNESS: u32 = 4;
    pub const TRANSPARENCY: u32 = 8;
    pub const COLOR: u32 = 16;
}

fn from_hair(bytes: &[u8], options: ImportOptions) -> Result<Groom> {
    let file = SourceFile::from_bytes(bytes)?;
    assert_eq!(file.format().info().name, "hair");
    Ok(file.import(&options)?.groom)
}

fn to_hair(groom: &Groom) -> Vec<u8> {
    let format = groom_format("hair").unwrap();
    groom
        .export(format, &ExportOptions::default())
        .unwrap()
        .bytes
}

/// A `.hair` file with the arrays of `flags`; `lengths` are points a strand. Without a segments
/// array all lengths must be equal.
fn hair_file(flags: u32, lengths: &[u16], salt: u32) -> Vec<u8> {
    let n_points: u32 = lengths.iter().map(|&n| u32::from(n)).sum();
    let value = |ix: u32| (ix.wrapping_mul(2_654_435_761) ^ salt) as i32 as f32 / 1e6;
    let mut bytes = b"HAIR".to_vec();
    for word in [lengths.len() as u32, n_points, flags] {
        bytes.extend(word.to_le_bytes());
    }
    let default_segments = lengths.first().map_or(0, |&n| u32::from(n) - 1);
    bytes.extend(default_segments.to_le_bytes());
    for default in [0.25f32, 0.5, 0.1, 0.2, 0.3] {
        bytes.extend(default.to_le_bytes());
    }
    bytes.extend((0..88u32).map(|ix| (ix * 7 + salt) as u8));
    if flags & flag::SEGMENTS != 0 {
        bytes.extend(lengths.iter().flat_map(|n| (n - 1).to_le_bytes()));
    }
    let mut floats = |n: u32| bytes.extend((0..n).flat_map(|ix| value(ix).to_le_bytes()));
    floats(3 * n_points);
    for (bit, components) in [
        (flag::THICKNESS, 1),
        (flag::TRANSPARENCY, 1),
        (flag::COLOR, 3),
    ] {
        if flags & bit != 0 {
            floats(components * n_points);
        }
    }
    bytes
}

fn through_groom_file(bytes: &[u8], options: ImportOptions) -> Vec<u8> {
    let groom = from_hair(bytes, options).unwrap();
    let groom = Groom::from_bytes(&groom.to_bytes().unwrap()).unwrap();
    to_hair(&groom)
}

#[test]
fn every_flag_combination_is_lossless() {
    let mut n_checked = 0;
    for arrays in 0..16u32 {
        let flags = flag::POINTS | (arrays & 1) | (arrays >> 1 << 2);
        let lengths: &[u16] = match flags & flag::SEGMENTS {
            0 => &[4, 4, 4],
            _ => &[2, 1, 5, 1, 1, 3, 1],
        };
        let bytes = hair_file(flags, lengths, arrays);
        for up in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
            let options = ImportOptions::default().with_up(up);
            assert!(
                through_groom_file(&bytes, options) == bytes,
                "flags {flags} up {up:?}"
            );
            n_checked += 1;
        }
    }
    assert_eq!(n_checked, 48);
}

#[test]
fn meaning_of_the_arrays() {
    let flags = flag::POINTS | flag::SEGMENTS | flag::COLOR;
    let bytes = hair_file(flags, &[2, 1, 3], 0);
    let groom = from_hair(&bytes, ImportOptions::default()).unwrap();
    assert_eq!(groom.strand_offsets, [0, 2, 5]);
    let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    // z up: (x, y, z) becomes (x, z, -y). Points start after three u16.
    let start = 128 + 6;
    assert_eq!(
        groom.points[0],
        [float(start), float(start + 8), -float(start + 4)]
    );
    // The single point is left out: the third point of the groom is the fourth of the file.
    assert_eq!(groom.points[2][0], float(start + 36));
    let color = groom.attribute("color").unwrap();
    assert_eq!((color.domain, color.components), (Domain::Point, 3));
    assert_eq!(color.data.len(), 15);
    let thickness = groom.attribute("thickness").unwrap();
    assert_eq!(
        (thickness.domain, &thickness.data[..]),
        (Domain::Groom, &[0.25][..])
    );
    let diameter = groom.attribute("diameter").unwrap();
    assert_eq!(
        (diameter.domain, &diameter.data[..]),
        (Domain::Groom, &[0.25][..])
    );
    assert_eq!(groom.source.n_set_aside(), 1);
    let original = groom.source.original.unwrap();
    assert_eq!(original.format, "hair");
    // The header, then the index of the single point.
    assert_eq!(original.data.len(), 128 + 36);
    assert_eq!(
        (&original.data[..128], &original.data[128..132]),
        (&bytes[..128], &[1, 0, 0, 0][..])
    );
}

#[test]
fn other_units_come_back_within_two_units_in_the_last_place() {
    let bytes = hair_file(flag::POINTS | flag::SEGMENTS, &[5, 9, 2], 7);
    let options = ImportOptions::default().with_unit(2.54);
    let groom = from_hair(&bytes, options).unwrap();
    let back = to_hair(&groom);
    let start = 128 + 6;
    assert_eq!(back[..start], bytes[..start]);
    let floats = |bytes: &[u8]| -> Vec<f32> {
        bytes[start..]
            .chunks(4)
            .map(|four| f32::from_le_bytes(four.try_into().unwrap()))
            .collect()
    };
    let (old, new) = (floats(&bytes), floats(&back));
    assert!(!old.is_empty() && old.len() == new.len());
    for (old, new) in old.into_iter().zip(new) {
        assert!(
            (old - new).abs() <= 2.0 * f32::EPSILON * old.abs(),
            "{old} {new}"
        );
    }
}

fn message(bytes: &[u8]) -> String {
    from_hair(bytes, ImportOptions::default())
        .unwrap_err()
        .to_string()
}

#[test]
fn lies_are_named() {
    let good = hair_file(31, &[2, 3], 1);
    let with = |at: usize, word: u32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        bytes
    };
    assert!(from_hair(&good, ImportOptions::default()).is_ok());
    for (bytes, part) in [
        (with(4, u32::MAX), "promises 8589934590 bytes of segments"),
        (with(8, u32::MAX), "promises 51539607540 bytes of points"),
        (with(8, 6), "promises"),
        (with(8, 4), "bytes after the last array"),
        (with(12, 63), "flags 0x3f"),
        (with(12, 29), "no points"),
        (with(12, 30), "bytes after"),
        (with(0, 0), "not a file of hair: it is of an unknown format"),
        (with(132, f32::NAN.to_bits()), "strand 0, point 0"),
        (with(132 + 36, f32::INFINITY.to_bits()), "strand 1, point 1"),
        (
            with(132 + 60, f32::NAN.to_bits()),
            "thickness of strand 0, point 0",
        ),
        // Only what is used has to make sense.
        (
            {
                let mut bytes = hair_file(3, &[2, 3], 1);
                bytes[20..24].copy_from_slice(&f32::NAN.to_le_bytes());
                bytes
            },
            "default thickness (byte 20) is NaN, must be finite",
        ),
        (Vec::new(), "empty"),
        (
            b"Ogawa\0\0\x01".to_vec(),
            "Alembic archive (Ogawa), unfinished; hair is imported from .hair",
        ),
        (
            b"Bgeo V".to_vec(),
            "Houdini geometry (old .bgeo); hair is imported from .hair",
        ),
        (b"#?RADIANCE\n".to_vec(), "`strandlight lights`"),
        (
            own_groom(Domain::Groom, &[1.0]).to_bytes().unwrap(),
            "it is a groom",
        ),
        (good[..100].to_vec(), "within its 128-byte header"),
        (hair_file(3, &[1, 1], 0), "two points or more"),
        (hair_file(3, &[], 0), "two points or more"),
    ] {
        let message = message(&bytes);
        assert!(message.contains(part), "{message:?} lacks {part:?}");
    }
    // 4 billion strands of 4 billion points by default, in 128 bytes.
    let mut bytes = hair_file(2, &[], 0);
    bytes[4..12].fill(0xff);
    bytes[16..20].fill(0xff);
    assert!(message(&bytes).contains("promises"));
}

#[test]
fn every_truncation_and_a_trailing_byte_are_refused() {
    let good = hair_file(31, &[2, 1, 3], 3);
    for length in 0..good.len() {
        assert!(
            from_hair(&good[..length], ImportOptions::default()).is_err(),
            "{length}"
        );
    }
    let mut long = good;
    long.push(0);
    assert!(matches!(
        from_hair(&long, ImportOptions::default()),
        Err(Error::Invalid { .. })
    ));
}

/// Points and colours, all strands of the header's length, as in the models of Cem Yuksel; and his
/// straight.hair where the environment variable STRANDLIGHT_SAMPLES names a folder with it.
#[test]
fn hair_of_equal_strands() {
    let made = hair_file(flag::POINTS | flag::COLOR, &[16; 50], 5);
    let z = |ix: usize| {
        let at = 128 + 12 * ix + 8;
        f32::from_le_bytes(made[at..at + 4].try_into().unwrap())
    };
    let extent =
        (0..800).map(z).fold(f32::MIN, f32::max) - (0..800).map(z).fold(f32::MAX, f32::min);
    let mut files = vec![(made.clone(), [50, 800], extent)];
    if let Some(folder) = std::env::var_os("STRANDLIGHT_SAMPLES") {
        let path = std::path::Path::new(&folder).join("hair/cyuksel_straight.hair");
        let bytes =
            std::fs::read(&path).expect("STRANDLIGHT_SAMPLES has hair/cyuksel_straight.hair");
        // Up is +Y: the tallest extent of the model.
        files.push((bytes, [10_000, 160_000], 86.0));
    }
    for (bytes, counts, extent) in files {
        let groom = from_hair(&bytes, ImportOptions::default()).unwrap();
        assert_eq!([groom.n_strands(), groom.points.len()], counts);
        let (min, max) = groom.bounds();
        let found = max[1] - min[1];
        assert!(
            (found / extent - 1.0).abs() < 0.05,
            "{min:?} {max:?} {extent}"
        );
        assert!(through_groom_file(&bytes, ImportOptions::default()) == bytes);
    }
}

/// A groom of two strands, 2 and 3 points, that no program imported.
fn own_groom(domain: Domain, diameter: &[f32]) -> Groom {
    Groom {
        points: (0..5).map(|ix| [ix as f32, 1.0, 2.0]).collect(),
        strand_offsets: vec![0, 2, 5],
        attributes: vec![Attribute {
            name: "diameter".to_owned(),
            domain,
            components: 1,
            data: diameter.to_vec(),
        }],
        ..Groom::default()
    }
}

fn diameter(groom: &Groom) -> &Attribute {
    groom.attribute("diameter").unwrap()
}

#[test]
fn the_diameter_of_a_groom_is_exported_as_thickness() {
    let word = |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let float = |bytes: &[u8], at: usize| f32::from_bits(word(bytes, at));

    // One value for all is the default.
    let constant = to_hair(&own_groom(Domain::Groom, &[0.0123]));
    assert_eq!(word(&constant, 12) & flag::THICKNESS, 0);
    assert_eq!(float(&constant, 20), 0.0123);
    let back = from_hair(&constant, ImportOptions::default()).unwrap();
    assert_eq!(diameter(&back).data, [0.0123]);

    // Values of points and of strands are the array.
    let own = [0.011, 0.012, 0.013, 0.014, 0.001];
    for (groom, expected) in [
        (own_groom(Domain::Point, &own), own),
        (
            own_groom(Domain::Strand, &[0.1, 0.2]),
            [0.1, 0.1, 0.2, 0.2, 0.2],
        ),
    ] {
        let bytes = to_hair(&groom);
        assert_eq!(word(&bytes, 12) & flag::THICKNESS, flag::THICKNESS);
        let back = from_hair(&bytes, ImportOptions::default()).unwrap();
        assert_eq!(diameter(&back).data, expected);
        assert_eq!(back.points, groom.points);
        assert!(to_hair(&back) == bytes);
    }

    // Without a diameter it is drawn 0.008 cm thick, and so it is written.
    let mut bare = own_groom(Domain::Groom, &[1.0]);
    bare.attributes.clear();
    assert_eq!(float(&to_hair(&bare), 20), 0.008);
}

#[test]
fn a_changed_diameter_is_exported_in_the_unit_of_the_file() {
    // Points only, single ones among them; the default thickness is 0.25 inches.
    let bytes = hair_file(flag::POINTS | flag::SEGMENTS, &[2, 1, 3], 5);
    let inches = ImportOptions::default().with_unit(2.54);
    let mut groom = from_hair(&bytes, inches.clone()).unwrap();
    let own = [0.254, 0.508, 0.762, 1.016, 1.27];
    for attribute in &mut groom.attributes {
        if attribute.name == "diameter" {
            attribute.domain = Domain::Point;
            attribute.data = own.to_vec();
        }
    }
    let file = to_hair(&groom);
    let thickness: Vec<f32> = file[file.len() - 24..]
        .chunks(4)
        .map(|four| f32::from_le_bytes(four.try_into().unwrap()))
        .collect();
    // The single point keeps the default it had.
    for (found, expected) in thickness.iter().zip([0.1f32, 0.2, 0.25, 0.3, 0.4, 0.5]) {
        assert!((found - expected).abs() <= 1e-7, "{thickness:?}");
    }
    let back = from_hair(&file, inches.clone()).unwrap();
    for (found, expected) in diameter(&back).data.iter().zip(own) {
        assert!((found - expected).abs() <= f32::EPSILON * expected);
    }
}

#[test]
fn magic_in_small_letters_is_read_and_written_in_capitals() {
    let good = hair_file(31, &[2, 1, 3], 3);
    for magic in [b"hair", b"Hair"] {
        let mut bytes = good.clone();
        bytes[..4].copy_from_slice(magic);
        assert!(through_groom_file(&bytes, ImportOptions::default()) == good);
    }
}

/// A file of 2 and 3 points whose thickness array is `thickness`; the default is 0.25.
fn with_thickness(thickness: [f32; 5]) -> Vec<u8> {
    let flags = flag::POINTS | flag::SEGMENTS | flag::THICKNESS;
    let mut bytes = hair_file(flags, &[2, 3], 0);
    let start = bytes.len() - 20;
    for (at, value) in (start..).step_by(4).zip(thickness) {
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }
    bytes
}

#[test]
fn thickness_that_cannot_be_drawn_is_counted() {
    let import = |bytes: &[u8], cm_per_unit| {
        let options = ImportOptions::default().with_unit(cm_per_unit);
        from_hair(bytes, options).unwrap()
    };
    let good = import(&with_thickness([0.1, 0.2, 0.3, 0.2, 1e-6]), 1.0);
    assert_eq!(good.thickness_faults(), None);
    assert_eq!(diameter(&good).data.len(), 5);

    // Tips that taper to nothing.
    let tips = import(&with_thickness([0.1, 0.0, 0.2, 0.1, 1e-9]), 1.0);
    assert_eq!(diameter(&tips).data, [0.1, 1e-6, 0.2, 0.1, 1e-6]);
    let faults = tips.thickness_faults().unwrap();
    assert_eq!((faults.too_thin, faults.is_left_out), (2, false));
    assert_eq!(
        faults.to_string(),
        "thickness: 2 of 5 values cannot be drawn (2 zero or below 1e-6 cm; first 0 at point 1 of \
         strand 0): drawn 1e-6 cm thick there"
    );

    // 0.5 units of 25 cm are above 10 cm.
    let bad = import(&with_thickness([0.01, 0.0, 0.01, -0.5, 0.5]), 25.0);
    assert_eq!(bad.attribute("diameter"), None);
    let faults = bad.thickness_faults().unwrap();
    assert_eq!(
        (faults.negative, faults.too_thick, faults.too_thin),
        (1, 1, 1)
    );
    assert_eq!(
        faults.to_string(),
        "thickness: 3 of 5 values cannot be drawn (1 negative, 1 above 10 cm, 1 zero or below \
         1e-6 cm; first -0.5 at point 1 of strand 1): all strands are drawn 0.008 cm thick"
    );

    // A default of zero, as programs write that know of no thickness.
    let mut zero = hair_file(flag::POINTS | flag::SEGMENTS, &[2, 3], 0);
    zero[20..24].fill(0);
    let zero = import(&zero, 1.0);
    assert_eq!(zero.attribute("diameter"), None);
    let text = zero.thickness_faults().unwrap().to_string();
    assert!(text.contains("first 0 at the default"), "{text}");
    assert!(
        text.ends_with("all strands are drawn 0.008 cm thick"),
        "{text}"
    );
}

#[test]
fn thickness_is_not_judged_where_a_file_has_widths_of_its_own() {
    // Enough strands for a head, with a thickness that in metres would be absurd.
    let (flags, lengths) = (flag::POINTS | flag::SEGMENTS, [3; 40]);
    let mut bytes = hair_file(flags, &lengths, 0);
    bytes[20..24].copy_from_slice(&0.2_f32.to_le_bytes());
    let groom = from_hair(&bytes, ImportOptions::default()).unwrap();
    assert_eq!(diameter(&groom).data, [0.2]);
    for name in ["usd", "alembic"] {
        let options = ExportOptions::default().with_unit(100.0);
        let format = groom_format(name).unwrap();
        let file = groom.export(format, &options).unwrap().bytes;
        let file = SourceFile::from_bytes(file).unwrap();
        let metres = ImportOptions::default().with_unit(100.0);
        let back = file.import(&metres).unwrap().groom;
        assert_eq!(back.attribute("thickness").unwrap().data, [0.2]);
        assert_eq!(back.thickness_faults(), None, "{name}");
        // Of what is drawn, not of the thickness that it carries.
        let centimetres = ExportOptions::default().with_unit(1.0);
        let hair = back.export(groom_format("hair").unwrap(), &centimetres);
        let hair = from_hair(&hair.unwrap().bytes, ImportOptions::default()).unwrap();
        assert!((diameter(&hair).data[0] - 0.2).abs() < 1e-6, "{name}");
    }
}

#[test]
fn what_was_assumed_and_set_aside_is_noted() {
    let mut bytes = hair_file(31, &[2, 1, 3], 3);
    bytes[..4].copy_from_slice(b"hair");
    let file = SourceFile::from_bytes(bytes).unwrap();
    let import = file.import(&ImportOptions::default()).unwrap();
    let kinds: Vec<NoteKind> = import.notes.iter().map(|note| note.kind).collect();
    assert_eq!(kinds, [NoteKind::Assumed, NoteKind::SetAside]);
    assert!(import.notes[0].text.contains("small letters"));
    let aside = "1 strand of a single point is kept for export but not drawn";
    assert_eq!(import.notes[1].to_string(), aside);
}

#[test]
fn a_file_can_be_written_in_another_unit() {
    // Single points and thickness among them, in inches.
    let bytes = hair_file(31, &[2, 1, 3], 3);
    let groom = from_hair(&bytes, ImportOptions::default().with_unit(2.54)).unwrap();
    let options = ExportOptions::default().with_unit(1.0).with_up(UpAxis::Y);
    let format = groom_format("hair").unwrap();
    let file = groom.export(format, &options).unwrap().bytes;
    let start = 128 + 6;
    assert_eq!(file[..20], bytes[..20]);
    let floats = |bytes: &[u8]| -> Vec<f64> {
        let four = |four: &[u8]| f32::from_le_bytes(four.try_into().unwrap());
        bytes.chunks(4).map(four).map(f64::from).collect()
    };
    let (old, new) = (floats(&bytes[start..]), floats(&file[start..]));
    let close = |found: f64, expected: f64| {
        assert!(
            (found - expected).abs() <= 1e-6 * expected.abs(),
            "{found} {expected}"
        );
    };
    for point in 0..6 {
        let [x, y, z] = [0, 1, 2].map(|axis| old[3 * point + axis] * 2.54);
        for (axis, expected) in [x, z, -y].into_iter().enumerate() {
            close(new[3 * point + axis], expected);
        }
        // Thickness is a length, transparency and colour are not.
        close(new[18 + point], old[18 + point] * 2.54);
        assert_eq!(new[24 + point], old[24 + point]);
    }
    assert_eq!(new[30..], old[30..]);
}

proptest! {
    #[test]
    fn random_files_are_lossless(
        arrays in 0u32..8,
        lengths in prop::collection::vec(1u16..6, 1..20),
        salt: u32,
    ) {
        prop_assume!(lengths.iter().any(|&n| n > 1));
        let bytes = hair_file(flag::POINTS | flag::SEGMENTS | (arrays << 2), &lengths, salt);
        prop_assert!(through_groom_file(&bytes, ImportOptions::default()) == bytes);
    }

    #[test]
    fn noise_is_answered(bytes in prop::collection::vec(any::<u8>(), 0..300), flags in 0u32..32) {
        let mut file = hair_file(flags, &[2, 2], 0);
        let n = file.len().min(bytes.len());
        file[4..n.max(4)].copy_from_slice(&bytes[4.min(n)..n]);
        let _ = from_hair(&file, ImportOptions::default());
        let _ = from_hair(&bytes, ImportOptions::default());
    }
}
