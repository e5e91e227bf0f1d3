//! Absorption and widths that vary from strand to strand.

use std::borrow::Cow;
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use strandlight_formats::{Groom, MAX_SCALE, MAX_SIGMA_A, MIN_SCALE, Scene, VariationSection};
use strandlight_scattering::color::redness_factors;

use super::locks::Locks;
use super::random::{Purpose, normal, root, strand_keys, uniform};
use crate::error::SceneError;
use crate::paint::{Paint, PaintedPoint};

/// Mean way of light through a fibre that it crosses at right angles, fibre radii.
const MEAN_CHORD: f64 = FRAC_PI_2;

/// What a strand has in place of the fibre of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
struct StrandFibre {
    /// Factors on sigma_a, linear RGB.
    absorption: [f64; 3],
    /// Factor on the widths beta of all modes.
    width_scale: f32,
}

/// The fibres of a groom's strands.
#[derive(Clone, Debug, PartialEq)]
pub struct FibreVariation {
    /// By strand of the groom.
    strands: Vec<StrandFibre>,
    /// First point of each strand, and their number at the end.
    offsets: Vec<u32>,
}

impl FibreVariation {
    /// Of the strands of `groom` as `section` has them; [`None`] where all have the fibre of the scene.
    ///
    /// With standard normal z_s of the strand and z_l of its lock, absorption is multiplied by
    /// `exp(s z_s + l z_l)`, s and l the amounts of melanin, and by [`redness_factors`] of such a
    /// sum; widths by `exp` of another. So the median fibre is that of the scene. Grey strands absorb
    /// nothing.
    pub fn new(section: &VariationSection, groom: &Groom) -> Option<FibreVariation> {
        let section = section.of_fibres();
        if !section.varies_fibres() {
            return None;
        }
        let locks = Locks::new(section.seed, section.lock_size_cm);
        let of_lock = [
            section.melanin_lock,
            section.redness_lock,
            section.roughness_lock,
        ];
        let has_locks = of_lock.iter().any(|&amount| amount > 0.0);
        let keys = strand_keys(groom, section.seed).into_iter().enumerate();
        let strands = keys.map(|(strand, key)| {
            let lock = match root(groom, strand) {
                Some(root) if has_locks => locks.key(locks.of(root).0),
                _ => 0,
            };
            let sum = |purpose, [of_strand, of_lock]: [f64; 2]| {
                // Numbers that do not count are not drawn.
                let part = |amount, key| match amount > 0.0 {
                    true => amount * normal(key, purpose),
                    false => 0.0,
                };
                part(of_strand, key) + part(of_lock, lock)
            };
            let melanin = [section.melanin_strand, section.melanin_lock];
            let redness = [section.redness_strand, section.redness_lock];
            let roughness = [section.roughness_strand, section.roughness_lock];
            let is_grey = section.grey > 0.0 && uniform(key, Purpose::Grey, 0) < section.grey;
            let pigment = match is_grey {
                true => 0.0,
                false => sum(Purpose::Melanin, melanin).exp(),
            };
            let width_scale = sum(Purpose::Roughness, roughness).exp() as f32;
            StrandFibre {
                absorption: redness_factors(sum(Purpose::Redness, redness)).map(|x| x * pigment),
                width_scale: width_scale.clamp(MIN_SCALE, MAX_SCALE),
            }
        });
        Some(FibreVariation {
            strands: strands.collect(),
            offsets: groom.strand_offsets.clone(),
        })
    }

    /// Absorption of the hair around any strand, of hair of absorption `sigma_a`; [`None`] where strands do not differ in it.
    ///
    /// Light meets many strands one after the other, so what they leave of it on the mean counts, as points have shares in
    /// them: that of a fibre whose attenuation over the mean way through one, pi/2 radii, is the mean of theirs.
    pub fn around(&self, sigma_a: [f64; 3]) -> Option<[f32; 3]> {
        let first = self.strands.first()?;
        let is_other = |strand: &StrandFibre| strand.absorption != first.absorption;
        if !self.strands.iter().any(is_other) {
            return None;
        }
        let mut left = [0.0; 3];
        for (strand, ends) in self.strands.iter().zip(self.offsets.windows(2)) {
            let n_points = f64::from(ends[1] - ends[0]);
            for c in 0..3 {
                left[c] += n_points * (-MEAN_CHORD * sigma_a[c] * strand.absorption[c]).exp();
            }
        }
        let n_points = f64::from(*self.offsets.last()?);
        let absorption = |left: f64| -(left / n_points).ln() / MEAN_CHORD;
        // Of strands that are all as black, what is left is nothing.
        let of = |left: f64| absorption(left).clamp(0.0, f64::from(MAX_SIGMA_A)) as f32;
        Some(left.map(of))
    }

