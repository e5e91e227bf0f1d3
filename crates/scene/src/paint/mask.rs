//! The mask: hair that brushes leave alone.

use std::ops::Range;

use super::Stroke;

/// How far each point of a groom is protected from brushes: 0 not at all, 1 wholly. Whatever a brush does to the
/// paint of a point is multiplied by `1 - mask`. It is no part of any picture.
///
/// Not to be confused with [`BrushMask`](super::BrushMask), the part of each strand that one brush works on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointMask {
    /// In the order of the groom's points, 0..=1.
    pub points: Vec<f32>,
}

impl PointMask {
    /// Protects none of `n_points` points.
    pub fn none(n_points: usize) -> PointMask {
        PointMask {
            points: vec![0.0; n_points],
        }
    }

    /// Is any point protected?
    pub fn is_protecting(&self) -> bool {
        self.points.iter().any(|&mask| mask > 0.0)
    }

    /// Gives the points of `stroke` their mask after it. Answers the range of points that it names, [`None`] where it
    /// changes no mask. Points beyond the groom's are passed over.
    pub fn apply(&mut self, stroke: &Stroke) -> Option<Range<usize>> {
        for &(ix, _, after) in &stroke.masked {
            if let Some(point) = self.points.get_mut(ix as usize) {
                *point = after;
            }
        }
        stroke.mask_range()
    }

    /// Gives the points of `stroke` their mask before it; the inverse of [`PointMask::apply`].
    pub fn revert(&mut self, stroke: &Stroke) -> Option<Range<usize>> {
        for &(ix, before, _) in &stroke.masked {
            if let Some(point) = self.points.get_mut(ix as usize) {
                *point = before;
            }
        }
        stroke.mask_range()
    }
}

/// What a brush changes: the paint, or the mask. A brush for the other one does nothing.
#[derive(Debug)]
pub enum Canvas<'a> {
    /// The paint, where the mask lets a brush at it.
    Paint(&'a mut super::Paint, Option<&'a PointMask>),
    /// The mask.
    Mask(&'a mut PointMask),
}

impl Canvas<'_> {
    /// The same, for less long.
    pub(super) fn again(&mut self) -> Canvas<'_> {
        match self {
            Canvas::Paint(paint, mask) => Canvas::Paint(paint, *mask),
            Canvas::Mask(mask) => Canvas::Mask(mask),
        }
    }

    /// Points that it has.
    pub(super) fn len(&self) -> usize {
        match self {
            Canvas::Paint(paint, _) => paint.points.len(),
            Canvas::Mask(mask) => mask.points.len(),
        }
    }

    /// The mask of a point; 0 where there is none.
    pub(super) fn mask_at(&self, point: u32) -> f32 {
        let mask = match self {
            Canvas::Paint(_, mask) => *mask,
            Canvas::Mask(mask) => Some(&**mask),
        };
        let mask = mask.and_then(|mask| mask.points.get(point as usize));
        mask.copied().unwrap_or(0.0)
    }
}

impl<'a> From<&'a mut super::Paint> for Canvas<'a> {
    fn from(paint: &'a mut super::Paint) -> Canvas<'a> {
        Canvas::Paint(paint, None)
    }
}

impl<'a> From<&'a mut PointMask> for Canvas<'a> {
    fn from(mask: &'a mut PointMask) -> Canvas<'a> {
        Canvas::Mask(mask)
    }
}
