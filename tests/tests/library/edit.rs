//! An edit of the hair makes what it touches, nothing else, and no state depends on the edits
//! before it.

use std::sync::{Arc, OnceLock};

use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, TableFile};
use strandlight_render::gpu::Context;
use strandlight_render::gpu_optics::GpuOptics;
use strandlight_render::probe::{MODE_ALL, Query, evaluate};
use strandlight_scattering::axis::{Axis, Spacing};
use strandlight_scattering::closed_form::{
    DirectionInFrame, Fibre, pack_averages, sample_averages,
};
use strandlight_scattering::dual_scattering::{Average, AverageTable, N_INCLINATIONS};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::lobes::{LobeAxes, LobeTable};
use strandlight_scattering::{HairParams, Lobe, Model, PerLobe};
use strandlight_scene::material::{
    EditError, EditReport, HairMaterial, LobeTables, Outcome, Parameter, Part, RULES,
};
use strandlight_scene::paint::PaintKinds;
use strandlight_scene::tables::ShadingTables;
use strandlight_tests::random::SplitMix64;
use strandlight_tests::strandlight;

/// Lobes on a grid too coarse for pictures.
fn tables() -> Arc<LobeTables> {
    static TABLES: OnceLock<Arc<LobeTables>> = OnceLock::new();
    let fit = |lobe| {
        let axis = |min, max, count| Axis {
            min,
            max,
            count,
            spacing: Spacing::Linear,
        };
        let axes = LobeAxes {
            eta: axis(1.2, 2.0, 4),
            alpha: axis(0.0, 1.5, 8),
            absorption: axis(0.0, 0.9, 4),
        };
        LobeTable::fit(lobe, Fresnel::Dielectric, axes, 1)
    };
    let tables = TABLES.get_or_init(|| {
        Arc::new(LobeTables {
            tt: Some(fit(Lobe::Tt)),
            trt: Some(fit(Lobe::Trt)),
        })
    });
    Arc::clone(tables)
}

fn textures(hair: &HairParams, modes: &[Lobe]) -> HairMaterial {
    HairMaterial::new(tables(), Fresnel::Dielectric, hair, modes, 4).unwrap()
}

/// `hair` with another value of `parameter`.
fn edited(hair: &HairParams, parameter: Parameter, unit: f64) -> HairParams {
    let mut hair = *hair;
    let lobes = |low: f64, high: f64| PerLobe {
        r: low + (high - low) * unit,
        tt: high,
        trt: low,
    };
    match parameter {
        Parameter::Eta => hair.eta = 1.3 + 0.5 * unit,
        Parameter::SigmaA => hair.sigma_a = [0.1 + unit, 0.3, 2.0 * unit],
        Parameter::Shift => hair.shift = lobes(-0.1, 0.1),
        Parameter::Width => hair.width = lobes(0.05, 0.3),
        Parameter::CausticWidth => hair.caustic_width = 0.05 + 0.3 * unit,
        Parameter::Eccentricity => hair.eccentricity = 0.8 + 0.4 * unit,
        Parameter::Intensity => hair.intensity = lobes(0.2, 0.9),
    }
    hair
}

/// The parts that were rebuilt.
fn rebuilt(report: &EditReport) -> Vec<Part> {
    report.rebuilt().map(|report| report.part).collect()
}

