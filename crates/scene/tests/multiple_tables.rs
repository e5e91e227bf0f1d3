//! Tables of multiple scattering against the closed form that they stand for.

use std::f64::consts::{PI, SQRT_2};
use std::sync::Arc;

use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, TableFile};
use strandlight_scattering::closed_form::{
    DirectionInFrame, LightInFrame, TERM_GLOBAL, TERM_LOCAL, direct_local_scattering,
    global_scattering, local_scattering, sample_averages,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::jobs::Job;
use strandlight_scattering::multiple_tables::{Azimuths, MultipleTables};
use strandlight_scattering::random::SplitMix64;
use strandlight_scattering::{HairParams, Lobe, Model, PerLobe};
use strandlight_scene::material::{HairMaterial, LobeTables};
use strandlight_scene::tables::ShadingTables;

const DEGREE: f64 = PI / 180.0;
const BOTH: u32 = TERM_GLOBAL | TERM_LOCAL;
const TERMS: [&str; 3] = ["global", "local", "direct local"];

/// The bundled tables.
struct Bundled {
    tables: ShadingTables,
    lobes: Arc<LobeTables>,
}

impl Bundled {
    fn new() -> Bundled {
        let file = TableFile::from_bytes(DEFAULT_TABLES).unwrap();
        Bundled {
            tables: ShadingTables::from_file(&file).unwrap(),
            lobes: Arc::new(LobeTables::from_file(&file, &Lobe::ALL).unwrap()),
        }
    }

    fn material(&self, hair: &HairParams, modes: &[Lobe]) -> HairMaterial {
        let lobes = Arc::clone(&self.lobes);
        let mut material = HairMaterial::new(lobes, Fresnel::Dielectric, hair, modes, 4).unwrap();
        material.enable_multiple(true);
        material
    }

    fn fill(&self, material: &HairMaterial, terms: u32) -> MultipleTables {
        let shading = material.optics().shading(self.tables.view());
        MultipleTables::new(&shading, material.averages(), terms, |jobs| {
            jobs.into_iter().for_each(Job::run);
        })
    }

    /// Squares of error and value of each term, of draws `first..first + count`.
    fn squares(
        &self,
        material: &HairMaterial,
        tables: &MultipleTables,
        first: u64,
        count: u64,
    ) -> [[f64; 2]; 3] {
        let shading = material.optics().shading(self.tables.view());
        let averages = material.averages();
        let mut squares = [[0.0; 2]; 3];
        for ix in first..first + count {
            let query = Query::draw(ix, material);
            let (towards, view) = (&query.light.direction, &query.view);
            let exact = [
                global_scattering(towards, view, query.sigma_f, &shading),
                local_scattering(towards, view, query.sigma_f, averages),
                direct_local_scattering(&query.light, view, averages),
            ];
            let found = query.look_up(tables);
            assert!(found.as_flattened().iter().all(|&value| value >= 0.0));
            for (squares, (found, exact)) in squares.iter_mut().zip(found.iter().zip(exact)) {
                for (found, exact) in found.iter().zip(exact) {
                    squares[0] += f64::from(found - exact).powi(2);
                    squares[1] += f64::from(exact).powi(2);
                }
            }
        }
        squares
    }
}

/// Relative RMSE of each term in percent.
fn percent(squares: [[f64; 2]; 3]) -> [f64; 3] {
    squares.map(|[error, value]| 100.0 * (error / value).sqrt())
}

/// A light and a view: directions even over the sphere, lambda log-uniform in 0.01..1.2, sigma_f after 1 to
/// 12 forward scatterings.
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
        let delta = random.uniform(0.0, PI) as f32;
        let lambda = random.log_uniform(0.01, 1.2) as f32;
        let events = random.log_uniform(1.0, 12.0) as f32;
        let sin_theta = random.uniform(-1.0, 1.0) as f32;
        let channel = random.uniform(0.0, 3.0) as usize;
        let at = sample_averages(material.averages(), sin_theta.asin());
        let sigma_bar_2 = events * at.beta_f_2[channel.min(2)];
        // A round fibre does not tell where the view is.
        let phi_o = random.uniform(-PI, PI) as f32;
        let light = LightInFrame::from_angles(theta_j, phi_o - delta, lambda);
        let view = DirectionInFrame::from_angles(theta_o, phi_o);
        Query {
            light,
            view,
            azimuths: Azimuths::between(&light.direction, &view),
            sigma_f: (lambda * lambda + sigma_bar_2).sqrt(),
        }
    }

    fn look_up(&self, tables: &MultipleTables) -> [[f32; 3]; 3] {
        let at = &self.light.direction;
        let theta_o = self.view.theta;
        let (global, local) = tables.at(at.theta, theta_o, &self.azimuths, self.sigma_f);
        let lambda = self.light.lambda;
        let direct = tables.direct_at(
            at.theta,
            at.cos_theta,
            theta_o,
            self.azimuths.cos_delta,
            lambda,
        );
        [global, local, direct]
    }
}

