//! Damaged files of every kind: answered with an error, never a panic, a hang or a wrong value.

use crate::checks;

use std::io::{Cursor, Read, Seek, SeekFrom};

use strandlight_formats::{
    Attribute, Axis, BakedFile, Container, Domain, Error, FitReport, Groom, Kind, LightSet,
    LightSetInfo, Mesh, Panorama, Spacing, SrbfLight, Table, TableFile, TableInfo, TableReader,
};

fn groom() -> Vec<u8> {
    let attribute = |name: &str, domain, data: &[f32]| Attribute {
        name: name.to_owned(),
        domain,
        components: 1,
        data: data.to_vec(),
    };
    let groom = Groom {
        points: (0..5).map(|i| [i as f32, 0.5, -0.25]).collect(),
        strand_offsets: vec![0, 2, 5],
        attributes: vec![
            attribute("diameter", Domain::Groom, &[0.008]),
            attribute("shade", Domain::Strand, &[0.5, 1.0]),
        ],
        ..Groom::default()
    };
    groom.to_bytes().expect("valid")
}

fn lights() -> Vec<u8> {
    let light = SrbfLight {
        direction: [0.0, 0.6, 0.8],
        lambda: 0.25,
        rgb: [1.0, 0.5, 0.0],
    };
    let set = LightSet {
        lights: vec![light; 2],
        info: LightSetInfo {
            parameters: vec![("layout".to_owned(), "latlong".to_owned())],
            ..LightSetInfo::default()
        },
    };
    set.to_bytes().expect("valid")
}

fn mesh() -> Vec<u8> {
    let corners = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let mut mesh = Mesh::new(corners, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]);
    if let Ok(mesh) = &mut mesh {
        mesh.uvs = vec![[0.5, 0.25]; 4];
    }
    mesh.and_then(|mesh| mesh.to_bytes()).expect("valid")
}

fn panorama() -> Vec<u8> {
    let pixels: Vec<[f32; 3]> = (0..8).map(|ix| [ix as f32, 0.5, 1e5]).collect();
    let panorama = Panorama::from_pixels(4, &pixels);
    panorama.and_then(|made| made.to_bytes()).expect("valid")
}

fn table(name: &str, first: f32) -> Table {
    let axis = |name: &str, count| Axis {
        name: name.to_owned(),
        min: 0.0,
        max: 1.0,
        count,
        spacing: Spacing::Linear,
    };
    Table {
        name: name.to_owned(),
        axes: vec![axis("x", 2), axis("y", 2)],
        channels: vec!["r".to_owned()],
        data: (0..4).map(|ix| first + ix as f32).collect(),
        max_interpolation_error: 0.0,
    }
}

fn tables() -> Vec<u8> {
    let file = TableFile {
        fresnel: "schlick".to_owned(),
        tables: vec![table("A", 1.0), table("B", 2.0), table("C", 3.0)],
        info: TableInfo::default(),
    };
    file.to_bytes().expect("valid")
}

type Reader = fn(&[u8]) -> Option<Error>;

