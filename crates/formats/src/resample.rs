//! Strands with other points on the same lines: an equal number for all, or as few as an error
//! allows.

use crate::attribute_names::known_attribute;
use crate::error::{Error, Result};
use crate::groom::{Attribute, Domain, Groom};
use crate::paint::PAINT_ATTRIBUTES;
use crate::validate::in_range;

/// Most points of a strand that [`Groom::resampled`] makes.
const MAX_POINTS_PER_STRAND: u32 = 65_536;

/// Largest error of widths and paint that [`Groom::simplified`] leaves, a share of the largest value in
/// the groom.
const MAX_VALUE_ERROR: f64 = 0.05;

/// A point on the polyline of a strand: between two points that follow each other, or one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pick {
    /// Index into the points of the groom.
    from: u32,
    /// How far towards the next, 0..1.
    t: f32,
}

impl Groom {
    /// Every strand with `points_per_strand` points at equal distances along it, root and tip where
    /// they were. Corners between the new points are cut.
    ///
    /// Point attributes are interpolated; integers (`id`, `group_id`, ...) are those of the
    /// nearest point. Strand and groom attributes and the source stay.
    ///
    /// # Errors
    /// `Value` where `points_per_strand` is outside 2..=65536, the points in all are no u32, or the
    /// groom breaks a promise.
    pub fn resampled(&self, points_per_strand: u32) -> Result<Groom> {
        self.validate()?;
        let (n, most) = (
            f64::from(points_per_strand),
            f64::from(MAX_POINTS_PER_STRAND),
        );
        in_range("points per strand", n, 2.0, most)?;
        let total = self.n_strands() as u64 * u64::from(points_per_strand);
        if total > u64::from(u32::MAX) {
            let range = format!("at most {}", u32::MAX);
            return Err(Error::value("number of points", total, range));
        }
        let mut picks = Vec::with_capacity(total as usize);
        let mut along = Vec::new();
        for strand in 0..self.n_strands() {
            self.add_even_picks(strand, points_per_strand, &mut along, &mut picks);
        }
        let offsets = (0..=self.n_strands() as u32).map(|ix| ix * points_per_strand);
        Ok(self.picked(&picks, offsets.collect()))
    }

    /// Every strand with as few of its own points as keep the others within `max_error_cm` of its
    /// line (Douglas and Peucker 1973); root and tip always stay. So do points where `diameter`, `dye`,
    /// `width_scale` or `shift_scale` is off the line between the points that stay by more than 5 % of its
    /// largest value in the groom. Point attributes are those of the points that stay. The time is
    /// quadratic in the points of a strand at worst.
    ///
    /// # Errors
    /// `Value` where `max_error_cm` is negative or no number, or the groom breaks a promise.
    pub fn simplified(&self, max_error_cm: f32) -> Result<Groom> {
        self.validate()?;
        if !(max_error_cm.is_finite() && max_error_cm >= 0.0) {
            return Err(Error::value(
                "largest error (cm)",
                max_error_cm,
                "finite and 0 or more",
            ));
        }
        let drawn = self.attributes.iter().flat_map(Drawn::of);
        let drawn: Vec<Drawn> = drawn.collect();
        let mut picks = Vec::new();
        let mut offsets = vec![0];
        let mut keeps = Vec::new();
        for strand in 0..self.n_strands() {
            let range = self.strand(strand);
            self.mark_kept(strand, f64::from(max_error_cm), &drawn, &mut keeps);
            let kept = range.zip(&keeps).filter(|(_, keep)| **keep);
            picks.extend(kept.map(|(ix, _)| Pick {
                from: ix as u32,
                t: 0.0,
            }));
            // No more than the groom has.
            offsets.push(picks.len() as u32);
        }
        Ok(self.picked(&picks, offsets))
    }

    /// Appends `n` points at equal distances along `strand`; `along` is room to work in.
    fn add_even_picks(&self, strand: usize, n: u32, along: &mut Vec<f64>, picks: &mut Vec<Pick>) {
        let range = self.strand(strand);
        let points = &self.points[range.clone()];
        along.clear();
        along.push(0.0);
        let mut length = 0.0;
        for pair in points.windows(2) {
            length += distance(pair[0], pair[1]);
            along.push(length);
        }
        let last = points.len() - 1;
        let mut segment = 0;
        for ix in 0..n {
            let pick = match ix {
                0 => (0, 0.0),
                ix if ix == n - 1 => (last, 0.0),
                _ => {
                    let wanted = length * f64::from(ix) / f64::from(n - 1);
                    while segment + 1 < last && along[segment + 1] < wanted {
                        segment += 1;
                    }
                    let step = along[segment + 1] - along[segment];
                    let t = match step > 0.0 {
                        true => (wanted - along[segment]) / step,
                        false => 0.0,
                    };
                    (segment, t.clamp(0.0, 1.0) as f32)
                }
            };
            picks.push(Pick {
                from: (range.start + pick.0) as u32,
                t: pick.1,
            });
        }
    }