fn widths(r: f64, tt: f64, trt: f64) -> PerLobe<f64> {
    PerLobe { r, tt, trt }.map(|std_dev| std_dev * DEGREE * SQRT_2)
}

/// Hair as it grows: Marschner's ranges and somewhat beyond, any absorption.
fn any_hair(ix: u64) -> HairParams {
    let mut random = SplitMix64::of_item(3, ix);
    let sigma = random.log_uniform(0.01, 6.0);
    let alpha = random.uniform(2.0, 10.0) * DEGREE;
    let beta = random.uniform(4.0, 12.0);
    HairParams {
        eta: random.uniform(1.4, 1.7),
        sigma_a: [1.0, random.uniform(1.0, 3.0), random.uniform(2.0, 6.0)]
            .map(|factor| factor * sigma),
        shift: PerLobe {
            r: -alpha,
            tt: 0.5 * alpha,
            trt: 1.5 * alpha,
        },
        width: widths(beta, 0.5 * beta, 2.0 * beta),
        caustic_width: random.log_uniform(0.06, 0.3),
        ..HairParams::default()
    }
}

/// Relative RMSE of each term over `hairs`, and of the worst of them, in percent.
fn errors_over(
    bundled: &Bundled,
    hairs: impl Iterator<Item = HairParams>,
    modes: &[Lobe],
) -> [[f64; 3]; 2] {
    let n_draws = 2000;
    let mut sum = [[0.0; 2]; 3];
    let mut worst = [0.0f64; 3];
    for (ix, hair) in hairs.enumerate() {
        let material = bundled.material(&hair, modes);
        let tables = bundled.fill(&material, BOTH);
        assert_eq!(tables.terms(), BOTH);
        let squares = bundled.squares(&material, &tables, ix as u64 * n_draws, n_draws);
        for term in 0..3 {
            worst[term] = worst[term].max(percent(squares)[term]);
            for k in 0..2 {
                sum[term][k] += squares[term][k];
            }
        }
    }
    [percent(sum), worst]
}

#[test]
fn any_hair_is_within_one_percent() {
    let bundled = Bundled::new();
    let [errors, worst] = errors_over(&bundled, (0..50).map(any_hair), &Lobe::ALL);
    for ((name, error), worst) in TERMS.iter().zip(errors).zip(worst) {
        println!("{name}: {error:.3} %, of the worst hair {worst:.3} %");
        assert!(error < 0.6, "{name}: {error}");
        assert!(worst < 1.2, "{name}: {worst}");
    }
}

