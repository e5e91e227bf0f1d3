//! A brush over all hair at once.

use super::mean::Mean;
use super::{Brush, BrushEffect, BrushError, Paint, PaintedPoint, Picker, Stroke};

impl Picker {
    /// What `brush` does to `paint`, which stays as it is, if it covers all hair: with its strength, where its
    /// mask has it. Blur takes the mean of each strand within its radius of a point, smear does nothing.
    ///
    /// # Errors
    /// The first value of the brush outside its range.
    pub fn flood(&self, paint: &Paint, brush: &Brush) -> Result<Stroke, BrushError> {
        brush.validate()?;
        let mut changed = Vec::new();
        if brush.effect == BrushEffect::Smear {
            return Ok(Stroke { changed });
        }
        for strand in self.strands() {
            let length = self.arc(strand.end - 1).max(1e-9);
            for point in strand.clone() {
                let Some(before) = paint.points.get(point as usize) else {
                    continue;
                };
                let coverage = brush.strength * brush.mask.at(self.arc(point) / length);
                let after = match brush.effect {
                    BrushEffect::Blur if coverage > 0.0 => {
                        let mean = self.mean_along(paint, brush, strand, point);
                        before.towards(&mean.unwrap_or(*before), coverage)
                    }
                    _ => brush.applied(before, coverage),
                };
                if after != *before {
                    changed.push((point, *before, after));
                }
            }
        }
        Ok(Stroke { changed })
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
