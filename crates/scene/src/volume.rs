//! The shadow volume: where its voxels lie and along which directions light sweeps through it.

use glam::Vec3;
use strandlight_formats::SrbfLight;
use strandlight_scattering::random::GOLDEN_ANGLE;
use strandlight_scattering::spherical_gaussian::solid_angle;

use crate::strands::Strands;

/// Voxels along the longest side (algorithms with twice as many gain 4 to 10 % in error).
pub const GRID_SIDE: u32 = 64;

/// Empty voxels around the groom on each side: trilinear splats and look-ups stay inside.
const MARGIN: u32 = 2;

/// How far towards a light its records are looked up, voxels: a strand does not shadow itself, but
/// its voxel holds it. Found by ray shooting; without it T is 0.01 too low.
pub const SELF_LIFT: f32 = 0.12;

/// Fixed-point quanta in `h * max_diameter`: a third of a voxel of the thickest fibre is 2^20 / 3
/// quanta, so the smallest trilinear weights still count.
pub(crate) const QUANTA: f32 = 1_048_576.0;

/// Most directions of a light that [`sweep_directions`] answers.
pub const MAX_DIRECTIONS: u32 = 8;

/// Channels of a voxel: area density, then the orientation tensor xx, yy, zz, xy, xz, yz.
pub const CHANNELS: u32 = 7;

/// Where the voxels lie; mirrored by `Grid` in `shaders/lib/grid.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Grid {
    /// Corner of voxel (0, 0, 0), cm.
    pub origin: [f32; 3],
    /// Side of a voxel, cm.
    pub h: f32,
    /// Voxels along x, y, z.
    pub dims: [u32; 3],
    /// Segments to splat.
    pub n_segments: u32,
    /// Quanta per cm^2 of fibre length times diameter.
    pub quanta_per_area: f32,
    /// Area density in 1/cm of one quantum in a voxel.
    pub density_per_quantum: f32,
    /// Not used.
    pub pad: [u32; 2],
}

strandlight_scattering::mirrors! {
    Grid as "Grid" in "lib/grid" {
        origin, h, dims, n_segments, quanta_per_area, density_per_quantum, pad,
    }
}

impl Grid {
    /// The grid around `strands`.
    pub fn around(strands: &Strands) -> Self {
        Grid::with_side(strands, GRID_SIDE)
    }

    /// The grid around `strands` with `n` voxels (8 at least) along the longest side.
    pub fn with_side(strands: &Strands, n: u32) -> Self {
        let n = n.max(8);
        let (low, high) = strands.bounds;
        let extent = high - low;
        let inner = (n - 2 * MARGIN) as f32;
        // A groom without extent still gets voxels of some size.
        let h = (extent.max_element() / inner).max(1e-4);
        let side = |x: f32| ((x / h).ceil() as u32 + 2 * MARGIN).clamp(2 * MARGIN + 1, n);
        let dims = [side(extent.x), side(extent.y), side(extent.z)];
        let half = 0.5 * h * Vec3::new(dims[0] as f32, dims[1] as f32, dims[2] as f32);
        let quantum = h * strands.max_diameter / QUANTA;
        Grid {
            origin: (0.5 * (low + high) - half).to_array(),
            h,
            dims,
            n_segments: strands.segments.len() as u32,
            quanta_per_area: 1.0 / quantum,
            density_per_quantum: quantum / (h * h * h),
            pad: [0; 2],
        }
    }

    /// Where a ray is in the grid, `inset` voxels or more from its faces: the distances from `start` at which it enters,
    /// 0 or more, and leaves. Twin in `shaders/lib/grid.wgsl`.
    pub fn span_in_grid(&self, start: Vec3, direction: Vec3, inset: f32) -> Option<[f32; 2]> {
        let tiny = direction.abs().cmplt(Vec3::splat(1e-8));
        let d = Vec3::select(tiny, Vec3::splat(1e-8), direction);
        let origin = Vec3::from(self.origin);
        let dims = Vec3::from(self.dims.map(|n| n as f32));
        let low = (origin + inset * self.h - start) / d;
        let high = (origin + (dims - inset) * self.h - start) / d;
        let entry = low.min(high).max_element().max(0.0);
        let exit = low.max(high).min_element();
        (entry < exit).then_some([entry, exit])
    }

    /// Middle of a voxel, cm.
    #[inline]
    pub fn centre(&self, voxel: [u32; 3]) -> Vec3 {
        let at = Vec3::from(voxel.map(|n| n as f32 + 0.5));
        Vec3::from(self.origin) + at * self.h
    }

    /// Number of voxels.
    pub fn n_voxels(&self) -> usize {
        self.dims.iter().map(|&n| n as usize).product()
    }
}

