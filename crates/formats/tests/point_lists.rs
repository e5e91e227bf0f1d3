//! `.data` files of strands: in, out, and every damage.

use proptest::prelude::*;
use strandlight_formats::{
    Attribute, BakedFile, Domain, Error, ExportOptions, FileKind, GROOM_FORMATS, Groom,
    GroomFormat, ImportOptions, NoteKind, Result, SourceFile, UpAxis, groom_format,
};

/// A file of strands of these lengths, somewhere on a head of a person who stands, in metres.
fn data_file(lengths: &[u32], salt: u32) -> Vec<u8> {
    let mut bytes = (lengths.len() as u32).to_le_bytes().to_vec();
    let mut ix = salt;
    for &n_points in lengths {
        bytes.extend(n_points.to_le_bytes());
        for _ in 0..n_points {
            for centre in [0.0, 1.64, 0.0f32] {
                ix = ix.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let aside = (ix >> 8) as f32 / (1 << 24) as f32 - 0.5;
                bytes.extend((centre + 0.3 * aside).to_le_bytes());
            }
        }
    }
    bytes
}

fn format() -> &'static dyn GroomFormat {
    groom_format("usc").unwrap()
}

fn import(bytes: &[u8], options: ImportOptions) -> Result<Groom> {
    Ok(SourceFile::from_bytes(bytes)?.import(&options)?.groom)
}

fn export(groom: &Groom) -> Vec<u8> {
    let export = groom.export(format(), &ExportOptions::default()).unwrap();
    export.bytes
}

fn cm() -> ImportOptions {
    ImportOptions::default().with_unit(1.0)
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    let four = |four: &[u8]| f32::from_le_bytes(four.try_into().unwrap());
    bytes.chunks(4).map(four).collect()
}

#[test]
fn strands_are_read_in_metres_with_y_up_unless_said_otherwise() {
    let bytes = data_file(&[2, 1, 3, 0], 1);
    let file = SourceFile::from_bytes(&*bytes).unwrap();
    assert_eq!(file.format().info(), format().info());
    let import = file.import(&ImportOptions::default()).unwrap();
    let groom = import.groom;
    assert_eq!(groom.strand_offsets, [0, 2, 5]);
    assert_eq!(
        (groom.source.cm_per_unit, groom.source.up),
        (100.0, UpAxis::Y)
    );
    assert_eq!(groom.source.hash.len(), 16);
    let first = floats(&bytes[8..20]);
    let in_cm: Vec<f32> = first
        .iter()
        .map(|&x| (100.0 * f64::from(x)) as f32)
        .collect();
    assert_eq!(groom.points[0][..], in_cm);
    assert_eq!(groom.source.n_set_aside(), 2);
    assert_eq!(import.notes.len(), 1);
    assert_eq!(import.notes[0].kind, NoteKind::SetAside);
    assert!(
        import.notes[0].text.starts_with("2 strands of fewer"),
        "{}",
        import.notes[0]
    );

    let turned = file.import(&cm().with_up(UpAxis::Z)).unwrap().groom;
    assert_eq!(turned.points[0], [first[0], first[2], -first[1]]);
}

#[test]
fn a_file_comes_back_byte_for_byte() {
    for lengths in [&[2, 3][..], &[1, 2, 1, 0, 5, 1], &[100; 40], &[0, 0, 2]] {
        let bytes = data_file(lengths, 7);
        for up in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
            let groom = import(&bytes, cm().with_up(up)).unwrap();
            let stored = Groom::from_bytes(&groom.to_bytes().unwrap()).unwrap();
            assert_eq!(stored, groom);
            assert!(export(&stored) == bytes, "{lengths:?} {up:?}");
        }
        // In metres each coordinate is rounded twice.
        let again = export(&import(&bytes, ImportOptions::default()).unwrap());
        assert_eq!(again.len(), bytes.len());
        for (old, new) in floats(&bytes).into_iter().zip(floats(&again)) {
            assert!(
                (old - new).abs() <= 2.0 * f32::EPSILON * old.abs(),
                "{old} {new}"
            );
        }
    }
}

