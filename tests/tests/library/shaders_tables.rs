//! Tables of a file as shading takes them: found by name, refused when they mean something else.

use strandlight_formats::TableFile;
use strandlight_scattering::Lobe;
use strandlight_scene::tables::{ShadingTables, ShadingTablesError};
use strandlight_tests::oracle;

fn edited(
    file: &TableFile,
    edit: impl FnOnce(&mut TableFile),
) -> Result<ShadingTables, ShadingTablesError> {
    let mut file = file.clone();
    edit(&mut file);
    ShadingTables::from_file(&file)
}

#[test]
fn faults_are_typed() {
    let file = oracle::tables(false);
    let good = edited(&file, |_| ()).unwrap();
    assert!(good.view().is_complete());
    assert_eq!(good.axes().schlick, 0);

    let missing = edited(&file, |file| {
        file.tables.retain(|table| table.name != "H_TT")
    });
    assert_eq!(missing, Err(ShadingTablesError::Missing("H_TT")));
    let axes = edited(&file, |file| {
        file.tables[0].axes[0].name = "lambda".to_owned()
    });
    assert!(matches!(
        axes,
        Err(ShadingTablesError::Axes { table: "C", .. })
    ));
    let axes = edited(&file, |file| file.tables[2].axes.truncate(1));
    assert!(matches!(
        axes,
        Err(ShadingTablesError::Axes { table: "H_TRT", .. })
    ));
    let channel = edited(&file, |file| file.tables[1].channels[2] = "H3".to_owned());
    assert_eq!(
        channel,
        Err(ShadingTablesError::Channel {
            table: "H_TT",
            channel: "H4"
        })
    );
    let short = edited(&file, |file| file.tables[0].data.truncate(100));
    assert!(matches!(
        short,
        Err(ShadingTablesError::Size { table: "C", .. })
    ));
    let huge = edited(&file, |file| file.tables[0].axes[1].count = u32::MAX);
    assert!(matches!(
        huge,
        Err(ShadingTablesError::Size { table: "C", .. })
    ));
    let different = edited(&file, |file| file.tables[2].axes[0].max = 9.0);
    assert_eq!(different, Err(ShadingTablesError::Different));
    // Schlick's tables have another column variable: relabelling is not enough.
    let relabelled = edited(&file, |file| file.fresnel = "schlick".to_owned());
    assert!(matches!(
        relabelled,
        Err(ShadingTablesError::Axes { table: "H_TT", .. })
    ));
}

#[test]
fn order_of_channels_and_tables_does_not_matter() {
    let file = oracle::tables(false);
    let good = ShadingTables::from_file(&file).unwrap();
    let shuffled = edited(&file, |file| {
        file.tables.reverse();
        for table in &mut file.tables {
            table.channels.swap(0, 3);
            let n = table.channels.len();
            for entry in table.data.chunks_exact_mut(n) {
                entry.swap(0, 3);
            }
        }
    });
    assert_eq!(shuffled.as_ref(), Ok(&good));
    // Negative control: data without its labels is another table.
    let mislabelled = edited(&file, |file| file.tables[0].channels.swap(0, 3));
    assert_ne!(mislabelled, Ok(good));
}

#[test]
fn a_mode_needs_its_own_table_only() {
    let whole = oracle::tables(false);
    for (mode, name) in [(Lobe::R, "C"), (Lobe::Tt, "H_TT"), (Lobe::Trt, "H_TRT")] {
        let mut one = whole.clone();
        one.tables.retain(|table| table.name == name);
        assert!(ShadingTables::for_modes(&one, &[mode]).is_ok(), "{name}");
        let mut others = whole.clone();
        others.tables.retain(|table| table.name != name);
        let missing = ShadingTables::for_modes(&others, &[mode]);
        assert_eq!(missing, Err(ShadingTablesError::Missing(name)));
    }
}
