//! One press, drag and release of the brush.

use std::ops::Range;

use super::PaintedPoint;

/// What a stroke changed: enough to do it again and to undo it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stroke {
    /// Groom point, its paint before and after; each point once, in order, none that stayed as it
    /// was.
    pub changed: Vec<(u32, PaintedPoint, PaintedPoint)>,
}

impl Stroke {
    /// From the first to the last point that it names; [`None`] if it changes nothing.
    pub fn range(&self) -> Option<Range<usize>> {
        let first = self.changed.iter().map(|&(ix, ..)| ix as usize).min()?;
        let last = self.changed.iter().map(|&(ix, ..)| ix as usize).max()?;
        Some(first..last + 1)
    }

    /// Does it change nothing?
    pub fn is_empty(&self) -> bool {
        self.changed.is_empty()
    }
}
