//! What holds for any bytes whatever, one check per reader; shared by the fuzz targets and the
//! ordinary tests. Each answers whether the bytes were a good file, and panics when a promise is
//! broken.

use strandlight_formats::{
    BakedFile, ExportOptions, GROOM_FORMATS, Groom, ImportOptions, LightSet, Scene, SourceFile,
    TableFile, UpAxis, groom_format,
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
