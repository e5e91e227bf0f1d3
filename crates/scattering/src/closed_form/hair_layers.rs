//! What the hair behind a point sends back: layers of fibres, as many as there are. Twin:
//! `shaders/lib/hair_layers.wgsl`.
//!
//! A stack without end, each layer of which sends a_f on and a_b back, reflects R, where
//! a_b R^2 - (1 + a_b^2 - a_f^2) R + a_b = 0; each layer lets through the share
//! q = a_f / (1 - a_b R) of the light that goes down. N layers reflect
//!
//! ```text
//! R_N = R (1 - q^{2N}) / (1 - R^2 q^{2N})
//! ```
//!
//! Without the one event in the first layer, which is single scattering, the stack without end sends
//! back A_b = R - a_b = q^2 R (1 - a_b R). Hair behind a point of optical depth tau, which the share
//! T' = exp(-tau) of the light comes through, is N = 1 + tau layers, and sends back the share
//!
//! ```text
//! f_local = (R_N - a_b) / A_b = (1 - T'^k) / (1 - R^2 q^2 T'^k),   k = -2 ln q
//! ```
//!
//! Light that goes up and down in the hair before a point, and between that and the hair behind it,
//! comes to the point too. With u the share of it that is left if each fibre on the way sends on q in
//! place of a_f, and R_2 what the hair behind reflects, that is all in all
//!
//! ```text
//! F = u (1 - R^2) / (1 - R R_2 - u^2 R (R - R_2)),   R_2 = a_b + f_local A_b
//! ```

use super::averages::{AverageTexel, sample_averages};

/// Sine of the inclination whose averages stand for all hair behind a point.
pub(super) const LAYERS_SINE: f32 = 0.4;
/// That inclination, radians.
pub(super) const LAYERS_THETA: f32 = 0.411_516_85;

/// Least share of light that comes through the hair behind a point, near the smallest that 16 bits hold: so there are at most 12.5 layers.
const LEAST_PASSING: f32 = 1e-5;

/// Largest q^2, and largest R^2 q^2: keeps k > 0 and f_local's denominator above 0.
const MOST_ROUND_TRIP: f32 = 0.9999;
/// Most that a stack without end reflects.
const MOST_REFLECTED: f32 = 0.999;

/// Layers of one kind of fibre, per channel; byte for byte the struct of the shaders (80 bytes).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct HairLayers {
    /// k > 0: optical depth of two layers, that into the hair and that out of it.
    pub two_layer_depth: [f32; 3],
    /// Fills the struct; always 0.
    pub padding_0: u32,
    /// R^2 q^2, 0..1: share of the light that goes up and down once more.
    pub round_trip: [f32; 3],
    /// Fills the struct; always 0.
    pub padding_1: u32,
    /// q / a_f, >= 1. q here is not bounded; [`super::forward_light`] bounds 1 - q.
    pub gain: [f32; 3],
    /// Fills the struct; always 0.
    pub padding_2: u32,
    /// R, 0..1.
    pub reflected: [f32; 3],
    /// Fills the struct; always 0.
    pub padding_3: u32,
    /// A_b, 0..=1.
    pub attenuation_b: [f32; 3],
    /// Fills the struct; always 0.
    pub padding_4: u32,
}

crate::mirrors! {
    HairLayers as "HairLayers" in "lib/hair_layers" {
        two_layer_depth, padding_0, round_trip, padding_1, gain, padding_2, reflected, padding_3,
        attenuation_b, padding_4,
    }
}

/// Of hair that sends nothing back.
pub const NO_LAYERS: HairLayers = HairLayers {
    two_layer_depth: [1.0; 3],
    padding_0: 0,
    round_trip: [0.0; 3],
    padding_1: 0,
    gain: [1.0; 3],
    padding_2: 0,
    reflected: [0.0; 3],
    padding_3: 0,
    attenuation_b: [0.0; 3],
    padding_4: 0,
};

