//! A stroke while it is being made.

use std::ops::Range;

use glam::Vec3;

use super::mean::{Mean, Smear};
use super::{
    Brush, BrushEffect, BrushError, BrushStroke, Paint, PaintedPoint, Picker, Stroke, StrokePath,
};
use crate::camera::Camera;

/// From dab to dab, in radii of the brush: closer ones look the same.
const SPACING: f32 = 0.25;

/// Most dabs from one place of the cursor to the next.
const MAX_DABS: f32 = 1024.0;

/// A point that a stroke has touched.
#[derive(Clone, Copy, Debug)]
struct Touched {
    point: u32,
    /// Largest nearness of all dabs so far.
    nearness: f32,
    before: PaintedPoint,
}

/// Between press and release: dabs change the paint at once, [`ActiveStroke::finish`] says what the
/// stroke did. What a point gets depends on the dab nearest to it alone, so neither on how many
/// places of the cursor were seen nor on their order; but for smear, which goes one way.
#[derive(Clone, Debug)]
pub struct ActiveStroke {
    brush: Brush,
    /// In the order they were touched.
    touched: Vec<Touched>,
    /// Of each point of the groom: one more than its place in `touched`, 0 if it is not there.
    places: Vec<u32>,
    /// Where the cursor was, and where the hair under it, when it was over hair.
    last: Option<([f32; 2], Option<Vec3>)>,
    /// Share of the brush's strength, 0..=1.
    pressure: f32,
    /// What smear carries, and its mirror image.
    smears: [Smear; 2],
}

impl ActiveStroke {
    /// The brush goes down.
    ///
    /// # Errors
    /// The first value of the brush outside its range.
    pub fn new(brush: Brush) -> Result<ActiveStroke, BrushError> {
        brush.validate()?;
        Ok(ActiveStroke {
            brush,
            touched: Vec::new(),
            places: Vec::new(),
            last: None,
            pressure: 1.0,
            smears: Default::default(),
        })
    }

    /// Dabs have this share of the brush's strength from now on, 0..=1; all of it where it is no number.
    pub fn set_pressure(&mut self, pressure: f32) {
        self.pressure = match pressure.is_nan() {
            true => 1.0,
            false => pressure.clamp(0.0, 1.0),
        };
    }

    /// The cursor is at `cursor`, px from the upper left corner of a picture of `size`: dabs from
    /// where it was to there, wherever it is over hair. Answers the range of points of the groom
    /// that may have changed.
    pub fn drag(
        &mut self,
        picker: &Picker,
        paint: &mut Paint,
        camera: &Camera,
        size: [u32; 2],
        cursor: [f32; 2],
    ) -> Option<Range<usize>> {
        if !cursor.iter().all(|x| x.is_finite()) {
            return None;
        }
        let (from, mut hit) = self.last.unwrap_or((cursor, None));
        let length = (cursor[0] - from[0]).hypot(cursor[1] - from[1]);
        let radius_px = match hit {
            Some(at) => Picker::radius_px(camera, size, at, self.brush.radius_cm),
            None => 8.0,
        };
        let steps = (length / (SPACING * radius_px).max(1.0)).ceil();
        let steps = steps.clamp(1.0, MAX_DABS) as u32;
        let mut changed = None;
        for step in 1..=steps {
            let t = step as f32 / steps as f32;
            let at = [0, 1].map(|c| from[c] + t * (cursor[c] - from[c]));
            hit = picker.pick(camera, size, at);
            if let Some(centre) = hit {
                changed = joined(changed, self.dab(picker, paint, centre));
            }
        }
        self.last = Some((cursor, hit));
        changed
    }