/// A small good file of each kind and its reader, answering the error if there is one.
fn kinds() -> [(&'static str, Vec<u8>, Reader); 5] {
    [
        ("groom", groom(), |bytes| Groom::from_bytes(bytes).err()),
        ("lights", lights(), |bytes| {
            LightSet::from_bytes(bytes).err()
        }),
        ("mesh", mesh(), |bytes| Mesh::from_bytes(bytes).err()),
        ("panorama", panorama(), |bytes| {
            Panorama::from_bytes(bytes).err()
        }),
        ("tables", tables(), |bytes| {
            TableFile::from_bytes(bytes).err()
        }),
    ]
}

#[test]
fn good_files_are_read_and_equal_content_gives_equal_bytes() {
    for (ix, (kind, bytes, read)) in kinds().into_iter().enumerate() {
        assert!(read(&bytes).is_none(), "{kind}");
        assert!(bytes == kinds()[ix].1, "{kind}");
    }
}

#[test]
fn every_truncation_is_refused() {
    for (kind, bytes, read) in kinds() {
        for length in 0..bytes.len() {
            let error = read(&bytes[..length]);
            assert!(error.is_some(), "{kind} cut to {length} bytes");
            // The same with a header that owns up to the new length and right checksums.
            let mut cut = bytes[..length].to_vec();
            checks::seal(&mut cut);
            assert!(
                read(&cut).is_some(),
                "{kind} cut to {length} bytes and sealed"
            );
        }
    }
}

#[test]
fn every_flipped_bit_is_noticed() {
    for (kind, mut bytes, read) in kinds() {
        for bit in 0..8 * bytes.len() {
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(read(&bytes).is_some(), "{kind}, bit {bit}");
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        assert!(read(&bytes).is_none());
    }
}

#[test]
fn one_byte_too_many_is_refused() {
    for (kind, mut bytes, read) in kinds() {
        bytes.push(0);
        assert!(read(&bytes).is_some(), "{kind}");
        checks::seal(&mut bytes);
        assert!(read(&bytes).is_some(), "{kind}, sealed");
    }
}

#[test]
fn other_files_are_not_mistaken() {
    for (kind, bytes, read) in kinds() {
        for (other, other_bytes, _) in kinds() {
            let error = read(&other_bytes);
            let mistaken = matches!(error, Some(Error::NotThisKind { .. }));
            assert_eq!(mistaken, kind != other, "{kind} {other}: {error:?}");
        }
        for start in [
            "",
            "HAIR",
            "hello",
            "\x76\x2f\x31\x01 this is another format altogether",
        ] {
            assert!(
                matches!(read(start.as_bytes()), Some(Error::NotThisKind { .. })),
                "{start}"
            );
        }
        let mut magic = bytes.clone();
        magic[0] ^= 0xff;
        assert!(matches!(read(&magic), Some(Error::NotThisKind { .. })));
    }
}

#[test]
fn a_newer_major_version_is_refused_by_name() {
    for (kind, mut bytes, read) in kinds() {
        bytes[12..14].copy_from_slice(&7u16.to_le_bytes());
        bytes[14..16].copy_from_slice(&3u16.to_le_bytes());
        checks::seal(&mut bytes);
        let error = read(&bytes);
        assert!(
            matches!(error, Some(Error::UnsupportedVersion { .. })),
            "{kind}: {error:?}"
        );
        let message = error.map(|error| error.to_string()).unwrap_or_default();
        assert!(
            message.contains("7.3") && message.contains("newer"),
            "{message}"
        );
    }
}

/// `bytes` with minor version 9 and a section `NEWS` that is not known yet, at the end.
fn from_the_future(bytes: &[u8], content: &[u8]) -> Vec<u8> {
    let n_sections = u32::from_le_bytes(bytes[16..20].try_into().expect("4 bytes"));
    let directory_end = 64 + 32 * n_sections as usize;
    let old_start = directory_end.next_multiple_of(64);
    let new_start = (directory_end + 32).next_multiple_of(64);
    let mut file = bytes[..directory_end].to_vec();
    for entry in (64..directory_end).step_by(32) {
        let offset = u64::from_le_bytes(file[entry + 8..entry + 16].try_into().expect("8 bytes"));
        let offset = offset + (new_start - old_start) as u64;
        file[entry + 8..entry + 16].copy_from_slice(&offset.to_le_bytes());
    }
    let offset = (new_start + bytes.len() - old_start).next_multiple_of(64);
    file.extend(b"NEWS");
    file.extend(5u32.to_le_bytes());
    for word in [offset as u64, content.len() as u64, 0] {
        file.extend(word.to_le_bytes());
    }
    file.resize(new_start, 0);
    file.extend(&bytes[old_start..]);
    file.resize(offset, 0);
    file.extend(content);
    file[14..16].copy_from_slice(&9u16.to_le_bytes());
    file[16..20].copy_from_slice(&(n_sections + 1).to_le_bytes());
    checks::seal(&mut file);
    file
}

#[test]
fn a_newer_minor_version_is_read_and_its_news_skipped() {
    for (kind, bytes, read) in kinds() {
        let future = from_the_future(&bytes, b"something unheard of");
        assert!(future.len() > bytes.len());
        let error = read(&future);
        assert!(error.is_none(), "{kind}: {error:?}");
        // Even what is skipped may not be damaged.
        let mut damaged = future;
        if let Some(last) = damaged.last_mut() {
            *last ^= 1;
        }
        assert!(read(&damaged).is_some(), "{kind}");
    }
    let (old, new) = (groom(), from_the_future(&groom(), b"x"));
    let read = |bytes: &[u8]| Groom::from_bytes(bytes).expect("good");
    assert!(read(&old) == read(&new));
}

#[test]
fn absurd_counts_are_answered_at_once() {
    let mut n_refused = 0;
    for (kind, bytes, read) in kinds() {
        for at in 0..bytes.len() - 8 {
            for value in [u64::MAX, 1 << 62, 1 << 32, 0x7fff_ffff, 1 << 20] {
                for width in [4, 8] {
                    let mut absurd = bytes.clone();
                    absurd[at..at + width].copy_from_slice(&value.to_le_bytes()[..width]);
                    checks::seal(&mut absurd);
                    // Changes to points or names may leave a good file; counts may not. Either
                    // way the answer comes, and from no more memory than the file has bytes.
                    n_refused += usize::from(read(&absurd).is_some());
                }
            }
        }
        assert!(n_refused > 1000, "{kind}: {n_refused}");
    }
}

/// Notes which bytes are read.
struct Recorder {
    inner: Cursor<Vec<u8>>,
    touched: Vec<bool>,
}

impl Read for Recorder {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let start = self.inner.position() as usize;
        let n = self.inner.read(buffer)?;
        self.touched[start..start + n].fill(true);
        Ok(n)
    }
}

impl Seek for Recorder {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.inner.seek(to)
    }
}

