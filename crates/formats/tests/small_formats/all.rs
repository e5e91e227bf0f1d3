//! What holds for all small formats.

use super::arrays::{ct2hair, npy};
use super::ply::{XYZ, ply_ascii, ply_binary};
use super::tfx::{TFX_2, tfx_3, tfx_4};
use super::*;

/// A file of each format, which may be damaged.
fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let usc = |n: usize| {
        let strand = |ix: usize| {
            [
                words(&[n as u32]),
                floats(curve(n, ix as f32).as_flattened()),
            ]
            .concat()
        };
        [words(&[40]), (0..40).flat_map(strand).collect()].concat()
    };
    let npy_points = floats(curve(6, 0.0).as_flattened());
    vec![
        ("hair", export(&groom(&[2, 3, 4]), "hair").bytes),
        ("tfx", tfx_4()),
        ("tfx", tfx_3(1)),
        ("tfx", TFX_2.into()),
        ("ply", ply_binary(false)),
        (
            "ply",
            ply_ascii(&format!("{XYZ}property int strand_id\n"), 4, |ix| {
                format!("{ix} 0 0 1")
            }),
        ),
        ("npy", npy(1, "<f4", "(2, 3, 3)", &npy_points)),
        ("pbrt", export(&groom(&[2, 3]), "pbrt").bytes),
        ("mitsuba", export(&groom(&[2, 3]), "mitsuba").bytes),
        ("mitsuba", export(&groom(&[300; 2]), "mitsuba").bytes),
        ("ct2hair", ct2hair(&[2, 3])),
        ("ct2hair", ct2hair(&[100; 20])),
        ("ct2hair", ct2hair(&[1000; 2])),
        ("usc", usc(2)),
        ("usc", usc(100)),
        ("usc", usc(1000)),
    ]
}

#[test]
fn objects_and_frames_are_refused_where_a_format_has_none() {
    for (name, bytes) in samples() {
        let file = SourceFile::from_bytes(bytes).unwrap();
        let refused = |options: ImportOptions, needle: &str| {
            let error = file.import(&options).unwrap_err().to_string();
            assert!(error.contains(needle), "{name}: {error}");
        };
        refused(cm().with_object("/head"), "has no named objects");
        refused(cm().with_frame(1), "holds one point in time");
        assert!(file.import(&cm()).is_ok(), "{name}");
    }
}

#[test]
fn every_format_is_found_by_its_content() {
    let mut seen = Vec::new();
    for (name, bytes) in samples() {
        let FileKind::Hair(info) = FileKind::of(&bytes) else {
            panic!("{name}: {:?}", FileKind::of(&bytes));
        };
        assert_eq!(info.name, name);
        // No other of the formats without a signature, nor with one, thinks that it is its own.
        let start = &bytes[..bytes.len().min(4096)];
        for other in GROOM_FORMATS {
            let is_it = other.sniff(start) > strandlight_formats::Sniff::No;
            assert_eq!(is_it, other.info().name == name, "{name}: {other:?}");
        }
        seen.push(name);
    }
    for name in [
        "hair", "tfx", "ply", "npy", "pbrt", "mitsuba", "ct2hair", "usc",
    ] {
        assert!(seen.contains(&name), "{name}");
    }
}

#[test]
fn every_truncation_and_flipped_bit_is_answered() {
    let mut n_checked = 0;
    for (name, good) in samples() {
        if good.len() > 4096 {
            continue;
        }
        let format = format(name);
        assert!(format.read(&good, &cm()).is_ok(), "{name}");
        // An error, or a groom that is sound or found not to be, and whose format writes it.
        let answer = |bytes: &[u8]| match format.read(bytes, &cm()) {
            Ok(import) if import.groom.validate().is_ok() => {
                if format.info().can.writes {
                    export(&import.groom, name);
                }
                true
            }
            Ok(_) => false,
            Err(error) => {
                let is_typed = matches!(error, Error::Invalid { .. } | Error::Value { .. });
                assert!(is_typed, "{name}: {error:?}");
                false
            }
        };
        let is_text = matches!(name, "mitsuba" | "pbrt") || good.starts_with(b"version");
        let is_ascii_ply = name == "ply" && good.windows(5).any(|word| word == b"ascii");
        for length in 0..good.len() {
            let is_good = answer(&good[..length]);
            let may_be = is_text || is_ascii_ply;
            assert!(!is_good || may_be, "{name}: {length} of {}", good.len());
            n_checked += 1;
        }
        for at in 0..good.len() {
            for bit in 0..8 {
                let mut bytes = good.clone();
                bytes[at] ^= 1 << bit;
                answer(&bytes);
                let _ = SourceFile::from_bytes(bytes).map(|file| file.import(&cm()));
                n_checked += 1;
            }
        }
    }
    assert!(n_checked > 20_000, "{n_checked}");
}

