//! Global and local multiple scattering in closed form against quadratures written here.

use std::f64::consts::{FRAC_PI_2, PI};
use strandlight_formats::BakedFile;

use strandlight_data::DEFAULT_TABLES;
use strandlight_scattering::closed_form::{
    DirectionInFrame, LightInFrame, direct_local_scattering, global_scattering_mode, half_circle,
    local_scattering, mean_cosine,
};
use strandlight_scattering::dual_scattering::{Average, AverageTable, Backscatter};
use strandlight_scattering::exact::{self, FibreSection, Forward, Light, View};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::quadrature::GaussLegendre;
use strandlight_scattering::{HairParams, Lobe, Model, PerLobe};
use strandlight_scene::material::HairMaterial;
use strandlight_scene::tables::ShadingTables;
use strandlight_tests::optics::multiple_textures;
use strandlight_tests::random::SplitMix64;

/// A Gaussian of unit mass on the line.
fn gaussian(x: f64, width: f64) -> f64 {
    (-(x / width) * (x / width)).exp() / (PI.sqrt() * width)
}

/// Int f(theta) dtheta over +-pi/2 where the Gaussians of these centres and widths live.
fn over_inclination(gaussians: [[f64; 2]; 2], mut f: impl FnMut(f64) -> [f64; 3]) -> [f64; 3] {
    let ends = gaussians.map(|[centre, width]| [centre - 7.0 * width, centre + 7.0 * width]);
    let low = ends[0][0].max(ends[1][0]).max(-FRAC_PI_2);
    let high = ends[0][1].min(ends[1][1]).min(FRAC_PI_2);
    let mut sum = [0.0; 3];
    if low >= high {
        return sum;
    }
    let width = gaussians[0][1].min(gaussians[1][1]).min(0.15);
    let n = ((high - low) / width).ceil().clamp(2.0, 200.0);
    let rule = GaussLegendre::new(8);
    for ix in 0..n as u32 {
        let at = |ix: f64| low + (high - low) * ix / n;
        for (theta, weight) in rule.on(at(f64::from(ix)), at(f64::from(ix) + 1.0)) {
            let value = f(theta);
            for c in 0..3 {
                sum[c] += weight * value[c];
            }
        }
    }
    sum
}

/// Share of a circular Gaussian of sharpness `kappa` in the half circle at distance `delta`.
fn exact_half_circle(kappa: f64, delta: f64) -> f64 {
    // The whole circle, each half of it finely around the peak at 0.
    let rule = GaussLegendre::new(60);
    let reach = (9.0 / kappa.sqrt()).min(PI);
    let mass = |a: f64, b: f64| -> f64 {
        let (a, b) = (a.clamp(-reach, reach), b.clamp(-reach, reach));
        let density = |x: f64| (-2.0 * kappa * (0.5 * x).sin().powi(2)).exp();
        rule.on(a, b).map(|(x, w)| w * density(x)).sum()
    };
    let [a, b] = [delta - FRAC_PI_2, delta + FRAC_PI_2];
    let inside = mass(a, b) + mass(a + 2.0 * PI, b + 2.0 * PI) + mass(a - 2.0 * PI, b - 2.0 * PI);
    inside / mass(-PI, PI)
}

/// [`exact_half_circle`] of TRT's blur over the lag, 0..=pi.
fn blurred_halves(caustic_width: f64) -> Vec<f64> {
    let kappa = 2.0 / (caustic_width * caustic_width);
    let at = |ix| PI * f64::from(ix) / f64::from(N_BLUR);
    (0..=N_BLUR)
        .map(|ix| exact_half_circle(kappa, at(ix)))
        .collect()
}

const N_BLUR: u32 = 300;