#[test]
fn asking_for_one_table_touches_no_other() {
    let bytes = tables();
    let length = bytes.len() as u64;
    let directory = Container::from_bytes(&bytes, Kind::Tables).expect("good");
    let sections: Vec<_> = directory.sections().to_vec();
    assert_eq!(sections.len(), 4);
    // The first and the last table are destroyed; the middle one can still be had.
    let mut broken = bytes.clone();
    for section in [sections[1], sections[3]] {
        broken[section.offset as usize] ^= 0xff;
    }
    let recorder = Recorder {
        touched: vec![false; broken.len()],
        inner: Cursor::new(broken),
    };
    let mut recorder_ref = recorder;
    {
        let container = Container::new(&mut recorder_ref, length, Kind::Tables).expect("good");
        let mut reader = TableReader::new(container).expect("good headers");
        assert_eq!(reader.headers().len(), 3);
        assert_eq!(reader.read_table("B").expect("good"), table("B", 2.0));
    }
    let touched = |ix: usize| {
        let section = sections[ix];
        let range = section.offset as usize..(section.offset + section.length) as usize;
        recorder_ref.touched[range].iter().any(|&touched| touched)
    };
    assert_eq!([1, 2, 3].map(touched), [false, true, false]);
    // Negative control: a full read stumbles over them.
    assert!(TableFile::from_bytes(recorder_ref.inner.get_ref()).is_err());
}

#[test]
fn bulk_data_is_aligned() {
    for (kind, bytes) in [
        (Kind::Groom, groom()),
        (Kind::Lights, lights()),
        (Kind::Tables, tables()),
        (Kind::Mesh, mesh()),
        (Kind::Panorama, panorama()),
    ] {
        let container = Container::from_bytes(&bytes, kind).expect("good");
        assert!(container.sections().len() >= 2);
        for section in container.sections() {
            assert_eq!(section.offset % 64, 0, "{}", section.name());
        }
    }
}

/// Figures of a record that contradict the data, or are no numbers, under right checksums.
#[test]
fn a_wrong_record_is_refused() {
    let bytes = groom();
    let section = Container::from_bytes(&bytes, Kind::Groom).expect("good");
    let meta = section
        .find(*b"META", 0)
        .expect("every groom has one")
        .offset as usize;
    // The record starts with the numbers of strands and points.
    assert_eq!((bytes[meta], bytes[meta + 4]), (2, 5));
    for at in [meta, meta + 4] {
        let mut wrong = bytes.clone();
        wrong[at] += 1;
        checks::seal(&mut wrong);
        let message = Groom::from_bytes(&wrong)
            .expect_err("must fail")
            .to_string();
        assert!(message.contains("differs from the record"), "{message}");
    }
    let set = LightSet::from_bytes(&lights()).expect("good");
    let with = |report: FitReport| {
        let info = LightSetInfo {
            report: Some(report),
            ..set.info.clone()
        };
        LightSet {
            info,
            lights: set.lights.clone(),
        }
    };
    let marker = 0.123_456_789_f64;
    let good = FitReport {
        rel_l2: marker,
        energy_ratio: [marker; 3],
        irradiance_error: marker,
        fibre_error: marker,
    };
    let bytes = with(good).to_bytes().expect("good");
    let needle = marker.to_le_bytes();
    let places: Vec<usize> = (0..bytes.len() - 8)
        .filter(|&at| bytes[at..at + 8] == needle)
        .collect();
    assert_eq!(places.len(), 6);
    for at in places {
        for bad in [f64::NAN, f64::INFINITY, -0.1] {
            let mut wrong = bytes.clone();
            wrong[at..at + 8].copy_from_slice(&bad.to_le_bytes());
            checks::seal(&mut wrong);
            let message = LightSet::from_bytes(&wrong)
                .expect_err("must fail")
                .to_string();
            assert!(message.contains("report."), "{message}");
        }
    }
}

