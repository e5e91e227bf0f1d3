//! Transmittance of a scene's lights by every method, against ray shooting.

use std::ops::RangeInclusive;

use rayon::prelude::*;
use serde_json::{Value, json};
use strandlight_scattering::HairParams;
use strandlight_scattering::closed_form::{ShadowRecord, transmitted};
use strandlight_scattering::dual_scattering::{Average, AverageTable};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scene::PreparedScene;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::volume::{GRID_SIDE, Grid};

use crate::transmittance::{
    Method, ShadowBuilder, Transmitted, directions_of, lobe_of, ray_shares,
};
use strandlight_reference::rays::Rays;
use strandlight_scattering::random::SplitMix64;
use strandlight_scene::progress::{Progress, timed};

/// What to measure.
#[derive(Clone, Debug)]
pub struct TransmittanceOptions {
    /// Random points of the strands.
    pub n_points: usize,
    /// Rays of a light's lobe that make the truth.
    pub n_rays: u32,
    /// Seed of the points.
    pub seed: u64,
    /// Baselines to measure beside the sweep.
    pub methods: Vec<Method>,
    /// Sides of the sweep's grid beside the renderer's.
    pub sides: Vec<u32>,
    /// Directions of a light's sweep beside the renderer's.
    pub directions: Vec<u32>,
}

/// Errors of a share over points and lights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShareErrors {
    /// Mean of the truth.
    pub mean: f64,
    /// Mean error.
    pub bias: f64,
    /// Root of the mean squared error; the truth's own noise is in it.
    pub rms: f64,
}

/// Errors over a class of lights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClassErrors {
    /// Lights in it.
    pub n_lights: usize,
    /// Of T, the unblocked share.
    pub unblocked: ShareErrors,
    /// Of T_f, all channels.
    pub forward: ShareErrors,
}

/// Names of the classes: lights by lambda, all, and all weighted by their power.
pub const CLASS_NAMES: [&str; 5] = ["< 0.3", "0.3..0.6", "> 0.6", "all", "by power"];

/// One method's measurement.
#[derive(Clone, Debug)]
pub struct TransmittanceRow {
    /// Method and setting.
    pub name: String,
    /// Errors of [`CLASS_NAMES`].
    pub classes: [ClassErrors; 5],
    /// Seconds before lights are known, wall time.
    pub geometry_seconds: f64,
    /// Seconds a light, of one thread.
    pub light_seconds: f64,
    /// Microseconds a look-up, of one thread.
    pub look_up_microseconds: f64,
}

/// All methods.
#[derive(Clone, Debug)]
pub struct TransmittanceBench {
    /// One for each method.
    pub rows: Vec<TransmittanceRow>,
    /// Standard error of a point's true T, root mean square over points and lights.
    pub noise: f64,
    /// Seconds that the truth took.
    pub truth_seconds: f64,
}

