//! What the tables of multiple scattering cost: to fill, and a look-up beside an evaluation of the closed form.
//!
//! ```sh
//! cargo run --release -p strandlight-scene --example multiple_tables -- 100
//! ```
//!
//! Lights and views as in `tests/multiple_tables.rs`, which has the errors; default hair, or of an eccentricity
//! that comes second. Time is that of
//! the main thread on a core, as Linux counts it.

use std::hint::black_box;
use std::process::ExitCode;
use std::sync::Arc;

use fearless_simd::prelude::*;
use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, TableFile};
use strandlight_scattering::closed_form::{
    DirectionInFrame, LightInFrame, TERM_GLOBAL, TERM_LOCAL, direct_local_scattering,
    global_scattering, local_scattering, sample_averages,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::jobs::{Job, in_turn};
use strandlight_scattering::multiple_tables::{
    Azimuths, AzimuthsOfLights, MultipleSource, MultipleTables, SeenLights,
};
use strandlight_scattering::random::SplitMix64;
use strandlight_scattering::wide::{LANES, Level, Simd, dispatch, f32x8};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::material::{HairMaterial, LobeTables};
use strandlight_scene::tables::ShadingTables;

type Failed = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("multiple_tables: {error}");
            ExitCode::from(2)
        }
    }
}

fn run() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (count, eccentricity) = match &arguments[..] {
        [count] => (count, 1.0),
        [count, eccentricity] => (count, eccentricity.parse()?),
        _ => return Err("usage: multiple_tables REPETITIONS [ECCENTRICITY]".into()),
    };
    cost(count.parse()?, eccentricity)
}

/// The bundled tables.
struct Bundled {
    tables: ShadingTables,
    lobes: Arc<LobeTables>,
}

impl Bundled {
    fn new() -> Result<Bundled, Failed> {
        let file = TableFile::from_bytes(DEFAULT_TABLES)?;
        Ok(Bundled {
            tables: ShadingTables::from_file(&file)?,
            lobes: Arc::new(LobeTables::from_file(&file, &Lobe::ALL)?),
        })
    }

    fn material(&self, hair: &HairParams, modes: &[Lobe]) -> Result<HairMaterial, Failed> {
        let lobes = Arc::clone(&self.lobes);
        let mut material = HairMaterial::new(lobes, Fresnel::Dielectric, hair, modes, 4)?;
        material.enable_multiple(true);
        Ok(material)
    }

    fn fill(&self, material: &HairMaterial) -> MultipleTables {
        let shading = material.optics().shading(self.tables.view());
        let terms = TERM_GLOBAL | TERM_LOCAL;
        MultipleTables::new(&shading, material.averages(), terms, |jobs| {
            jobs.into_iter().for_each(Job::run);
        })
    }
}

/// A light and a view.
struct Query {
    light: LightInFrame,
    view: DirectionInFrame,
    azimuths: Azimuths,
    sigma_f: f32,
}

impl Query {
    fn draw(ix: u64, material: &HairMaterial) -> Query {
        let mut random = SplitMix64::of_item(7, ix);
        let mut theta = || random.uniform(-1.0, 1.0).asin() as f32;
        let (theta_j, theta_o) = (theta(), theta());
        let delta = random.uniform(0.0, std::f64::consts::PI) as f32;
        let lambda = random.log_uniform(0.01, 1.2) as f32;
        let events = random.log_uniform(1.0, 12.0) as f32;
        let sin_theta = random.uniform(-1.0, 1.0) as f32;
        let channel = random.uniform(0.0, 3.0) as usize;
        let at = sample_averages(material.averages(), sin_theta.asin());
        let sigma_bar_2 = events * at.beta_f_2[channel.min(2)];
        let light = LightInFrame::from_angles(theta_j, 0.0, lambda);
        let view = DirectionInFrame::from_angles(theta_o, delta);
        Query {
            light,
            view,
            azimuths: Azimuths::between(&light.direction, &view),
            sigma_f: (lambda * lambda + sigma_bar_2).sqrt(),
        }
    }
}

/// Nanoseconds that the main thread has been on a core.
fn on_core() -> Result<u64, Failed> {
    let text = std::fs::read_to_string("/proc/self/schedstat")?;
    Ok(text.split(' ').next().unwrap_or_default().parse()?)
}

/// Eight lights under one view.
struct Eight {
    theta_j: [f32; LANES],
    cos_theta_j: [f32; LANES],
    view: DirectionInFrame,
    cos_phi: [f32; LANES],
    sin_phi: [f32; LANES],
    sigma_f: [f32; LANES],
    lambda: [f32; LANES],
}

impl Eight {
    fn new(queries: &[Query; LANES]) -> Eight {
        let of = |number: fn(&Query) -> f32| std::array::from_fn(|lane| number(&queries[lane]));
        Eight {
            theta_j: of(|q| q.light.direction.theta),
            cos_theta_j: of(|q| q.light.direction.cos_theta),
            view: queries[0].view,
            cos_phi: of(|q| q.light.direction.cos_phi),
            sin_phi: of(|q| q.light.direction.sin_phi),
            sigma_f: of(|q| q.sigma_f),
            lambda: of(|q| q.light.lambda),
        }
    }
}

