//! `.hair` files: every combination of flags comes back byte for byte.

use proptest::prelude::*;
use strandlight_formats::hair::flag;
use strandlight_formats::{Domain, Error, Groom, HairImport, UpAxis};

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

fn through_groom_file(bytes: &[u8], options: HairImport) -> Vec<u8> {
    let groom = Groom::from_hair(bytes, options).unwrap();
    let groom = Groom::from_bytes(&groom.to_bytes().unwrap()).unwrap();
    groom.to_hair().unwrap()
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
            let options = HairImport {
                up,
                ..HairImport::default()
            };
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
    let groom = Groom::from_hair(&bytes, HairImport::default()).unwrap();
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
    let original = groom.source.hair.unwrap();
    assert_eq!(original.single_points.len(), 1);
    assert_eq!(original.single_points[0].strand, 1);
}

#[test]
fn other_units_come_back_within_two_units_in_the_last_place() {
    let bytes = hair_file(flag::POINTS | flag::SEGMENTS, &[5, 9, 2], 7);
    let options = HairImport {
        cm_per_unit: 2.54,
        up: UpAxis::Z,
    };
    let groom = Groom::from_hair(&bytes, options).unwrap();
    let back = groom.to_hair().unwrap();
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
    Groom::from_hair(bytes, HairImport::default())
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
    assert!(Groom::from_hair(&good, HairImport::default()).is_ok());
    for (bytes, part) in [
        (with(4, u32::MAX), "promises 8589934590 bytes of segments"),
        (with(8, u32::MAX), "promises 51539607540 bytes of points"),
        (with(8, 6), "promises"),
        (with(8, 4), "bytes after the last array"),
        (with(12, 63), "flags 0x3f"),
        (with(12, 29), "no points"),
        (with(12, 30), "bytes after"),
        (with(0, 0), "does not start with HAIR"),
        (with(132, f32::NAN.to_bits()), "strand 0, point 0"),
        (with(132 + 36, f32::INFINITY.to_bits()), "strand 1, point 1"),
        (
            with(132 + 60, f32::NAN.to_bits()),
            "thickness of strand 0, point 0",
        ),
        (Vec::new(), "empty"),
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
            Groom::from_hair(&good[..length], HairImport::default()).is_err(),
            "{length}"
        );
    }
    let mut long = good;
    long.push(0);
    assert!(matches!(
        Groom::from_hair(&long, HairImport::default()),
        Err(Error::Invalid { .. })
    ));
}

/// The sample by Cem Yuksel, where it has been laid beside the project.
#[test]
fn genuine_sample() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data/hair/cyuksel_straight.hair");
    let Ok(bytes) = std::fs::read(&path) else {
        println!("skipped: no {}", path.display());
        return;
    };
    let groom = Groom::read_hair(&path, HairImport::default()).unwrap();
    assert_eq!((groom.n_strands(), groom.points.len()), (10_000, 160_000));
    // Up is +Y: the tallest extent of the model.
    let (min, max) = groom.bounds();
    assert!(max[1] - min[1] > 80.0, "{min:?} {max:?}");
    assert!(through_groom_file(&bytes, HairImport::default()) == bytes);
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
        prop_assert!(through_groom_file(&bytes, HairImport::default()) == bytes);
    }

    #[test]
    fn noise_is_answered(bytes in prop::collection::vec(any::<u8>(), 0..300), flags in 0u32..32) {
        let mut file = hair_file(flags, &[2, 2], 0);
        let n = file.len().min(bytes.len());
        file[4..n.max(4)].copy_from_slice(&bytes[4.min(n)..n]);
        let _ = Groom::from_hair(&file, HairImport::default());
        let _ = Groom::from_hair(&bytes, HairImport::default());
    }
}