/// Any bits are texels, so the size is all that can contradict them.
#[test]
fn a_panorama_of_another_size_is_refused() {
    let bytes = panorama();
    let container = Container::from_bytes(&bytes, Kind::Panorama).expect("good");
    let section = container.find(*b"META", 0).expect("every panorama has one");
    let meta = section.offset as usize;
    // The record starts with width, height and exponent.
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("4 bytes"));
    assert_eq!([0, 4, 8].map(|at| word(meta + at)), [4, 2, 1]);
    for (at, value, needle) in [
        (0, 6, "size is 6 x 2"),
        (4, 3, "size is 4 x 3"),
        (0, 4100, "width is 4100"),
        (0, 0, "width is 0"),
        (8, 113, "exponent is 113"),
        (8, i32::MIN as u32, "exponent is -2147483648"),
    ] {
        let mut wrong = bytes.clone();
        wrong[meta + at..meta + at + 4].copy_from_slice(&u32::to_le_bytes(value));
        checks::seal(&mut wrong);
        let message = Panorama::from_bytes(&wrong).expect_err(needle).to_string();
        assert!(message.contains(needle), "{message}");
    }
    let [mut wide, mut other] = [bytes.clone(), bytes.clone()];
    wide[meta..meta + 8].copy_from_slice(&[8, 0, 0, 0, 4, 0, 0, 0]);
    checks::seal(&mut wide);
    let message = Panorama::from_bytes(&wide)
        .expect_err("must fail")
        .to_string();
    assert!(message.contains("number of texels is 8"), "{message}");
    let texels = container
        .find(*b"TXLS", 0)
        .expect("every panorama has them");
    let at = texels.offset as usize;
    other[at..at + 4].fill(0xff);
    checks::seal(&mut other);
    let read = Panorama::from_bytes(&other).expect("any bits are texels");
    assert_eq!(read.texel(0, 0), [65_408.0; 3]);
}

#[test]
fn an_unknown_kind_of_light_is_refused_by_name() {
    let bytes = lights();
    let container = Container::from_bytes(&bytes, Kind::Lights).expect("good");
    let section = container.find(*b"KIND", 0).expect("it is recorded");
    let at = section.offset as usize;
    assert_eq!(bytes[at..at + section.length as usize], *b"srbf");
    for (name, shown) in [(*b"warp", "warp"), ([0xff, 0, b'a', b'b'], "\\xff\\x00ab")] {
        let mut other = bytes.clone();
        other[at..at + 4].copy_from_slice(&name);
        checks::seal(&mut other);
        let message = LightSet::from_bytes(&other)
            .expect_err("must fail")
            .to_string();
        for needle in ["kind of the lights is", shown, "srbf"] {
            assert!(message.contains(needle), "{message}");
        }
    }
}

#[test]
fn errors_name_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("cut.groom");
    let missing = folder.path().join("missing.groom");
    let bytes = groom();
    std::fs::write(&path, &bytes[..bytes.len() - 1]).expect("written");
    for (path, part) in [(&path, "bytes"), (&missing, "No such file")] {
        let message = Groom::read(path).expect_err("must fail").to_string();
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or_default();
        assert!(
            message.contains(name) && message.contains(part),
            "{message}"
        );
    }
    let message = Groom::read(folder.path())
        .expect_err("must fail")
        .to_string();
    assert!(message.contains("is a directory"), "{message}");
}