/// The layers of fibres of which one sends on a_f at an event, and a stack without end sends back A_b.
pub(crate) fn layers_of(a_f: [f32; 3], attenuation_b: [f32; 3]) -> HairLayers {
    let mut layers = NO_LAYERS;
    for channel in 0..3 {
        let (a_f, attenuation_b) = (a_f[channel], attenuation_b[channel]);
        let a_f_2 = a_f * a_f;
        // The a_b of the stack that sends back A_b: A_b a_b^2 + (A_b^2 + a_f^2) a_b = A_b (1 - a_f^2).
        let one_minus_a_f_2 = (1.0 - a_f_2).max(0.0);
        let sum = attenuation_b * attenuation_b + a_f_2;
        let root = (sum * sum + 4.0 * attenuation_b * attenuation_b * one_minus_a_f_2).sqrt();
        let a_b = 2.0 * attenuation_b * one_minus_a_f_2 / (sum + root).max(1e-20);
        let reflected = attenuation_b + a_b;
        let gain = 1.0 / (1.0 - a_b * reflected).max(1e-6);
        let q = a_f * gain;
        let q_2 = (q * q).clamp(1e-20, MOST_ROUND_TRIP);
        layers.two_layer_depth[channel] = -q_2.ln();
        layers.round_trip[channel] = (reflected * reflected * q_2).min(MOST_ROUND_TRIP);
        layers.gain[channel] = gain;
        layers.reflected[channel] = reflected.min(MOST_REFLECTED);
        layers.attenuation_b[channel] = attenuation_b;
    }
    layers
}

/// Mean of what averages are at +theta and at -theta.
pub(super) fn mean_of_signs(up: [f32; 3], down: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|c| 0.5 * (up[c] + down[c]))
}

/// The layers of hair that is not painted; without averages [`NO_LAYERS`].
pub fn plain_layers(averages: &[AverageTexel]) -> HairLayers {
    if averages.is_empty() {
        return NO_LAYERS;
    }
    let [up, down] = [LAYERS_THETA, -LAYERS_THETA].map(|theta| sample_averages(averages, theta));
    layers_of(
        mean_of_signs(up.a_f, down.a_f),
        mean_of_signs(up.attenuation_b, down.attenuation_b),
    )
}

/// f_local of the hair along +x, +y, +z, -x, -y and -z, by channel.
pub type AxisDensities = [[f32; 6]; 3];

/// f_local of hair that such a share of the light comes through.
fn density_behind(layers: &HairLayers, share: f32) -> [f32; 3] {
    let depth = share.max(LEAST_PASSING).ln();
    [0, 1, 2].map(|c: usize| {
        let share_both_ways = (layers.two_layer_depth[c] * depth).exp();
        (1.0 - share_both_ways) / (1.0 - layers.round_trip[c] * share_both_ways)
    })
}

/// f_local of hair along the axes that such shares of the light come through.
pub fn axis_densities(layers: &HairLayers, axis_shares: &[f32; 6]) -> AxisDensities {
    let mut densities = [[0.0; 6]; 3];
    for (axis, share) in axis_shares.iter().enumerate() {
        for (densities, density) in densities.iter_mut().zip(density_behind(layers, *share)) {
            densities[axis] = density;
        }
    }
    densities
}

/// Factor f_local on local scattering of light from the unit vector `towards`, per channel, 0..=1 but for rounding: what the hair behind the
/// point, away from the light, sends back of what a stack without end would. Between the axes it counts by the squares of the direction.
pub fn local_density(densities: &AxisDensities, towards: [f32; 3]) -> [f32; 3] {
    let mut found = [0.0; 3];
    for (axis, along) in towards.into_iter().enumerate() {
        let away = if along > 0.0 { 3 + axis } else { axis };
        for (found, densities) in found.iter_mut().zip(densities) {
            *found += along * along * densities[away];
        }
    }
    found
}

