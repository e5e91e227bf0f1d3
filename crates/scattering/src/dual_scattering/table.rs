//! The averages over 128 inclinations, as the renderer samples them: what an edit makes.
//!
//! `q_f` and `q_b` of each mode ([`AzimuthRule`]) on 65 columns over cos(theta_d), then
//! 128 x 3 integrals over theta_o of 16 nodes each, with q interpolated by cubics.
//!
//! Largest errors against [`super::event()`] where at least 1e-3 of the largest attenuation is
//! left, of the largest value (example `averages`, 24 fibres):
//!
//! | | at the rows | between, by [`AverageTable::sample`] |
//! |---|---|---|
//! | hair: eta 1.55, sigma_a 0.01..6, beta_R 0.1..0.3 | 8e-6 | median 1e-3, largest 5e-3 (A_b, grazing) |
//! | any valid fibre | 1.4e-3 | median 5e-3; 0.1 where lobes of a width below the rows' distance leave past the ends |

use std::f64::consts::PI;

use super::Average;
use super::azimuth::{AzimuthRule, Halves};
use super::backscatter::{Backscatter, all_orders};
use super::event::{BREATH, Event, event_of_modes};
use super::longitudinal::{full_angle, outgoing};
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe, Model};
use crate::jobs::{self, Job, in_turn};
use crate::quadrature::GaussLegendre;

/// Inclinations of a table, evenly over -pi/2..=pi/2, ends included (Xu 2011 section 5: 128).
pub const N_INCLINATIONS: usize = 128;

/// Columns over cos(theta_d), evenly in `asinh(c / k)`, `k = sqrt(eta^2 - 1)` and at least this:
/// the Fresnel term turns at k, and absorption goes with ln c above it.
pub(super) const N_COLUMNS: usize = 65;
pub(super) const K_MIN: f64 = 0.02;
/// Nodes over half the fibre's width; half angles of an elliptic fibre.
pub(super) const N_OFFSETS: usize = 20;
pub(super) const N_TURNS: usize = 6;
/// Nodes over theta_o, and where M_t is cut off: erfc(3.5) = 7e-7.
pub(super) const N_OUTGOING: usize = 16;
pub(super) const REACH: f64 = 3.5;
/// Columns or rows that one job finds: some ten microseconds of work.
const IN_A_JOB: usize = 4;

/// All averages of one fibre over the incident inclination.
#[derive(Clone, Debug, PartialEq)]
pub struct AverageTable {
    /// The fibre model: the form of the lobes whose shifts and widths these are.
    pub model: Model,
    /// `[inclination][column][channel]`, linear RGB; row `ix` is at `theta = pi (ix / 127 - 1/2)`,
    /// columns in the order of [`Average::ALL`], with `beta_f^2` and `beta_b^2` for widths of one
    /// event.
    pub rows: Vec<[[f32; 3]; Average::ALL.len()]>,
}

/// Where the columns over cos(theta_d) stand, and how they are interpolated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taps {
    k: f64,
    length: f64,
    /// `1 / k`, and columns per unit of asinh.
    scale: [f64; 2],
}

impl Taps {
    /// [`N_COLUMNS`] columns for index `eta`.
    pub fn new(eta: f64) -> Taps {
        let k = ((eta - 1.0) * (eta + 1.0)).max(0.0).sqrt().max(K_MIN);
        let last = (N_COLUMNS - 1) as f64;
        let length = k.recip().asinh();
        Taps {
            k,
            length,
            scale: [k.recip(), last / length],
        }
    }

    /// cos(theta_d) of a column.
    pub fn cos_theta_d(&self, ix: usize) -> f64 {
        let last = (N_COLUMNS - 1) as f64;
        self.k * (self.length * ix as f64 / last).sinh()
    }