/// Factors scale what shading reads mode by mode; those of 0 are modes that are off.
#[test]
fn intensities_scale_the_modes() {
    let file = TableFile::from_bytes(DEFAULT_TABLES).unwrap();
    let shading = ShadingTables::for_modes(&file, &[Lobe::R]).unwrap();
    let answer = |hair: &HairParams, modes: &[Lobe], dphi: f32, theta: f32| {
        let optics = textures(hair, modes).optics().clone();
        let light = DirectionInFrame::from_angles(0.2, 0.0);
        let view = DirectionInFrame::from_angles(theta, dphi);
        let query = Query::single(MODE_ALL, light, 0.5, view, optics.fibre).with_optics(0);
        evaluate(&query, &shading.view(), &[optics])
    };
    let with = |r, tt, trt| HairParams {
        intensity: PerLobe { r, tt, trt },
        ..HairParams::default()
    };
    let whole = HairParams::default();
    for (dphi, theta) in [(0.3, -0.4), (1.4, 0.1), (2.9, -0.1)] {
        let parts = Lobe::ALL.map(|lobe| answer(&whole, &[lobe], dphi, theta));
        let [off, on] = [
            answer(&with(0.0, 1.0, 0.0), &Lobe::ALL, dphi, theta),
            answer(&whole, &[Lobe::Tt], dphi, theta),
        ];
        assert_eq!(off, on);
        let found = answer(&with(0.25, 0.5, 0.75), &Lobe::ALL, dphi, theta);
        for c in 0..3 {
            let expected = 0.25 * parts[0][c] + 0.5 * parts[1][c] + 0.75 * parts[2][c];
            assert!(expected > 0.0);
            assert!(
                (found[c] / expected - 1.0).abs() < 1e-5,
                "{found:?} {expected}"
            );
        }
    }
}

#[test]
fn an_edit_makes_what_it_touches() {
    use Part::*;
    for (parameter, expected) in [
        (
            Parameter::Eta,
            RULES
                .iter()
                .map(|rule| rule.part)
                .filter(|part| !part.is_painted())
                .collect::<Vec<_>>(),
        ),
        (
            Parameter::SigmaA,
            vec![
                Fibre,
                EnergiesTt,
                SharesTt,
                LobesTt,
                EnergiesTrt,
                SharesTrt,
                LobesTrt,
                Averages,
                Multiple,
            ],
        ),
        (
            Parameter::Intensity,
            vec![Reflectance, LobesTt, LobesTrt, Averages, Multiple],
        ),
        (Parameter::Shift, vec![Fibre, Averages, Multiple]),
        (Parameter::Width, vec![Fibre, Averages, Multiple]),
        (
            Parameter::CausticWidth,
            vec![Fibre, ShapesTrt, LobesTrt, Averages, Multiple],
        ),
        (
            Parameter::Eccentricity,
            vec![
                Fibre,
                RowTrt,
                EnergiesTrt,
                ShapesTrt,
                SharesTrt,
                LobesTrt,
                Averages,
                Multiple,
            ],
        ),
    ] {
        let hair = HairParams::default();
        let mut textures = textures(&hair, &Lobe::ALL);
        textures.enable_multiple(true);
        let before = textures.optics().clone();
        let report = textures.apply(&edited(&hair, parameter, 0.7)).unwrap();
        assert_eq!(rebuilt(&report), expected, "{}", parameter.name());
        // What is kept is the same, what is made is another.
        let after = textures.optics();
        for (part, is_same) in [
            (Fibre, before.fibre == after.fibre),
            (Reflectance, before.reflectance == after.reflectance),
            (LobesTt, before.tt == after.tt),
            (LobesTrt, before.trt == after.trt),
            (Averages, before.averages == after.averages),
            (Multiple, before.multiple == after.multiple),
        ] {
            assert_eq!(is_same, !expected.contains(&part), "{parameter:?} {part:?}");
        }
        // The same again is no edit.
        let hair = *textures.hair();
        let report = textures.apply(&hair).unwrap();
        assert_eq!(rebuilt(&report), []);
        assert_eq!(report.bytes_to_upload(), 0);
        assert_eq!(report.microseconds(), 0.0);
    }
}

