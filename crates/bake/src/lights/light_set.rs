//! The file of a fit.

use strandlight_formats::{FitReport, LightSet, LightSetInfo};
use strandlight_images::Map;

use super::fit::{Fit, FitOptions};

/// The light set that `fitted` to `map` is, with what its file records about its making: nothing
/// that changes from run to run.
pub fn light_set(
    options: FitOptions,
    map: &Map,
    fitted: &Fit,
    report: Option<FitReport>,
) -> LightSet {
    let mut parameters = vec![("layout".to_owned(), "latlong".to_owned())];
    parameters.extend(map.parameters());
    parameters.push(("compact_lights".to_owned(), fitted.suns.to_string()));
    LightSet {
        lights: fitted.lights.lights.clone(),
        info: LightSetInfo {
            map_hash: map.source().hash.clone(),
            // At most 32768: fits.
            map_size: [map.width() as u32, map.height() as u32],
            requested_count: options.count as u32,
            seed: options.seed,
            parameters,
            report,
            ..LightSetInfo::default()
        },
    }
}