    /// Dabs along a line through `path`, world space, cm.
    pub fn follow(
        &mut self,
        picker: &Picker,
        paint: &mut Paint,
        path: &[[f32; 3]],
    ) -> Option<Range<usize>> {
        let mut changed = None;
        let mut last: Option<Vec3> = None;
        for &point in path {
            let point = Vec3::from(point);
            if !point.is_finite() {
                continue;
            }
            let from = last.unwrap_or(point);
            let steps = (from.distance(point) / (SPACING * self.brush.radius_cm)).ceil();
            let steps = steps.clamp(1.0, MAX_DABS) as u32;
            for step in 1..=steps {
                let centre = from.lerp(point, step as f32 / steps as f32);
                changed = joined(changed, self.dab(picker, paint, centre));
            }
            last = Some(point);
        }
        changed
    }

    /// One dab around `centre`, cm, and around its mirror image if the brush is symmetric.
    pub fn dab(
        &mut self,
        picker: &Picker,
        paint: &mut Paint,
        centre: Vec3,
    ) -> Option<Range<usize>> {
        let mut changed = self.dab_once(picker, paint, centre, 0);
        if self.brush.is_symmetric {
            let mirrored = Vec3::new(-centre.x, centre.y, centre.z);
            changed = joined(changed, self.dab_once(picker, paint, mirrored, 1));
        }
        changed
    }

    fn dab_once(
        &mut self,
        picker: &Picker,
        paint: &mut Paint,
        centre: Vec3,
        side: usize,
    ) -> Option<Range<usize>> {
        let brush = self.brush;
        self.places.resize(paint.points.len(), 0);
        let found = picker.around(centre, brush.radius_cm, |distance| brush.nearness(distance));
        let laid = self.laid(paint, &found, centre, side);
        let pressure = self.pressure;
        let mut changed: Option<Range<usize>> = None;
        for (point, nearness) in found {
            let Some(strand) = picker.strand_of(point) else {
                continue;
            };
            let (root, tip) = (strand.start, strand.end - 1);
            let arc = picker.arc(point);
            let length = picker.arc(tip).max(1e-9);
            // From the point to the tip, then back to the root, as far as it makes a difference.
            let towards_tip = point..strand.end;
            let towards_root = (root..point).rev();
            let mut see = |at: u32| {
                let carried = brush.carried(nearness, (picker.arc(at) - arc).abs());
                let Some(paint) = paint.points.get_mut(at as usize) else {
                    return false;
                };
                let place = &mut self.places[at as usize];
                if *place == 0 {
                    // NaN is not near.
                    if carried <= 0.0 || carried.is_nan() {
                        return false;
                    }
                    self.touched.push(Touched {
                        point: at,
                        nearness: 0.0,
                        before: *paint,
                    });
                    *place = self.touched.len() as u32;
                }
                let touched = &mut self.touched[*place as usize - 1];
                if carried <= touched.nearness {
                    return false;
                }
                touched.nearness = carried;
                let coverage = pressure * brush.coverage(carried, picker.arc(at) / length);
                *paint = match &laid {
                    Some(laid) => touched.before.towards(laid, coverage),
                    None => brush.applied(&touched.before, coverage),
                };
                changed = Some(match changed.take() {
                    Some(range) => range.start.min(at as usize)..range.end.max(at as usize + 1),
                    None => at as usize..at as usize + 1,
                });
                true
            };
            for at in towards_tip {
                if !see(at) {
                    break;
                }
            }
            for at in towards_root {
                if !see(at) {
                    break;
                }
            }
        }
        changed
    }

    /// What blur and smear lay on in a dab over the points of `found`, from the paint that these had before
    /// the stroke; [`None`] of other brushes.
    fn laid(
        &mut self,
        paint: &Paint,
        found: &[(u32, f32)],
        centre: Vec3,
        side: usize,
    ) -> Option<PaintedPoint> {
        let effect = self.brush.effect;
        if !matches!(effect, BrushEffect::Blur | BrushEffect::Smear) {
            return None;
        }
        let mut mean = Mean::default();
        for &(point, nearness) in found {
            let before = match self.places.get(point as usize) {
                Some(0) | None => paint.points.get(point as usize),
                Some(&place) => Some(&self.touched[place as usize - 1].before),
            };
            if let Some(before) = before {
                mean.add(before, nearness);
            }
        }
        let mean = mean.point()?;
        match effect {
            BrushEffect::Smear => Some(self.smears[side].carry(mean, centre, self.brush.radius_cm)),
            _ => Some(mean),
        }
    }