#[test]
fn the_model_is_an_edit_of_fibre_and_averages() {
    use Part::*;
    let marschner = HairParams::default();
    let energy = HairParams {
        model: Model::Energy,
        ..marschner
    };
    let dim = HairParams {
        intensity: PerLobe {
            trt: 0.5,
            ..marschner.intensity
        },
        ..energy
    };
    let mut now = textures(&marschner, &Lobe::ALL);
    now.enable_multiple(true);
    for (hair, expected) in [
        (energy, &[Fibre, Averages, Multiple][..]),
        (energy, &[]),
        // The orders beyond TRT have its intensity.
        (
            dim,
            &[Fibre, Reflectance, LobesTt, LobesTrt, Averages, Multiple],
        ),
        (
            energy,
            &[Fibre, Reflectance, LobesTt, LobesTrt, Averages, Multiple],
        ),
        (marschner, &[Fibre, Averages, Multiple]),
    ] {
        let report = now.apply(&hair).unwrap();
        assert_eq!(rebuilt(&report), expected);
        let mut fresh = textures(&hair, &Lobe::ALL);
        fresh.enable_multiple(true);
        assert!(now == fresh);
    }
    // What is not offered is refused, and nothing is changed.
    let elliptic = HairParams {
        eccentricity: 0.8,
        ..energy
    };
    let error = now.apply(&elliptic).unwrap_err().to_string();
    assert!(
        error.contains("eccentricity of model energy is 0.8"),
        "{error}"
    );
    let schlick = HairMaterial::new(tables(), Fresnel::Schlick, &energy, &Lobe::ALL, 4);
    assert_eq!(schlick.unwrap_err(), EditError::EnergySchlick);
    let mut of_energy = textures(&energy, &Lobe::ALL);
    let refused = of_energy.enable_paint(Some(PaintKinds::default()));
    assert_eq!(refused.unwrap_err(), EditError::PaintedEnergy);
    now.enable_paint(Some(PaintKinds::default())).unwrap();
    assert_eq!(now.apply(&energy).unwrap_err(), EditError::PaintedEnergy);
    assert_eq!(now.hair(), &marschner);
}

#[test]
fn only_enabled_modes_have_textures() {
    let hair = HairParams::default();
    for (modes, present) in [
        (&[Lobe::R][..], &[Part::Fibre, Part::Reflectance][..]),
        (
            &[Lobe::Tt],
            &[
                Part::Fibre,
                Part::RowTt,
                Part::EnergiesTt,
                Part::ShapesTt,
                Part::SharesTt,
                Part::LobesTt,
            ],
        ),
        (&[], &[Part::Fibre]),
    ] {
        let mut all = textures(&hair, &Lobe::ALL);
        let report = all.enable(modes).unwrap();
        for part in &report.parts {
            let is_present = part.outcome != Outcome::Absent;
            assert_eq!(is_present, present.contains(&part.part), "{}", part.name);
            assert!(is_present || part.gpu_bytes == 0);
        }
        assert_eq!(rebuilt(&report), [Part::Fibre]);
        assert!(all == textures(&hair, modes));
        // Back again: what went is made.
        all.enable(&Lobe::ALL).unwrap();
        assert!(all == textures(&hair, &Lobe::ALL));
    }
}

