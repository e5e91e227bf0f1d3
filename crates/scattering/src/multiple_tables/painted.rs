//! Tables for painted points, whose fibres differ in absorption.
//!
//! Multiple scattering of a channel depends on the absorption of that channel alone, so the three channels of a
//! [`MultipleTables`] are as good as three absorptions. Between these, parabolas go through what the values are over a
//! scale that has most of their fall: the share that hair scatters forward, or sends back. The last absorption of a pack of three is
//! the first of the next, and only packs that points need are filled.
//!
//! `crates/scene/tests/painted_tables.rs` has their errors against the closed form.

use crate::closed_form::{
    AverageRow, AverageTexel, Fibre, ForwardTable, LAST_FORWARD, LAYER_MIDDLE, LocalAverages,
    N_AVERAGE_COLUMNS, N_FORWARD, PaintedAveragesView, PaintedPointAverages, PaintedViews,
    PointPaint, SampleAverages, average_row, painted_layers, painted_shading,
    sample_painted_forward,
};
use crate::dual_scattering::{DEFAULT_AVERAGE_LAYERS, N_INCLINATIONS};
use crate::hair::Parameter;
use crate::jobs::Job;

use super::{MultipleTables, Nodes};

/// Layers of absorption, which are those of the averages.
const N_LAYERS: usize = DEFAULT_AVERAGE_LAYERS;

/// Nodes of packs, which are several and are filled after most edits: fewer than those of one fibre.
const PAINTED_NODES: Nodes = Nodes {
    widths: 10,
    direct_widths: 12,
    inclined: [33.0, 52.0],
};

/// Packs of three absorptions each.
pub const N_PACKS: usize = PACK_LAYERS.len();

/// Layers that the absorptions of the packs are. What hair sends back changes fast where there is little absorption.
const PACK_LAYERS: [[usize; 3]; 9] = [
    [0, 1, 2],
    [2, 3, 4],
    [4, 5, 7],
    [7, 9, 11],
    [11, 13, 15],
    [15, 17, 20],
    [20, 22, 25],
    [25, 28, 31],
    [31, 35, N_LAYERS - 1],
];

/// By layer, the pack that has what lies between it and the next.
const PACK_OF_LAYER: [u8; N_LAYERS] = {
    let mut packs = [0; N_LAYERS];
    let mut pack = 0;
    let mut layer = 0;
    while layer < N_LAYERS {
        if pack + 1 < N_PACKS && layer >= PACK_LAYERS[pack][2] {
            pack += 1;
        }
        packs[layer] = pack as u8;
        layer += 1;
    }
    packs
};

/// Which packs, a bit each.
pub type Packs = u32;

/// Where a channel stands among the absorptions of a pack.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PackPlace {
    /// Which pack.
    pub pack: usize,
    /// Weights of its absorptions.
    pub weights: [f32; 3],
}

/// Where a painted point stands among the packs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaintedPlaces {
    /// By its own absorption, which global scattering follows.
    pub own: [PackPlace; 3],
    /// By that of the hair around it, which sends light back.
    pub around: [PackPlace; 3],
}

/// By layer, what values are interpolated over: of global and of local scattering.
type Scales = [[f32; 2]; N_LAYERS];

/// Multiple scattering of painted points whose widths and shifts are those of the scene's fibre.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PaintedTables {
    packs: [Option<Box<MultipleTables>>; N_PACKS],
    /// Once a pack is there.
    scales: Option<Box<Scales>>,
}

/// Place of absorption among the layers, 0..1: they are dense where little absorption makes a difference.
fn place(sigma_a: f32) -> f32 {
    (sigma_a / (LAYER_MIDDLE + sigma_a)).sqrt()
}

/// Place of the last layer, of the largest absorption there is.
fn last_place() -> f32 {
    let [_, most] = Parameter::SigmaA.range();
    place(most as f32)
}

/// Absorption of a layer.
fn sigma_a_of(layer: usize) -> f32 {
    let place = last_place() * layer as f32 / (N_LAYERS - 1) as f32;
    LAYER_MIDDLE * place * place / (1.0 - place * place)
}

/// Among the layers, 0..=39, where absorption `sigma_a` >= 0 of one channel stands, per fibre radius.
fn layer_at(sigma_a: f32) -> f32 {
    let last = (N_LAYERS - 1) as f32;
    (place(sigma_a) * (last / last_place())).clamp(0.0, last)
}

fn pack_at(layer: f32) -> usize {
    usize::from(PACK_OF_LAYER[layer as usize])
}

