//! The rows of the tables, from the closed form.
//!
//! Rows of model `energy` are found one by one, those of model `marschner` eight at a time (`fill_wide.rs`), which
//! tests hold to those here.
//!
//! Local scattering is evaluated as it is. Of global scattering, nodes and weights of the outer integral do
//! not depend on the lag, and N_t^G at a node is read from [`Profiles`]: a row costs less than one
//! evaluation of [`crate::closed_form::global_scattering()`].

use core::f32::consts::{FRAC_1_PI, FRAC_PI_2};

use crate::closed_form::{
    AverageTexel, DirectionInFrame, Fibre, LN_CULL, LightInFrame, SQRT_PI, direct_local_scattering,
    forward_share, half_circle, inclination, local_rule, local_scattering, mean_cosine,
    node_constants, node_count, node_extent, node_place, outer_rule,
};

use crate::wide::Level;

use super::axes::Axes;
use super::azimuth::{Profiles, Row};

/// Cosine of the lag at which the share of direct light within a half circle is that of the closed form.
pub(super) const MATCHED_COSINE: f32 = 0.5;

/// Above this share it says too little of the sharpness.
pub(super) const ALL: f32 = 0.99;

/// Halvings of the range of a cosine.
pub(super) const N_BISECTIONS: usize = 12;

/// A row of direct local scattering: red, green, blue, and a cosine.
pub(super) type DirectRow = [f32; 4];

/// What the rows are made of.
pub(super) struct Source<'a> {
    pub fibre: &'a Fibre,
    /// For global scattering; none where it is switched off.
    pub profiles: Option<&'a Profiles>,
    /// For local scattering; none where it is switched off.
    pub averages: Option<&'a [AverageTexel]>,
}

fn direction(theta: f32, [cos_phi, sin_phi]: [f32; 2]) -> DirectionInFrame {
    DirectionInFrame {
        theta,
        cos_theta: theta.cos().max(0.0),
        cos_phi,
        sin_phi,
    }
}