/// Measures `methods` at random points of `scene` under all its lights; `progress` makes a reporter
/// of a stage's name and steps.
///
/// The truth has `n_rays` directions stratified over each light's lobe; T_f is the mean product of
/// a_f at each crossing's inclination, with the scene's hair.
pub fn run_transmittance(
    scene: &PreparedScene,
    options: &TransmittanceOptions,
    progress: impl Fn(&str, u64) -> Progress,
) -> TransmittanceBench {
    let strands = &scene.strands;
    let (lights, sweeps) = scene.light_records();
    let random = &mut SplitMix64::of_item(options.seed, 0);
    let points: Vec<u32> = (0..options.n_points)
        .map(|_| random.uniform(0.0, strands.points.len() as f64) as u32)
        .collect();
    let forward = ForwardTable::new(scene.hair.hair(), scene.hair.fresnel());

    let stage = progress("ray shooting", (points.len() * lights.len()) as u64);
    // [light][point]
    let (truth, truth_seconds) = timed(|| {
        let rays = Rays::new(strands);
        lights
            .iter()
            .map(|light| {
                let lobe = lobe_of(light, options.n_rays);
                let shares = |&point: &u32| {
                    let shares = ray_shares(&rays, strands, point, &lobe, |sin| forward.at(sin));
                    stage.advance(1);
                    shares
                };
                points.par_iter().map(shares).collect()
            })
            .collect::<Vec<Vec<Transmitted>>>()
    });
    stage.finish();
    let variance = truth
        .iter()
        .flatten()
        .map(|it| it.unblocked * (1.0 - it.unblocked));
    let n = (points.len() * lights.len()).max(1) as f64;
    let noise = (variance.sum::<f64>() / n / f64::from(options.n_rays)).sqrt();

    let sides = std::iter::once(None).chain(options.sides.iter().map(|&side| Some(side)));
    let mut settings: Vec<Setting> = Vec::new();
    for side in sides {
        for k in std::iter::once(None).chain(options.directions.iter().map(|&k| Some(k))) {
            settings.push(Setting {
                method: Method::Sweep,
                side,
                k,
            });
        }
    }
    settings.extend(options.methods.iter().map(|&method| Setting {
        method,
        side: None,
        k: None,
    }));
    let stage = progress("methods", (settings.len() * lights.len()) as u64);
    let rows = settings
        .iter()
        .map(|setting| {
            let grid = Grid::with_side(strands, setting.side.unwrap_or(GRID_SIDE));
            let (builder, geometry_seconds) =
                timed(|| ShadowBuilder::on_grid(setting.method, strands, grid));
            let found: Vec<(Vec<Transmitted>, [f64; 2])> = lights
                .par_iter()
                .map(|light| {
                    let own: Vec<[f32; 4]>;
                    let directions = match setting.k {
                        Some(k) => {
                            let lobe = lobe_of(light, k);
                            own = lobe.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect();
                            &own[..]
                        }
                        None => directions_of(light, &sweeps),
                    };
                    let (light_shadows, light_seconds) =
                        timed(|| builder.light_shadows(light, directions));
                    let (shares, seconds) = timed(|| {
                        let record = |&point: &u32| forward.shares(&light_shadows.record(point));
                        points.iter().map(record).collect()
                    });
                    stage.advance(1);
                    (shares, [light_seconds, seconds])
                })
                .collect();
            let seconds = |ix: usize| found.iter().map(|(_, seconds)| seconds[ix]).sum::<f64>();
            TransmittanceRow {
                name: setting.name(),
                classes: classes(&lights, &truth, &found),
                geometry_seconds,
                light_seconds: seconds(0) / lights.len().max(1) as f64,
                look_up_microseconds: 1e6 * seconds(1) / n,
            }
        })
        .collect();
    stage.finish();
    TransmittanceBench {
        rows,
        noise,
        truth_seconds,
    }
}

/// A method with what it is varied by.
struct Setting {
    method: Method,
    side: Option<u32>,
    k: Option<u32>,
}

impl Setting {
    fn name(&self) -> String {
        let mut name = self.method.name().to_owned();
        if let Some(side) = self.side {
            name += &format!(" side {side}");
        }
        if let Some(k) = self.k {
            name += &format!(" K {k}");
        }
        name
    }
}

/// a_f over the sine of the incident inclination.
struct ForwardTable(Vec<[f32; 3]>);

/// Entries of a [`ForwardTable`], evenly over -1..=1.
const N_SINES: usize = 257;

impl ForwardTable {
    fn new(hair: &HairParams, fresnel: Fresnel) -> ForwardTable {
        let table = AverageTable::new(hair, fresnel);
        let entry = |ix: usize| {
            let sin = 2.0 * ix as f32 / (N_SINES - 1) as f32 - 1.0;
            table.get(Average::AF, sin.asin())
        };
        ForwardTable((0..N_SINES).map(entry).collect())
    }

