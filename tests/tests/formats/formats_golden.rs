//! Files of every released version stay readable, value for value.
//!
//! `tests/golden/v1.*` were written by version 1 of each format and are never written again.
//! When a format gets a new version, add files for it:
//! `cargo test -p strandlight-tests --test formats formats_golden -- --ignored` writes what is
//! missing, of golden files and of the fuzzers' corpus, and leaves the rest alone.

use std::fs;
use std::path::{Path, PathBuf};

use strandlight_formats::{
    Attribute, Axis, Background, BakedFile, CameraSection, Domain, ExportOptions, FitReport, Groom,
    GroomSection, GroomSource, HairSection, ImportOptions, LightKind, LightSet, LightSetInfo,
    LightsSection, Lobe, LutInput, Mesh, MeshSource, Original, Panorama, PanoramaSource, PerLobe,
    RenderSection, Scattering, Scene, SourceFile, Spacing, SrbfLight, Table, TableFile, TableInfo,
    TablesSection, ToneMap, UpAxis, VariationSection, groom_format,
};
use strandlight_tests::project_root;

fn golden(name: &str) -> PathBuf {
    project_root().join("tests/golden").join(name)
}

fn bytes(name: &str) -> Vec<u8> {
    fs::read(golden(name)).expect("golden files are part of the project")
}

fn pairs(list: &[(&str, &str)]) -> Vec<(String, String)> {
    list.iter()
        .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()))
        .collect()
}

/// Content of `v1.hair`: strands of 2, 1 and 3 points, all arrays.
fn hair_bytes() -> Vec<u8> {
    let mut bytes = b"HAIR".to_vec();
    for word in [3u32, 6, 31, 7] {
        bytes.extend(word.to_le_bytes());
    }
    for default in [0.125f32, 0.25, 0.75, 0.5, 0.25] {
        bytes.extend(default.to_le_bytes());
    }
    let mut info = [0u8; 88];
    info[..11].copy_from_slice(b"golden hair");
    bytes.extend(info);
    bytes.extend([1u8, 0, 0, 0, 2, 0]);
    for ix in 0..18 {
        bytes.extend((0.5 * ix as f32 - 4.0).to_le_bytes());
    }
    for ix in 0..6 * 5 {
        bytes.extend((ix as f32 / 32.0).to_le_bytes());
    }
    bytes
}

/// Content of `v1.usc`: strands of 2, 1 and 3 points on a grid, so that metres are exact.
fn usc_bytes() -> Vec<u8> {
    let mut bytes = 3u32.to_le_bytes().to_vec();
    let mut ix = 0;
    for n_points in [2u32, 1, 3] {
        bytes.extend(n_points.to_le_bytes());
        for _ in 0..n_points {
            let place = [0.25 * (ix % 2) as f32, 1.5 + 0.25 * (ix % 3) as f32, 0.25];
            bytes.extend(place.iter().flat_map(|x| x.to_le_bytes()));
            ix += 1;
        }
    }
    bytes
}

fn groom() -> Groom {
    let attribute = |name: &str, domain, components, data: Vec<f32>| Attribute {
        name: name.to_owned(),
        domain,
        components,
        data,
    };
    // What is kept of a .hair file: its header, and strands of a single point, here one with index
    // 1.
    let mut data = hair_bytes();
    data.truncate(128);
    data.extend(1u32.to_le_bytes());
    let single = [1.0f32, 2.0, 3.0, 0.5, 0.25, 0.1, 0.2, 0.3];
    data.extend(single.iter().flat_map(|value| value.to_le_bytes()));
    Groom {
        points: vec![
            [0.0, 1.5, -2.25],
            [1.0, 0.1, -0.0],
            [1e-20, 99_999.0, 3.0],
            [4.0, 5.0, 6.0],
            [7.0, 8.0, 9.0],
        ],
        strand_offsets: vec![0, 2, 5],
        attributes: vec![
            attribute("diameter", Domain::Groom, 1, vec![0.0075]),
            attribute("shade", Domain::Strand, 2, vec![0.1, 0.2, 0.3, 0.4]),
            attribute(
                "color",
                Domain::Point,
                3,
                (0..15).map(|ix| ix as f32 / 16.0).collect(),
            ),
        ],
        source: GroomSource {
            cm_per_unit: 2.54,
            up: UpAxis::Z,
            hash: "0123456789abcdef".to_owned(),
            tool_version: "strandlight 0.1.0".to_owned(),
            parameters: pairs(&[("style", "golden"), ("seed", "7")]),
            original: Some(Original {
                format: "hair".to_owned(),
                data,
            }),
        },
    }
}