    /// The column left of `cos_theta_d` in 0..=1, the first of four, and the weights of the cubic
    /// through those.
    pub fn at(&self, cos_theta_d: f64) -> (usize, usize, [f64; 4]) {
        let c = self.scale[0] * cos_theta_d;
        let x = self.scale[1] * (c + (c * c + 1.0).sqrt()).ln();
        let left = (x as usize).min(N_COLUMNS - 2);
        let first = left.clamp(1, N_COLUMNS - 3) - 1;
        let t = x - first as f64;
        let (a, b, c, d) = (t, t - 1.0, t - 2.0, t - 3.0);
        let cubic = [
            b * c * d / -6.0,
            a * c * d / 2.0,
            a * b * d / -2.0,
            a * b * c / 6.0,
        ];
        (left, first, cubic)
    }
}

/// `q_f` per channel, then `q_b`, over the columns of one mode.
struct Columns {
    taps: Taps,
    values: Vec<[f64; 6]>,
}

impl Columns {
    /// Of all modes.
    fn of_modes(azimuth: &AzimuthRule, eta: f64, run: impl FnOnce(Vec<Job>)) -> [Columns; 3] {
        let taps = Taps::new(eta);
        let value = |ix: usize| {
            let lobe = Lobe::ALL[ix / N_COLUMNS];
            let cos_theta_d = taps.cos_theta_d(ix % N_COLUMNS);
            let Halves { forward, backward } = azimuth.halves(lobe, cos_theta_d);
            let [a, b, c] = forward;
            let [d, e, f] = backward;
            [a, b, c, d, e, f]
        };
        let mut values = vec![[0.0; 6]; Lobe::ALL.len() * N_COLUMNS];
        jobs::fill(&mut values, IN_A_JOB, value, run);
        std::array::from_fn(|mode| Columns {
            taps,
            values: values[mode * N_COLUMNS..][..N_COLUMNS].to_vec(),
        })
    }

    /// Adds `weight` times the values at `cos_theta_d` in 0..=1: the cubic through four columns,
    /// kept near its neighbours where they fall by orders of magnitude.
    fn add(&self, cos_theta_d: f64, weight: f64, sums: &mut [f64; 6]) {
        let (left, first, cubic) = self.taps.at(cos_theta_d);
        let rows = &self.values[first..first + 4];
        let (low, high) = (&self.values[left], &self.values[left + 1]);
        for i in 0..6 {
            let mut value = 0.0;
            for (row, share) in rows.iter().zip(cubic) {
                value += share * row[i];
            }
            let (least, most) = (low[i].min(high[i]), low[i].max(high[i]));
            sums[i] += weight * value.max(0.5 * least).min(2.0 * most);
        }
    }
}

/// [`super::event()`] at many inclinations, fast.
struct FastEvents<'a> {
    hair: &'a HairParams,
    columns: [Columns; 3],
    rule: GaussLegendre,
}

impl FastEvents<'_> {
    fn new(hair: &HairParams, fresnel: Fresnel, run: impl FnOnce(Vec<Job>)) -> FastEvents<'_> {
        let azimuth = AzimuthRule::new(hair, fresnel, N_OFFSETS, N_TURNS);
        FastEvents {
            hair,
            columns: Columns::of_modes(&azimuth, hair.eta, run),
            rule: GaussLegendre::new(N_OUTGOING),
        }
    }

    fn at(&self, theta: f64) -> Event {
        let mut modes = [Halves::default(); 3];
        for ((lobe, columns), mode) in Lobe::ALL.into_iter().zip(&self.columns).zip(&mut modes) {
            let (shift, width) = full_angle(self.hair, lobe);
            let mut sums = [0.0; 6];
            for node in outgoing(theta, shift, width, REACH, f64::INFINITY, &self.rule) {
                columns.add(node.cos_theta_d, node.weight, &mut sums);
            }
            columns.add(theta.cos(), BREATH, &mut sums);
            let [a, b, c, d, e, f] = sums;
            *mode = Halves {
                forward: [a, b, c],
                backward: [d, e, f],
            };
        }
        event_of_modes(self.hair, &modes)
    }
}

impl AverageTable {
    /// The table of `hair` (valid, see [`HairParams::validate`]).
    ///
    /// 0.8 ms on one core, 1.7 of an elliptic fibre (example `averages`).
    pub fn new(hair: &HairParams, fresnel: Fresnel) -> AverageTable {
        AverageTable::with(hair, fresnel, in_turn)
    }

