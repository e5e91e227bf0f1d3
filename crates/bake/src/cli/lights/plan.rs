//! Which fits a command line asks for, and making them.

use strandlight_bake::lights::{
    Budget, CountError, Fit, FitError, FitOptions, STEPS, Separated, curve_steps, fit,
    fit_to_budget, fit_with_curve, separate,
};
use strandlight_formats::LightSet;
use strandlight_images::Map;
use strandlight_scattering::HairParams;
use strandlight_scene::progress::{Progress, timed};

use super::args::{FitArgs, hair_of};
use crate::cli::Failure;

/// Which fits are to be made.
pub struct Plan {
    pub hair: Option<HairParams>,
    pub goal: Goal,
}

pub enum Goal {
    Count(FitOptions),
    /// A number of lights, and others for comparison.
    Curve(FitOptions),
    Budget(Budget),
    /// So many compact sources at the most, and the rest as a map.
    Suns(usize),
}

/// What was found in a map.
pub struct Found {
    pub fit: Fit,
    /// Lights that were asked for.
    pub count: usize,
    /// Place on the curve, and the curve.
    pub curve: Option<(CountError, Vec<CountError>)>,
    /// The rest of the map, if the lights are its compact sources alone.
    pub residual: Option<Map>,
}

impl Plan {
    pub fn of(args: &FitArgs) -> Result<Plan, Failure> {
        let hair = args.hair.as_deref().map(hair_of).transpose()?;
        let options = FitOptions {
            count: args.count,
            seed: args.seed,
        };
        let goal = match (args.suns, args.max_error) {
            (Some(suns), _) => Goal::Suns(suns),
            (None, Some(max_error)) => Goal::Budget(Budget {
                max_error,
                metric: args.metric,
                max_count: args.max_count,
                seed: args.seed,
                hair,
            }),
            (None, None) if args.curve => Goal::Curve(options),
            (None, None) => Goal::Count(options),
        };
        Ok(Plan { hair, goal })
    }

    pub fn steps(&self) -> u64 {
        match &self.goal {
            Goal::Count(_) => STEPS,
            Goal::Suns(_) => 1,
            Goal::Curve(options) => curve_steps(options.count),
            Goal::Budget(budget) => budget.steps(),
        }
    }

    /// Makes the fits.
    pub fn fit(&self, map: &Map, progress: &Progress) -> Result<Found, String> {
        let chosen = match self.goal {
            Goal::Count(options) => {
                return Ok(Found {
                    fit: fit(map, options, progress).map_err(told)?,
                    count: options.count,
                    curve: None,
                    residual: None,
                });
            }
            Goal::Suns(most) => {
                let found = suns(map, most);
                progress.advance(1);
                return found;
            }
            Goal::Curve(options) => fit_with_curve(map, options, self.hair.as_ref(), progress),
            Goal::Budget(budget) => fit_to_budget(map, budget, progress),
        };
        let chosen = chosen.map_err(told)?;
        let point = chosen.point;
        Ok(Found {
            fit: chosen.fit,
            count: point.count,
            curve: Some((point, chosen.curve)),
            residual: None,
        })
    }
}

fn told(error: FitError) -> String {
    error.to_string()
}

fn suns(map: &Map, most: usize) -> Result<Found, String> {
    let (parts, seconds) = timed(|| separate(map, most));
    let Separated { lights, residual } = parts.map_err(|error| error.to_string())?;
    Ok(Found {
        count: most,
        curve: None,
        residual: Some(residual),
        fit: Fit {
            suns: lights.len(),
            lights: LightSet {
                lights,
                ..LightSet::default()
            },
            energy_scale: [1.0; 3],
            seconds: vec![("suns", seconds)],
        },
    })
}