fn lights() -> LightSet {
    let light = |direction, lambda, rgb| SrbfLight {
        direction,
        lambda,
        rgb,
    };
    LightSet {
        lights: vec![
            light([0.0, 0.6, 0.8], 0.001, [1e9, 1.0, 0.0]),
            light([-1.0, 0.0, 0.0], 10.0, [0.1, 0.2, 0.3]),
        ],
        info: LightSetInfo {
            map_hash: "fedcba9876543210".to_owned(),
            map_size: [1024, 512],
            tool_version: "strandlight 0.1.0".to_owned(),
            requested_count: 40,
            seed: 11,
            parameters: pairs(&[("layout", "latlong")]),
            report: Some(FitReport {
                rel_l2: 0.25,
                energy_ratio: [1.0, 0.999, 1.001],
                irradiance_error: 0.005,
                fibre_error: 0.01,
            }),
        },
    }
}

fn tables() -> TableFile {
    let axis = |name: &str, min, max, count, spacing| Axis {
        name: name.to_owned(),
        min,
        max,
        count,
        spacing,
    };
    let table = |name: &str, axes: [Axis; 2], n_channels: usize| Table {
        name: name.to_owned(),
        channels: (0..n_channels).map(|ix| format!("ch{ix}")).collect(),
        data: (0..n_channels as u32 * axes[0].count * axes[1].count)
            .map(|ix| ix as f32 / 7.0)
            .collect(),
        axes: axes.to_vec(),
        max_interpolation_error: 0.0005,
    };
    let pair = |first, second| [first, second];
    TableFile {
        fresnel: "dielectric".to_owned(),
        tables: vec![
            table(
                "C",
                pair(
                    axis("kappa", 0.0, 2e6, 3, Spacing::InverseSqrt),
                    axis("cos_half_phi", 0.0, 1.0, 2, Spacing::RootSquare),
                ),
                8,
            ),
            table(
                "H_TT",
                pair(
                    axis("eta", 1.0, 10.0, 2, Spacing::Reciprocal),
                    axis("eta_ratio", 0.0, 1.0, 2, Spacing::Concave),
                ),
                4,
            ),
            table(
                "other",
                pair(
                    axis("lambda", 0.001, 10.0, 2, Spacing::Log),
                    axis("phi", -1.0, 3.0, 2, Spacing::Linear),
                ),
                1,
            ),
        ],
        info: TableInfo {
            tool_version: "strandlight 0.1.0".to_owned(),
            parameters: pairs(&[("order", "64")]),
        },
    }
}

fn mesh() -> Mesh {
    Mesh {
        positions: vec![
            [0.0, 1.5, -2.25],
            [1.0, 0.1, -0.0],
            [1e-20, 99_999.0, 3.0],
            [4.0, 5.0, 6.0],
        ],
        normals: vec![
            [0.0, 1.0, 0.0],
            [0.6, 0.0, -0.8],
            [-1.0, 0.0, 0.0],
            [0.0, -0.6, 0.8],
        ],
        uvs: vec![[0.0, 0.5], [1.0, -0.25], [0.1, 0.2], [3.0, 4.0]],
        triangles: vec![[0, 1, 2], [3, 2, 1]],
        source: MeshSource {
            hash: "0123456789abcdef".to_owned(),
            tool_version: "strandlight 0.1.0".to_owned(),
            parameters: pairs(&[("unit", "m"), ("up", "y")]),
        },
    }
}

fn panorama() -> Panorama {
    let mut pixels: Vec<[f32; 3]> = (0..32).map(|ix| [ix as f32 / 8.0, 0.25, 1e-9]).collect();
    pixels[9] = [69_120.0, 40_000.0, 0.0];
    let mut panorama = Panorama::from_pixels(8, &pixels).expect("valid");
    panorama.source = PanoramaSource {
        map_hash: "fedcba9876543210".to_owned(),
        map_size: [2048, 1024],
        tool_version: "strandlight 0.1.0".to_owned(),
        parameters: pairs(&[("layout", "latlong")]),
    };
    panorama
}

