//! Numerical stress of single and multiple scattering: what the renderer evaluates, in f32 on the
//! CPU and as WGSL on the adapter, against the exact model in f64, at corners and random extremes.
//!
//! - [`Target`]: the scheme under test.
//! - [`run()`]: all checks; the same seed gives the same [`Report`] on any number of threads.
//! - [`Report`]: checks with their worst cases and all inputs of these.

mod accuracy;
mod continuity;
mod draw;
mod energy;
mod invalid;
mod multiple;
mod multiple_point;
mod point;
mod report;
mod run;
mod symmetry;
mod target;
mod values;

use strandlight_scattering::closed_form::MAX_NODES;

use draw::Domain;
use run::Run;
use strandlight_scene::progress::Progress;

pub use invalid::ParseQuery;
pub(crate) use point::hair_json;
pub use report::{Check, Report, Status, Worst};
pub use run::Options;
pub use target::{StressError, Target};

/// Runs all checks of `target`.
///
/// # Errors
/// The adapter failed. Failed checks are in the report.
pub fn run(
    target: &Target,
    options: Options,
    parse_query: ParseQuery,
    progress: &(dyn Fn(&str, u64) -> Progress + Sync),
) -> Result<Report, StressError> {
    let run = Run {
        target,
        fresnel: target.fresnel(),
        options,
        progress,
    };
    let n = options.n;
    let mut checks = Vec::new();
    checks.extend(
        run.evaluate("corners", draw::corners())?
            .finite("finite, corners"),
    );
    let extremes = run.evaluate("extremes", draw::extremes(options.seed, 0, n))?;
    checks.extend(extremes.finite("finite, random extremes"));
    checks.extend(extremes.twins_by_mode());
    drop(extremes);
    if target.has_nodes() {
        checks.extend(multiple::checks(&run, n)?);
    }
    let share = |part: usize| n.div_ceil(part);
    checks.extend(energy::under_constant_light(&run, share(25))?);
    checks.extend(energy::over_azimuth(&run, share(200))?);
    for domain in [Domain::Ordinary, Domain::Extreme] {
        checks.extend(energy::wide_light(&run, share(250), domain)?);
        checks.extend(energy::over_views(&run, share(500), domain, None)?);
        checks.extend(energy::furnace(&run, share(250), domain)?);
    }
    if target.has_nodes() {
        let nodes = Some(MAX_NODES);
        checks.extend(energy::over_views(
            &run,
            share(500),
            Domain::Extreme,
            nodes,
        )?);
    }
    checks.extend(symmetry::checks(&run, n)?);
    checks.extend(continuity::checks(&run, share(2000))?);
    checks.extend(accuracy::against_exact(&run, share(200))?);
    checks.extend(accuracy::rounding(&run, share(4))?);
    checks.extend(invalid::checks(parse_query));
    Ok(Report {
        scheme: target.scheme(),
        adapter: target.adapter().map(str::to_owned),
        n: n as u64,
        seed: options.seed,
        checks,
    })
}
