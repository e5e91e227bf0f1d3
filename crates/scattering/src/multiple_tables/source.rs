//! The tables as a GPU fills and reads them. Twins: `shaders/lib/multiple_tables.wgsl` (axes and look-ups),
//! `shaders/pass/multiple_tables.wgsl` (rows).
//!
//! What costs time, the rows, is made on the device from [`MultipleSource`], a few ten kB. A row of 16
//! numbers is four texels of a 3D texture, in as many blocks of layers: block k holds the numbers 4 k to
//! 4 k + 3, so that a filtered look-up never mixes blocks. The second half of an elliptic fibre's rows are four
//! further blocks. Along x lies the difference of the inclinations,
//! along y their sum, along z the width.

use crate::closed_form::{AverageTexel, SampleLobes, Shading};

use super::axes::{Axes, LEAST_DIFFERENCE, POLE, SUM_MIDDLE};
use super::azimuth::{GRAZING, LAST_NODE, Profiles, Row};
use super::elliptic;
use super::lag::{LagFunctions, N_FUNCTIONS};
use super::{MultipleTables, NODES, Plan};
use crate::jobs::Job;

/// Texels of a row, or of half a row of an elliptic fibre.
const HALF_TEXELS: usize = 1 + N_FUNCTIONS;

/// What the largest numbers are about in half floats: 4000 times below their range, and 5 digits above
/// where they lose precision.
const STORED: f32 = 16.0;

/// The axes of a table, byte for byte the struct `MultipleAxes` of the shaders (32 bytes).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MultipleAxes {
    /// Nodes over width, sum and difference.
    pub count: [u32; 3],
    /// w / (w + middle) of a width is even between nodes.
    pub middle: f32,
    /// That of the least width.
    pub first: f32,
    /// Nodes per unit of it.
    pub scale: f32,
    /// Squared width of the ridge under a light of width 0.
    pub ridge_2: f32,
    /// Fills the struct; always 0.
    pub padding: f32,
}

/// What the shaders know of the tables, byte for byte the uniform `MultipleLayout` (224 bytes).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MultipleLayout {
    /// Of global and local scattering.
    pub rows: MultipleAxes,
    /// Of direct local scattering.
    pub direct: MultipleAxes,
    /// Factors of cos((2 k + 1) Delta) in the functions of the lag.
    pub functions: [[f32; 4]; 6],
    /// What 1 in a texel of rows stands for.
    pub row_scales: [f32; 4],
    /// And of direct rows.
    pub direct_scales: [f32; 4],
    /// Half of the sums are below this many times the root of the ridge's width.
    pub sum_middle: f32,
    /// Keeps the share of the largest difference finite where that is 0.
    pub least_difference: f32,
    /// Distance of nodes at the poles from them, radians.
    pub pole: f32,
    /// Profiles: nodes below this cosine are about as far apart as those above.
    pub grazing: f32,
    /// Nodes of a profile, less one.
    pub last_node: f32,
    /// As [`MultipleTables::terms`].
    pub terms: u32,
    /// Halves of a row: 2 of an elliptic fibre, else 1.
    pub n_halves: u32,
    /// Fills the uniform; always 0.
    pub padding: u32,
}

crate::mirrors! {
    MultipleAxes as "MultipleAxes" in "lib/multiple_tables" {
        count, middle, first, scale, ridge_2, padding,
    }
    MultipleLayout as "MultipleLayout" in "lib/multiple_tables" {
        rows, direct, functions, row_scales, direct_scales, sum_middle, least_difference, pole, grazing,
        last_node, terms, n_halves, padding,
    }
}

/// What [`MultipleTables`] of a fibre are made from on a GPU, besides the fibre and its averages.
#[derive(Clone, Debug, PartialEq)]
pub struct MultipleSource {
    /// Where rows stand and what their numbers mean.
    pub layout: MultipleLayout,
    /// N_t^G over cos(theta_d), `[half][mode][node]`: of each row the constant and the factors of the functions,
    /// red, green, blue and 0; of a second half the factors of four more. Zeros of modes that are not enabled.
    pub profiles: Vec<[f32; 4 * HALF_TEXELS]>,
    /// The functions of an elliptic fibre: of each term of each order the factors in all of them. Empty for
    /// round ones.
    pub elliptic: Vec<[f32; elliptic::N_FUNCTIONS]>,
}