    /// The groom of these points.
    fn picked(&self, picks: &[Pick], strand_offsets: Vec<u32>) -> Groom {
        let points = picks.iter().map(|pick| {
            let from = self.points[pick.from as usize];
            match pick.t {
                0.0 => from,
                _ => {
                    let to = self.points[pick.from as usize + 1];
                    [0, 1, 2].map(|axis| pick.between(from[axis], to[axis]))
                }
            }
        });
        let attributes = self.attributes.iter().map(|attribute| Attribute {
            data: match attribute.domain {
                Domain::Groom | Domain::Strand => attribute.data.clone(),
                Domain::Point => picked_values(attribute, picks),
            },
            ..attribute.clone_empty()
        });
        Groom {
            points: points.collect(),
            strand_offsets,
            attributes: attributes.collect(),
            source: self.source.clone(),
        }
    }
}

impl Pick {
    /// The value between those of the two points; never outside them.
    fn between(self, from: f32, to: f32) -> f32 {
        let t = f64::from(self.t);
        ((1.0 - t) * f64::from(from) + t * f64::from(to)) as f32
    }
}

impl Attribute {
    /// The same without values.
    fn clone_empty(&self) -> Attribute {
        Attribute {
            name: self.name.clone(),
            domain: self.domain,
            components: self.components,
            data: Vec::new(),
        }
    }
}

fn picked_values(attribute: &Attribute, picks: &[Pick]) -> Vec<f32> {
    let n = attribute.components as usize;
    let is_integer = known_attribute(&attribute.name).is_some_and(|known| known.is_integer);
    let mut data = Vec::with_capacity(picks.len() * n);
    for &pick in picks {
        let at = pick.from as usize * n;
        let from = &attribute.data[at..at + n];
        match pick.t {
            0.0 => data.extend(from),
            t => {
                let to = &attribute.data[at + n..at + 2 * n];
                let value = |(&from, &to): (&f32, &f32)| match is_integer {
                    true if t < 0.5 => from,
                    true => to,
                    false => pick.between(from, to),
                };
                data.extend(from.iter().zip(to).map(value));
            }
        }
    }
    data
}

/// A component of a width or of paint along the strands.
struct Drawn<'a> {
    /// Values of all components.
    data: &'a [f32],
    n_components: usize,
    component: usize,
    max_error: f64,
}