#[test]
fn what_goes_out_is_what_others_read() {
    let groom = Groom {
        points: vec![[100.0, 200.0, 300.0], [0.0, -50.0, 25.0]],
        strand_offsets: vec![0, 2],
        attributes: vec![Attribute {
            name: "diameter".to_owned(),
            domain: Domain::Groom,
            components: 1,
            data: vec![0.01],
        }],
        ..Groom::default()
    };
    let usual = groom.export(format(), &ExportOptions::default()).unwrap();
    let mut expected = vec![1, 0, 0, 0, 2, 0, 0, 0];
    expected.extend(
        [1.0f32, 2.0, 3.0, 0.0, -0.5, 0.25]
            .iter()
            .flat_map(|x| x.to_le_bytes()),
    );
    assert_eq!(usual.bytes, expected);
    assert_eq!(usual.dropped, ["diameter"]);

    let options = ExportOptions::default().with_unit(1.0).with_up(UpAxis::Z);
    let other = groom.export(format(), &options).unwrap().bytes;
    assert_eq!(
        floats(&other[8..]),
        [100.0, -300.0, 200.0, 0.0, -25.0, -50.0]
    );
    for cm_per_unit in [0.0, -1.0, f64::NAN, 1e7] {
        let options = ExportOptions::default().with_unit(cm_per_unit);
        let message = groom.export(format(), &options).unwrap_err().to_string();
        assert!(message.contains("unit (cm)"), "{message}");
    }
}

/// From one format to another and back: points stay, in whatever unit and axes they are written.
#[test]
fn formats_are_converted_into_each_other() {
    let bytes = data_file(&[2, 1, 30, 4], 3);
    let groom = import(&bytes, ImportOptions::default()).unwrap();
    let mut n_checked = 0;
    for other in GROOM_FORMATS {
        // What is only read, and what has strands of one length only.
        if !other.info().can.writes || other.info().name == "tfx" {
            continue;
        }
        let export = groom.export(other, &ExportOptions::default()).unwrap();
        let extension = other.info().extensions[0];
        let back = SourceFile::from_bytes(export.bytes).unwrap();
        assert_eq!(back.format().info(), other.info(), "{extension}");
        let back = back.import(&ImportOptions::default()).unwrap().groom;
        assert_eq!(back.strand_offsets, groom.strand_offsets, "{extension}");
        for (old, new) in groom.points.iter().zip(&back.points) {
            for (old, new) in old.iter().zip(new) {
                assert!(
                    (old - new).abs() <= 2.0 * f32::EPSILON * old.abs(),
                    "{extension}"
                );
            }
        }
        n_checked += 1;
    }
    assert!(n_checked >= 4, "{n_checked}");
}

#[test]
fn lies_are_named() {
    let good = data_file(&[2, 3], 1);
    let with = |at: usize, word: u32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        bytes
    };
    // The reader itself: what makes no sense at the start is not taken for such a file.
    let read = |bytes: &[u8]| {
        let error = format().read(bytes, &ImportOptions::default());
        error.unwrap_err().to_string()
    };
    for (bytes, needle) in [
        (
            Vec::new(),
            "number of strands take 4 bytes, the file has 0 left (at byte 0)",
        ),
        (
            with(0, u32::MAX),
            "number of strands is -1, must be in 0..=2147483647",
        ),
        (
            with(0, 0x7fff_ffff),
            "number of points of strand 2 take 4 bytes, the file has 0 left",
        ),
        (with(0, 1), "40 bytes after the last strand (at byte 32)"),
        (
            with(4, 0x8000_0000),
            "number of points of strand 0 is -2147483648",
        ),
        (
            with(4, 0x7fff_ffff),
            "2147483647 points of strand 0 take 25769803764 bytes, the file has 64 left (at byte 8)",
        ),
        (with(8, f32::NAN.to_bits()), "strand 0, point 0 is [NaN"),
        (with(60, f32::INFINITY.to_bits()), "strand 1, point 2"),
        (with(60, 1e4f32.to_bits()), "at 100 cm per unit"),
        (
            data_file(&[1, 0, 1], 1),
            "strands with two points or more is 0",
        ),
        (data_file(&[], 1), "strands with two points or more is 0"),
    ] {
        let message = read(&bytes);
        assert!(message.contains(needle), "{message:?} lacks {needle:?}");
    }
    let few = ImportOptions::default().with_max_points(4);
    let message = import(&good, few.clone()).unwrap_err().to_string();
    assert!(
        message.contains("number of points is 5, must be at most 4"),
        "{message}"
    );
    assert!(import(&good, few.with_max_points(5)).is_ok());
}