impl MultipleSource {
    /// For `terms` and with `run` as [`MultipleTables::new`] takes them, and the same tables.
    pub fn new(
        shading: &Shading<impl SampleLobes + Sync>,
        averages: &[AverageTexel],
        terms: u32,
        run: impl FnOnce(Vec<Job>),
    ) -> MultipleSource {
        let plan = Plan::new(&NODES, (shading, averages, terms), run);
        let profiles = plan.profiles.as_ref().map(Profiles::rows);
        let profiles = profiles.unwrap_or_else(|| vec![Row::default()]);
        let numbers = profiles.as_flattened().iter();
        let global = scale(numbers.fold(0.0, |a, b| f32::max(a, b.abs())), &plan.axes);
        let sent_back = averages.iter().flat_map(|texel| &texel[..3]);
        let sent_back = sent_back.fold(0.0, |a, &b| f32::max(a, b));
        let local = scale(sent_back, &plan.direct_axes);
        let n_halves = plan.profiles.as_ref().map_or(1, Profiles::n_halves);
        let functions = plan
            .profiles
            .map(|profiles| (profiles.functions, profiles.elliptic));
        let (LagFunctions(functions), elliptic) = functions.unwrap_or_default();
        MultipleSource {
            layout: MultipleLayout {
                rows: MultipleAxes::from(&plan.axes),
                direct: MultipleAxes::from(&plan.direct_axes),
                functions,
                row_scales: [global, global, global, local],
                direct_scales: [local, local, local, 1.0],
                sum_middle: SUM_MIDDLE,
                least_difference: LEAST_DIFFERENCE,
                pole: POLE,
                grazing: GRAZING,
                last_node: LAST_NODE,
                terms: plan.terms,
                n_halves: n_halves as u32,
                padding: 0,
            },
            elliptic: elliptic.map_or(Vec::new(), |functions| functions.0.as_flattened().to_vec()),
            profiles,
        }
    }

    /// The terms that the tables serve; see [`MultipleTables::terms`].
    pub fn terms(&self) -> u32 {
        self.layout.terms
    }

    /// Bytes that a GPU is sent.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.layout)
            + size_of_val(&self.profiles[..])
            + size_of_val(&self.elliptic[..])
    }

    /// Are the tables those of an elliptic fibre, whose rows have two halves?
    pub fn is_elliptic(&self) -> bool {
        !self.elliptic.is_empty()
    }

    /// Texels of a row.
    pub fn row_texels(&self) -> u32 {
        HALF_TEXELS as u32 * self.layout.n_halves
    }

    /// Texels of the texture of rows along x, y and z.
    pub fn rows_size(&self) -> [u32; 3] {
        let [w, p, q] = self.layout.rows.count;
        [q, p, w * self.row_texels()]
    }

    /// Texels of the texture of direct rows along x, y and z.
    pub fn direct_size(&self) -> [u32; 3] {
        let [w, p, q] = self.layout.direct.count;
        [q, p, w]
    }
}

/// The power of two that 1 stands for in half floats, where numbers are about as large as `largest` over the
/// width of the ridge.
fn scale(largest: f32, axes: &Axes) -> f32 {
    let about = largest / axes.ridge_2.sqrt() / STORED;
    match about.is_normal() {
        true => about.log2().ceil().clamp(-100.0, 100.0).exp2(),
        false => 1.0,
    }
}

impl From<&Axes> for MultipleAxes {
    fn from(axes: &Axes) -> MultipleAxes {
        MultipleAxes {
            count: axes.count.map(|count| count as u32),
            middle: axes.middle,
            first: axes.first,
            scale: axes.scale,
            ridge_2: axes.ridge_2,
            padding: 0.0,
        }
    }
}

impl MultipleTables {
    /// Rows of the whole table, `[width][sum][difference]`: global scattering in the first three of each
    /// four, local scattering in the last of the first three. The second half is empty but for elliptic fibres.
    pub fn rows(&self) -> [&[[f32; 4 * HALF_TEXELS]]; 2] {
        self.rows.each_ref().map(|rows| &rows[..])
    }