#[test]
fn what_is_only_read_is_not_written() {
    for name in ["ply", "npy", "ct2hair"] {
        let error = groom(&[2]).export(format(name), &ExportOptions::default());
        let message = error.unwrap_err().to_string();
        assert!(message.contains("one that is written"), "{message}");
    }
}

/// From one format to another and back, with the loss that each has.
#[test]
fn conversions_keep_what_they_say() {
    let start = groom(&[8; 40]);
    let mut n_checked = 0;
    for first in ["hair", "usc", "tfx", "mitsuba", "pbrt"] {
        for second in ["hair", "usc", "tfx", "mitsuba", "pbrt"] {
            let mut groom = start.clone();
            for name in [first, second, first] {
                let bytes = export(&groom, name).bytes;
                groom = import(name, &bytes, &ImportOptions::default())
                    .unwrap()
                    .groom;
            }
            assert_eq!(
                groom.strand_offsets, start.strand_offsets,
                "{first} {second}"
            );
            for (old, new) in start
                .points
                .as_flattened()
                .iter()
                .zip(groom.points.as_flattened())
            {
                // Metres round twice for each of three files.
                let error = (old - new).abs();
                assert!(
                    error <= 6.0 * f32::EPSILON * old.abs(),
                    "{first} {second}: {old} {new}"
                );
            }
            let has_widths = |name: &str| !matches!(name, "usc" | "tfx");
            let is_kept = has_widths(first) && has_widths(second);
            let found = groom.attribute("diameter").map(|found| &found.data);
            let tapers = found.is_some_and(|found| found.iter().any(|&x| x != found[0]));
            assert_eq!(tapers, is_kept, "{first} {second}");
            n_checked += 1;
        }
    }
    assert_eq!(n_checked, 25);
}

/// What the format `.hair` is like where nobody wrote it with care.
#[test]
fn hair_of_the_wild_is_not_drawn_too_thick() {
    // A head 0.27 wide with thickness 1, in small letters, without an info string.
    let head: Vec<[f32; 3]> = (0..80)
        .map(|ix| {
            let [turn, up] = [(ix / 2) as f32 * 2.4, (ix / 2) as f32 / 40.0];
            let out = 0.13 * (1.0 - up * up).sqrt() + 0.005 * (ix % 2) as f32;
            [out * turn.sin(), out * turn.cos(), 0.13 * up]
        })
        .collect();
    let mut bytes = b"hair".to_vec();
    bytes.extend(words(&[40, 80, 2, 1]));
    bytes.extend(floats(&[1.0, 0.0, 1.0, 1.0, 1.0]));
    bytes.resize(128, 0);
    bytes.extend(floats(head.as_flattened()));
    let found = import("hair", &bytes, &ImportOptions::default()).unwrap();
    assert_eq!(found.groom.attribute("diameter"), None);
    assert_eq!(data(&found.groom, "thickness"), [1.0]);
    let faults = found.groom.thickness_faults().unwrap().to_string();
    assert_eq!(
        faults,
        "thickness: 1 of 1 values cannot be drawn (1 above 0.05 cm; first 1 at the default): all \
         strands are drawn 0.008 cm thick"
    );
    assert!(notes(&found, NoteKind::Assumed)[0].contains("small letters"));
    // It goes out as it came.
    let again = export(&found.groom, "hair").bytes;
    assert!(again[4..] == bytes[4..] && again.starts_with(b"HAIR"));
}
