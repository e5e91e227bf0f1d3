//! Checks of light sets.

use strandlight_bake::lights::{
    EVALUATION_STEPS, evaluate_with_progress, evaluate_with_residual, light_energy,
    misplaced_light, rest_parameter,
};
use strandlight_formats::{FitReport, LightSet};
use strandlight_images::Map;
use strandlight_scene::progress::Progress;

use crate::cli::progress::progress;

use super::line::Line;
use super::reference::{Reference, Residual};

/// Largest relative difference of a channel's energy between a light set and its map.
const ENERGY_TOLERANCE: f64 = 5e-3;
/// Relative difference between a recorded figure and the same measured again, and what any figure
/// may differ by: another system's libm moves them by less.
const RECORDED_TOLERANCE: f64 = 1e-3;
/// See [`RECORDED_TOLERANCE`].
const RECORDED_FLOOR: f64 = 1e-7;

/// What the format promises beyond what every reader checks; with a map, the fit measured again.
pub fn checks(set: &LightSet, reference: Option<&Reference<'_>>) -> Vec<Line> {
    let mut lines = vec![
        Line::held("number of lights", set.lights.len(), wrong_count(set)),
        Line::held("lights by falling energy", set.lights.len(), misplaced(set)),
        Line::held("hash of the map", 1, malformed_hash(&set.info.map_hash)),
    ];
    if let Some(reference) = reference {
        lines.extend(against_map(set, reference));
    }
    lines
}

/// That the residual of the map is not looked at, where one is named.
pub fn needless_residual(
    set: &LightSet,
    reference: Option<&Reference<'_>>,
) -> Option<&'static str> {
    let is_named = reference.is_some_and(|it| !matches!(it.residual, Residual::NotNamed));
    (is_named && !is_of_compact_sources(set))
        .then_some("--residual has no effect: the set is not one of `lights --suns`")
}

/// Does the set hold the compact sources of its map alone?
fn is_of_compact_sources(set: &LightSet) -> bool {
    set.info.parameters.contains(&rest_parameter())
}

/// More lights than were asked for; files of other programs may say nothing (0).
fn wrong_count(set: &LightSet) -> Option<String> {
    let (found, asked) = (set.lights.len(), set.info.requested_count as usize);
    (asked > 0 && found > asked).then(|| format!("{found}, but {asked} were asked for"))
}

fn misplaced(set: &LightSet) -> Option<String> {
    let ix = misplaced_light(&set.lights)?;
    let [before, own] = [ix - 1, ix].map(|ix| light_energy(&set.lights[ix]));
    Some(format!(
        "lights[{ix}] has energy {own:.6e}, more than {before:.6e} of lights[{}]",
        ix - 1
    ))
}

/// A hash that is neither empty nor 16 digits.
pub fn malformed_hash(hash: &str) -> Option<String> {
    let is_digit = |c: char| c.is_ascii_digit() || ('a'..='f').contains(&c);
    let good = hash.is_empty() || (hash.len() == 16 && hash.chars().all(is_digit));
    (!good).then(|| format!("{hash:?}, must be 16 hexadecimal digits or nothing"))
}

/// Measures the fit again. What the file says of itself decides nothing: it must be true.
fn against_map(set: &LightSet, reference: &Reference<'_>) -> Vec<Line> {
    let map = match reference.image(&set.info.parameters) {
        Ok(map) => map,
        Err(error) => {
            let name = "recorded image of the map";
            return vec![Line::held(name, 1, Some(error.to_string()))];
        }
    };
    let report = match report(set, &map, reference) {
        Ok(report) => report,
        Err(what) => return vec![Line::held("rest of the map", 1, Some(what))],
    };
    let energy_off = report.energy_ratio.map(|ratio| (ratio - 1.0).abs());
    let note = if report.fibre_error > reference.max_error {
        " (--max-error; a set of few lights needs more)"
    } else {
        ""
    };
    let mut lines = vec![
        Line::measured(
            "energy of a channel, relative",
            energy_off.into_iter().fold(0.0, f64::max),
            ENERGY_TOLERANCE,
            "",
        ),
        Line::measured("fibre error", report.fibre_error, reference.max_error, note),
    ];
    let (recorded, found) = (&set.info.map_hash, &map.source().hash);
    let size = [map.width() as u32, map.height() as u32];
    if recorded.is_empty() {
        return lines;
    }
    let is_other = recorded != found;
    lines.push(Line::held(
        "fitted to this map",
        1,
        is_other.then(|| {
            let path = reference.path.display();
            format!("fitted to a map of hash {recorded}, not to {path} of hash {found}")
        }),
    ));
    if is_other {
        return lines;
    }
    lines.push(Line::held(
        "recorded size of the map",
        1,
        (set.info.map_size != size).then(|| {
            let [[w, h], [width, height]] = [set.info.map_size, size];
            format!("{w} x {h} is recorded, it is {width} x {height}")
        }),
    ));
    if let Some(recorded) = &set.info.report {
        let figures = figures(recorded).into_iter().zip(figures(&report));
        let wrong = figures
            .filter(|((_, recorded), (_, found))| {
                let tolerance = RECORDED_TOLERANCE * found.abs() + RECORDED_FLOOR;
                // NaN fails the comparison too.
                let is_same = (recorded - found).abs() <= tolerance;
                !is_same
            })
            .map(|((name, recorded), (_, found))| {
                format!("{name} is recorded as {recorded:.6e}, measured again {found:.6e}")
            })
            .next();
        lines.push(Line::held("recorded figures", N_FIGURES, wrong));
    }
    lines
}

/// The figures of a set; of one that holds the compact sources of its map alone, with the rest.
fn report(set: &LightSet, map: &Map, reference: &Reference<'_>) -> Result<FitReport, String> {
    let progress = progress("comparing with the map", EVALUATION_STEPS);
    let report = report_with_progress(set, map, reference, &progress);
    progress.finish();
    report
}

fn report_with_progress(
    set: &LightSet,
    map: &Map,
    reference: &Reference<'_>,
    progress: &Progress,
) -> Result<FitReport, String> {
    if !is_of_compact_sources(set) {
        return Ok(evaluate_with_progress(set, map, progress));
    }
    let what = "the set holds the compact sources of its map alone";
    let residual = match &reference.residual {
        Residual::NotNamed => return Err(format!("{what}; name the rest by --residual")),
        Residual::Unreadable => return Err(format!("{what}, and --residual could not be read")),
        Residual::Read(residual) => residual,
    };
    evaluate_with_residual(set, residual, map, progress).ok_or_else(|| {
        let [width, height] = [residual.width(), residual.height()];
        format!("the residual is {width} x {height}, the map is not")
    })
}

const N_FIGURES: usize = 6;

/// The figures of a report by name.
fn figures(report: &FitReport) -> [(&'static str, f64); N_FIGURES] {
    let [r, g, b] = report.energy_ratio;
    [
        ("rel_l2", report.rel_l2),
        ("energy_ratio[0]", r),
        ("energy_ratio[1]", g),
        ("energy_ratio[2]", b),
        ("irradiance_error", report.irradiance_error),
        ("fibre_error", report.fibre_error),
    ]
}
