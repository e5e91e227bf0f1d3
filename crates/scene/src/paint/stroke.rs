//! One press, drag and release of the brush.

use std::ops::Range;

use super::PaintedPoint;

/// What a stroke changed, of the paint or of the mask: enough to do it again and to undo it. Each point is there once,
/// in order, and none that stayed as it was.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stroke {
    /// Groom point, its paint before and after.
    pub changed: Vec<(u32, PaintedPoint, PaintedPoint)>,
    /// Groom point, its mask before and after.
    pub masked: Vec<(u32, f32, f32)>,
}

impl Stroke {
    /// From the first to the last point whose paint it changes; [`None`] if it changes none.
    pub fn range(&self) -> Option<Range<usize>> {
        range(self.changed.iter().map(|&(ix, ..)| ix))
    }

    /// From the first to the last point whose mask it changes; [`None`] if it changes none.
    pub fn mask_range(&self) -> Option<Range<usize>> {
        range(self.masked.iter().map(|&(ix, ..)| ix))
    }

    /// Does it change nothing?
    pub fn is_empty(&self) -> bool {
        self.changed.is_empty() && self.masked.is_empty()
    }
}

fn range(points: impl Iterator<Item = u32> + Clone) -> Option<Range<usize>> {
    let first = points.clone().min()? as usize;
    let last = points.max()? as usize;
    Some(first..last + 1)
}