/// N_t^G by offsets h: `1/(2 pi) Int A_t(h) [is within the half circle, after the blur] dh`.
fn exact_half_circle_of_mode(
    lobe: Lobe,
    dphi: f64,
    theta_d: f64,
    hair: &HairParams,
    blurred: &[f64],
) -> [f64; 3] {
    let section = FibreSection::new(hair.eta, hair.sigma_a, theta_d, Fresnel::Dielectric);
    let n = 300;
    let step = PI / f64::from(n);
    let mut sum = [0.0; 3];
    for ix in 0..n {
        let gamma = -FRAC_PI_2 + step * (f64::from(ix) + 0.5);
        let delta = (dphi - section.exit_azimuth(lobe, gamma)).rem_euclid(2.0 * PI);
        let delta = delta.min(2.0 * PI - delta);
        let inside = if lobe == Lobe::Trt {
            let x = delta / PI * f64::from(N_BLUR);
            let ix = (x as usize).min(blurred.len() - 2);
            blurred[ix] + (blurred[ix + 1] - blurred[ix]) * (x - ix as f64)
        } else {
            // The step's share of the edge's cell.
            let cell = section.exit_azimuth_slope(lobe, gamma).abs() * step;
            (0.5 + (FRAC_PI_2 - delta) / cell.max(1e-9)).clamp(0.0, 1.0)
        };
        let (sin, cos) = gamma.sin_cos();
        let kept = section.attenuation(lobe, sin, cos);
        for c in 0..3 {
            sum[c] += 0.5 * cos * inside * kept[c] * step / PI;
        }
    }
    sum
}

struct Configuration {
    hair: HairParams,
    theta_j: f64,
    theta_o: f64,
    dphi: f64,
    sigma_f: f64,
}

/// Hair from blond to black, lights and views evenly over the sphere.
fn configuration(random: &mut SplitMix64) -> Configuration {
    let degree = PI / 180.0;
    let alpha = -random.uniform(2.0, 8.0) * degree;
    let beta = random.uniform(4.0, 12.0) * degree * std::f64::consts::SQRT_2;
    let sigma_a = random.log_uniform(0.02, 1.0);
    Configuration {
        hair: HairParams {
            eta: 1.55,
            sigma_a: [sigma_a, 1.5 * sigma_a, 2.5 * sigma_a],
            shift: PerLobe {
                r: alpha,
                tt: -0.5 * alpha,
                trt: -1.5 * alpha,
            },
            width: PerLobe {
                r: beta,
                tt: 0.5 * beta,
                trt: 2.0 * beta,
            },
            caustic_width: random.uniform(0.08, 0.3),
            ..HairParams::default()
        },
        theta_j: random.uniform(-0.99, 0.99).asin(),
        theta_o: random.uniform(-0.99, 0.99).asin(),
        dphi: random.uniform(-PI, PI),
        sigma_f: random.log_uniform(0.05, 2.0),
    }
}

/// Relative RMSE: root of summed squares of error over value.
#[derive(Default)]
struct Rmse([f64; 2]);

impl Rmse {
    fn add(&mut self, found: [f32; 3], exact: [f64; 3]) {
        for (found, exact) in found.iter().zip(exact) {
            assert!(found.is_finite() && *found >= 0.0, "{found}");
            self.0[0] += (f64::from(*found) - exact).powi(2);
            self.0[1] += exact * exact;
        }
    }

    fn get(&self) -> f64 {
        (self.0[0] / self.0[1]).sqrt()
    }
}

fn directions(at: &Configuration) -> [DirectionInFrame; 2] {
    [
        DirectionInFrame::from_angles(at.theta_j as f32, 0.0),
        DirectionInFrame::from_angles(at.theta_o as f32, at.dphi as f32),
    ]
}

/// Z_j.
fn exact_mean_cosine(theta_j: f64, sigma_f: f64) -> f64 {
    let at = [theta_j, sigma_f];
    over_inclination([at, at], |theta| {
        [gaussian(theta - theta_j, sigma_f) * theta.cos(); 3]
    })[0]
}

#[test]
fn half_circles_are_those_of_quadrature() {
    let mut worst = 0.0f64;
    for step in -12..=24 {
        let kappa = 10f64.powf(f64::from(step) * 0.25);
        for ix in 0..=60 {
            let delta = PI * f64::from(ix) / 60.0;
            let found = f64::from(half_circle(kappa as f32, delta.cos() as f32));
            let error = (found - exact_half_circle(kappa, delta)).abs();
            worst = worst.max(error);
        }
    }
    println!("half circle: {worst:.2e}");
    assert!(worst < 1.3e-3, "{worst}");
}

