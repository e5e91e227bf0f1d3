//! A stroke while it is being made.

use std::ops::Range;

use glam::Vec3;

use super::mean::{Mean, Smear};
use super::{
    Brush, BrushEffect, BrushError, BrushStroke, Canvas, Paint, PaintedPoint, Picker, PointMask,
    Stroke, StrokePath,
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
    /// Paint before the stroke, where it is the paint that the stroke changes.
    before: PaintedPoint,
    /// Mask before the stroke.
    mask: f32,
}

/// Between press and release: dabs change the [`Canvas`] at once, [`ActiveStroke::finish`] says what the
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

    /// What the brush does.
    pub fn effect(&self) -> BrushEffect {
        self.brush.effect
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
    pub fn drag<'a>(
        &mut self,
        picker: &Picker,
        canvas: impl Into<Canvas<'a>>,
        camera: &Camera,
        size: [u32; 2],
        cursor: [f32; 2],
    ) -> Option<Range<usize>> {
        if !cursor.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut canvas = canvas.into();
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
                changed = joined(changed, self.dab_all(picker, &mut canvas, centre));
            }
        }
        self.last = Some((cursor, hit));
        changed
    }

    /// Dabs along a line through `path`, world space, cm.
    pub fn follow<'a>(
        &mut self,
        picker: &Picker,
        canvas: impl Into<Canvas<'a>>,
        path: &[[f32; 3]],
    ) -> Option<Range<usize>> {
        let mut canvas = canvas.into();
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
                changed = joined(changed, self.dab_all(picker, &mut canvas, centre));
            }
            last = Some(point);
        }
        changed
    }

    /// One dab around `centre`, cm, and around its mirror image if the brush is symmetric.
    pub fn dab<'a>(
        &mut self,
        picker: &Picker,
        canvas: impl Into<Canvas<'a>>,
        centre: Vec3,
    ) -> Option<Range<usize>> {
        self.dab_all(picker, &mut canvas.into(), centre)
    }

    fn dab_all(
        &mut self,
        picker: &Picker,
        canvas: &mut Canvas<'_>,
        centre: Vec3,
    ) -> Option<Range<usize>> {
        let mut changed = self.dab_once(picker, canvas, centre, 0);
        if self.brush.is_symmetric {
            let mirrored = Vec3::new(-centre.x, centre.y, centre.z);
            changed = joined(changed, self.dab_once(picker, canvas, mirrored, 1));
        }
        changed
    }

    fn dab_once(
        &mut self,
        picker: &Picker,
        canvas: &mut Canvas<'_>,
        centre: Vec3,
        side: usize,
    ) -> Option<Range<usize>> {
        let brush = self.brush;
        if brush.effect.is_of_mask() != matches!(canvas, Canvas::Mask(_)) {
            return None;
        }
        self.places.resize(canvas.len(), 0);
        let found = picker.around(centre, brush.radius_cm, |distance| brush.nearness(distance));
        let laid = match canvas {
            Canvas::Paint(paint, _) => self.laid(paint, &found, centre, side),
            Canvas::Mask(_) => None,
        };
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
                let Some(place) = self.places.get_mut(at as usize) else {
                    return false;
                };
                if *place == 0 {
                    // NaN is not near.
                    if carried <= 0.0 || carried.is_nan() {
                        return false;
                    }
                    self.touched.push(Touched {
                        point: at,
                        nearness: 0.0,
                        before: match canvas {
                            Canvas::Paint(paint, _) => paint.points[at as usize],
                            Canvas::Mask(_) => PaintedPoint::NONE,
                        },
                        mask: canvas.mask_at(at),
                    });
                    *place = self.touched.len() as u32;
                }
                let touched = &mut self.touched[*place as usize - 1];
                if carried <= touched.nearness {
                    return false;
                }
                touched.nearness = carried;
                let coverage = pressure * brush.coverage(carried, picker.arc(at) / length);
                let is_other = match canvas {
                    Canvas::Paint(paint, _) => {
                        let coverage = coverage * (1.0 - touched.mask);
                        let painted = match &laid {
                            Some(laid) => touched.before.towards(laid, coverage),
                            None => brush.applied(&touched.before, coverage),
                        };
                        let point = &mut paint.points[at as usize];
                        std::mem::replace(point, painted) != painted
                    }
                    Canvas::Mask(mask) => {
                        let masked = brush.masked(touched.mask, coverage);
                        let point = &mut mask.points[at as usize];
                        std::mem::replace(point, masked) != masked
                    }
                };
                // Hair that is protected is not painted by being gone over.
                if !is_other {
                    return true;
                }
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
            ..Stroke::default()
        }
    }

    /// The brush goes up: what the stroke did to `mask`, which stays as it is.
    pub fn finish_mask(mut self, mask: &PointMask) -> Stroke {
        self.touched.sort_unstable_by_key(|touched| touched.point);
        let masked = self.touched.into_iter().filter_map(|touched| {
            let Touched {
                point,
                mask: before,
                ..
            } = touched;
            let after = *mask.points.get(point as usize)?;
            (after != before).then_some((point, before, after))
        });
        Stroke {
            masked: masked.collect(),
            ..Stroke::default()
        }
    }
}

impl Picker {
    /// Makes `stroke` on `canvas` and answers what it did. A path in pixels is one in a picture of `size` by
    /// `camera`.
    ///
    /// # Errors
    /// The first value of the brush outside its range.
    pub fn stroke<'a>(
        &self,
        canvas: impl Into<Canvas<'a>>,
        camera: &Camera,
        size: [u32; 2],
        stroke: &BrushStroke,
    ) -> Result<Stroke, BrushError> {
        let mut active_stroke = ActiveStroke::new(stroke.brush)?;
        let mut canvas = canvas.into();
        match &stroke.path {
            StrokePath::World(path) => {
                active_stroke.follow(self, canvas.again(), path);
            }
            StrokePath::Pixels(path) => {
                for &cursor in path {
                    active_stroke.drag(self, canvas.again(), camera, size, cursor);
                }
            }
        }
        Ok(match canvas {
            Canvas::Paint(paint, _) => active_stroke.finish(paint),
            Canvas::Mask(mask) => active_stroke.finish_mask(mask),
        })
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
mod tests;