/// The packs that a point of this `fibre` ([`crate::closed_form::painted_fibre`]'s) needs.
#[inline]
pub fn packs_of(fibre: &Fibre, paint: &PointPaint) -> Packs {
    let all = fibre.sigma_a.iter().chain(paint.around.iter().flatten());
    all.fold(0, |packs, &sigma_a| packs | 1 << pack_at(layer_at(sigma_a)))
}

impl PackPlace {
    /// At a layer, of values that are interpolated over one of the [`Scales`].
    #[inline]
    fn at(layer: f32, scales: &Scales, which: usize) -> PackPlace {
        let pack = pack_at(layer);
        let first = (layer as usize).min(N_LAYERS - 2);
        let [below, above] = [scales[first][which], scales[first + 1][which]];
        let scale = below + (above - below) * (layer - first as f32);
        let layers = PACK_LAYERS[pack];
        let [a, b, c] = layers.map(|of| of as f32);
        let [to_a, to_b, to_c] = [layer - a, layer - b, layer - c];
        let parabolas = [
            to_b * to_c / ((b - a) * (c - a)),
            to_a * to_c / ((b - a) * (b - c)),
            to_a * to_b / ((c - a) * (c - b)),
        ];
        let weight = |ix: usize| parabolas[ix] * (scale / scales[layers[ix]][which]);
        PackPlace {
            pack,
            weights: [0, 1, 2].map(weight),
        }
    }
}

impl PaintedPlaces {
    /// The packs that it needs.
    #[inline]
    pub fn packs(&self) -> Packs {
        let places = self.own.iter().chain(&self.around);
        places.fold(0, |packs, place| packs | 1 << place.pack)
    }
}

impl PaintedTables {
    /// Those of `packs` that are not there yet.
    pub fn missing(&self, packs: Packs) -> Packs {
        let is_missing = |pack: &usize| self.packs[*pack].is_none();
        let missing = (0..N_PACKS).filter(is_missing);
        packs & missing.fold(0, |missing, pack| missing | 1 << pack)
    }

    /// Where a point of this `fibre` ([`crate::closed_form::painted_fibre`]'s) stands.
    #[inline]
    pub fn places(&self, fibre: &Fibre, paint: &PointPaint) -> PaintedPlaces {
        let Some(scales) = &self.scales else {
            // There is nothing to be looked up.
            let none = [PackPlace::default(); 3];
            return PaintedPlaces {
                own: none,
                around: none,
            };
        };
        let own = fibre.sigma_a.map(layer_at);
        let around = paint.around.map_or(own, |around| around.map(layer_at));
        PaintedPlaces {
            own: own.map(|layer| PackPlace::at(layer, scales, 0)),
            around: around.map(|layer| PackPlace::at(layer, scales, 1)),
        }
    }

    /// Fills a pack of the hair of `views`, for `terms` as [`MultipleTables::new`]. `run` has to run all jobs.
    pub fn fill(&mut self, pack: usize, views: &PaintedViews, terms: u32, run: impl Fn(Vec<Job>)) {
        let scales = || Box::new(scales_of(views.averages));
        self.scales.get_or_insert_with(scales);
        let fibre = Fibre {
            sigma_a: PACK_LAYERS[pack].map(sigma_a_of),
            ..views.hair.fibre
        };
        let averages = average_texels(&unscaled(views.averages, &fibre));
        let shading = painted_shading(views, &fibre);
        let of = (&shading, &averages[..], terms);
        let tables = MultipleTables::with_nodes(&PAINTED_NODES, of, run);
        self.packs[pack] = Some(Box::new(tables));
    }

    /// A pack, if it is there.
    #[inline]
    pub fn pack(&self, pack: usize) -> Option<&MultipleTables> {
        self.packs[pack].as_deref()
    }

    /// The terms that all of them serve, as [`MultipleTables::terms`].
    pub fn terms(&self) -> u32 {
        let packs = self.packs.iter().flatten();
        packs.fold(u32::MAX, |all, tables| all & tables.terms())
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        self.packs
            .iter()
            .flatten()
            .map(|tables| tables.bytes())
            .sum()
    }
}

/// Averages of hair of this fibre all around, its widths and shifts being those without paint.
fn unscaled<'a>(averages: PaintedAveragesView<'a>, fibre: &Fibre) -> PaintedPointAverages<'a> {
    PaintedPointAverages {
        view: averages,
        row: average_row(averages.decode, fibre.sigma_a, 1.0, 1.0),
    }
}

