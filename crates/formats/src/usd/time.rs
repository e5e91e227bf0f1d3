//! Values at a moment: USD's value resolution of one layer.

use super::layer::Layer;
use super::model::{Numbers, Property, Real, Value};
use crate::error::Result;

/// When values are asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Moment {
    /// Nothing moves: defaults, or else the first samples.
    Default,
    /// A time code.
    Code(f64),
}

/// Times of the samples of `property`.
pub(super) fn samples_of(property: Option<&Property>) -> impl Iterator<Item = f64> {
    let samples = property.map_or(&[][..], |property| &property.samples);
    samples.iter().map(|(time, _)| *time)
}

/// A value, or two with the share of the second.
enum At<'a> {
    One(&'a Value),
    Between(&'a Value, &'a Value, f64),
}

impl Moment {
    /// What `property` has then; samples, where there are any, hide the default.
    fn find(self, property: &Property) -> Option<At<'_>> {
        let samples = &property.samples;
        let Moment::Code(time) = self else {
            let first = samples.first().map(|(_, value)| value);
            return first.or(property.default.as_ref()).map(At::One);
        };
        let after = samples.partition_point(|(sample, _)| *sample <= time);
        match (
            after.checked_sub(1).map(|ix| &samples[ix]),
            samples.get(after),
        ) {
            (None, None) => property.default.as_ref().map(At::One),
            (None, Some((_, value))) | (Some((_, value)), None) => Some(At::One(value)),
            (Some((a, value)), Some(_)) if *a == time => Some(At::One(value)),
            (Some((a, before)), Some((b, after))) => {
                Some(At::Between(before, after, (time - a) / (b - a)))
            }
        }
    }

    /// The numbers of `property`, interpolated linearly; held where the numbers of values differ or
    /// the next is blocked. `None` where there are none.
    pub fn numbers<T: Real + Into<f64>>(
        self,
        layer: &Layer,
        property: &Property,
    ) -> Result<Option<Numbers<T>>> {
        Ok(match self.find(property) {
            None => None,
            Some(At::One(value)) => layer.numbers(value)?,
            Some(At::Between(before, after, t)) => {
                let Some(mut before) = layer.numbers::<T>(before)? else {
                    return Ok(None);
                };
                let after = layer.numbers::<T>(after)?;
                let after = after.filter(|after| after.data.len() == before.data.len());
                for (a, b) in before
                    .data
                    .iter_mut()
                    .zip(after.iter().flat_map(|n| &n.data))
                {
                    let (from, to): (f64, f64) = ((*a).into(), (*b).into());
                    *a = T::from_f64((1.0 - t) * from + t * to);
                }
                Some(before)
            }
        })
    }

    /// The integers of `property`, which are held from sample to sample.
    pub fn held(self, layer: &Layer, property: &Property) -> Result<Option<Numbers<f64>>> {
        match self.find(property) {
            None => Ok(None),
            Some(At::One(value) | At::Between(value, ..)) => layer.numbers(value),
        }
    }

    /// The numbers of a transform; quaternions turn evenly.
    pub fn transform(
        self,
        layer: &Layer,
        property: &Property,
        is_quaternion: bool,
    ) -> Result<Option<Vec<f64>>> {
        if is_quaternion && let Some(At::Between(before, after, t)) = self.find(property) {
            let before = layer.numbers::<f64>(before)?.map(|numbers| numbers.data);
            let after = layer.numbers::<f64>(after)?.map(|numbers| numbers.data);
            return Ok(match (before.as_deref(), after.as_deref()) {
                (Some(&[a, b, c, d]), Some(&[e, f, g, h])) => {
                    Some(slerp([a, b, c, d], [e, f, g, h], t).to_vec())
                }
                _ => before,
            });
        }
        Ok(self
            .numbers::<f64>(layer, property)?
            .map(|numbers| numbers.data))
    }
}

/// Spherical linear interpolation (Shoemake 1985), the shorter way.
fn slerp(a: [f64; 4], b: [f64; 4], t: f64) -> [f64; 4] {
    let dot: f64 = (0..4).map(|ix| a[ix] * b[ix]).sum();
    let (dot, sign) = if dot < 0.0 { (-dot, -1.0) } else { (dot, 1.0) };
    // Nearly equal ones: linearly, since the sines vanish.
    let (from, to) = if dot > 1.0 - 1e-5 {
        (1.0 - t, t)
    } else {
        let angle = dot.acos();
        let weight = |share: f64| (share * angle).sin() / angle.sin();
        (weight(1.0 - t), weight(t))
    };
    [0, 1, 2, 3].map(|ix| from * a[ix] + sign * to * b[ix])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_turn_evenly() {
        let half = 0.5f64.sqrt();
        let between = slerp([1.0, 0.0, 0.0, 0.0], [half, 0.0, 0.0, half], 1.0 / 3.0);
        let (sin, cos) = 15.0f64.to_radians().sin_cos();
        assert!((between[0] - cos).abs() < 1e-12 && (between[3] - sin).abs() < 1e-12);
        let same = slerp([1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], 0.5);
        assert_eq!(same[0], 1.0);
    }
}
