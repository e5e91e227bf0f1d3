//! What holds for any bytes whatever, one check per reader; shared by the fuzz targets and the
//! ordinary tests. Each answers whether the bytes were a good file, and panics when a promise is
//! broken.

use strandlight_formats::{
    BakedFile, Cube, ExportOptions, GROOM_FORMATS, Groom, ImportOptions, LightSet, Mesh, Panorama,
    Scene, SourceFile, TableFile, UpAxis, groom_format,
};
use xxhash_rust::xxh3::xxh3_64;

/// A groom that was read is written and read again as it was.
pub fn groom(bytes: &[u8]) -> bool {
    sealed_and_not(bytes, |bytes| {
        let Ok(groom) = Groom::from_bytes(bytes) else {
            return false;
        };
        let again = groom.to_bytes().expect("what was read can be written");
        assert!(Groom::from_bytes(&again).expect("what was written can be read") == groom);
        for format in GROOM_FORMATS {
            let _ = groom.export(format, &ExportOptions::default());
        }
        true
    })
}

/// A light set that was read is written and read again as it was.
pub fn lights(bytes: &[u8]) -> bool {
    sealed_and_not(bytes, |bytes| {
        let Ok(set) = LightSet::from_bytes(bytes) else {
            return false;
        };
        let again = set.to_bytes().expect("what was read can be written");
        let again = LightSet::from_bytes(&again).expect("what was written can be read");
        assert!(again.lights == set.lights);
        true
    })
}

/// A mesh that was read is written and read again as it was.
pub fn mesh(bytes: &[u8]) -> bool {
    sealed_and_not(bytes, |bytes| {
        let Ok(mesh) = Mesh::from_bytes(bytes) else {
            return false;
        };
        let again = mesh.to_bytes().expect("what was read can be written");
        assert!(Mesh::from_bytes(&again).expect("what was written can be read") == mesh);
        let _ = mesh.smooth_normals();
        true
    })
}

/// A panorama that was read is written and read again as it was.
pub fn panorama(bytes: &[u8]) -> bool {
    sealed_and_not(bytes, |bytes| {
        let Ok(panorama) = Panorama::from_bytes(bytes) else {
            return false;
        };
        let again = panorama.to_bytes().expect("what was read can be written");
        assert!(Panorama::from_bytes(&again).expect("what was written can be read") == panorama);
        assert!(panorama.pixels().iter().flatten().all(|x| x.is_finite()));
        true
    })
}

/// Tables that were read are written and read again as they were.
pub fn tables(bytes: &[u8]) -> bool {
    sealed_and_not(bytes, |bytes| {
        let Ok(file) = TableFile::from_bytes(bytes) else {
            return false;
        };
        let again = file.to_bytes().expect("what was read can be written");
        assert!(TableFile::from_bytes(&again).expect("what was written can be read") == file);
        true
    })
}

/// A scene that was read is written and read again as it was.
pub fn scene(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return false;
    };
    let Ok(scene) = Scene::from_toml(text) else {
        return false;
    };
    let again = scene
        .to_toml_string()
        .expect("what was read can be written");
    assert!(Scene::from_toml(&again).expect("what was written can be read") == scene);
    true
}

/// A `.cube` file is refused, or has all the samples that it says, finite, over ranges that are not
/// empty.
pub fn cube(bytes: &[u8]) -> bool {
    let Ok(cube) = Cube::from_bytes(bytes) else {
        return false;
    };
    assert!(cube.curves.is_some() || cube.grid.is_some());
    for (table, power) in [(cube.curves, 1), (cube.grid, 3)] {
        let Some(table) = table else {
            continue;
        };
        assert!(table.size >= 2 && table.samples.len() == (table.size as usize).pow(power));
        assert!(table.samples.as_flattened().iter().all(|x| x.is_finite()));
        assert!((0..3).all(|ix| table.low[ix] < table.high[ix]));
    }
    true
}

/// A `.hair` file that was read in centimetres is written byte for byte, whatever its axes; its
/// magic in capitals.
pub fn hair(bytes: &[u8]) -> bool {
    inverse(bytes, "hair", |again| {
        again[..4] == *b"HAIR" && again[4..] == bytes[4..]
    })
}

/// A `.data` file of strands that was read in centimetres is written byte for byte.
pub fn usc(bytes: &[u8]) -> bool {
    inverse(bytes, "usc", |again| again == bytes)
}

/// Curves of an Alembic archive that were read are written and read again as the same strands.
pub fn alembic(bytes: &[u8]) -> bool {
    let format = groom_format("alembic").expect("it is in the table");
    let n_frames = format.frame_times(bytes).map_or(1, |times| times.len());
    let last = (n_frames - 1).min(u32::MAX as usize) as u32;
    let mut good = false;
    for frame in [0, last] {
        let options = ImportOptions::default().with_frame(frame);
        let Ok(import) = format.read(bytes, &options) else {
            continue;
        };
        if import.groom.validate().is_err() {
            continue;
        }
        let export = import.groom.export(format, &ExportOptions::default());
        let again = export.expect("what was read can be written").bytes;
        let again = format.read(&again, &ImportOptions::default());
        let again = again.expect("what was written can be read").groom;
        assert!(again.points == import.groom.points);
        assert!(again.strand_offsets == import.groom.strand_offsets);
        good = true;
    }
    good
}

/// Hair of TressFX that was read is written, and of version 4 in the usual order byte for byte.
pub fn tfx(bytes: &[u8]) -> bool {
    stable(bytes, "tfx")
}