#[test]
fn mean_cosines_are_those_of_quadrature() {
    let mut worst = 0.0f64;
    for theta in [0.0, 0.3, -0.8, 1.2, 1.5, -1.56, FRAC_PI_2] {
        for sigma in [0.005, 0.02, 0.1, 0.3, 0.7, 1.3, 2.0, 4.0, 10.0] {
            let (t, s) = (theta as f32, sigma as f32);
            let found = f64::from(mean_cosine(t, t.cos().max(0.0), s));
            worst = worst.max((found / exact_mean_cosine(theta, sigma) - 1.0).abs());
        }
    }
    println!("mean cosine: {worst:.2e}");
    assert!(worst < 2e-4, "{worst}");
}

#[test]
fn global_scattering_is_that_of_quadrature() {
    let mut random = SplitMix64(31);
    let file = strandlight_formats::TableFile::from_bytes(DEFAULT_TABLES).unwrap();
    let tables = ShadingTables::from_file(&file).unwrap();
    let mut errors: [Rmse; 4] = Default::default();
    for _ in 0..40 {
        let at = configuration(&mut random);
        let textures: HairMaterial = multiple_textures(&at.hair);
        let shading = textures.optics().shading(tables.view());
        let [light, view] = directions(&at);
        let z = exact_mean_cosine(at.theta_j, at.sigma_f);
        let blurred = blurred_halves(at.hair.caustic_width);
        let mut sums = ([0.0f32; 3], [0.0; 3]);
        for lobe in Lobe::ALL {
            let mode = lobe.p();
            let centre = 2.0 * at.hair.shift.get(lobe) - at.theta_o;
            let width = 2.0 * at.hair.width.get(lobe);
            let gaussians = [[at.theta_j, at.sigma_f], [centre, width]];
            let exact = over_inclination(gaussians, |theta_i| {
                let theta_d = 0.5 * (at.theta_o - theta_i);
                let n = exact_half_circle_of_mode(lobe, at.dphi, theta_d, &at.hair, &blurred);
                let ratio = theta_i.cos() / theta_d.cos();
                let weight = gaussian(theta_i - at.theta_j, at.sigma_f)
                    * gaussian(theta_i - centre, width)
                    * ratio
                    * ratio
                    / z;
                n.map(|n| weight * n)
            });
            let found = global_scattering_mode(mode, &light, &view, at.sigma_f as f32, &shading);
            errors[mode as usize].add(found, exact);
            for c in 0..3 {
                sums.0[c] += found[c];
                sums.1[c] += exact[c];
            }
        }
        errors[3].add(sums.0, sums.1);
    }
    let errors = errors.map(|error| error.get());
    println!("global, relative RMSE of R, TT, TRT, all: {errors:.5?}");
    assert!(errors.iter().all(|&error| error < 0.003), "{errors:?}");
}

/// S_back at theta_i without its factor in azimuth, times the cosine and dtheta_i.
fn back(theta_i: f64, theta_o: f64, table: &AverageTable) -> [f64; 3] {
    let theta = (0.5 * (theta_i - theta_o)) as f32;
    let [a, shift, width] =
        [Average::Ab, Average::DeltaB, Average::SigmaB].map(|it| table.get(it, theta));
    let ratio = theta_i.cos() / (0.5 * (theta_o - theta_i)).cos();
    std::array::from_fn(|c| {
        let centre = f64::from(shift[c]) - theta_o;
        f64::from(a[c]) * gaussian(theta_i - centre, f64::from(width[c])) * ratio * ratio
    })
}