    /// [`AverageTable::new`] by jobs. `run` has to run all of them, in any order, on as many threads as it likes; the
    /// table is the same to the bit.
    #[doc(hidden)]
    pub fn with(hair: &HairParams, fresnel: Fresnel, run: impl Fn(Vec<Job>)) -> AverageTable {
        let theta = |ix| PI * (ix as f64 / (N_INCLINATIONS - 1) as f64 - 0.5);
        if hair.model == Model::Energy {
            return AverageTable::of_energy(hair, fresnel, theta);
        }
        let events = FastEvents::new(hair, fresnel, &run);
        let row_at = |ix| {
            let event = events.at(theta(ix));
            row(&event, &all_orders(&event))
        };
        let mut rows = vec![[[0.0; 3]; Average::ALL.len()]; N_INCLINATIONS];
        jobs::fill(&mut rows, IN_A_JOB, row_at, &run);
        AverageTable {
            model: hair.model,
            rows,
        }
    }

    /// [`AverageTable::new`] of model `energy`, for which q at the inclination itself is all: even in it.
    fn of_energy(
        hair: &HairParams,
        fresnel: Fresnel,
        theta: impl Fn(usize) -> f64,
    ) -> AverageTable {
        let azimuth = AzimuthRule::new(hair, fresnel, N_OFFSETS, N_TURNS);
        let below = (0..N_INCLINATIONS / 2).map(|ix| {
            let modes = Lobe::ALL.map(|lobe| azimuth.halves(lobe, theta(ix).cos()));
            let event = event_of_modes(hair, &modes);
            row(&event, &all_orders(&event))
        });
        let below: Vec<_> = below.collect();
        let above = below.iter().rev().copied();
        AverageTable {
            model: hair.model,
            rows: below.iter().copied().chain(above).collect(),
        }
    }

    /// All columns at incident inclination `theta` in +-pi/2, by linear interpolation in single
    /// precision; beyond the ends the ends.
    pub fn sample(&self, theta: f32) -> [[f32; 3]; Average::ALL.len()] {
        let last = (N_INCLINATIONS - 1) as f32;
        let x = ((theta / std::f32::consts::PI + 0.5) * last).clamp(0.0, last);
        let ix = (x as usize).min(N_INCLINATIONS - 2);
        let t = x - ix as f32;
        let (a, b) = (&self.rows[ix], &self.rows[ix + 1]);
        std::array::from_fn(|q| std::array::from_fn(|c| (1.0 - t) * a[q][c] + t * b[q][c]))
    }

    /// One average at `theta`, see [`AverageTable::sample`]; widths as widths.
    pub fn get(&self, average: Average, theta: f32) -> [f32; 3] {
        let value = self.sample(theta)[average as usize];
        match average {
            Average::BetaF | Average::BetaB => value.map(f32::sqrt),
            _ => value,
        }
    }
}

/// The columns of one inclination.
fn row(event: &Event, backscatter: &Backscatter) -> [[f32; 3]; Average::ALL.len()] {
    Average::ALL.map(|average| {
        let value = match average {
            Average::BetaF => event.forward.width_2,
            Average::BetaB => event.backward.width_2,
            _ => average.of(event, backscatter),
        };
        value.map(|value| value as f32)
    })
}

#[cfg(test)]
mod tests {
    use super::super::event;
    use super::*;
    use crate::hair::PerLobe;

    const FRESNEL: Fresnel = Fresnel::Dielectric;

    fn theta_of(row: usize) -> f64 {
        PI * (row as f64 / (N_INCLINATIONS - 1) as f64 - 0.5)
    }

    /// Largest error of each average at `rows`, of its largest value there.
    fn errors(hair: &HairParams, rows: &[usize]) -> [f64; 9] {
        let table = AverageTable::new(hair, FRESNEL);
        let (mut worst, mut peak) = ([0.0f64; 9], [0.0f64; 9]);
        for &ix in rows {
            let event = event(theta_of(ix), hair, FRESNEL);
            let expected = row(&event, &all_orders(&event));
            for (q, (found, expected)) in table.rows[ix].iter().zip(&expected).enumerate() {
                for (found, expected) in found.iter().zip(expected) {
                    worst[q] = worst[q].max(f64::from(found - expected).abs());
                    peak[q] = peak[q].max(f64::from(expected.abs()));
                }
            }
        }
        std::array::from_fn(|q| worst[q] / peak[q])
    }