fn scene() -> Scene {
    let per_mode = |r, tt, trt| PerLobe { r, tt, trt };
    Scene {
        version: 1,
        groom: GroomSection {
            file: "v1.groom".into(),
        },
        lights: LightsSection {
            file: "../golden/v1.lights".into(),
            intensity: 2.5,
            rotate_deg: -90.0,
            ..LightsSection::new("")
        },
        tables: Some(TablesSection {
            file: "v1.tables".into(),
        }),
        hair: HairSection {
            preset: None,
            eta: 1.6,
            sigma_a: [0.1, 0.2, 0.4],
            reflectance: None,
            melanin: None,
            shift_deg: per_mode(-5.0, 2.5, 7.5),
            width_deg: per_mode(6.0, 3.0, 12.0),
            caustic_width_deg: 10.0,
            eccentricity: 0.9,
            diameter_cm: Some(0.006),
            modes: vec![Lobe::Trt, Lobe::R],
            density_forward: None,
            density_back: None,
            ..HairSection::default()
        },
        camera: Some(CameraSection {
            position: [0.0, 10.0, 80.0],
            target: [0.0, -5.0, 0.0],
            up: [0.0, 0.0, 1.0],
            fov_deg: 35.0,
        }),
        render: RenderSection {
            size: [640, 360],
            samples: 16,
            exposure: -1.5,
            tone_map: ToneMap::None,
            lut: None,
            lut_input: LutInput::Log2,
            background: Background::Color([0.25, 0.5, 1.0]),
            scattering: Scattering::Total,
            shadow_maps: 64,
        },
        proxies: Vec::new(),
        variation: VariationSection::default(),
        motion: None,
        folder: project_root().join("tests/golden"),
    }
}

#[test]
fn version_1_groom() {
    for name in ["v1.groom", "v1_1.groom"] {
        let read = Groom::read(&golden(name)).expect("readable");
        assert_eq!(read, groom(), "{name}");
        // -0.0 equals 0.0, so look at the bits too.
        assert_eq!(read.points[1][2].to_bits(), (-0.0f32).to_bits());
    }
}