impl<'a> Drawn<'a> {
    /// The components of `attribute`; none where it does not vary along strands or is not drawn.
    fn of(attribute: &'a Attribute) -> Vec<Drawn<'a>> {
        let is_paint = PAINT_ATTRIBUTES
            .iter()
            .any(|(name, _)| *name == attribute.name);
        if attribute.domain != Domain::Point || !(is_paint || attribute.name == "diameter") {
            return Vec::new();
        }
        let n_components = attribute.components as usize;
        let one = |component| {
            let values = attribute.data.iter().skip(component).step_by(n_components);
            let largest = values.fold(0.0, |largest: f32, value| largest.max(value.abs()));
            Drawn {
                data: &attribute.data,
                n_components,
                component,
                max_error: MAX_VALUE_ERROR * f64::from(largest),
            }
        };
        (0..n_components).map(one).collect()
    }

    fn at(&self, point: usize) -> f64 {
        f64::from(self.data[point * self.n_components + self.component])
    }

    /// How far the value at `point` is from that `t` of the way from `start` to `end`, in largest
    /// errors.
    fn error(&self, point: usize, (start, end): (usize, usize), t: f64) -> f64 {
        let line = (1.0 - t) * self.at(start) + t * self.at(end);
        match self.max_error > 0.0 {
            true => (self.at(point) - line).abs() / self.max_error,
            // All are zero.
            false => 0.0,
        }
    }
}

impl Groom {
    /// Marks the points that stay of `strand`.
    fn mark_kept(&self, strand: usize, max_error: f64, drawn: &[Drawn], keeps: &mut Vec<bool>) {
        let range = self.strand(strand);
        let points = &self.points[range.clone()];
        keeps.clear();
        keeps.resize(points.len(), false);
        let last = points.len() - 1;
        (keeps[0], keeps[last]) = (true, true);
        let mut open = vec![(0, last)];
        while let Some((start, end)) = open.pop() {
            let worst = |error: &dyn Fn(usize) -> f64, most: f64| {
                (start + 1..end)
                    .map(|ix| (ix, error(ix)))
                    .max_by(|a, b| a.1.total_cmp(&b.1))
                    .filter(|(_, error)| *error > most)
            };
            let on_segment = |ix: usize| to_segment(points[ix], points[start], points[end]);
            let of_values = |ix: usize| {
                let t = on_segment(ix).1;
                let ends = (range.start + start, range.start + end);
                let errors = drawn
                    .iter()
                    .map(|drawn| drawn.error(range.start + ix, ends, t));
                errors.fold(0.0, f64::max)
            };
            let far = worst(&|ix| on_segment(ix).0, max_error);
            let Some((ix, _)) = far.or_else(|| worst(&of_values, 1.0)) else {
                continue;
            };
            keeps[ix] = true;
            open.extend([(start, ix), (ix, end)]);
        }
    }
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    let square = |axis: usize| (f64::from(b[axis]) - f64::from(a[axis])).powi(2);
    (0..3).map(square).sum::<f64>().sqrt()
}

/// How far `point` is from the line between `a` and `b`, ends included, and how far along it, 0..=1, the
/// nearest place is.
fn to_segment(point: [f32; 3], a: [f32; 3], b: [f32; 3]) -> (f64, f64) {
    let sub = |p: [f32; 3], q: [f32; 3]| {
        [0, 1, 2].map(|axis: usize| f64::from(p[axis]) - f64::from(q[axis]))
    };
    let dot = |u: [f64; 3], v: [f64; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    let (line, way) = (sub(b, a), sub(point, a));
    let square = dot(line, line);
    let t = match square > 0.0 {
        true => (dot(way, line) / square).clamp(0.0, 1.0),
        false => 0.0,
    };
    let rest = [0, 1, 2].map(|axis: usize| way[axis] - t * line[axis]);
    (dot(rest, rest).sqrt(), t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attribute(name: &str, domain: Domain, components: u32, data: &[f32]) -> Attribute {
        Attribute {
            name: name.to_owned(),
            domain,
            components,
            data: data.to_vec(),
        }
    }

    /// A strand with a corner, 1 + 3 long, and a straight one of two points.
    fn groom() -> Groom {
        Groom {
            points: vec![
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 3.0, 0.0],
                [5.0, 0.0, 0.0],
                [5.0, 0.0, 6.0],
            ],
            strand_offsets: vec![0, 3, 5],
            attributes: vec![
                attribute("diameter", Domain::Point, 1, &[0.4, 0.3, 0.1, 0.2, 0.1]),
                attribute("id", Domain::Point, 1, &[7.0, 8.0, 9.0, 1.0, 2.0]),
                attribute("root_uv", Domain::Strand, 2, &[0.1, 0.2, 0.3, 0.4]),
                attribute("width_scale", Domain::Groom, 1, &[2.0]),
            ],
            ..Groom::default()
        }
    }

    #[test]
    fn points_stand_at_equal_distances() {
        let even = groom().resampled(5).unwrap();
        even.validate().unwrap();
        assert_eq!(even.strand_offsets, [0, 5, 10]);
        let first = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 0.0]];
        assert_eq!(even.points[..4], first);
        assert_eq!(even.points[4], [1.0, 3.0, 0.0]);
        assert_eq!(even.points[6], [5.0, 0.0, 1.5]);
        assert_eq!(even.points[9], [5.0, 0.0, 6.0]);
        let diameter = &even.attribute("diameter").unwrap().data;
        assert_eq!((diameter[0], diameter[1], diameter[4]), (0.4, 0.3, 0.1));
        assert!((diameter[2] - (0.3 - 0.2 / 3.0)).abs() < 1e-7);
        let id = &even.attribute("id").unwrap().data;
        assert_eq!(id[..5], [7.0, 8.0, 8.0, 9.0, 9.0]);
        for name in ["root_uv", "width_scale"] {
            assert_eq!(even.attribute(name), groom().attribute(name));
        }
    }

    #[test]
    fn even_strands_stay_as_they_are() {
        let even = groom().resampled(5).unwrap();
        assert_eq!(even.resampled(5).unwrap(), even);
        // Of no length: all points in one place.
        let mut still = groom();
        still.points.fill([1.0, 2.0, 3.0]);
        let even = still.resampled(4).unwrap();
        assert_eq!(even.points, vec![[1.0, 2.0, 3.0]; 8]);
        // Points twice in one place are passed.
        let mut twice = groom();
        twice.points[1] = twice.points[0];
        let even = twice.resampled(3).unwrap();
        assert_eq!(even.points[1], [0.5, 1.5, 0.0]);
    }