/// What hair of each layer scatters forward, and sends back.
fn scales_of(averages: PaintedAveragesView) -> Scales {
    // Of no more than that there is nothing to tell.
    const LEAST: f32 = 1e-9;
    std::array::from_fn(|layer| {
        let row = average_row(averages.decode, [sigma_a_of(layer); 3], 1.0, 1.0);
        let of_layer = PaintedPointAverages {
            view: averages,
            row,
        };
        let ([a_f, ..], _) = sample_painted_forward(&averages, &row, SCALE_SINE);
        let [a_b, ..] = painted_layers(&of_layer).attenuation_b;
        [a_f.max(LEAST), a_b.max(LEAST)]
    })
}

/// The averages of painted hair as [`MultipleTables::new`] wants them. Light may come through hair of any absorption, so
/// beta_f^2, which is looked at for the least width of such light, is the least of all.
fn average_texels(averages: &PaintedPointAverages) -> Vec<AverageTexel> {
    let b = least_beta_f_2(averages);
    let last = (N_INCLINATIONS - 1) as f32;
    let texel = |ix: usize| {
        let theta = core::f32::consts::PI * (ix as f32 / last - 0.5);
        let LocalAverages {
            attenuation_b: a,
            shift_b: d,
            width_b_2: s,
            energy,
        } = averages.averages_at(theta);
        let (a_f, _) = sample_painted_forward(&averages.view, &averages.row, theta.sin().abs());
        [
            a[0], a[1], a[2], a_f[0], d[0], d[1], d[2], a_f[1], s[0], s[1], s[2], a_f[2], b, b, b,
            energy,
        ]
    };
    (0..N_INCLINATIONS).map(texel).collect()
}

/// Sine of the inclination of the light whose forward scattering is a scale.
const SCALE_SINE: f32 = 0.4;

/// Least share of light scattered forward whose width counts.
const LEAST_A_F: f32 = 1e-6;

/// Of hair of any absorption that scatters light forward.
fn least_beta_f_2(averages: &PaintedPointAverages) -> f32 {
    let of_layer = |layer: usize| {
        let row = average_row(averages.view.decode, [sigma_a_of(layer); 3], 1.0, 1.0);
        (0..N_FORWARD).filter_map(move |ix| {
            let ([a_f, ..], [b, ..]) =
                sample_painted_forward(&averages.view, &row, ix as f32 / LAST_FORWARD);
            (a_f > LEAST_A_F).then_some(b)
        })
    };
    let least = (0..N_LAYERS).flat_map(of_layer).reduce(f32::min);
    // Where nothing is scattered forward, no width counts.
    least.unwrap_or(1.0)
}