/// What version 1.0 kept of `.hair` files still brings back the file.
#[test]
fn version_1_groom_is_exported_as_it_was_imported() {
    let exported = |name: &str| {
        let groom = Groom::read(&golden(name)).expect("readable");
        assert_eq!(groom.source.n_set_aside(), 1);
        let format = groom_format("hair").expect("there is one");
        let export = groom.export(format, &ExportOptions::default());
        export.expect("writable").bytes
    };
    let bytes = exported("v1.groom");
    // The info string, and the single point as the second of three strands.
    assert_eq!(bytes[40..51], *b"golden hair");
    assert_eq!(bytes[128..134], [1, 0, 0, 0, 2, 0]);
    let single: Vec<u8> = [1.0f32, 2.0, 3.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    assert_eq!(bytes[134 + 24..134 + 36], single);
    assert!(bytes == exported("v1_1.groom"));
}

#[test]
fn version_1_lights() {
    for name in ["v1.lights", "v1_1.lights"] {
        let read = LightSet::read(&golden(name)).expect("readable");
        assert_eq!(read, lights(), "{name}");
        assert_eq!(read.kind(), LightKind::Srbf);
    }
}

#[test]
fn version_1_mesh() {
    let read = Mesh::read(&golden("v1.mesh")).expect("readable");
    assert_eq!(read, mesh());
    assert_eq!(read.positions[1][2].to_bits(), (-0.0f32).to_bits());
}

#[test]
fn version_1_panorama() {
    let read = Panorama::read(&golden("v1.panorama")).expect("readable");
    assert_eq!(read, panorama());
    assert_eq!((read.width(), read.height(), read.exponent()), (8, 4, 1));
    assert_eq!(read.pixels()[9], [69_120.0, 39_936.0, 0.0]);
}

#[test]
fn version_1_tables() {
    assert_eq!(
        TableFile::read(&golden("v1.tables")).expect("readable"),
        tables()
    );
    let mut reader = TableFile::open(&golden("v1.tables")).expect("readable");
    let other = reader.read_table("other").expect("readable");
    assert_eq!(Some(&other), tables().tables.last());
}

#[test]
fn version_1_scene() {
    let read = Scene::read(golden("v1.toml")).expect("readable");
    assert_eq!(read, scene());
    assert_eq!(read.groom_path(), golden("v1.groom"));
}

#[test]
fn version_1_hair() {
    let bytes = bytes("v1.hair");
    assert!(bytes == hair_bytes());
    let file = SourceFile::from_bytes(&*bytes).expect("known");
    let import = file.import(&ImportOptions::default());
    let groom = import.expect("readable").groom;
    assert_eq!(groom.strand_offsets, [0, 2, 5]);
    // Source point 3, the first after the single one, is (0.5, 1, 1.5), z up.
    assert_eq!(groom.points[2], [0.5, 1.5, -1.0]);
    let export = groom.export(file.format(), &ExportOptions::default());
    assert!(export.expect("writable").bytes == bytes);
}

#[test]
fn version_1_usc() {
    let bytes = bytes("v1.usc");
    assert!(bytes == usc_bytes());
    let file = SourceFile::from_bytes(&*bytes).expect("known");
    assert_eq!(file.format().info().name, "usc");
    let import = file.import(&ImportOptions::default());
    let groom = import.expect("readable").groom;
    assert_eq!(groom.strand_offsets, [0, 2, 5]);
    // In metres, y up; the single point is left out.
    assert_eq!(groom.points[2], [25.0, 150.0, 25.0]);
    let export = groom.export(file.format(), &ExportOptions::default());
    assert!(export.expect("writable").bytes == bytes);
}

/// A version that is what is written is written as it was: a change of bytes without a change of
/// version would be noticed here.
#[test]
fn the_last_version_is_still_written_the_same() {
    assert!(groom().to_bytes().expect("valid") == bytes("v1_1.groom"));
    assert!(lights().to_bytes().expect("valid") == bytes("v1_1.lights"));
    assert!(mesh().to_bytes().expect("valid") == bytes("v1.mesh"));
    assert!(panorama().to_bytes().expect("valid") == bytes("v1.panorama"));
    assert!(tables().to_bytes().expect("valid") == bytes("v1.tables"));
}

fn write_if_missing(path: &Path, bytes: &[u8]) {
    fs::create_dir_all(path.parent().expect("it has a folder")).expect("writable");
    if !path.exists() {
        fs::write(path, bytes).expect("writable");
    }
}

#[test]
#[ignore = "writes golden files and the fuzzers' corpus where missing"]
fn write_missing_files() {
    let files = [
        ("groom", "v1_1", groom().to_bytes().expect("valid")),
        ("lights", "v1_1", lights().to_bytes().expect("valid")),
        ("mesh", "v1", mesh().to_bytes().expect("valid")),
        ("panorama", "v1", panorama().to_bytes().expect("valid")),
        ("tables", "v1", tables().to_bytes().expect("valid")),
        ("hair", "v1", hair_bytes()),
        ("usc", "v1", usc_bytes()),
    ];
    let corpus = project_root().join("fuzz/corpus");
    for (kind, version, bytes) in &files {
        write_if_missing(&golden(&format!("{version}.{kind}")), bytes);
        let folder = corpus.join(kind);
        write_if_missing(&folder.join(format!("good_{version}")), bytes);
        write_if_missing(&folder.join("cut"), &bytes[..bytes.len() * 2 / 3]);
        write_if_missing(
            &folder.join("header_only"),
            &bytes[..128.min(bytes.len() / 2)],
        );
        let mut counts = bytes.clone();
        let count_at = match *kind {
            "hair" => 4,
            "usc" => 0,
            _ => 16,
        };
        counts[count_at..][..4].fill(0xff);
        write_if_missing(&folder.join("absurd_count"), &counts);
        let mut nan = bytes.clone();
        let at = nan.len() - 8;
        nan[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
        // Any bits are texels.
        if *kind != "panorama" {
            write_if_missing(&folder.join("nan_near_the_end"), &nan);
        }
        let mut long = bytes.clone();
        long.push(0);
        write_if_missing(&folder.join("trailing_byte"), &long);
    }
    let mut points = usc_bytes();
    points[4..8].copy_from_slice(&[0xff, 0xff, 0xff, 0x7f]);
    write_if_missing(&corpus.join("usc/absurd_points"), &points);
    let plain = [
        &hair_bytes()[..12],
        &[2, 0, 0, 0],
        &[1, 0, 0, 0],
        &hair_bytes()[20..128],
    ]
    .concat();
    let mut plain = [plain, hair_bytes()[134..134 + 72].to_vec()].concat();
    write_if_missing(&corpus.join("hair/good_default_segments"), &plain);
    plain[16..20].fill(0xff);
    write_if_missing(&corpus.join("hair/absurd_segments"), &plain);

    let folder = corpus.join("scene");
    let text = String::from_utf8(bytes("v1.toml")).expect("UTF-8");
    for (name, text) in [
        ("good_v1", text.clone()),
        (
            "good_least",
            "version=1\ngroom.file='a'\nlights.file='b'".to_owned(),
        ),
        ("unknown_key", format!("{text}\ncolour = 1")),
        ("newer", text.replace("version = 1", "version = 2")),
        ("nan", text.replace("eta = 1.6", "eta = nan")),
        ("cut", text[..text.len() / 2].to_owned()),
        ("deep", "a = ".to_owned() + &"[".repeat(2000)),
    ] {
        write_if_missing(&folder.join(name), text.as_bytes());
    }
}