#[test]
fn local_scattering_is_that_of_quadrature() {
    let mut random = SplitMix64(32);
    let mut errors: [Rmse; 2] = Default::default();
    for _ in 0..120 {
        let at = configuration(&mut random);
        let table = AverageTable::new(&at.hair, Fresnel::Dielectric);
        let texels = strandlight_scattering::closed_form::pack_averages(&table);
        let [light, view] = directions(&at);
        let z = exact_mean_cosine(at.theta_j, at.sigma_f);
        let bump = [at.theta_j, at.sigma_f];
        let overlap = (PI - at.dphi.abs()) / (PI * PI);
        let exact = over_inclination([bump, bump], |theta_i| {
            let weight = overlap * gaussian(theta_i - at.theta_j, at.sigma_f) / z;
            back(theta_i, at.theta_o, &table).map(|value| weight * value)
        });
        let found = local_scattering(&light, &view, at.sigma_f as f32, &texels[..]);
        errors[0].add(found, exact);
        // The light itself: a circular Gaussian in both angles.
        let kappa = 2.0 / (at.sigma_f * at.sigma_f);
        let omega = 2.0 * PI / kappa * (1.0 - (-2.0 * kappa).exp());
        let wide = [at.theta_j, 2.0 * at.sigma_f];
        let exact = over_inclination([wide, wide], |theta_i| {
            let kappa_p = kappa * theta_i.cos() * at.theta_j.cos();
            let whole = 2.0 * PI * strandlight_scattering::special::bessel_i0_scaled(kappa_p);
            let inside = whole * exact_half_circle(kappa_p, at.dphi.abs()) / PI;
            let light = (kappa * ((theta_i - at.theta_j).cos() - 1.0)).exp();
            back(theta_i, at.theta_o, &table).map(|value| inside * light / omega * value)
        });
        let found = direct_local_scattering(
            &LightInFrame {
                direction: light,
                lambda: at.sigma_f as f32,
            },
            &view,
            &texels[..],
        );
        errors[1].add(found, exact);
    }
    let errors = errors.map(|error| error.get());
    println!("local, direct local, relative RMSE: {errors:.5?}");
    assert!(errors.iter().all(|&error| error < 0.006), "{errors:?}");
}

/// Model `energy`, of white hair too, against the exact model; averages are those of the renderer.
#[test]
fn model_energy_is_that_of_the_exact_model() {
    let mut random = SplitMix64(33);
    let file = strandlight_formats::TableFile::from_bytes(DEFAULT_TABLES).unwrap();
    let tables = ShadingTables::from_file(&file).unwrap();
    let mut errors: [Rmse; 6] = Default::default();
    for ix in 0..120 {
        let mut at = configuration(&mut random);
        at.hair.model = Model::Energy;
        if ix % 4 == 0 {
            at.hair.sigma_a = [0.0; 3];
        }
        let textures: HairMaterial = multiple_textures(&at.hair);
        let shading = textures.optics().shading(tables.view());
        let [light, view] = directions(&at);
        let forward = Forward {
            theta: at.theta_j,
            phi: 0.0,
            sigma_f: at.sigma_f,
        };
        let eye = View {
            theta: at.theta_o,
            phi: at.dphi,
        };
        let mut sums = ([0.0f32; 3], [0.0; 3]);
        for lobe in Lobe::ALL {
            let mode = lobe.p();
            let exact = exact::global(lobe, forward, eye, &at.hair, Fresnel::Dielectric);
            let found = global_scattering_mode(mode, &light, &view, at.sigma_f as f32, &shading);
            errors[mode as usize].add(found, exact);
            for c in 0..3 {
                sums.0[c] += found[c];
                sums.1[c] += exact[c];
            }
        }
        errors[3].add(sums.0, sums.1);
        let table = AverageTable::new(&at.hair, Fresnel::Dielectric);
        let texels = strandlight_scattering::closed_form::pack_averages(&table);
        let back = |theta: f64| {
            let of = |average| table.get(average, theta as f32).map(f64::from);
            Backscatter {
                attenuation: of(Average::Ab),
                shift: of(Average::DeltaB),
                width_2: of(Average::SigmaB).map(|width| width * width),
                model: Model::Energy,
            }
        };
        let exact = exact::local(forward, eye, back);
        let found = local_scattering(&light, &view, at.sigma_f as f32, &texels[..]);
        errors[4].add(found, exact);
        let lambda = at.sigma_f.min(1.2);
        let source = Light {
            theta: at.theta_j,
            phi: 0.0,
            lambda,
        };
        let exact = exact::direct_local(source, eye, back);
        let source = LightInFrame {
            direction: light,
            lambda: lambda as f32,
        };
        errors[5].add(direct_local_scattering(&source, &view, &texels[..]), exact);
    }
    let errors = errors.map(|error| error.get());
    println!("energy: global R, TT, TRT, all, local, direct local: {errors:.5?}");
    assert!(errors[..4].iter().all(|&error| error < 0.006), "{errors:?}");
    assert!(errors[4..].iter().all(|&error| error < 0.01), "{errors:?}");
}