#[test]
fn every_truncation_and_a_trailing_byte_are_refused() {
    let good = data_file(&[2, 1, 3, 0, 2], 3);
    let read = |bytes: &[u8]| format().read(bytes, &ImportOptions::default());
    assert!(read(&good).is_ok());
    for length in 0..good.len() {
        assert!(import(&good[..length], cm()).is_err(), "{length}");
        let error = read(&good[..length]).unwrap_err();
        assert!(matches!(error, Error::Invalid { .. }), "{length}: {error}");
    }
    let mut long = good;
    long.push(0);
    assert!(matches!(read(&long), Err(Error::Invalid { .. })));
}

#[test]
fn damaged_originals_are_named_on_export() {
    let bytes = data_file(&[2, 1, 3, 0], 1);
    let good = import(&bytes, cm()).unwrap();
    let with = |at: usize, word: u32| {
        let mut groom = good.clone();
        let data = &mut groom.source.original.as_mut().unwrap().data;
        data[at..at + 4].copy_from_slice(&word.to_le_bytes());
        groom
    };
    let mut cut = good.clone();
    cut.source.original.as_mut().unwrap().data.pop();
    for (groom, needle) in [
        (cut, "39 bytes"),
        (with(0, 9), "index 9"),
        (with(20, 1), "index 1"),
        (with(4, 2), "2 points"),
        (with(8, f32::NAN.to_bits()), "point of strand 1"),
    ] {
        let error = groom.export(format(), &ExportOptions::default());
        let message = error.unwrap_err().to_string();
        assert!(message.contains(needle), "{message:?} lacks {needle:?}");
        // The rest of the groom is sound, and no other format minds.
        let hair = groom_format("hair").unwrap();
        assert!(groom.export(hair, &ExportOptions::default()).is_ok());
    }
}

#[test]
fn rounding_errors_of_sines_are_coordinates() {
    let mut bytes = data_file(&[8; 3], 1);
    for (at, rounding_error) in [(8, -1.1e-16f32), (12, 6.9e-33)] {
        bytes[at..at + 4].copy_from_slice(&rounding_error.to_le_bytes());
    }
    assert_eq!(export(&import(&bytes, cm()).unwrap()), bytes);
}

#[test]
fn other_files_are_not_taken_for_it() {
    let likely = |bytes: &[u8]| matches!(FileKind::of(bytes), FileKind::Hair(_));
    assert!(likely(&data_file(&[100; 50], 1)));
    assert!(likely(&data_file(&[1; 50], 1)));
    let mut n_taken = 0;
    for seed in 0..10_000u32 {
        let mut state = seed;
        let noise: Vec<u8> = (0..600)
            .flat_map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 16).to_le_bytes()
            })
            .collect();
        n_taken += usize::from(likely(&noise));
    }
    assert_eq!(n_taken, 0);
    for bytes in [
        &[0; 300][..],
        &[1; 300],
        &[255; 300],
        b"1 2 3\n4 5 6\n",
        &data_file(&[2], 1)[..11],
        &[1, 0, 0, 0],
    ] {
        assert!(!likely(bytes), "{bytes:?}");
    }
}

proptest! {
    #[test]
    fn random_files_are_lossless(lengths in prop::collection::vec(0u32..6, 1..20), salt: u32) {
        prop_assume!(lengths.iter().any(|&n| n > 1));
        let bytes = data_file(&lengths, salt);
        let read = format().read(&bytes, &cm());
        prop_assert!(export(&read.unwrap().groom) == bytes);
    }

    #[test]
    fn noise_is_answered(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = format().read(&bytes, &ImportOptions::default());
        let _ = SourceFile::from_bytes(bytes).map(|file| file.import(&cm()));
    }
}