/// F, 0..=1, of a light of which factors of q leave the share `u`. The hair behind sends back `density_back` (d_b f_local) of what a stack
/// without end would.
pub(super) fn between_layers(layers: &HairLayers, u: [f32; 3], density_back: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|c: usize| {
        let (r, u) = (layers.reflected[c], u[c]);
        // R - R_2.
        let missing = (1.0 - density_back[c]) * layers.attenuation_b[c];
        let one_minus_r_2 = 1.0 - r * r;
        (u * one_minus_r_2 / (one_minus_r_2 + r * missing * (1.0 - u * u))).min(1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What n layers reflect, n = 1, 2, ..: each added to those behind it.
    fn reflected(a_f: f64, a_b: f64) -> impl Iterator<Item = f64> {
        std::iter::successors(Some(a_b), move |behind| {
            Some(a_b + a_f * a_f * behind / (1.0 - a_b * behind))
        })
    }

    #[test]
    fn a_stack_of_layers_is_added_up() {
        let mut worst = 0.0f64;
        for (a_f, a_b) in [
            (0.7, 0.2),
            (0.5, 0.3),
            (0.9, 0.05),
            (0.3, 0.02),
            (0.02, 0.3),
        ] {
            let endless = reflected(a_f, a_b).nth(3000).unwrap();
            let layers = layers_of([a_f as f32; 3], [(endless - a_b) as f32; 3]);
            for (n, found) in reflected(a_f, a_b).enumerate().take(11) {
                let expected = (found - a_b) / (endless - a_b);
                let [density, ..] = density_behind(&layers, (-(n as f32)).exp());
                worst = worst.max((f64::from(density) - expected).abs());
            }
        }
        assert!(worst < 2e-4, "{worst}");
    }

    #[test]
    fn more_hair_sends_back_more_from_black_to_white() {
        for (a_f, a_b) in [
            (0.0, 0.0),
            (0.0, 0.5),
            (1e-6, 1e-12),
            (0.3, 1e-9),
            (0.75, 0.01),
            (0.8, 0.7),
            (1.0, 1.0),
        ] {
            let layers = layers_of([a_f; 3], [a_b; 3]);
            let depths = [0.0, 1e-4, 0.1, 1.0, 3.0, 11.0, 40.0];
            let found = depths.map(|depth: f32| density_behind(&layers, (-depth).exp())[0]);
            assert!(found.is_sorted(), "{a_f} {a_b} {found:?}");
            assert!(found[0] == 0.0 && found[6] <= 1.0, "{a_f} {a_b} {found:?}");
        }
    }

    #[test]
    fn hair_behind_a_point_sends_light_back() {
        // Hair below, and some towards +x.
        let layers = layers_of([0.7; 3], [0.23; 3]);
        let densities = axis_densities(&layers, &[0.6, 1.0, 1.0, 1.0, 0.0, 1.0]);
        let of = |towards| local_density(&densities, towards)[1];
        let (below, aside) = (of([0.0, 1.0, 0.0]), of([-1.0, 0.0, 0.0]));
        assert!(
            below > 0.99 && aside > 0.1 && aside < 0.5,
            "{below} {aside}"
        );
        assert_eq!(of([0.0, -1.0, 0.0]), 0.0);
        assert_eq!(of([0.0, 0.0, 1.0]), 0.0);
        // From in between some of both.
        let between = of([-0.8, 0.6, 0.0]);
        assert!(
            (between - 0.64 * aside - 0.36 * below).abs() < 1e-6,
            "{between}"
        );
    }

    #[test]
    fn light_goes_up_and_down_between_layers() {
        let mut worst = 0.0f64;
        for (a_f, a_b) in [(0.7, 0.2), (0.5, 0.3), (0.9, 0.05), (0.3, 0.02)] {
            let endless = reflected(a_f, a_b).nth(3000).unwrap();
            let layers = layers_of([a_f as f32; 3], [(endless - a_b) as f32; 3]);
            let q = layers.gain[0] * a_f as f32;
            // What n layers before the point let through, n = 1, 2, ..
            let mut through = a_f;
            for (n, before) in reflected(a_f, a_b).enumerate().take(12) {
                for behind in reflected(a_f, a_b).take(12) {
                    let expected = through / (1.0 - before * behind);
                    let density = (behind - a_b) / (endless - a_b);
                    let u = q.powi(n as i32 + 1);
                    let [f, ..] = between_layers(&layers, [u; 3], [density as f32; 3]);
                    worst = worst.max((f64::from(f) - expected).abs());
                }
                through *= a_f / (1.0 - a_b * before);
            }
        }
        assert!(worst < 2e-5, "{worst}");
    }
}