/// [`crate::closed_form::forward_table`] of the hair around painted points whose averages stand in this `row`
/// ([`crate::closed_form::painted_averages()`]'s): [`sample_painted_forward`] at all its sines, which are those of the columns, so only
/// rows are mixed. One is made for nearly every painted point.
pub fn painted_forward_table(view: &PaintedAveragesView, row: &AverageRow) -> ForwardTable {
    let mut table = [[0.0; 4]; 2 * N_FORWARD];
    // Two neighbours, as rows and weights; one where there is no step between them.
    let neighbours = |step: u32, fraction: f32| match step {
        0 => [(0, 1.0), (0, 0.0)],
        _ => [(0, 1.0 - fraction), (step, fraction)],
    };
    let shifts = neighbours(row.shift_step, row.shift_fraction);
    let widths = neighbours(row.width_step, row.width_fraction);
    for channel in 0..3 {
        let layers = neighbours(1, row.fractions[channel]);
        for (shift, of_shift) in shifts {
            for (width, of_width) in widths {
                for (layer, of_layer) in layers {
                    let weight = of_shift * of_width * of_layer;
                    if weight > 0.0 {
                        let row_ix = (row.rows[channel] + shift + width + layer) as usize;
                        let first = row_ix * N_AVERAGE_COLUMNS + N_INCLINATIONS;
                        let texels = &view.texels[first..first + N_FORWARD];
                        let entries = table.as_chunks_mut::<2>().0;
                        for ([a_f, beta_f_2], texel) in entries.iter_mut().zip(texels) {
                            a_f[channel] += weight * texel[0];
                            beta_f_2[channel] += weight * row.width_scale_2 * texel[1];
                        }
                    }
                }
            }
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::HairParams;
    use crate::dual_scattering::PaintedAverageTable;
    use crate::fresnel::Fresnel;

    #[test]
    fn forward_tables_are_samples_at_their_sines() {
        for n_scales in [1, 5] {
            let layers = [DEFAULT_AVERAGE_LAYERS, n_scales, n_scales];
            let averages =
                PaintedAverageTable::new(&HairParams::default(), Fresnel::Dielectric, layers);
            let view = averages.view();
            for (sigma_a, width, shift) in [
                ([0.0, 0.2, 60.0], 1.0, 1.0),
                ([0.03, 1.7, 0.4], 0.6, 1.9),
                ([9.0, 0.001, 3.0], 30.0, 0.01),
            ] {
                let row = average_row(view.decode, sigma_a, width, shift);
                let table = painted_forward_table(&view, &row);
                for (ix, [a_f, beta_f_2]) in table.as_chunks::<2>().0.iter().enumerate() {
                    let expected = sample_painted_forward(&view, &row, ix as f32 / LAST_FORWARD);
                    for c in 0..3 {
                        let pairs = [(a_f[c], expected.0[c]), (beta_f_2[c], expected.1[c])];
                        for (found, expected) in pairs {
                            let error = (found - expected).abs();
                            assert!(
                                error <= 1e-6 * expected.abs().max(1.0),
                                "{ix}: {found} {expected}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn absorption_of_a_layer_is_that_of_its_table() {
        let scales: Scales = std::array::from_fn(|layer| [1.0 / (1 + layer) as f32, 2.0]);
        for (pack, layers) in PACK_LAYERS.into_iter().enumerate() {
            for (ix, layer) in layers.into_iter().enumerate() {
                let at = layer_at(sigma_a_of(layer));
                assert!((at - layer as f32).abs() < 1e-3, "{layer} {at}");
                // The last is that of the next pack as well.
                let place = PackPlace::at(layer as f32, &scales, 0);
                let (pack, ix) = match ix {
                    2 if pack + 1 < N_PACKS => (pack + 1, 0),
                    _ => (pack, ix),
                };
                assert_eq!(place.pack, pack);
                for (other, weight) in place.weights.into_iter().enumerate() {
                    assert_eq!(weight, f32::from(u8::from(other == ix)), "{layer}");
                }
            }
        }
        let [first, .., last] = PACK_LAYERS;
        assert_eq!([first[0], last[2]], [0, N_LAYERS - 1]);
        assert_eq!(layer_at(0.0), 0.0);
        assert_eq!(layer_at(1e6), (N_LAYERS - 1) as f32);
    }

    #[test]
    fn parabolas_over_the_scale_are_exact() {
        let scale = |layer: f32| (4.0 + layer).recip();
        let scales: Scales = std::array::from_fn(|layer| [1.0, scale(layer as f32)]);
        let value = |layer: f32, scale: f32| (3.0 - 0.2 * layer + 0.01 * layer * layer) * scale;
        for step in 0..4 * (N_LAYERS - 1) {
            let layer = 0.25 * step as f32;
            let PackPlace { pack, weights } = PackPlace::at(layer, &scales, 1);
            let found: f32 = (PACK_LAYERS[pack].into_iter().zip(weights))
                .map(|(of, weight)| weight * value(of as f32, scales[of][1]))
                .sum();
            // Scales are interpolated linearly.
            let first = (layer as usize).min(N_LAYERS - 2);
            let (below, above) = (scales[first][1], scales[first + 1][1]);
            let expected = value(layer, below + (above - below) * (layer - first as f32));
            assert!((found / expected - 1.0).abs() < 1e-4, "{layer}");
        }
    }

    #[test]
    fn points_need_the_packs_of_their_channels() {
        // Beyond the first layer of a pack.
        let of = |packs: [usize; 3]| packs.map(|pack| sigma_a_of(PACK_LAYERS[pack][0]) + 1e-4);
        let fibre = Fibre {
            sigma_a: of([0, 1, 2]),
            ..bytemuck::Zeroable::zeroed()
        };
        let alone = PointPaint {
            dye: [0.0; 3],
            weight: 0.0,
            width_scale: 1.0,
            shift_scale: 1.0,
            around: None,
        };
        assert_eq!(packs_of(&fibre, &alone), 0b111);
        let paint = PointPaint {
            around: Some(of([0, 3, 6])),
            ..alone
        };
        assert_eq!(packs_of(&fibre, &paint), 0b100_1111);
        let tables = PaintedTables::default();
        assert_eq!(tables.missing(1 << 3), 1 << 3);
        assert!(tables.pack(3).is_none());
    }
}