    /// The brush goes up: what the stroke did to `paint`, which stays as it is.
    pub fn finish(mut self, paint: &Paint) -> Stroke {
        self.touched.sort_unstable_by_key(|touched| touched.point);
        let changed = self.touched.into_iter().filter_map(|touched| {
            let Touched { point, before, .. } = touched;
            let after = *paint.points.get(point as usize)?;
            (after != before).then_some((point, before, after))
        });
        Stroke {
            changed: changed.collect(),
        }
    }
}

impl Picker {
    /// What `stroke` does to `paint`, which stays as it is. A path in pixels is one in a picture of
    /// `size` by `camera`.
    ///
    /// # Errors
    /// The first value of the brush outside its range.
    pub fn stroke(
        &self,
        paint: &Paint,
        camera: &Camera,
        size: [u32; 2],
        stroke: &BrushStroke,
    ) -> Result<Stroke, BrushError> {
        let mut active_stroke = ActiveStroke::new(stroke.brush)?;
        let mut paint = paint.clone();
        match &stroke.path {
            StrokePath::World(path) => {
                active_stroke.follow(self, &mut paint, path);
            }
            StrokePath::Pixels(path) => {
                for &cursor in path {
                    active_stroke.drag(self, &mut paint, camera, size, cursor);
                }
            }
        }
        Ok(active_stroke.finish(&paint))
    }
}