#[test]
fn single_fibres_are_within_their_bounds() {
    let bundled = Bundled::new();
    let brown = HairParams::default();
    let sigma_a = |sigma_a| HairParams { sigma_a, ..brown };
    let width = |width| HairParams { width, ..brown };
    let shifts = PerLobe {
        r: -15.0,
        tt: 7.5,
        trt: 22.5,
    };
    let shifted = HairParams {
        shift: shifts.map(|shift| shift * DEGREE),
        ..brown
    };
    let caustic = HairParams {
        caustic_width: 3.0 * DEGREE * SQRT_2,
        ..brown
    };
    let all = &Lobe::ALL[..];
    // Narrower than hair is found.
    let narrowest = width(widths(2.0, 1.0, 4.0));
    let cases = [
        ("brown, the default", brown, all),
        ("sample", sigma_a([0.09, 0.34, 0.85]), all),
        ("blond", sigma_a([0.1257, 0.2091, 0.411]), all),
        ("white", sigma_a([0.0084, 0.0139, 0.0274]), all),
        ("black", sigma_a([3.352, 5.576, 10.96]), all),
        ("half the widths", width(widths(3.5, 1.75, 7.0)), all),
        ("widths 2, 1, 4", narrowest, all),
        ("widths 16, 20, 30", width(widths(16.0, 20.0, 30.0)), all),
        ("shifts -15, 7.5, 22.5", shifted, all),
        ("caustic 3", caustic, all),
        ("R alone", brown, &[Lobe::R]),
        ("TT alone", brown, &[Lobe::Tt]),
        ("TRT alone", brown, &[Lobe::Trt]),
    ];
    for (name, hair, modes) in cases {
        let material = bundled.material(&hair, modes);
        let tables = bundled.fill(&material, BOTH);
        let errors = percent(bundled.squares(&material, &tables, 0, 10_000));
        println!("{name:22} {errors:.3?} %, {} bytes", tables.bytes());
        assert!(
            errors.iter().all(|&error| error < 1.0),
            "{name}: {errors:?}"
        );
    }
}

#[test]
fn hair_of_model_energy_is_within_its_bounds() {
    let bundled = Bundled::new();
    // Direct local scattering of black hair, next to nothing, has 1.35 %.
    for (sigma_a, limit) in [
        ([0.26, 0.42, 0.83], 1.0),
        ([0.1257, 0.2091, 0.411], 1.0),
        ([0.0084, 0.0139, 0.0274], 1.0),
        ([0.0; 3], 1.0),
        ([3.352, 5.576, 10.96], 1.5),
    ] {
        let hair = HairParams {
            sigma_a,
            model: Model::Energy,
            ..HairParams::default()
        };
        let material = bundled.material(&hair, &Lobe::ALL);
        let tables = bundled.fill(&material, BOTH);
        assert_eq!(tables.terms(), BOTH);
        let errors = percent(bundled.squares(&material, &tables, 0, 10_000));
        println!("energy {sigma_a:?} {errors:.3?} %");
        assert!(
            errors.iter().all(|&error| error < limit),
            "{sigma_a:?}: {errors:?}"
        );
    }
}

#[test]
fn tables_of_other_hair_are_told_apart() {
    let bundled = Bundled::new();
    let material = bundled.material(&HairParams::default(), &Lobe::ALL);
    let other = HairParams {
        sigma_a: [0.2, 0.42, 0.83],
        ..HairParams::default()
    };
    let tables = bundled.fill(&bundled.material(&other, &Lobe::ALL), BOTH);
    let errors = percent(bundled.squares(&material, &tables, 0, 2000));
    assert!(errors.iter().all(|&error| error > 2.0), "{errors:?}");
}

/// The same hair, elliptic.
fn any_elliptic_hair(ix: u64) -> HairParams {
    let mut random = SplitMix64::of_item(8, ix);
    HairParams {
        eccentricity: random.log_uniform(0.8, 1.25),
        ..any_hair(ix)
    }
}