impl Eight {
    #[inline(always)]
    fn seen<S: Simd>(&self, simd: S) -> SeenLights<S> {
        let [theta, cos_theta, cos_phi, sin_phi] =
            [self.theta_j, self.cos_theta_j, self.cos_phi, self.sin_phi]
                .map(|x| f32x8::simd_from(simd, x));
        SeenLights {
            theta,
            cos_theta,
            n: LANES,
            azimuths: AzimuthsOfLights::between([cos_phi, sin_phi], &self.view),
            theta_o: self.view.theta,
        }
    }
}

#[inline(always)]
fn look_up<S: Simd>(simd: S, tables: &MultipleTables, queries: &[Eight]) -> f32 {
    let mut sum = f32x8::splat(simd, 0.0);
    for q in queries {
        let sigma_f = f32x8::simd_from(simd, q.sigma_f);
        let (global, local) = tables.at_lights(&q.seen(simd), sigma_f);
        for value in global.into_iter().chain(local) {
            sum += value;
        }
    }
    <[f32; LANES]>::from(sum).iter().sum()
}

#[inline(always)]
fn look_up_direct<S: Simd>(simd: S, tables: &MultipleTables, queries: &[Eight]) -> f32 {
    let mut sum = f32x8::splat(simd, 0.0);
    for q in queries {
        let lambda = f32x8::simd_from(simd, q.lambda);
        for value in tables.direct_at_lights(&q.seen(simd), lambda) {
            sum += value;
        }
    }
    <[f32; LANES]>::from(sum).iter().sum()
}

fn cost(repetitions: u64, eccentricity: f64) -> Result<(), Failed> {
    let bundled = Bundled::new()?;
    let hair = HairParams {
        eccentricity,
        ..HairParams::default()
    };
    let material = bundled.material(&hair, &Lobe::ALL)?;
    let shading = material.optics().shading(bundled.tables.view());
    let averages = material.averages();
    let start = on_core()?;
    let fills = repetitions.div_ceil(100);
    for _ in 0..fills {
        black_box(bundled.fill(black_box(&material)));
    }
    let fill = (on_core()? - start) as f64 * 1e-6 / fills as f64;
    let tables = bundled.fill(&material);
    println!("fill {fill:.1} ms, {} bytes", tables.bytes());
    let start = on_core()?;
    for _ in 0..repetitions {
        let terms = TERM_GLOBAL | TERM_LOCAL;
        black_box(MultipleSource::new(
            black_box(&shading),
            averages,
            terms,
            in_turn,
        ));
    }
    let source = (on_core()? - start) as f64 * 1e-6 / repetitions as f64;
    println!("what a GPU fills them from {source:.2} ms");
    let queries: Vec<Query> = (0..4096).map(|ix| Query::draw(ix, &material)).collect();
    let time = |name: &str, one: &dyn Fn(&[Query]) -> f32| -> Result<(), Failed> {
        let start = on_core()?;
        for _ in 0..repetitions {
            black_box(one(black_box(&queries)));
        }
        let each = (on_core()? - start) as f64 / (repetitions as f64 * queries.len() as f64);
        println!("{name:24} {each:7.1} ns");
        Ok(())
    };
    let sum = |value: [f32; 3]| value[0] + value[1] + value[2];
    time("global + local look-up", &|queries| {
        let one = |q: &Query| {
            let theta = q.light.direction.theta;
            let (global, local) = tables.at(theta, q.view.theta, &q.azimuths, q.sigma_f);
            sum(global) + sum(local)
        };
        queries.iter().map(one).sum()
    })?;
    time("direct local look-up", &|queries| {
        let one = |q: &Query| {
            let at = &q.light.direction;
            let (theta_o, lambda) = (q.view.theta, q.light.lambda);
            let cos_delta = q.azimuths.cos_delta;
            sum(tables.direct_at(at.theta, at.cos_theta, theta_o, cos_delta, lambda))
        };
        queries.iter().map(one).sum()
    })?;
    let eights: Vec<Eight> = queries.as_chunks().0.iter().map(Eight::new).collect();
    let best = Level::new();
    let mut levels = vec![("best", best)];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        levels.extend(best.as_avx2().map(|avx2| ("AVX2", avx2.level())));
        levels.extend(best.as_sse2().map(|sse2| ("SSE2", sse2.level())));
    }
    for (name, level) in levels {
        time(
            &format!("global + local, {name}"),
            &|_| dispatch!(level, simd => look_up(simd, &tables, black_box(&eights))),
        )?;
        time(
            &format!("direct local, {name}"),
            &|_| dispatch!(level, simd => look_up_direct(simd, &tables, black_box(&eights))),
        )?;
    }
    time("global", &|queries| {
        let one = |q: &Query| {
            sum(global_scattering(
                &q.light.direction,
                &q.view,
                q.sigma_f,
                &shading,
            ))
        };
        queries.iter().map(one).sum()
    })?;
    time("local", &|queries| {
        let one = |q: &Query| {
            sum(local_scattering(
                &q.light.direction,
                &q.view,
                q.sigma_f,
                averages,
            ))
        };
        queries.iter().map(one).sum()
    })?;
    time("direct local", &|queries| {
        let one = |q: &Query| sum(direct_local_scattering(&q.light, &q.view, averages));
        queries.iter().map(one).sum()
    })?;
    Ok(())
}
