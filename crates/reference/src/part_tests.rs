//! Parts of a picture: merged, they are one run's; what does not belong together is refused.

use super::*;

use strandlight_images::exr_file;

use crate::{PartInfo, PartsError, ReferencePart, order_of_parts, samples_of_part};

const SIZE: [u32; 2] = [40, 24];

/// A reference picture of the scene with the samples of `part`, `[index, count]`, of `n_samples`.
fn part_of(
    (scene, integrator): (&PreparedScene, &dyn Integrator),
    [index, count]: [u32; 2],
    n_samples: u32,
    seed: u64,
) -> ReferencePart {
    let samples = samples_of_part(index, count, n_samples);
    let mut film = Film::from_sample(SIZE, samples.start);
    film.expose(
        scene,
        integrator,
        samples.end - samples.start,
        seed,
        &|_| (),
    );
    ReferencePart {
        file: ReferenceFile {
            method: Method::Directional,
            inputs: "these".to_owned(),
            seed,
            provenance: Provenance::default()
                .with("version", "this")
                .with("scene", "a")
                .with("groom", "b"),
            film,
        },
        backdrop: Backdrop::of(scene, SIZE),
        index,
        count,
        n_samples,
    }
}

/// All parts as files.
fn files_of(at: (&PreparedScene, &dyn Integrator), count: u32, n_samples: u32) -> Vec<Vec<u8>> {
    let part = |index| part_of(at, [index, count], n_samples, 3).encode().unwrap();
    (0..count).map(part).collect()
}

fn infos_of(files: &[Vec<u8>]) -> Vec<PartInfo> {
    let infos = files.iter().map(|bytes| PartInfo::read(bytes).unwrap());
    infos.collect()
}

fn merge(files: &[Vec<u8>]) -> Vec<u8> {
    let infos = infos_of(files);
    let order = order_of_parts(&infos).unwrap();
    let mut parts = order
        .iter()
        .map(|&ix| ReferencePart::decode(&files[ix], &infos[ix]).unwrap());
    let mut merged = parts.next().unwrap();
    for part in parts {
        merged.append(&part).unwrap();
    }
    merged.file.encode(&merged.backdrop).unwrap()
}

#[test]
fn merged_parts_are_one_run_byte_by_byte() {
    let transparent = scene();
    let mut scene = scene();
    scene.background = strandlight_formats::Background::Lights;
    for scene in [&transparent, &scene] {
        with_directional(scene, |integrator| {
            let at = (scene, integrator);
            for n_samples in [1, 5, 64, 100] {
                let ReferencePart { file, backdrop, .. } = part_of(at, [0, 1], n_samples, 3);
                assert_eq!(file.film.n_samples(), n_samples);
                let seen = file.film.pixels().filter(|pixel| pixel.covered > 0.0);
                assert!(seen.count() > 100);
                let whole = file.encode(&backdrop).unwrap();
                for count in [1, 3, 7] {
                    let mut files = files_of(at, count, n_samples);
                    // In any order.
                    files.rotate_left(count as usize / 2);
                    assert!(merge(&files) == whole, "{count} parts of {n_samples}");
                }
            }
        });
    }
}

#[test]
fn parts_of_other_pictures_are_refused_by_name() {
    let scene = scene();
    with_directional(&scene, |integrator| {
        let at = (&scene, integrator);
        let files = files_of(at, 3, 8);
        let infos = infos_of(&files);
        let said = |parts: &[PartInfo]| order_of_parts(parts).unwrap_err().to_string();
        // Missing and doubled ones.
        let [a, b, c] = [0, 1, 2].map(|ix: usize| infos[ix].clone());
        assert_eq!(
            said(std::slice::from_ref(&c)),
            "missing of 3 parts: 0/3, 1/3"
        );
        assert_eq!(said(&[a.clone(), c.clone()]), "missing of 3 parts: 1/3");
        let doubled = order_of_parts(&[a.clone(), b.clone(), c.clone(), b.clone()]);
        let PartsError::Doubled { part, before, .. } = doubled.unwrap_err() else {
            panic!("another error");
        };
        assert_eq!([before, part], [1, 3]);
        // Other pictures.
        let of = |change: &dyn Fn(&mut ReferencePart)| {
            let mut part = part_of(at, [1, 3], 8, 3);
            change(&mut part);
            PartInfo::read(&part.encode().unwrap()).unwrap()
        };
        assert_eq!(of(&|_| ()), b);
        let with = |name: &str, value: &str| {
            let base = Provenance::default();
            let base = base.with("version", if name == "version" { value } else { "this" });
            let base = base.with("scene", if name == "scene" { value } else { "a" });
            let base = base.with("groom", if name == "groom" { value } else { "b" });
            of(&|part| part.file.provenance = base.clone())
        };
        for (other, named) in [
            (of(&|part| part.file.seed = 4), "its seed is 4, not 3"),
            (
                of(&|part| part.file.method = Method::Path),
                "its method is path, not directional",
            ),
            (with("groom", "x"), "its groom is x, not b"),
            (with("scene", "x"), "its scene is x, not a"),
            (with("version", "x"), "its program is x, not this"),
            (
                of(&|part| part.file.inputs = "those".to_owned()),
                "its scene or options differ",
            ),
            (
                PartInfo::read(&part_of(at, [1, 4], 8, 3).encode().unwrap()).unwrap(),
                "its number of parts is 4, not 3",
            ),
            (
                PartInfo::read(&part_of(at, [1, 3], 9, 3).encode().unwrap()).unwrap(),
                "its number of samples in all is 9, not 8",
            ),
        ] {
            let error = order_of_parts(&[a.clone(), c.clone(), other]).unwrap_err();
            let PartsError::Other { part: 2, source } = &error else {
                panic!("{error}");
            };
            assert!(source.to_string().ends_with(named), "{source}");
        }
    });
}