    /// `paint` over this variation of hair of absorption `sigma_a`: as paint of hair of one fibre,
    /// which gives each point the fibre that it has. Widths of both are multiplied.
    ///
    /// # Errors
    /// `paint` of another number of points than the groom has.
    pub fn under(&self, sigma_a: [f64; 3], paint: Option<&Paint>) -> Result<Paint, SceneError> {
        let n_points = self.offsets.last().map_or(0, |&n| n as usize);
        let mut varied = Paint::unpainted(n_points);
        let around = self.around(sigma_a);
        self.lay_under((sigma_a, around), paint, 0..n_points, &mut varied)?;
        Ok(varied)
    }

    /// [`FibreVariation::under`] for the groom's points in `range`, into `varied`; `around` is that of `sigma_a`.
    ///
    /// # Errors
    /// `paint` or `varied` of another number of points than the groom has.
    pub fn lay_under(
        &self,
        (sigma_a, around): ([f64; 3], Option<[f32; 3]>),
        paint: Option<&Paint>,
        range: Range<usize>,
        varied: &mut Paint,
    ) -> Result<(), SceneError> {
        let n_points = self.offsets.last().map_or(0, |&n| n as usize);
        let n_painted = paint.map_or(n_points, |paint| paint.points.len());
        if n_painted != n_points || varied.points.len() != n_points {
            return Err(SceneError::Offsets);
        }
        let range = range.start.min(n_points)..range.end.min(n_points);
        let first = self
            .offsets
            .partition_point(|&end| end as usize <= range.start);
        for strand in first.saturating_sub(1)..self.strands.len() {
            let [start, end] = [self.offsets[strand], self.offsets[strand + 1]].map(|x| x as usize);
            if start >= range.end {
                break;
            }
            let fibre = &self.strands[strand];
            let own: [f32; 3] = std::array::from_fn(|c| {
                let sigma_a = sigma_a[c] * fibre.absorption[c];
                sigma_a.min(f64::from(MAX_SIGMA_A)) as f32
            });
            for ix in start.max(range.start)..end.min(range.end) {
                let over = paint.map_or(PaintedPoint::NONE, |paint| paint.points[ix]);
                let over_fibre = |fibre: [f32; 3]| {
                    [0, 1, 2]
                        .map(|c| (1.0 - over.weight) * fibre[c] + over.weight * over.sigma_a[c])
                };
                let (sigma_a, weight) = match fibre.absorption == [1.0; 3] {
                    true => (over.sigma_a, over.weight),
                    false => (over_fibre(own), 1.0),
                };
                varied.points[ix] = PaintedPoint {
                    sigma_a,
                    weight,
                    width_scale: (over.width_scale * fibre.width_scale).clamp(MIN_SCALE, MAX_SCALE),
                    shift_scale: over.shift_scale,
                    around: around.map(over_fibre),
                };
            }
        }
        Ok(())
    }
}

/// What the points of `groom` are painted with in `scene`: `paint` over the variation of its strands, or
/// `paint` where they do not vary.
///
/// # Errors
/// `paint` of another number of points than the groom has.
pub fn varied_paint<'a>(
    scene: &Scene,
    groom: &Groom,
    paint: Option<&'a Paint>,
) -> Result<Option<Cow<'a, Paint>>, SceneError> {
    match FibreVariation::new(&scene.variation, groom) {
        Some(fibres) => {
            let varied = fibres.under(scene.hair.params().sigma_a, paint)?;
            Ok(Some(Cow::Owned(varied)))
        }
        None => Ok(paint.filter(|paint| paint.is_painted()).map(Cow::Borrowed)),
    }
}