    /// Rows of direct local scattering.
    pub fn direct_rows(&self) -> &[[f32; 4]] {
        &self.direct
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form::{
        Fibre, LobeView, Reflectance, TERM_GLOBAL, TERM_LOCAL, Tables, pack_averages,
    };
    use crate::dual_scattering::AverageTable;
    use crate::fresnel::Fresnel;
    use crate::jobs::in_turn;
    use crate::multiple_tables::axes::Place;
    use crate::multiple_tables::mix;
    use crate::random::SplitMix64;
    use crate::{HairParams, Lobe};

    /// Half a float's digits, to the nearest.
    fn half(value: f32) -> f32 {
        f32::from_bits((value.to_bits() + 0x1000) & 0xffff_e000)
    }

    /// GPUs may filter with weights of eight bits: that, and half floats, change less than what the tables
    /// err.
    #[test]
    fn weights_of_eight_bits_and_half_floats_do() {
        let hair = HairParams::default();
        let fibre = Fibre::new(&hair, &[Lobe::R], 4).expect("in range");
        let decode = bytemuck::Zeroable::zeroed();
        let none = LobeView {
            decode: &decode,
            texels: &[],
        };
        let shading = Shading {
            fibre: &fibre,
            reflectance: &Reflectance::new(Fresnel::Dielectric, hair.eta),
            tables: Tables {
                c: &[],
                h_tt: &[],
                h_trt: &[],
                axes: bytemuck::Zeroable::zeroed(),
            },
            tt: none,
            trt: none,
        };
        let averages = pack_averages(&AverageTable::new(&hair, Fresnel::Dielectric));
        let terms = TERM_GLOBAL | TERM_LOCAL;
        let source = MultipleSource::new(&shading, &averages, terms, in_turn);
        let tables = MultipleTables::new(&shading, &averages, terms, in_turn);
        assert_eq!(source.terms(), tables.terms());
        let [q, p, layers] = source.rows_size();
        let [rows, further] = tables.rows();
        assert_eq!((q * p * layers) as usize, HALF_TEXELS * rows.len());
        assert!(further.is_empty());
        let [q, p, w] = source.direct_size();
        assert_eq!((q * p * w) as usize, tables.direct_rows().len());
        // Both scales leave room above and digits below.
        let MultipleLayout {
            row_scales,
            direct_scales,
            ..
        } = source.layout;
        let rows = rows.as_flattened().as_chunks::<4>().0;
        for (rows, scales) in [(rows, row_scales), (tables.direct_rows(), direct_scales)] {
            for channel in [0, 3] {
                let largest = rows.iter().map(|row| row[channel].abs() / scales[channel]);
                let largest = largest.fold(0.0, f32::max);
                assert!((0.5..2e4).contains(&largest), "{largest}");
            }
        }
        let rounded: Vec<Row> = tables.rows[0].iter().map(|row| row.map(half)).collect();
        let rounded_direct: Vec<_> = tables.direct.iter().map(|row| row.map(half)).collect();
        let mut random = SplitMix64::of_item(5, 0);
        let mut squares = [[0.0; 2]; 3];
        for _ in 0..4000 {
            let mut theta = || random.uniform(-1.0, 1.0).asin() as f32;
            let (theta_j, theta_o) = (theta(), theta());
            let width = random.log_uniform(0.05, 2.0) as f32;
            let place = tables.axes.place(width, theta_j, theta_o);
            let coarse = |mut place: Place| {
                place.fraction = place.fraction.map(|f| (256.0 * f).round() / 256.0);
                place
            };
            let exact = mix(&tables.rows[0], &tables.axes, place);
            let found = mix(&rounded, &tables.axes, coarse(place));
            let place = tables.direct_axes.place(width, theta_j, theta_o);
            let exact_direct = mix(&tables.direct, &tables.direct_axes, place);
            let found_direct = mix(&rounded_direct, &tables.direct_axes, coarse(place));
            let pairs = [
                (found[0], exact[0]),
                (found[3], exact[3]),
                (found_direct[0], exact_direct[0]),
            ];
            for (squares, (found, exact)) in squares.iter_mut().zip(pairs) {
                squares[0] += f64::from(found - exact).powi(2);
                squares[1] += f64::from(exact).powi(2);
            }
        }
        for [error, value] in squares {
            let error = (error / value).sqrt();
            println!("{error:.1e}");
            assert!(error > 0.0 && error < 1.5e-3, "{error}");
        }
    }
}