    fn at(&self, sin: f32) -> [f32; 3] {
        let x = (0.5 * (sin + 1.0)).clamp(0.0, 1.0) * (N_SINES - 1) as f32;
        let ix = (x as usize).min(N_SINES - 2);
        let t = x - ix as f32;
        let (a, b) = (&self.0[ix], &self.0[ix + 1]);
        [0, 1, 2].map(|c| (1.0 - t) * a[c] + t * b[c])
    }

    /// T and T_f of a record; its inclination has no sign, so both signs' a_f are averaged.
    fn shares(&self, record: &ShadowRecord) -> Transmitted {
        let (a, b) = (self.at(record.sin_theta), self.at(-record.sin_theta));
        let p = [0, 1, 2].map(|c| (1.0 - 0.5 * (a[c] + b[c])).max(0.03));
        Transmitted {
            unblocked: f64::from(record.shares[0]),
            forward: transmitted(record, p).map(f64::from),
        }
    }
}

/// Bounds of lambda of the first three classes.
const CLASS_LAMBDAS: [RangeInclusive<f32>; 3] = [
    0.0..=0.299_999,
    0.299_999_1..=0.6,
    0.600_000_1..=f32::INFINITY,
];

fn classes(
    lights: &[LightRecord],
    truth: &[Vec<Transmitted>],
    found: &[(Vec<Transmitted>, [f64; 2])],
) -> [ClassErrors; 5] {
    std::array::from_fn(|class| {
        let weight = |light: &LightRecord| match class {
            0..=2 => f64::from(u8::from(CLASS_LAMBDAS[class].contains(&light.lambda))),
            3 => 1.0,
            _ => f64::from(light.power),
        };
        let mut errors = ClassErrors::default();
        let (mut sums, mut weights) = ([[0.0; 3]; 2], [0.0; 2]);
        for ((light, truth), (found, _)) in lights.iter().zip(truth).zip(found) {
            let weight = weight(light);
            if weight == 0.0 {
                continue;
            }
            errors.n_lights += 1;
            for (truth, found) in truth.iter().zip(found) {
                let mut add = |kind: usize, truth: f64, found: f64| {
                    let error = found - truth;
                    for (sum, value) in sums[kind].iter_mut().zip([truth, error, error * error]) {
                        *sum += weight * value;
                    }
                    weights[kind] += weight;
                };
                add(0, truth.unblocked, found.unblocked);
                for (&truth, &found) in truth.forward.iter().zip(&found.forward) {
                    add(1, truth, found);
                }
            }
        }
        let [unblocked, forward] = [0, 1].map(|kind| {
            let [mean, bias, square] = sums[kind].map(|sum| sum / f64::max(weights[kind], 1e-300));
            ShareErrors {
                mean,
                bias,
                rms: square.sqrt(),
            }
        });
        ClassErrors {
            unblocked,
            forward,
            ..errors
        }
    })
}

impl TransmittanceBench {
    /// The document of `--json`.
    pub fn to_json(&self) -> Value {
        let share = |errors: &ShareErrors| json!({ "mean": errors.mean, "bias": errors.bias, "rms": errors.rms });
        let rows = self.rows.iter().map(|row| {
            let class = |(name, errors): (&str, &ClassErrors)| {
                json!({
                    "lights": name,
                    "n_lights": errors.n_lights,
                    "T": share(&errors.unblocked),
                    "T_f": share(&errors.forward),
                })
            };
            let classes = CLASS_NAMES.into_iter().zip(&row.classes).map(class);
            json!({
                "method": row.name,
                "classes": classes.collect::<Vec<_>>(),
                "geometry_seconds": row.geometry_seconds,
                "light_seconds": row.light_seconds,
                "look_up_microseconds": row.look_up_microseconds,
            })
        });
        json!({
            "truth": { "noise": self.noise, "seconds": self.truth_seconds },
            "methods": rows.collect::<Vec<_>>(),
        })
    }
}