#[test]
fn elliptic_fibres_are_within_their_bounds() {
    let bundled = Bundled::new();
    // Of TRT, of which there is little, the closed form errs by 2.6 % itself.
    for (modes, limits) in [
        (&Lobe::ALL[..], [0.4, 0.6]),
        (&[Lobe::R, Lobe::Tt], [0.4, 0.6]),
        (&[Lobe::Trt], [4.0, 20.0]),
    ] {
        let hairs = (0..30).map(any_elliptic_hair);
        let [[global, ..], worst] = errors_over(&bundled, hairs, modes);
        println!(
            "{modes:?}: {global:.3} %, of the worst hair {:.3} %",
            worst[0]
        );
        assert!(
            global < limits[0] && worst[0] < limits[1],
            "{global} {worst:?}"
        );
        // Local scattering is that of a round fibre.
        assert!(worst[1] < 1.0 && worst[2] < 1.2, "{worst:?}");
    }
}

#[test]
fn terms_that_are_off_cost_nothing() {
    let bundled = Bundled::new();
    let material = bundled.material(&HairParams::default(), &Lobe::ALL);
    let all = bundled.fill(&material, BOTH);
    let none = bundled.fill(&material, 0);
    assert_eq!((none.terms(), none.bytes()), (0, 0));
    let query = Query::draw(1, &material);
    assert_eq!(query.look_up(&none), [[0.0; 3]; 3]);
    let global = bundled.fill(&material, TERM_GLOBAL);
    assert_eq!(global.terms(), TERM_GLOBAL);
    assert!(global.bytes() < all.bytes());
    assert_eq!(query.look_up(&global)[1..], [[0.0; 3]; 2]);
    assert_eq!(query.look_up(&global)[0], query.look_up(&all)[0]);
    let local = bundled.fill(&material, TERM_LOCAL);
    assert_eq!(query.look_up(&local)[0], [0.0; 3]);
    assert_eq!(query.look_up(&local)[2], query.look_up(&all)[2]);
}

#[test]
fn jobs_run_in_any_order_and_on_any_thread() {
    let bundled = Bundled::new();
    for eccentricity in [1.0, 0.8] {
        let hair = HairParams {
            eccentricity,
            ..HairParams::default()
        };
        let material = bundled.material(&hair, &Lobe::ALL);
        let shading = material.optics().shading(bundled.tables.view());
        let tables = MultipleTables::new(&shading, material.averages(), BOTH, |jobs| {
            std::thread::scope(|scope| {
                for job in jobs.into_iter().rev() {
                    scope.spawn(|| job.run());
                }
            });
        });
        assert!(tables == bundled.fill(&material, BOTH));
    }
}

#[test]
fn any_direction_and_width_has_a_value() {
    let bundled = Bundled::new();
    for eccentricity in [1.0, 0.8, 0.5, 2.0] {
        let hair = HairParams {
            eccentricity,
            ..HairParams::default()
        };
        let tables = bundled.fill(&bundled.material(&hair, &Lobe::ALL), BOTH);
        check_values(&tables);
    }
}

fn check_values(tables: &MultipleTables) {
    let pole = std::f32::consts::FRAC_PI_2;
    let thetas = [-pole, -1.5, 0.0, 0.4, pole];
    for theta_j in thetas {
        for theta_o in thetas {
            for cos_delta in [-1.0, -0.999, 0.0, 0.3, 1.0] {
                for width in [0.001, 0.1, 1.0, 10.0, 1e3] {
                    let sin_delta = (1.0f32 - cos_delta * cos_delta).sqrt();
                    let azimuths = Azimuths {
                        cos_delta,
                        sin_delta,
                        cos_view: 0.6,
                        sin_view: 0.8,
                    };
                    let (global, local) = tables.at(theta_j, theta_o, &azimuths, width);
                    let cosine = theta_j.cos().max(0.0);
                    let direct = tables.direct_at(theta_j, cosine, theta_o, cos_delta, width);
                    for value in [global, local, direct].as_flattened() {
                        assert!((0.0..100.0).contains(value), "{theta_j} {theta_o} {width}");
                    }
                }
            }
        }
    }
}