#[test]
fn averages_come_and_go_with_multiple_scattering() {
    let hair = HairParams::default();
    let single = textures(&hair, &Lobe::ALL);
    assert!(!single.is_multiple() && single.averages().is_empty());
    let mut all = single.clone();
    let report = all.enable_multiple(true);
    assert_eq!(rebuilt(&report), [Part::Averages, Part::Multiple]);
    let source = all.optics().multiple.as_ref().unwrap();
    let bytes = size_of_val(&source.layout) + size_of_val(&source.profiles[..]);
    assert_eq!(report.bytes_to_upload(), 64 * N_INCLINATIONS + bytes);
    // What shading samples is the table.
    let table = AverageTable::new(&hair, Fresnel::Dielectric);
    assert_eq!(all.averages(), pack_averages(&table));
    for theta in [-1.57f32, -0.4, 0.0, 0.123, 1.2] {
        let found = sample_averages(all.averages(), theta);
        for (average, found, scale) in [
            (Average::AF, found.a_f, 1.0),
            (Average::BetaF, found.beta_f_2.map(f32::sqrt), 0.1),
            (Average::Ab, found.attenuation_b, 0.1),
            (Average::DeltaB, found.shift_b, 0.1),
            (Average::SigmaB, found.width_b_2.map(f32::sqrt), 1.0),
        ] {
            let expected = table.get(average, theta);
            for (found, expected) in found.iter().zip(expected) {
                // Squares are interpolated where the table has widths.
                let error = (found - expected).abs();
                assert!(error < 1e-3 * scale, "{average:?} {theta} {error}");
            }
        }
    }
    // Modes do not matter to the averages, and the same again is no edit.
    let report = all.enable(&[]).unwrap();
    assert_eq!(rebuilt(&report), [Part::Fibre, Part::Multiple]);
    assert_eq!(rebuilt(&all.enable_multiple(true)), []);
    all.enable(&Lobe::ALL).unwrap();
    all.enable_multiple(false);
    assert!(all == single);
}

/// Edits of one to three parameters at once, now and then of the modes.
fn random_edit(random: &mut SplitMix64, hair: &mut HairParams, modes: &mut Vec<Lobe>) {
    for _ in 0..=(random.uniform(0.0, 2.99) as usize) {
        let which = random.uniform(0.0, 5.99) as usize;
        let unit = random.uniform(0.0, 1.0);
        *hair = edited(hair, Parameter::ALL[which], unit);
    }
    if random.uniform(0.0, 1.0) < 0.3 {
        let bits = random.uniform(0.0, 7.99) as usize;
        *modes = Lobe::ALL.to_vec();
        modes.retain(|&mode| bits & (1 << mode as usize) != 0);
    }
}

#[test]
fn no_state_depends_on_the_edits_before() {
    let mut random = SplitMix64(7);
    let (mut hair, mut modes) = (HairParams::default(), Lobe::ALL.to_vec());
    let mut now = textures(&hair, &modes);
    let mut n_kept = 0;
    let mut is_multiple = false;
    for _ in 0..60 {
        random_edit(&mut random, &mut hair, &mut modes);
        let report = now.edit(&hair, &modes).unwrap();
        let kept = report.parts.iter();
        n_kept += kept.filter(|part| part.outcome == Outcome::Kept).count();
        if random.uniform(0.0, 1.0) < 0.3 {
            is_multiple = !is_multiple;
            now.enable_multiple(is_multiple);
        }
        let mut fresh = textures(&hair, &modes);
        fresh.enable_multiple(is_multiple);
        assert!(now == fresh);
    }
    assert!(n_kept > 60, "nothing was ever kept");
}

#[test]
fn gpu_holds_what_is_in_memory() {
    let context = Context::new().expect("an adapter");
    let mut random = SplitMix64(11);
    let (mut hair, mut modes) = (HairParams::default(), Lobe::ALL.to_vec());
    let mut now = textures(&hair, &modes);
    let mut gpu = GpuOptics::new(&context, &[now.optics()]).unwrap();
    let (mut n_written, mut n_whole, mut n_with_averages) = (0, 0, 0);
    // What tables of multiple scattering are filled from is written beside the optics.
    let bytes_to_upload = |report: &EditReport| -> usize {
        let parts = report
            .rebuilt()
            .filter(|report| report.part != Part::Multiple);
        parts.map(|report| report.gpu_bytes).sum()
    };
    for _ in 0..30 {
        random_edit(&mut random, &mut hair, &mut modes);
        let report = now.edit(&hair, &modes).unwrap();
        let written = gpu.update(&context, now.optics(), &report);
        assert_eq!(written.bytes, bytes_to_upload(&report));
        n_written += written.bytes;
        if random.uniform(0.0, 1.0) < 0.3 {
            let report = now.enable_multiple(!now.is_multiple());
            let written = gpu.update(&context, now.optics(), &report);
            assert_eq!(written.bytes, bytes_to_upload(&report));
            n_written += written.bytes;
        }
        if now.is_multiple() {
            assert!(gpu.read_averages(&context).unwrap() == now.averages());
            n_with_averages += 1;
        }
        n_whole += now.optics().gpu_bytes();
        let uniform = gpu.read_uniform(&context).unwrap();
        let expected = now.optics().uniform();
        assert_eq!(uniform.fibre, expected.fibre);
        for mode in now.modes() {
            match mode {
                Lobe::R => assert_eq!(uniform.reflectance, expected.reflectance),
                Lobe::Tt => assert_eq!(uniform.tt, expected.tt),
                Lobe::Trt => assert_eq!(uniform.trt, expected.trt),
            }
        }
        for (mode, lobes) in [(Lobe::Tt, &now.optics().tt), (Lobe::Trt, &now.optics().trt)] {
            if modes.contains(&mode) {
                assert!(gpu.read_lobes(&context, mode).unwrap() == lobes.texels);
            }
        }
    }
    println!("{n_written} bytes written where all would be {n_whole}");
    assert!(n_written < n_whole && n_with_averages > 3);
}

