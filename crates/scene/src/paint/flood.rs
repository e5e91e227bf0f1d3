//! A brush over all hair at once.

use super::mean::Mean;
use super::{Brush, BrushEffect, BrushError, Canvas, Paint, PaintedPoint, Picker, Stroke};

impl Picker {
    /// What `brush` does to `canvas`, which stays as it is, if it covers all hair: with its strength, where its part of
    /// the strands has it and the mask lets it. Blur takes the mean of each strand within its radius of a point, smear
    /// does nothing.
    ///
    /// # Errors
    /// The first value of the brush outside its range.
    pub fn flood<'a>(
        &self,
        canvas: impl Into<Canvas<'a>>,
        brush: &Brush,
    ) -> Result<Stroke, BrushError> {
        brush.validate()?;
        let canvas = canvas.into();
        let mut stroke = Stroke::default();
        if brush.effect == BrushEffect::Smear
            || brush.effect.is_of_mask() != matches!(canvas, Canvas::Mask(_))
        {
            return Ok(stroke);
        }
        for strand in self.strands() {
            let length = self.arc(strand.end - 1).max(1e-9);
            for point in strand.clone() {
                let coverage = brush.strength * brush.mask.at(self.arc(point) / length);
                let mask = canvas.mask_at(point);
                match &canvas {
                    Canvas::Mask(_) => {
                        let after = brush.masked(mask, coverage);
                        if after != mask && (point as usize) < canvas.len() {
                            stroke.masked.push((point, mask, after));
                        }
                    }
                    Canvas::Paint(paint, _) => {
                        let Some(before) = paint.points.get(point as usize) else {
                            continue;
                        };
                        let coverage = coverage * (1.0 - mask);
                        let after = match brush.effect {
                            BrushEffect::Blur if coverage > 0.0 => {
                                let mean = self.mean_along(paint, brush, strand, point);
                                before.towards(&mean.unwrap_or(*before), coverage)
                            }
                            _ => brush.applied(before, coverage),
                        };
                        if after != *before {
                            stroke.changed.push((point, *before, after));
                        }
                    }
                }
            }
        }
        Ok(stroke)
    }

    /// Mean paint of a strand around one of its points, nearer ones counting more.
    fn mean_along(
        &self,
        paint: &Paint,
        brush: &Brush,
        strand: &std::ops::Range<u32>,
        point: u32,
    ) -> Option<PaintedPoint> {
        let mut mean = Mean::default();
        let mut see = |at: u32| {
            let nearness = brush.nearness((self.arc(at) - self.arc(point)).abs());
            if let (true, Some(paint)) = (nearness > 0.0, paint.points.get(at as usize)) {
                mean.add(paint, nearness);
            }
            nearness > 0.0
        };
        let _ = (point..strand.end).all(&mut see);
        let _ = (strand.start..point).rev().all(&mut see);
        mean.point()
    }
}
