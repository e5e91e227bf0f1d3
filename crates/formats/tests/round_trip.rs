//! Every kind survives writing and reading.

use strandlight_formats::{
    Attribute, Axis, Domain, Error, Groom, LightSet, Scene, Spacing, SrbfLight, Table, TableFile,
};

fn groom() -> Groom {
    Groom {
        points: (0..5).map(|i| [i as f32, 2.0, 3.0]).collect(),
        strand_offsets: vec![0, 2, 5],
        attributes: vec![Attribute {
            name: "diameter".to_owned(),
            domain: Domain::Strand,
            components: 1,
            data: vec![0.007, 0.008],
        }],
        ..Groom::default()
    }
}

fn lights() -> LightSet {
    let light = SrbfLight {
        direction: [0.6, 0.0, 0.8],
        lambda: 0.3,
        rgb: [1.0, 2.0, 0.0],
    };
    LightSet {
        lights: vec![light; 3],
        ..LightSet::default()
    }
}

fn table(name: &str) -> Table {
    let axis = |name: &str, count, spacing| Axis {
        name: name.to_owned(),
        min: 1.0,
        max: 10.0,
        count,
        spacing,
    };
    Table {
        name: name.to_owned(),
        axes: vec![
            axis("eta", 3, Spacing::Log),
            axis("theta_d", 2, Spacing::Linear),
        ],
        channels: ["H0", "H2", "H4", "H6"].map(str::to_owned).to_vec(),
        data: (0..24).map(|i| i as f32).collect(),
        max_interpolation_error: 1e-4,
    }
}

fn tables() -> TableFile {
    TableFile {
        fresnel: "dielectric".to_owned(),
        tables: vec![table("H_TT"), table("H_TRT")],
        ..TableFile::default()
    }
}

#[test]
fn all_kinds() {
    let bytes = groom().to_bytes().unwrap();
    assert_eq!(Groom::from_bytes(&bytes).unwrap(), groom());
    let bytes = lights().to_bytes().unwrap();
    assert_eq!(LightSet::from_bytes(&bytes).unwrap(), lights());
    let bytes = tables().to_bytes().unwrap();
    assert_eq!(TableFile::from_bytes(&bytes).unwrap(), tables());
    assert!(matches!(
        Groom::from_bytes(&bytes),
        Err(Error::NotThisKind { .. })
    ));
    let scene = Scene::new("a.groom", "b.lights");
    let text = scene.to_toml_string().unwrap();
    assert_eq!(Scene::from_toml(&text).unwrap(), scene, "{text}");
}

#[test]
fn one_table_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.tables");
    tables().write(&path).unwrap();
    let mut reader = TableFile::open(&path).unwrap();
    assert_eq!(reader.read_table("H_TRT").unwrap(), table("H_TRT"));
    let message = reader.read_table("C").unwrap_err().to_string();
    assert!(
        message.contains("x.tables") && message.contains("H_TT, H_TRT"),
        "{message}"
    );
}