#[test]
fn sources_stand_above_what_is_made_of_them() {
    for (ix, rule) in RULES.iter().enumerate() {
        for source in rule.sources {
            assert!(RULES[..ix].iter().any(|above| above.part == *source));
        }
        assert_eq!(RULES.iter().filter(|r| r.part == rule.part).count(), 1);
    }
}

#[test]
fn a_refused_edit_changes_nothing() {
    let hair = HairParams::default();
    let mut all = textures(&hair, &Lobe::ALL);
    let before = all.clone();
    for bad in [
        HairParams { eta: 0.9, ..hair },
        HairParams {
            sigma_a: [0.1, f64::NAN, 0.1],
            ..hair
        },
        HairParams {
            width: PerLobe {
                tt: -0.1,
                ..hair.width
            },
            ..hair
        },
    ] {
        assert!(matches!(all.apply(&bad), Err(EditError::Param(_))));
        assert!(all == before);
    }
    let none = Arc::new(LobeTables::default());
    let r_alone = HairMaterial::new(none, Fresnel::Dielectric, &hair, &[Lobe::R], 4);
    let mut r_alone = r_alone.unwrap();
    let refused = r_alone.enable(&[Lobe::R, Lobe::Trt]);
    assert_eq!(refused, Err(EditError::NoLobes(Lobe::Trt)));
    assert_eq!(r_alone.modes(), [Lobe::R]);
}

#[test]
fn the_command_lists_every_parameter() {
    let output = strandlight()
        .args(["bench", "edit", "--repetitions", "3", "--json"])
        .output()
        .expect("strandlight runs");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let report: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("one JSON document");
    let edits = report["edits"].as_array().expect("a list");
    let names: Vec<_> = edits.iter().map(|edit| &edit["parameter"]).collect();
    let all = Parameter::ALL.map(Parameter::name);
    assert!(names.iter().zip(all).all(|(found, name)| *found == name));
    for edit in edits {
        let parts = edit["rebuilt"].as_array().expect("a list");
        let bytes = parts
            .iter()
            .map(|part| part["bytes"].as_u64().expect("a count"));
        assert_eq!(Some(bytes.sum::<u64>()), edit["bytes"].as_u64());
        assert!(edit["microseconds"].as_f64() > Some(0.0));
    }
    // The widths and shifts of M live in the uniform; averages depend on them.
    for name in ["shift", "width"] {
        let of_name = edits.iter().find(|edit| edit["parameter"] == name);
        let bytes = of_name.expect("listed")["bytes"].as_u64();
        let multiple = textures(&HairParams::default(), &Lobe::ALL).enable_multiple(true);
        let expected = size_of::<Fibre>() + multiple.bytes_to_upload();
        assert_eq!(bytes, Some(expected as u64));
    }
}
