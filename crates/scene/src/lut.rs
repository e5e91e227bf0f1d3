//! LUTs: from linear radiance to what a screen shows, by a table. Twin: `shaders/lib/lut.wgsl`.

use std::sync::Arc;

pub use strandlight_formats::LutInput;
use strandlight_formats::{Cube, CubeTable};

use crate::tone::srgb::srgb_from_linear;

/// [`LutInput::Log2`] in shaders.
pub const LUT_LOG2: u32 = 0;
/// [`LutInput::Srgb`] in shaders.
pub const LUT_SRGB: u32 = 1;
/// [`LutInput::Linear`] in shaders.
pub const LUT_LINEAR: u32 = 2;

/// A LUT and what it takes. Clones share the table.
#[derive(Clone, Debug)]
pub struct Lut {
    /// The table.
    pub cube: Arc<Cube>,
    /// How linear radiance is encoded for it.
    pub input: LutInput,
}

impl PartialEq for Lut {
    fn eq(&self, other: &Lut) -> bool {
        let is_same = || Arc::ptr_eq(&self.cube, &other.cube) || self.cube == other.cube;
        self.input == other.input && is_same()
    }
}

impl Lut {
    /// sRGB in 0..=1 of linear Rec.709 radiance (exposure already applied).
    pub fn display(&self, rgb: [f32; 3]) -> [f32; 3] {
        let mut v = rgb.map(|x| encoded(x, self.input));
        if let Some(curves) = &self.cube.curves {
            v = along_curves(curves, v);
        }
        if let Some(grid) = &self.cube.grid {
            v = in_grid(grid, v);
        }
        v.map(|x| x.clamp(0.0, 1.0))
    }
}

/// Linear radiance as a LUT takes it.
fn encoded(v: f32, input: LutInput) -> f32 {
    match input {
        // Ten stops on either side of middle grey.
        LutInput::Log2 => (((v.clamp(1e-10, 1e10) / 0.18).log2() + 10.0) / 20.0).clamp(0.0, 1.0),
        LutInput::Srgb => srgb_from_linear(v.clamp(0.0, 1.0)),
        LutInput::Linear => v.clamp(-1e30, 1e30),
    }
}

/// Radiance that is encoded so by [`LutInput::Log2`].
pub(crate) fn radiance(encoded: f32) -> f32 {
    0.18 * (20.0 * encoded - 10.0).exp2()
}

/// Where `v` lies among samples 0 to `size` - 1 at inputs from `low` to `high`.
fn place(v: f32, low: f32, high: f32, size: u32) -> f32 {
    ((v - low) / (high - low)).clamp(0.0, 1.0) * (size - 1) as f32
}

/// Three curves, between whose samples are straight lines.
fn along_curves(curves: &CubeTable, v: [f32; 3]) -> [f32; 3] {
    let samples = &curves.samples;
    std::array::from_fn(|ix| {
        let at = place(v[ix], curves.low[ix], curves.high[ix], curves.size);
        let below = (at as usize).min(samples.len() - 2);
        let (a, b) = (samples[below][ix], samples[below + 1][ix]);
        a + (at - below as f32) * (b - a)
    })
}

/// A grid, in each cell of which are six tetrahedra about the diagonal of greys.
fn in_grid(grid: &CubeTable, v: [f32; 3]) -> [f32; 3] {
    let at = std::array::from_fn(|ix| place(v[ix], grid.low[ix], grid.high[ix], grid.size));
    let (corners, weights) = tetrahedron(at, grid.size);
    let samples = corners.map(|ix| grid.samples[ix as usize]);
    std::array::from_fn(|channel| {
        let terms = (0..4).map(|ix| weights[ix] * samples[ix][channel]);
        terms.sum()
    })
}