/// Of a voxel's eight numbers towards `d`: extinction `sigma_t = sqrt(A (A - d^T Q d))`, 1/cm, and the mean of sin^2 of the
/// inclination, d^T Q d / A.
pub fn extinction(voxel: &[f32; 8], d: Vec3) -> [f32; 2] {
    let [a, xx, yy, zz, xy, xz, yz, _] = *voxel;
    let along = d.x * d.x * xx
        + d.y * d.y * yy
        + d.z * d.z * zz
        + 2.0 * (d.x * d.y * xy + d.x * d.z * xz + d.y * d.z * yz);
    let sigma_t = (a * (a - along)).max(0.0).sqrt();
    [sigma_t, (along / a.max(1e-20)).clamp(0.0, 1.0)]
}

/// Directions from the hair towards a light over which its transmittance is averaged.
///
/// One below lambda 0.3, four up to 0.6, eight above: inverse-transform samples of the SRBF
/// (`cos alpha = 1 + ln(u + (1 - u) e^(-2 kappa)) / kappa`, kappa = 2 / lambda^2), stratified in u,
/// golden-ratio azimuths. One direction is the centre itself.
pub fn sweep_directions(light: &SrbfLight) -> Vec<[f32; 3]> {
    let k = match light.lambda {
        l if l < 0.3 => 1,
        l if l <= 0.6 => 4,
        _ => MAX_DIRECTIONS,
    };
    lobe_directions(light, k)
}

/// `k` directions inside the lobe of `light`, each for the same share of its radiance; one is the
/// centre.
pub fn lobe_directions(light: &SrbfLight, k: u32) -> Vec<[f32; 3]> {
    if k <= 1 {
        let axis = Vec3::from(light.direction).normalize_or(Vec3::Y);
        return vec![axis.to_array()];
    }
    shifted_lobe_directions(light, k, 0.5)
}

/// As [`lobe_directions`], another set for each `shift` in 0..1: the mean over all of them is that
/// over the lobe even where `k` is 1.
pub(crate) fn shifted_lobe_directions(light: &SrbfLight, k: u32, shift: f64) -> Vec<[f32; 3]> {
    let axis = Vec3::from(light.direction).normalize_or(Vec3::Y);
    let (x, y) = axis.any_orthonormal_pair();
    let kappa = 2.0 / f64::from(light.lambda * light.lambda);
    (0..k)
        .map(|ix| {
            let u = (f64::from(ix) + shift) / f64::from(k);
            let cos = 1.0 + (u + (1.0 - u) * (-2.0 * kappa).exp()).ln() / kappa;
            let cos = cos.clamp(-1.0, 1.0);
            let sin = (1.0 - cos * cos).sqrt() as f32;
            let turns = f64::from(ix) * GOLDEN_ANGLE;
            let azimuth = turns + std::f64::consts::TAU * (13.0 * (shift - 0.5));
            let across = x * azimuth.cos() as f32 + y * azimuth.sin() as f32;
            (axis * cos as f32 + across * sin)
                .normalize_or(axis)
                .to_array()
        })
        .collect()
}

/// Power of a light per channel: amplitude times solid angle. Who needs one number of it says
/// which: [`largest`], the mean, the sum.
pub fn power(light: &SrbfLight) -> [f64; 3] {
    let solid_angle = solid_angle(f64::from(light.lambda));
    light.rgb.map(|x| f64::from(x) * solid_angle)
}

/// The largest channel of [`power`]: what bounds the light that arrives in any channel.
pub fn largest(power: [f64; 3]) -> f32 {
    power.into_iter().fold(0.0, f64::max) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweep_directions_have_the_mean_of_the_lobe() {
        for lambda in [0.1_f32, 0.4, 0.9, 2.0, 8.0] {
            let light = SrbfLight {
                direction: [0.6, 0.0, -0.8],
                lambda,
                rgb: [1.0; 3],
            };
            let directions = sweep_directions(&light);
            let mean: f32 = directions
                .iter()
                .map(|d| Vec3::from(*d).dot(Vec3::from(light.direction)))
                .sum::<f32>()
                / directions.len() as f32;
            // E[cos] of a von Mises-Fisher lobe is coth(kappa) - 1 / kappa.
            let kappa = 2.0 / (lambda * lambda);
            let exact = 1.0 / kappa.tanh() - 1.0 / kappa;
            let tolerance = if lambda < 0.3 { 0.01 } else { 0.04 };
            assert!((mean - exact).abs() < tolerance, "{lambda}: {mean} {exact}");
        }
    }

    #[test]
    fn power_is_amplitude_times_solid_angle() {
        let light = SrbfLight {
            direction: [0.0, 1.0, 0.0],
            lambda: 0.01,
            rgb: [1.0, 0.0, 4.0],
        };
        let power = power(&light);
        assert!((power[0] / (std::f64::consts::PI * 1e-4) - 1.0).abs() < 1e-5);
        assert_eq!([power[1], power[2]], [0.0, 4.0 * power[0]]);
        assert_eq!(largest(power), power[2] as f32);
    }
}