/// Curves of Mitsuba that were read are written, and read again as they were.
pub fn mitsuba(bytes: &[u8]) -> bool {
    stable(bytes, "mitsuba")
}

/// Curves of pbrt likewise.
pub fn pbrt(bytes: &[u8]) -> bool {
    stable(bytes, "pbrt")
}

/// A PLY file is read or refused.
pub fn ply(bytes: &[u8]) -> bool {
    is_read(bytes, "ply")
}

/// A NumPy array is read or refused.
pub fn npy(bytes: &[u8]) -> bool {
    is_read(bytes, "npy")
}

/// A file of CT2Hair is read or refused.
pub fn ct2hair(bytes: &[u8]) -> bool {
    is_read(bytes, "ct2hair")
}

/// Is `bytes` read by the format called `name`, as a sound groom?
fn is_read(bytes: &[u8], name: &str) -> bool {
    let found = SourceFile::from_bytes(bytes);
    let _ = found.map(|file| file.import(&ImportOptions::default()));
    let format = groom_format(name).expect("it is in the table");
    let options = ImportOptions::default().with_unit(1.0);
    let groom = format.read(bytes, &options).map(|import| import.groom);
    groom.is_ok_and(|groom| groom.validate().is_ok())
}

/// What the format called `name` has read in centimetres is written, and from then on stays byte
/// for byte as it is.
fn stable(bytes: &[u8], name: &str) -> bool {
    if !is_read(bytes, name) {
        return false;
    }
    let format = groom_format(name).expect("it is in the table");
    let options = ImportOptions::default().with_unit(1.0);
    let write = |bytes: &[u8]| {
        let groom = format.read(bytes, &options).expect("it was read").groom;
        let export = groom.export(format, &ExportOptions::default());
        export.expect("what was read can be written").bytes
    };
    let once = write(bytes);
    assert!(write(&once) == once, "what was written is read otherwise");
    true
}

/// A USD file that was read is written as a groom that is read again as it was.
pub fn usd(bytes: &[u8]) -> bool {
    let format = groom_format("usd").expect("it is in the table");
    let options = ImportOptions::default().with_unit(1.0).with_up(UpAxis::Y);
    let _ = format.frame_times(bytes);
    let Ok(import) = format.read(bytes, &options) else {
        return false;
    };
    let groom = import.groom;
    if groom.validate().is_err() {
        return false;
    }
    let export = groom.export(format, &ExportOptions::default());
    let again = export.expect("what was read can be written").bytes;
    let back = format.read(&again, &options);
    let back = back.expect("what was written can be read").groom;
    assert!(back.points == groom.points && back.strand_offsets == groom.strand_offsets);
    true
}

/// What the format called `name` has read in centimetres is written as `is_same` wants it.
fn inverse(bytes: &[u8], name: &str, is_same: impl Fn(&[u8]) -> bool) -> bool {
    let format = groom_format(name).expect("it is in the table");
    // By content too, whatever it is taken for.
    let found = SourceFile::from_bytes(bytes);
    let _ = found.map(|file| file.import(&ImportOptions::default()));
    let mut good = false;
    for up in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
        let options = ImportOptions::default().with_unit(1.0).with_up(up);
        let Ok(import) = format.read(bytes, &options) else {
            continue;
        };
        let groom = import.groom;
        if groom.validate().is_err() {
            continue;
        }
        let export = groom.export(format, &ExportOptions::default());
        let again = export.expect("what was read can be written").bytes;
        assert!(is_same(&again), "import and export are not inverse");
        let _ = (
            groom.doubts(groom.diameter_range()),
            groom.thickness_faults(),
        );
        good = true;
    }
    good
}

/// Checks the bytes as they are, and with all checksums set right, which lets random changes
/// past the first door.
fn sealed_and_not(bytes: &[u8], check: impl Fn(&[u8]) -> bool) -> bool {
    let good = check(bytes);
    let mut sealed = bytes.to_vec();
    seal(&mut sealed);
    check(&sealed);
    good
}

/// Sets length and checksums of a container right, where its directory makes sense.
pub fn seal(file: &mut [u8]) {
    let word = |file: &[u8], at: usize| {
        let bytes = file.get(at..at.checked_add(8)?)?;
        bytes.try_into().ok().map(u64::from_le_bytes)
    };
    if file.len() < 64 {
        return;
    }
    let length = file.len() as u64;
    file[24..32].copy_from_slice(&length.to_le_bytes());
    let n_sections = word(file, 16).unwrap_or(0) as u32 as usize;
    let end = n_sections.saturating_mul(32).saturating_add(64);
    if end <= file.len() {
        for entry in (64..end).step_by(32) {
            let (Some(offset), Some(length)) = (word(file, entry + 8), word(file, entry + 16))
            else {
                continue;
            };
            let section = usize::try_from(offset)
                .ok()
                .zip(
                    offset
                        .checked_add(length)
                        .and_then(|end| usize::try_from(end).ok()),
                )
                .and_then(|(start, end)| file.get(start..end));
            if let Some(section) = section {
                let sum = xxh3_64(section);
                file[entry + 24..entry + 32].copy_from_slice(&sum.to_le_bytes());
            }
        }
        let sum = xxh3_64(&file[64..end]);
        file[32..40].copy_from_slice(&sum.to_le_bytes());
    }
    let sum = xxh3_64(&file[..56]);
    file[56..64].copy_from_slice(&sum.to_le_bytes());
}
