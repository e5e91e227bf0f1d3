//! Paint on hair: what a groom's points carry, and the brush that changes it.
//!
//! - [`Paint`]: a [`PaintedPoint`] for each point of a groom, read from and written to its
//!   attributes ([`strandlight_formats::PAINT_ATTRIBUTES`]).
//! - [`PointMask`]: what of it brushes leave alone; a brush changes one of the two, its [`Canvas`].
//! - [`Picker`]: finds the strand under the cursor and the points around it.
//! - [`Brush`] and [`BrushStroke`]: what a person or a script does; [`ActiveStroke`] makes it
//!   a [`Stroke`], which knows each point before and after and so can be undone.
//!
//! ```
//! use strandlight_scene::paint::{Paint, PaintedPoint, Stroke};
//!
//! let mut paint = Paint::unpainted(3);
//! let dyed = PaintedPoint { sigma_a: [0.1, 0.9, 2.0], weight: 1.0, ..PaintedPoint::NONE };
//! let stroke = Stroke { changed: vec![(1, PaintedPoint::NONE, dyed)], ..Stroke::default() };
//! assert_eq!(paint.apply(&stroke), Some(1..2));
//! assert!(paint.is_painted());
//! paint.revert(&stroke);
//! assert!(!paint.is_painted());
//! ```

mod active_stroke;
mod attributes;
mod brush;
mod flood;
mod grid;
mod kinds;
mod mask;
mod mean;
mod optics;
mod picker;
mod point;
mod stroke;

pub use active_stroke::ActiveStroke;
pub use brush::{Brush, BrushEffect, BrushError, BrushMask, BrushStroke, StrokePath};
#[doc(hidden)]
pub use kinds::PaintKinds;
pub use mask::{Canvas, PointMask};
#[doc(hidden)]
pub use optics::PaintedOptics;
pub(crate) use optics::{no_painted_averages, no_painted_lobes};
#[doc(hidden)]
pub use picker::PICK_PX;
pub use picker::Picker;
pub use point::PaintedPoint;
pub use stroke::Stroke;

use std::ops::Range;

use crate::error::SceneError;
use crate::strands::Strands;

/// Paint of a groom: one entry for each of its points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Paint {
    /// In the order of the groom's points.
    pub points: Vec<PaintedPoint>,
}

impl Paint {
    /// No paint on `n_points` points.
    pub fn unpainted(n_points: usize) -> Paint {
        Paint {
            points: vec![PaintedPoint::NONE; n_points],
        }
    }

    /// Is any point other than [`PaintedPoint::NONE`]?
    pub fn is_painted(&self) -> bool {
        self.points.iter().any(PaintedPoint::is_painted)
    }

    /// The paint of [`Strands::points`], between points of the groom as [`PaintedPoint::mix`] has
    /// it.
    ///
    /// # Errors
    /// Not as many entries as the groom of `strands` has points.
    pub fn spread(&self, strands: &Strands) -> Result<Vec<PaintedPoint>, SceneError> {
        strands.spread(&self.points, |a, b, t| a.mix(&b, t))
    }

    /// Writes the paint of those of [`Strands::points`] that lie at or beside the groom's points in
    /// `changed` into `spread`, which [`Paint::spread`] made, and answers which these are.
    ///
    /// # Errors
    /// Not as many entries as the groom of `strands` has points, or as `strands` has.
    pub(crate) fn spread_range(
        &self,
        strands: &Strands,
        changed: Range<usize>,
        spread: &mut [PaintedPoint],
    ) -> Result<Range<usize>, SceneError> {
        let origins = strands.origins();
        if self.points.len() != strands.n_groom_points() || spread.len() != origins.len() {
            return Err(SceneError::Offsets);
        }
        if changed.is_empty() {
            return Ok(0..0);
        }
        // Points of the groom ascend; what follows the point before the first mixes with it.
        let first = origins.partition_point(|origin| (origin.point as usize) + 1 < changed.start);
        let last = origins.partition_point(|origin| (origin.point as usize) < changed.end);
        for (origin, spread) in origins[first..last].iter().zip(&mut spread[first..last]) {
            let ix = origin.point as usize;
            *spread = match origin.fraction == 0.0 {
                true => self.points[ix],
                false => self.points[ix].mix(&self.points[ix + 1], origin.fraction),
            };
        }
        Ok(first..last)
    }

    /// Gives the points of `stroke` their paint after it. Answers the range of points that it
    /// names, [`None`] of an empty stroke. Points beyond the groom's are passed over.
    pub fn apply(&mut self, stroke: &Stroke) -> Option<Range<usize>> {
        for &(ix, _, after) in &stroke.changed {
            if let Some(point) = self.points.get_mut(ix as usize) {
                *point = after;
            }
        }
        stroke.range()
    }

    /// Gives the points of `stroke` their paint before it; the inverse of [`Paint::apply`].
    pub fn revert(&mut self, stroke: &Stroke) -> Option<Range<usize>> {
        for &(ix, before, _) in &stroke.changed {
            if let Some(point) = self.points.get_mut(ix as usize) {
                *point = before;
            }
        }
        stroke.range()
    }
}