    #[test]
    fn rows_are_those_of_the_quadrature() {
        let blond = HairParams {
            sigma_a: [0.0, 0.05, 0.15],
            ..HairParams::default()
        };
        for hair in [HairParams::default(), blond] {
            for (rows, limit) in [(&[3, 40, 63, 90, 120][..], 2e-5), (&[0, 127], 5e-4)] {
                let found = errors(&hair, rows);
                println!("{found:?}");
                assert!(found.iter().all(|&error| error < limit), "{found:?}");
            }
        }
        let elliptic = HairParams {
            eccentricity: 0.8,
            ..blond
        };
        let found = errors(&elliptic, &[3, 63, 120]);
        println!("elliptic: {found:?}");
        assert!(found.iter().all(|&error| error < 1e-3), "{found:?}");
        // An index near 1 and much absorption; narrow lobes.
        let odd = HairParams {
            eta: 1.0002,
            sigma_a: [0.3, 1.2, 6.0],
            width: PerLobe {
                r: 0.3,
                tt: 0.01,
                trt: 1.0,
            },
            ..HairParams::default()
        };
        let found = errors(&odd, &[3, 30, 63, 120]);
        println!("odd: {found:?}");
        assert!(found.iter().all(|&error| error < 1e-3), "{found:?}");
    }

    #[test]
    fn samples_lie_on_and_between_rows() {
        let table = AverageTable::new(&HairParams::default(), FRESNEL);
        for ix in [0, 1, 77, 126, 127] {
            let found = table.sample(theta_of(ix) as f32);
            for (found, expected) in found.iter().zip(&table.rows[ix]) {
                let error = (found[1] - expected[1]).abs();
                assert!(error < 1e-5 * (1.0 + expected[1].abs()), "{ix} {error}");
            }
        }
        let middle = (0.5 * (theta_of(30) + theta_of(31))) as f32;
        let found = table.get(Average::AF, middle)[2];
        let expected = 0.5 * (table.rows[30][0][2] + table.rows[31][0][2]);
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        let width_2 = table.sample(0.3)[Average::BetaB as usize][0];
        assert_eq!(table.get(Average::BetaB, 0.3)[0], width_2.sqrt());
        for theta in [f32::NEG_INFINITY, -9.0, 9.0] {
            let end = if theta < 0.0 { 0 } else { 127 };
            assert_eq!(table.sample(theta), table.rows[end]);
        }
    }

    #[test]
    fn every_fibre_is_finite_and_keeps_energy() {
        let mut n = 0;
        for eta in [1.0001, 1.3, 1.55, 3.0] {
            for sigma in [0.0, 0.1, 50.0] {
                for width in [0.001, 0.2, 1.5] {
                    for shift in [-0.5, 0.0, 0.5] {
                        let hair = HairParams {
                            eta,
                            sigma_a: [0.0, sigma, 50.0],
                            shift: PerLobe {
                                r: shift,
                                tt: shift,
                                trt: -shift,
                            },
                            width: PerLobe {
                                r: width,
                                tt: width,
                                trt: width,
                            },
                            caustic_width: 0.01,
                            eccentricity: if shift == 0.5 { 2.0 } else { 1.0 },
                            ..HairParams::default()
                        };
                        let table = AverageTable::new(&hair, FRESNEL);
                        for row in &table.rows {
                            for c in 0..3 {
                                let [a_f, a_b, _, _, _, _, many, _, _] = row.map(|rgb| rgb[c]);
                                assert!(row.iter().all(|rgb| rgb[c].is_finite()), "{hair:?}");
                                let sum = a_f + a_b;
                                assert!((0.0..1.0 + 1e-5).contains(&sum), "{hair:?} {sum}");
                                assert!(many >= 0.0 && many + a_b < 1.0 + 1e-5, "{hair:?}");
                                n += 1;
                            }
                        }
                    }
                }
            }
        }
        assert_eq!(n, 4 * 3 * 3 * 3 * 128 * 3);
    }
}
