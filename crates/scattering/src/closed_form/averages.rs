//! The averages of dual scattering over the incident inclination, as shading samples them. Twin:
//! `shaders/lib/averages.wgsl`.

use core::f32::consts::{FRAC_1_PI, FRAC_PI_2};

use crate::Model;
use crate::dual_scattering::{Average, AverageTable, N_INCLINATIONS};

/// What many events send back and one sends on, at one inclination; linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Averages {
    /// a_f: share of the light that goes on at one event, 0..=1.
    pub a_f: [f32; 3],
    /// beta_f^2: squared width of such an event, Xu's, full angle.
    pub beta_f_2: [f32; 3],
    /// A_b: share that many events send back, 0..=1.
    pub attenuation_b: [f32; 3],
    /// Delta_b: mean shift of that light, radians, full angle.
    pub shift_b: [f32; 3],
    /// sigma_b^2: its squared width, Xu's, full angle; > 0.
    pub width_b_2: [f32; 3],
    /// 1 where that light is a lobe of model `energy`, 0 where it is a Gaussian.
    pub energy: f32,
}

/// What local scattering needs of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalAverages {
    /// As [`Averages::attenuation_b`].
    pub attenuation_b: [f32; 3],
    /// As [`Averages::shift_b`].
    pub shift_b: [f32; 3],
    /// As [`Averages::width_b_2`].
    pub width_b_2: [f32; 3],
    /// As [`Averages::energy`].
    pub energy: f32,
}

/// Where local scattering finds averages: those of one fibre, or of a painted point.
pub trait SampleAverages {
    /// The averages at incident inclination `theta`, radians; beyond +-pi/2 those of the ends.
    fn averages_at(&self, theta: f32) -> LocalAverages;
}

impl SampleAverages for [AverageTexel] {
    fn averages_at(&self, theta: f32) -> LocalAverages {
        let at = sample_averages(self, theta);
        LocalAverages {
            attenuation_b: at.attenuation_b,
            shift_b: at.shift_b,
            width_b_2: at.width_b_2,
            energy: at.energy,
        }
    }
}

/// One inclination: four texels of the texture, (A_b, a_f of red), (Delta_b, a_f of green),
/// (sigma_b^2, a_f of blue), (beta_f^2, 1 of model `energy`).
pub type AverageTexel = [f32; 16];

/// Inclinations less one, the index of the last.
pub(crate) const LAST_INCLINATION: f32 = 127.0;

const _: () = assert!(N_INCLINATIONS == 128, "the shader has it as a number");

/// The texels of a table, [`N_INCLINATIONS`] of them, evenly over -pi/2..=pi/2.
pub fn pack_averages(table: &AverageTable) -> Vec<AverageTexel> {
    let energy = f32::from(u8::from(table.model == Model::Energy));
    let pack = |row: &[[f32; 3]; Average::ALL.len()]| {
        let of = |average: Average| row[average as usize];
        let a_f = of(Average::AF);
        let [a, d] = [of(Average::Ab), of(Average::DeltaB)];
        let s = of(Average::SigmaB).map(|width| width * width);
        let b = of(Average::BetaF);
        [
            a[0], a[1], a[2], a_f[0], d[0], d[1], d[2], a_f[1], s[0], s[1], s[2], a_f[2], b[0],
            b[1], b[2], energy,
        ]
    };
    table.rows.iter().map(pack).collect()
}

/// The averages at incident inclination `theta`, between two of the [`N_INCLINATIONS`] `texels`;
/// beyond the ends the ends.
pub fn sample_averages(texels: &[AverageTexel], theta: f32) -> Averages {
    let at = ((theta + FRAC_PI_2) * (FRAC_1_PI * LAST_INCLINATION)).clamp(0.0, LAST_INCLINATION);
    let first = at.floor().min(LAST_INCLINATION - 1.0);
    let fraction = at - first;
    let (low, high) = (&texels[first as usize], &texels[first as usize + 1]);
    let mut x = [0.0f32; 16];
    for (i, x) in x.iter_mut().enumerate() {
        *x = low[i] + (high[i] - low[i]) * fraction;
    }
    Averages {
        a_f: [x[3], x[7], x[11]],
        beta_f_2: [x[12], x[13], x[14]],
        attenuation_b: [x[0], x[1], x[2]],
        shift_b: [x[4], x[5], x[6]],
        width_b_2: [x[8], x[9], x[10]],
        energy: x[15],
    }
}