    #[test]
    fn numbers_of_points_out_of_range_are_refused() {
        for n in [0, 1, 65_537, u32::MAX] {
            let message = groom().resampled(n).unwrap_err().to_string();
            assert!(message.contains("points per strand"), "{message}");
        }
        for error in [-1.0, f32::NAN] {
            let message = groom().simplified(error).unwrap_err().to_string();
            assert!(message.contains("largest error"), "{message}");
        }
        let empty = Groom::default();
        assert!(empty.resampled(4).is_err() && empty.simplified(0.1).is_err());
    }

    #[test]
    fn few_points_stay_within_the_error() {
        // A half circle of radius 10.
        let arc = |ix: i32| {
            let angle = std::f32::consts::PI * ix as f32 / 200.0;
            [10.0 * angle.cos(), 10.0 * angle.sin(), 1.0]
        };
        let mut circle = Groom {
            points: (0..=200).map(arc).collect(),
            strand_offsets: vec![0, 201],
            ..Groom::default()
        };
        let ixs: Vec<f32> = (0..=200).map(|ix| ix as f32).collect();
        circle.attributes = vec![attribute("way", Domain::Point, 1, &ixs)];
        let mut n_before = usize::MAX;
        for max_error in [0.0005, 0.01, 0.1, 1.0] {
            let few = circle.simplified(max_error).unwrap();
            few.validate().unwrap();
            assert!(few.points.len() < n_before, "{max_error}");
            n_before = few.points.len();
            let kept = &few.attributes[0].data;
            assert_eq!((kept[0], kept[kept.len() - 1]), (0.0, 200.0));
            for (&point, &ix) in few.points.iter().zip(kept) {
                assert_eq!(point, arc(ix as i32));
            }
            for &point in &circle.points {
                let nearest = few.points.windows(2).map(|pair| {
                    let [a, b] = [pair[0], pair[1]];
                    to_segment(point, a, b).0
                });
                let error = nearest.fold(f64::MAX, f64::min);
                assert!(error <= f64::from(max_error), "{error} {max_error}");
            }
        }
        assert_eq!(circle.simplified(20.0).unwrap().points.len(), 2);
        // A straight line needs its ends only, whatever the error; points beyond its end stay.
        let line = |xs: &[f32]| Groom {
            points: xs.iter().map(|&x| [x, 0.0, 0.0]).collect(),
            strand_offsets: vec![0, xs.len() as u32],
            ..Groom::default()
        };
        let straight = line(&[0.0, 1.0, 2.0, 4.0]).simplified(0.0).unwrap();
        assert_eq!(straight.points.len(), 2);
        let back = line(&[0.0, 6.0, 2.0]).simplified(0.5).unwrap();
        assert_eq!(back.points.len(), 3);
    }

    #[test]
    fn few_points_keep_widths_and_paint() {
        let straight = |attributes: Vec<Attribute>| Groom {
            points: (0..9).map(|ix| [ix as f32, 0.0, 0.0]).collect(),
            strand_offsets: vec![0, 9],
            attributes,
            ..Groom::default()
        };
        let kept = |name: &str, components: u32, data: &[f32]| {
            let own = attribute(name, Domain::Point, components, data);
            let few = straight(vec![own]).simplified(0.5).unwrap();
            few.points.iter().map(|at| at[0]).collect::<Vec<f32>>()
        };
        // A bulge of half the thickness in the middle, a taper, and less than 5 % of the thickest.
        let mut widths = [0.01; 9];
        widths[4] = 0.015;
        assert_eq!(kept("diameter", 1, &widths), [0.0, 3.0, 4.0, 5.0, 8.0]);
        let taper: Vec<f32> = (0..9).map(|ix| 0.01 - 0.001 * ix as f32).collect();
        assert_eq!(kept("diameter", 1, &taper), [0.0, 8.0]);
        widths[4] = 0.0104;
        assert_eq!(kept("diameter", 1, &widths), [0.0, 8.0]);
        // Dye from one point to the next; its colour is the same all along.
        let dye = |ix: usize| [0.2, 0.4, 0.6, f32::from(u8::from(ix >= 6))];
        let dye: Vec<f32> = (0..9).flat_map(dye).collect();
        assert_eq!(kept("dye", 4, &dye), [0.0, 5.0, 6.0, 8.0]);
        // What is not drawn, and what is zero all along.
        assert_eq!(
            kept("way", 1, &widths.map(|w| 100.0 * (w - 0.01))),
            [0.0, 8.0]
        );
        assert_eq!(kept("dye", 4, &[0.0; 36]), [0.0, 8.0]);
    }
}
