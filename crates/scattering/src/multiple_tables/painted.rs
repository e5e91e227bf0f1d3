//! Tables for painted points, whose fibres differ in absorption.
//!
//! Multiple scattering of a channel depends on the absorption of that channel alone, so the three channels of a
//! [`MultipleTables`] are as good as three layers of absorption. Between layers values are interpolated; those of a pack
//! overlap with those of the next in one, so any two neighbours are in one pack, and only packs that points need are filled.
//!
//! `crates/scene/tests/painted_tables.rs` has their errors against the closed form.

use crate::closed_form::{
    AverageRow, AverageTexel, Fibre, ForwardTable, LAST_FORWARD, LAYER_MIDDLE, LocalAverages,
    N_AVERAGE_COLUMNS, N_FORWARD, PaintedAveragesView, PaintedPointAverages, PaintedViews,
    PointPaint, SampleAverages, average_row, painted_shading, sample_painted_forward,
};
use crate::dual_scattering::{DEFAULT_AVERAGE_LAYERS, N_INCLINATIONS};
use crate::hair::Parameter;
use crate::jobs::Job;

use super::MultipleTables;

/// Layers, which are those of the averages.
const N_LAYERS: usize = DEFAULT_AVERAGE_LAYERS;

/// Packs of three layers each.
pub const N_PACKS: usize = N_LAYERS / 2;

const _: () = assert!(2 * N_PACKS >= N_LAYERS);

/// Which packs, a bit each.
pub type Packs = u32;

const _: () = assert!(N_PACKS <= Packs::BITS as usize);

/// Where the absorption of a channel stands among the layers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LayerPlace {
    /// Which pack.
    pub pack: usize,
    /// Which of its layers is the lower of two neighbours, 0 or 1.
    pub lower: usize,
    /// How far it is on the way from there to the next, 0..=1.
    pub fraction: f32,
}

/// Where a painted point stands among the layers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaintedPlaces {
    /// By its own absorption, which global scattering follows.
    pub own: [LayerPlace; 3],
    /// By that of the hair around it, which sends light back.
    pub around: [LayerPlace; 3],
}

/// Multiple scattering of painted points whose widths and shifts are those of the scene's fibre.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PaintedTables {
    packs: [Option<Box<MultipleTables>>; N_PACKS],
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

/// Absorption of a layer; the last pack has the last one twice.
fn sigma_a_of(layer: usize) -> f32 {
    let layer = layer.min(N_LAYERS - 1);
    let place = last_place() * layer as f32 / (N_LAYERS - 1) as f32;
    LAYER_MIDDLE * place * place / (1.0 - place * place)
}

impl LayerPlace {
    /// Of absorption `sigma_a` >= 0 of one channel, per fibre radius.
    #[inline]
    pub fn of(sigma_a: f32) -> LayerPlace {
        let last = (N_LAYERS - 1) as f32;
        let at = (place(sigma_a) * (last / last_place())).clamp(0.0, last);
        let first = at.floor().min(last - 1.0);
        LayerPlace {
            pack: first as usize / 2,
            lower: first as usize % 2,
            fraction: at - first,
        }
    }
}

impl PaintedPlaces {
    /// Of a point of this `fibre` ([`crate::closed_form::painted_fibre`]'s).
    #[inline]
    pub fn of(fibre: &Fibre, paint: &PointPaint) -> PaintedPlaces {
        let own = fibre.sigma_a.map(LayerPlace::of);
        PaintedPlaces {
            own,
            around: paint
                .around
                .map_or(own, |around| around.map(LayerPlace::of)),
        }
    }

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
        packs & !self.filled()
    }

    /// Those that are there.
    pub fn filled(&self) -> Packs {
        let packs = self.packs.iter().enumerate();
        packs.fold(0, |filled, (pack, tables)| {
            filled | Packs::from(tables.is_some()) << pack
        })
    }

    /// Drops all but those of `packs`.
    pub fn keep(&mut self, packs: Packs) {
        for (pack, tables) in self.packs.iter_mut().enumerate() {
            tables.take_if(|_| packs & 1 << pack == 0);
        }
    }

    /// Fills a pack of the hair of `views`, for `terms` as [`MultipleTables::new`]. `run` has to run all jobs.
    pub fn fill(&mut self, pack: usize, views: &PaintedViews, terms: u32, run: impl Fn(Vec<Job>)) {
        let fibre = Fibre {
            sigma_a: [0, 1, 2].map(|layer| sigma_a_of(2 * pack + layer)),
            ..views.hair.fibre
        };
        let averages = average_texels(&unscaled(views.averages, &fibre));
        let shading = painted_shading(views, &fibre);
        let tables = MultipleTables::new(&shading, &averages, terms, run);
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
    fn layers_stand_where_their_absorption_is() {
        for layer in 0..N_LAYERS {
            let LayerPlace {
                pack,
                lower,
                fraction,
            } = LayerPlace::of(sigma_a_of(layer));
            let at = (2 * pack + lower) as f32 + fraction;
            assert!((at - layer as f32).abs() < 1e-3, "{layer} {at}");
        }
        let none = LayerPlace::of(0.0);
        assert_eq!(none, LayerPlace::default());
        let beyond = LayerPlace::of(1e6);
        assert_eq!([beyond.pack, beyond.lower], [N_PACKS - 1, 0]);
        assert!(beyond.fraction == 1.0);
    }

    #[test]
    fn points_need_the_packs_of_their_channels() {
        let place = |pack| LayerPlace {
            pack,
            ..LayerPlace::default()
        };
        let places = PaintedPlaces {
            own: [place(0), place(3), place(3)],
            around: [place(0), place(5), place(15)],
        };
        assert_eq!(places.packs(), 1 | 1 << 3 | 1 << 5 | 1 << 15);
        let tables = PaintedTables::default();
        assert_eq!(tables.missing(places.packs()), places.packs());
        assert!(tables.pack(3).is_none());
    }
}