/// The least range around both.
fn joined(a: Option<Range<usize>>, b: Option<Range<usize>>) -> Option<Range<usize>> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.start.min(b.start)..a.end.max(b.end)),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{BrushEffect, BrushMask};
    use super::*;
    use crate::strands::Strands;

    /// A curtain of 41 strands from y = 0 down to -10 at x = -10..=10, 11 points each, and one
    /// more in front of its middle.
    fn curtain() -> Strands {
        let (mut points, mut offsets) = (Vec::new(), vec![0]);
        for strand in 0..42 {
            let (x, z) = match strand {
                41 => (0.0, 3.0),
                _ => (0.5 * strand as f32 - 10.0, 0.0),
            };
            points.extend((0..11).map(|ix| [x, -(ix as f32), z]));
            offsets.push(points.len() as u32);
        }
        Strands::new(&points, &offsets, |_, _| 0.01, true).unwrap()
    }

    fn camera() -> Camera {
        Camera {
            eye: Vec3::new(0.0, -5.0, 60.0),
            target: Vec3::new(0.0, -5.0, 0.0),
            up: Vec3::Y,
            fov_y: 0.5,
        }
    }

    const SIZE: [u32; 2] = [400, 300];

    #[test]
    fn the_strand_in_front_is_picked() {
        let picker = Picker::new(&curtain());
        let hit = picker.pick(&camera(), SIZE, [200.0, 150.0]).unwrap();
        assert!(hit.distance(Vec3::new(0.0, -5.0, 3.0)) < 1e-3, "{hit}");
        let px_per_cm = 150.0 / (60.0 * 0.25f32.tan());
        let cursor = [200.0 + 5.0 * px_per_cm + 1.0, 150.0 + 2.25 * px_per_cm];
        let hit = picker.pick(&camera(), SIZE, cursor).unwrap();
        assert!(hit.distance(Vec3::new(5.0, -7.25, 0.0)) < 1e-2, "{hit}");
        assert_eq!(picker.pick(&camera(), SIZE, [5.0, 5.0]), None);
        assert_eq!(picker.pick(&camera(), SIZE, [f32::NAN, 5.0]), None);
        // From behind, the curtain is in front.
        let behind = Camera {
            eye: Vec3::new(0.0, -5.0, -60.0),
            ..camera()
        };
        let hit = picker.pick(&behind, SIZE, [200.0, 150.0]).unwrap();
        assert!(hit.z.abs() < 1e-3, "{hit}");
    }

    fn stroke(brush: Brush, path: StrokePath) -> (Stroke, Paint) {
        let strands = curtain();
        let picker = Picker::new(&strands);
        let paint = Paint::unpainted(strands.n_groom_points());
        let stroke = BrushStroke { brush, path };
        let stroke = picker.stroke(&paint, &camera(), SIZE, &stroke).unwrap();
        let mut after = paint.clone();
        after.apply(&stroke);
        (stroke, after)
    }

    /// The left half of the curtain is dyed.
    fn half_dyed(strands: &Strands) -> Paint {
        let mut paint = Paint::unpainted(strands.n_groom_points());
        for (point, origin) in strands.points.iter().zip(strands.origins()) {
            if origin.fraction == 0.0 && point[0] < 0.0 {
                paint.points[origin.point as usize] = PaintedPoint {
                    sigma_a: [0.1, 2.0, 3.0],
                    weight: 1.0,
                    width_scale: 2.0,
                    ..PaintedPoint::NONE
                };
            }
        }
        paint
    }

    /// Paint of the groom's point of the curtain at x and 5 cm below the root, after a stroke over it.
    fn after(brush: Brush, path: [[f32; 3]; 2]) -> impl Fn(f32) -> PaintedPoint {
        let strands = curtain();
        let mut paint = half_dyed(&strands);
        let stroke = BrushStroke {
            brush,
            path: StrokePath::World(path.to_vec()),
        };
        let picker = Picker::new(&strands);
        let stroke = picker.stroke(&paint, &camera(), SIZE, &stroke).unwrap();
        let before = paint.clone();
        paint.apply(&stroke);
        let mut undone = paint.clone();
        undone.revert(&stroke);
        assert_eq!(undone, before);
        move |x| paint.points[(11.0 * (2.0 * (x + 10.0))) as usize + 5]
    }

    #[test]
    fn blur_softens_an_edge_and_leaves_what_is_even() {
        let brush = Brush {
            radius_cm: 2.0,
            effect: BrushEffect::Blur,
            ..Brush::default()
        };
        let at = after(brush, [[-6.0, -5.0, 0.0], [6.0, -5.0, 0.0]]);
        let weights: Vec<f32> = (-5..=5).map(|x| at(x as f32).weight).collect();
        assert!(
            weights.windows(2).all(|pair| pair[0] >= pair[1]),
            "{weights:?}"
        );
        assert!((0.3..0.7).contains(&at(0.0).weight), "{weights:?}");
        let soft = weights
            .iter()
            .filter(|weight| (0.01..0.99).contains(*weight));
        assert!(soft.count() >= 3, "{weights:?}");
        let width = at(0.0).width_scale;
        assert!((1.1..1.9).contains(&width), "{width}");
        // Away from the edge there is nothing to soften.
        assert_eq!((weights[0], weights[10]), (1.0, 0.0));
        assert_eq!(at(-4.5).sigma_a, [0.1, 2.0, 3.0]);
    }

    #[test]
    fn smear_drags_paint_the_way_that_it_goes() {
        let brush = Brush {
            radius_cm: 1.0,
            effect: BrushEffect::Smear,
            softness: 0.0,
            ..Brush::default()
        };
        let path = [[-4.0, -5.0, 0.0], [4.0, -5.0, 0.0]];
        let right = after(brush, path);
        let left = after(brush, [path[1], path[0]]);
        // Dye comes into the bare half, or bareness into the dyed one; less and less.
        let [near, far] = [right(1.0).weight, right(3.0).weight];
        assert!(near > 0.3 && far < near && far > 0.0, "{near} {far}");
        assert_eq!(right(-3.0).weight, 1.0);
        let [near, far] = [left(-1.0).weight, left(-3.0).weight];
        assert!(near < 0.7 && far > near, "{near} {far}");
        assert_eq!(left(3.0).weight, 0.0);
        assert!((1.0..2.0).contains(&left(-2.0).width_scale));
    }

    #[test]
    fn pressure_is_a_share_of_the_strength() {
        let strands = curtain();
        let picker = Picker::new(&strands);
        let weight = |pressure: f32| {
            let mut paint = Paint::unpainted(strands.n_groom_points());
            let mut stroke = ActiveStroke::new(Brush::default()).unwrap();
            stroke.set_pressure(pressure);
            stroke.dab(&picker, &mut paint, Vec3::new(2.0, -5.0, 0.0));
            paint
                .points
                .iter()
                .map(|point| point.weight)
                .fold(0.0, f32::max)
        };
        assert_eq!(
            [0.0, 0.25, 1.0, 3.0, f32::NAN].map(weight),
            [0.0, 0.25, 1.0, 1.0, 1.0]
        );
    }

    #[test]
    fn floods_cover_all_hair_within_the_mask() {
        let strands = curtain();
        let picker = Picker::new(&strands);
        let paint = half_dyed(&strands);
        let mut brush = Brush {
            strength: 0.5,
            effect: BrushEffect::Erase,
            mask: BrushMask {
                from: 0.5,
                to: 1.0,
                soft: 0.0,
            },
            ..Brush::default()
        };
        let stroke = picker.flood(&paint, &brush).unwrap();
        // Twenty strands are dyed, six of eleven points of each lie in the mask.
        assert_eq!(stroke.changed.len(), 20 * 6);
        assert!(stroke.changed.iter().all(|(.., after)| after.weight == 0.5));
        brush.effect = BrushEffect::Dye([1.0; 3]);
        let stroke = picker.flood(&paint, &brush).unwrap();
        assert_eq!(stroke.changed.len(), 42 * 6);
        brush.effect = BrushEffect::Smear;
        assert!(picker.flood(&paint, &brush).unwrap().is_empty());
        // Strands that are even stay as they are; a tip that is dyed fades into the rest.
        brush = Brush {
            radius_cm: 3.0,
            effect: BrushEffect::Blur,
            ..Brush::default()
        };
        let mut paint = Paint::unpainted(strands.n_groom_points());
        paint.points[10].weight = 1.0;
        let mut after = paint.clone();
        after.apply(&picker.flood(&paint, &brush).unwrap());
        let weights: Vec<f32> = after.points[6..11].iter().map(|it| it.weight).collect();
        assert!(weights.windows(2).all(|pair| pair[0] < pair[1]) || weights[0] == 0.0);
        assert!(weights[4] < 0.8 && weights[3] > 0.1, "{weights:?}");
        assert!(after.points[11..].iter().all(|it| it.weight == 0.0));
        brush.radius_cm = f32::NAN;
        assert!(picker.flood(&paint, &brush).is_err());
    }

    #[test]
    fn a_dab_touches_the_ball_and_can_be_undone() {
        let brush = Brush {
            radius_cm: 1.2,
            softness: 0.0,
            ..Brush::default()
        };
        let centre = [2.0, -5.0, 0.0];
        let (stroke, mut paint) = stroke(brush, StrokePath::World(vec![centre]));
        let strands = curtain();
        let mut inside = 0;
        for (point, origin) in strands.points.iter().zip(strands.origins()) {
            if origin.fraction != 0.0 {
                continue;
            }
            let distance = Vec3::from_slice(point).distance(Vec3::from(centre));
            let painted = paint.points[origin.point as usize];
            if distance < 1.19 {
                assert_eq!(painted.weight, 1.0, "{point:?}");
                inside += 1;
            }
            // Hair between points counts for the points at its ends.
            assert!(distance < 2.21 || !painted.is_painted(), "{point:?}");
        }
        assert!(inside >= 9, "{inside}");
        assert!(stroke.changed.is_sorted_by_key(|&(ix, ..)| ix));
        paint.revert(&stroke);
        assert!(!paint.is_painted());
    }

    #[test]
    fn what_a_point_gets_does_not_depend_on_how_the_cursor_was_seen() {
        let brush = Brush {
            radius_cm: 1.5,
            along_cm: 2.0,
            strength: 0.7,
            ..Brush::default()
        };
        let ends = vec![[140.0, 120.0], [260.0, 130.0]];
        let between = |t: f32| [140.0 + 120.0 * t, 120.0 + 10.0 * t];
        let finely = (0..=200).map(|ix| between(ix as f32 / 200.0)).collect();
        let (a, _) = stroke(brush, StrokePath::Pixels(ends.clone()));
        let (b, _) = stroke(brush, StrokePath::Pixels(finely));
        let (again, _) = stroke(brush, StrokePath::Pixels(ends));
        assert_eq!(a, again);
        let heaviest = |stroke: &Stroke| {
            let weights = stroke.changed.iter().map(|(_, _, after)| after.weight);
            weights.fold(0.0, f32::max)
        };
        assert!(
            heaviest(&a) <= 0.7 && heaviest(&a) > 0.3,
            "{}",
            heaviest(&a)
        );
        let mut apart = 0.0f32;
        for (ix, _, after) in &b.changed {
            let other = a.changed.iter().find(|(at, ..)| at == ix);
            apart = apart.max((other.map_or(0.0, |(_, _, p)| p.weight) - after.weight).abs());
        }
        assert!(apart < 0.1, "{apart}");
    }

    #[test]
    fn paint_carries_along_strands_within_the_mask_and_to_the_other_side() {
        let brush = Brush {
            radius_cm: 0.3,
            along_cm: 4.0,
            softness: 0.0,
            is_symmetric: true,
            mask: BrushMask {
                from: 0.4,
                to: 1.0,
                soft: 0.0,
            },
            effect: BrushEffect::WidthScale(3.0),
            ..Brush::default()
        };
        let (_, paint) = stroke(brush, StrokePath::World(vec![[4.0, -5.0, 0.0]]));
        for (ix, point) in paint.points.iter().enumerate() {
            let (strand, place) = (ix / 11, ix % 11);
            // x = 4 and -4; from 0.4 on and within 4 cm of 5.
            let expected = match [28, 12].contains(&strand) && (4..9).contains(&place) {
                true => 3.0,
                false => 1.0,
            };
            assert!(
                (point.width_scale - expected).abs() < 1e-5,
                "{ix} {point:?}"
            );
        }
    }

    #[test]
    fn strands_apart_and_repeated_points_have_their_own_lengths() {
        let points = [
            // A strand that is one point, then one that repeats a point.
            [5.0, 0.0, 0.0],
            [5.0, 0.0, 0.0],
            [0.0, 0.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, -3.0, 0.0],
        ];
        let strands = Strands::new(&points, &[0, 2, 6], |_, _| 0.01, false).unwrap();
        let picker = Picker::new(&strands);
        assert_eq!(picker.strand_of(0), None);
        assert_eq!(picker.strand_of(4), Some(2..6));
        assert_eq!([2, 3, 4, 5].map(|ix| picker.arc(ix)), [0.0, 1.0, 1.0, 3.0]);
        let brush = Brush {
            radius_cm: 0.1,
            softness: 0.0,
            ..Brush::default()
        };
        let mut active_stroke = ActiveStroke::new(brush).unwrap();
        let mut paint = Paint::unpainted(6);
        active_stroke.dab(&picker, &mut paint, Vec3::new(0.0, -1.0, 0.0));
        // Both points that coincide, or there would be a seam between them.
        let weights: Vec<f32> = paint.points.iter().map(|point| point.weight).collect();
        assert_eq!(weights, [0.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
    }
}