/// The four samples of a grid around the place `at`, in units of samples, and their weights, which
/// add up to 1.
fn tetrahedron(at: [f32; 3], size: u32) -> ([u32; 4], [f32; 4]) {
    let base = at.map(|x| (x as u32).min(size - 2));
    let [r, g, b] = std::array::from_fn(|ix| at[ix] - base[ix] as f32);
    // Steps along the axes: that of the largest fraction first, then the middle one.
    let step = [1, size, size * size];
    let (order, fractions) = match (r >= g, g >= b, r >= b) {
        (true, true, _) => ([0, 1, 2], [r, g, b]),
        (true, false, true) => ([0, 2, 1], [r, b, g]),
        (true, false, false) => ([2, 0, 1], [b, r, g]),
        (false, false, _) => ([2, 1, 0], [b, g, r]),
        (false, true, true) => ([1, 0, 2], [g, r, b]),
        (false, true, false) => ([1, 2, 0], [g, b, r]),
    };
    let [first, second, third] = order.map(|axis: usize| step[axis]);
    let corner = base[0] + size * (base[1] + size * base[2]);
    let [x, y, z] = fractions;
    (
        [
            corner,
            corner + first,
            corner + first + second,
            corner + first + second + third,
        ],
        [1.0 - x, x - y, y - z, z],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lut(text: &str, input: LutInput) -> Lut {
        let cube = Cube::from_bytes(text.as_bytes()).expect("a LUT");
        Lut {
            cube: Arc::new(cube),
            input,
        }
    }

    /// A grid of `size` of `color` at places in 0..=1.
    fn grid(size: u32, color: impl Fn([f32; 3]) -> [f32; 3]) -> String {
        let mut text = format!("LUT_3D_SIZE {size}\n");
        let at = |ix: u32| ix as f32 / (size - 1) as f32;
        for ix in 0..size.pow(3) {
            let [r, g, b] = color([ix % size, ix / size % size, ix / size / size].map(at));
            text += &format!("{r} {g} {b}\n");
        }
        text
    }

    fn close(a: [f32; 3], b: [f32; 3]) {
        let apart = (0..3).map(|ix| (a[ix] - b[ix]).abs()).fold(0.0, f32::max);
        assert!(apart < 2e-6, "{a:?} {b:?}");
    }

    fn places() -> impl Iterator<Item = [f32; 3]> {
        (0..2000u32).map(|ix| {
            [0x9E37_79B1, 0x85EB_CA77, 0xC2B2_AE3D]
                .map(|factor: u32| (ix.wrapping_mul(factor) >> 8) as f32 / 16_777_216.0)
        })
    }

    #[test]
    fn middle_grey_and_the_ends_of_the_stops_are_where_they_are_said_to_be() {
        for (stops, wanted) in [
            (0.0, 0.5),
            (-10.0, 0.0),
            (10.0, 1.0),
            (-40.0, 0.0),
            (40.0, 1.0),
        ] {
            let found = encoded(0.18 * f32::exp2(stops), LutInput::Log2);
            assert!((found - wanted).abs() < 1e-6, "{stops}: {found}");
            let back = encoded(radiance(wanted), LutInput::Log2);
            assert!((back - wanted).abs() < 1e-6, "{wanted}: {back}");
        }
        assert_eq!(encoded(0.0, LutInput::Log2), 0.0);
        assert_eq!(encoded(-1.0, LutInput::Srgb), 0.0);
        assert_eq!(encoded(9.0, LutInput::Srgb), srgb_from_linear(1.0));
        assert_eq!(encoded(-1.0, LutInput::Linear), -1.0);
    }

    #[test]
    fn what_is_linear_is_met_exactly_in_every_tetrahedron() {
        let color = |[r, g, b]: [f32; 3]| [0.2 + 0.5 * r - 0.1 * b, 0.6 * g, 0.3 * r + 0.7 * b];
        for size in [2, 3, 17] {
            let lut = lut(&grid(size, color), LutInput::Linear);
            places().for_each(|v| close(lut.display(v), color(v)));
        }
        // Greys are made of greys alone: a product of two channels is not smeared over them.
        let product = lut(&grid(2, |[r, g, _]| [r * g; 3]), LutInput::Linear);
        close(product.display([0.5; 3]), [0.5; 3]);
        close(product.display([0.5, 0.5, 0.0]), [0.5; 3]);
        close(product.display([1.0, 0.25, 0.25]), [0.25; 3]);
    }

    #[test]
    fn weights_are_shares_of_samples_around_the_place() {
        for v in places() {
            let at = v.map(|x| 4.0 * x);
            let (corners, weights) = tetrahedron(at, 5);
            assert!(weights.iter().all(|x| (0.0..=1.0).contains(x)), "{v:?}");
            let mean: [f32; 3] = std::array::from_fn(|axis| {
                let place = |ix: u32| (ix / 5_u32.pow(axis as u32) % 5) as f32;
                (0..4).map(|ix| weights[ix] * place(corners[ix])).sum()
            });
            close(mean.map(|x| 0.25 * x), v);
        }
        assert_eq!(
            tetrahedron([1.0; 3], 2),
            ([0, 1, 3, 7], [0.0, 0.0, 0.0, 1.0])
        );
    }

    #[test]
    fn ranges_and_curves_are_followed() {
        let text = format!(
            "LUT_1D_SIZE 3\nLUT_1D_INPUT_RANGE -1 3\nLUT_3D_SIZE 2\n0 0 1\n0.25 0.5 0.5\n1 1 0\n{}",
            &grid(2, |v| v)["LUT_3D_SIZE 2\n".len()..]
        );
        let both = lut(&text, LutInput::Linear);
        close(both.display([1.0, 0.0, 0.0]), [0.25, 0.25, 0.75]);
        close(both.display([-5.0, 3.0, 9.0]), [0.0, 1.0, 0.0]);
        let wide = format!("DOMAIN_MIN 0 0 -1\nDOMAIN_MAX 2 4 1\n{}", grid(3, |v| v));
        let wide = lut(&wide, LutInput::Linear);
        close(wide.display([0.5, 1.0, 0.0]), [0.25, 0.25, 0.5]);
        // Nothing, and nothing but light.
        for v in [f32::NAN, f32::INFINITY, f32::MAX, -f32::MAX] {
            let shown = wide.display([v; 3]);
            assert!(shown.iter().all(|x| x.is_nan() == v.is_nan()), "{shown:?}");
        }
    }

    #[test]
    fn a_lut_that_changes_nothing_shows_what_no_tone_map_shows() {
        let lut = lut(&grid(17, |v| v), LutInput::Srgb);
        for v in places() {
            close(lut.display(v), v.map(srgb_from_linear));
        }
    }
}