impl Source<'_> {
    /// Fills the layer of this width of the table of global and local scattering; second halves of rows are
    /// those of an elliptic fibre, else none.
    pub fn fill_layer(&self, axes: &Axes, width: f32, [rows, further]: [&mut [Row]; 2]) {
        match self.fibre.is_energy() {
            true => each_row(axes, width, rows, |j, o| self.row(width, j, o)[0]),
            false => self.rows_of_layer(Level::new(), axes, width, [rows, further]),
        }
    }

    /// Fills the layer of this width of the table of direct local scattering.
    pub fn fill_direct_layer(&self, axes: &Axes, width: f32, rows: &mut [DirectRow]) {
        match self.fibre.is_energy() {
            true => each_row(axes, width, rows, |j, o| self.direct_row(width, j, o)),
            false => self.direct_rows_of_layer(Level::new(), axes, width, rows),
        }
    }

    /// Global scattering in the first three of each four, local scattering over the overlap of the half
    /// circles, pi - Delta, in the last of the first three.
    /// Then the second half, of zeros but for an elliptic fibre.
    pub fn row(&self, sigma_f: f32, theta_j: f32, theta_o: f32) -> [Row; 2] {
        let mut halves = [Row::default(); 2];
        let light = direction(theta_j, [1.0, 0.0]);
        if let Some(profiles) = self.profiles {
            let halves = &mut halves[..profiles.n_halves()];
            self.add_global(profiles, &light, theta_o, sigma_f, halves);
        }
        let [row, _] = &mut halves;
        if let Some(averages) = self.averages {
            let view = direction(theta_o, [1.0, 0.0]);
            let value = local_scattering(&light, &view, sigma_f, averages);
            for (channel, value) in value.into_iter().enumerate() {
                row[4 * channel + 3] = FRAC_1_PI * value;
            }
        }
        halves
    }

    /// [`crate::closed_form::global_scattering()`] of an N_t^G by its factors.
    fn add_global(
        &self,
        profiles: &Profiles,
        light: &DirectionInFrame,
        theta_o: f32,
        sigma_f: f32,
        rows: &mut [Row],
    ) {
        let fibre = self.fibre;
        // The pi of both Gaussians.
        let scale = FRAC_1_PI / (sigma_f * mean_cosine(light.theta, light.cos_theta, sigma_f));
        for mode in 0..3 {
            if fibre.modes & (1 << mode) == 0 {
                continue;
            }
            if fibre.is_energy() {
                let share = forward_share(mode, light.theta, theta_o, sigma_f, fibre);
                let cos_o = inclination(theta_o).cos_theta_d;
                // Of both Gaussians there is but the light's.
                profiles.add(mode as usize, cos_o, scale * SQRT_PI * share, rows);
                continue;
            }
            let (alpha, beta) = (fibre.alpha[mode as usize], fibre.beta[mode as usize]);
            let rule = outer_rule(light.theta, sigma_f, theta_o, alpha, beta);
            if rule.ln_bound < LN_CULL {
                continue;
            }
            let extent = node_extent(&rule);
            let count = node_count(extent, fibre.node_count(mode));
            for ix in 0..count {
                let place = node_place(&rule, node_constants(extent, count, ix));
                let lobe = (rule.to_lobe + place.step) * rule.inverse_width;
                let light_2 = (rule.to_light + place.step) / sigma_f;
                let fall = (-lobe * lobe - light_2 * light_2).exp();
                let weight = place.weight * rule.inverse_width * fall;
                let cos_i = place.theta_i.cos().max(0.0);
                let cos_d = inclination(0.5 * (theta_o - place.theta_i)).cos_theta_d;
                let ratio = (cos_i / cos_d).min(2.0);
                profiles.add(mode as usize, cos_d, scale * weight * (ratio * ratio), rows);
            }
        }
    }

    /// Direct local scattering as if light came from everywhere in azimuth, and the cosine of the inclination
    /// that gives the light the sharpness in azimuth that all nodes have together.
    pub fn direct_row(&self, lambda: f32, theta_j: f32, theta_o: f32) -> DirectRow {
        let Some(averages) = self.averages else {
            return [0.0; 4];
        };
        let light = LightInFrame {
            direction: direction(theta_j, [1.0, 0.0]),
            lambda,
        };
        let at = |azimuth| direct_local_scattering(&light, &direction(theta_o, azimuth), averages);
        // Half of a circle of light is in half a circle, whatever its sharpness.
        let whole = at([0.0, 1.0]).map(|value| 2.0 * value);
        let found = at([
            MATCHED_COSINE,
            (1.0 - MATCHED_COSINE * MATCHED_COSINE).sqrt(),
        ]);
        let sum = |value: [f32; 3]| value[0] + value[1] + value[2];
        let share = sum(found) / sum(whole).max(1e-30);
        let cosine = if share < ALL {
            let kappa = 2.0 * light.direction.cos_theta / (lambda * lambda);
            cosine_of_share(kappa, share)
        } else {
            // All light is on one side: any sharpness of this order does.
            let mean = local_rule(theta_j, lambda, theta_o, averages).rule.mean;
            mean.clamp(-FRAC_PI_2, FRAC_PI_2).cos().max(0.0)
        };
        [whole[0], whole[1], whole[2], cosine]
    }
}

/// Fills a layer by a function of theta_j and theta_o.
pub(super) fn each_row<T>(axes: &Axes, width: f32, rows: &mut [T], row: impl Fn(f32, f32) -> T) {
    for (ix, place) in rows.iter_mut().enumerate() {
        let [theta_j, theta_o] = axes.inclinations_of(width, ix);
        *place = row(theta_j, theta_o);
    }
}

/// The factor 0..=1 of `kappa` with which this share of a circular Gaussian lies within the half circle
/// around a direction that is [`MATCHED_COSINE`] off its centre, to 2e-4.
fn cosine_of_share(kappa: f32, share: f32) -> f32 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..N_BISECTIONS {
        let middle = 0.5 * (low + high);
        if half_circle(kappa * middle, MATCHED_COSINE) < share {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