#[test]
fn damaged_parts_are_refused() {
    let scene = scene();
    with_directional(&scene, |integrator| {
        let at = (&scene, integrator);
        let part = part_of(at, [1, 3], 8, 3);
        let bytes = part.encode().unwrap();
        let info = PartInfo::read(&bytes).unwrap();
        let decoded = ReferencePart::decode(&bytes, &info).unwrap();
        assert!(decoded.file.film == part.file.film && decoded.backdrop == part.backdrop);
        assert!(decoded.encode().unwrap() == bytes);
        let read = |bytes: &[u8]| {
            PartInfo::read(bytes).and_then(|info| ReferencePart::decode(bytes, &info))
        };
        for length in (0..bytes.len()).step_by(bytes.len() / 40) {
            assert!(read(&bytes[..length]).is_err(), "{length}");
        }
        // A flipped bit is an error, or in what holds nothing of the part.
        let mut n_refused = 0;
        for at in (0..bytes.len()).step_by(bytes.len() / 300) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << (at % 8);
            match read(&damaged) {
                Err(_) => n_refused += 1,
                Ok(found) => assert!(found == decoded, "byte {at}"),
            }
        }
        assert!(n_refused > 270, "{n_refused}");

        // Values that a decoder takes as they are.
        let changed = |name: &str, value: &str| {
            let from = format!("strandlight/{name}\0string\0");
            let place = bytes.windows(from.len()).position(|w| w == from.as_bytes());
            let place = place.expect("an attribute") + from.len() + 4;
            let mut damaged = bytes.clone();
            damaged[place..place + value.len()].copy_from_slice(value.as_bytes());
            read(&damaged).unwrap_err()
        };
        assert!(matches!(changed("seed", "4"), FileError::Checksum));
        assert!(matches!(changed("groom", "c"), FileError::Checksum));
        assert!(matches!(changed("part", "3/3"), FileError::NotAPart(_)));
        assert!(matches!(changed("part", "x/3"), FileError::NotAPart(_)));
        assert!(matches!(
            changed("first-sample", "1"),
            FileError::NotAPart(_)
        ));
        assert!(matches!(
            changed("all-samples", "9"),
            FileError::NotAPart(_)
        ));

        // Other files, and parts that are gone on with.
        let whole = part.file.encode(&part.backdrop).unwrap();
        assert!(matches!(
            PartInfo::read(&whole),
            Err(FileError::NotAPart(_))
        ));
        let mut wanted = part_of(at, [0, 1], 8, 3).file;
        let error = wanted.resume(&bytes).unwrap_err();
        assert!(matches!(error, FileError::IsAPart(_)), "{error}");
    });
}

/// Files of earlier versions have one sum of all samples, whatever their number.
#[test]
fn files_of_one_sum_are_gone_on_with() {
    let scene = scene();
    with_directional(&scene, |integrator| {
        let mut wanted = part_of((&scene, integrator), [0, 1], 5, 3);
        let mut entries = wanted.file.provenance.entries().to_vec();
        let more = [
            ("method", "directional"),
            ("inputs", "these"),
            ("seed", "3"),
            ("samples", "5"),
        ];
        entries.extend(more.map(|(name, value)| (format!("strandlight/{name}"), value.to_owned())));
        let channels = wanted.file.layers(&wanted.backdrop);
        let size = SIZE.map(|side| side as usize);
        let bytes = exr_file::encode((size[0], size[1]), channels, &entries).unwrap();
        let expected = wanted.file.film.clone();
        wanted.file.resume(&bytes).unwrap();
        let film = &mut wanted.file.film;
        film.expose(&scene, integrator, 7, 3, &|_| ());
        let mut expected = expected;
        expected.expose(&scene, integrator, 7, 3, &|_| ());
        assert_eq!([film.n_samples(), expected.n_samples()], [12, 12]);
        for (found, expected) in film.pixels().zip(expected.pixels()) {
            assert_eq!(found.covered, expected.covered);
            for c in 0..3 {
                let (found, expected) = (found.single[c], expected.single[c]);
                assert!(
                    (found - expected).abs() <= 1e-6 * expected,
                    "{found} {expected}"
                );
            }
        }
    });
}
