//! The brush: what it does to a point, and how much of it a point gets.

use strandlight_formats::{MAX_SCALE, MAX_SIGMA_A, MIN_SCALE};

use super::PaintedPoint;
pub use crate::error::BrushError;

/// What a brush does to hair: to its paint, or to the mask that protects paint from brushes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BrushEffect {
    /// Dye of this absorption per fibre radius, linear RGB, over what is there.
    Dye([f32; 3]),
    /// Widths times this; 1 is the hair's own.
    WidthScale(f32),
    /// Shifts times this; 1 is the hair's own.
    ShiftScale(f32),
    /// Takes all paint off.
    Erase,
    /// Towards the mean paint of the hair in the ball.
    Blur,
    /// Takes up the paint that it goes over and lays it on along its way.
    Smear,
    /// The mask towards this: 1 protects the paint from brushes, 0 releases it.
    Protect(f32),
    /// The mask towards its opposite: what is protected is released, and the rest protected.
    InvertProtection,
}

impl BrushEffect {
    /// Does it change the mask, and no paint?
    pub fn is_of_mask(self) -> bool {
        matches!(
            self,
            BrushEffect::Protect(_) | BrushEffect::InvertProtection
        )
    }
}

/// Where along a strand a brush works, in shares of its length: 0 at the root, 1 at the tip.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BrushMask {
    /// It works fully from here ...
    pub from: f32,
    /// ... to here,
    pub to: f32,
    /// and less and less over this much beyond either end.
    pub soft: f32,
}

impl Default for BrushMask {
    /// The whole strand.
    fn default() -> Self {
        BrushMask {
            from: 0.0,
            to: 1.0,
            soft: 0.1,
        }
    }
}

impl BrushMask {
    /// How much the brush does at `place` (0 root..=1 tip) of a strand, 0..=1.
    pub fn at(&self, place: f32) -> f32 {
        let beyond = (self.from - place).max(place - self.to).max(0.0);
        if beyond <= 0.0 {
            return 1.0;
        }
        smooth(1.0 - beyond / self.soft.max(1e-6))
    }
}

/// A brush: a ball that moves through hair.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Brush {
    /// Radius of the ball, cm, > 0.
    pub radius_cm: f32,
    /// How much a stroke does where the ball's centre went, 0..=1. Going over a point again
    /// within one stroke does no more.
    pub strength: f32,
    /// Effect of the brush; scripts may also call it `what`.
    #[serde(alias = "what")]
    pub effect: BrushEffect,
    /// Share of the radius, from the edge inwards, over which the brush does less and less: 0
    /// for a hard edge, 1 for one that falls from the centre on.
    pub softness: f32,
    /// How far along its strand a touched point carries, cm: one at the centre so far, one at the
    /// edge not at all. 0 keeps the paint inside the ball.
    pub along_cm: f32,
    /// Do the same at the other side of the plane x = 0 of the groom.
    pub is_symmetric: bool,
    /// Where along the strands it works.
    pub mask: BrushMask,
}

impl Default for Brush {
    fn default() -> Self {
        Brush {
            radius_cm: 1.5,
            strength: 1.0,
            effect: BrushEffect::Dye([0.2, 1.4, 3.0]),
            softness: 0.5,
            along_cm: 0.0,
            is_symmetric: false,
            mask: BrushMask::default(),
        }
    }
}

/// Largest radius and reach along strands, cm.
const MAX_LENGTH_CM: f32 = 1e4;

impl Brush {
    /// Checks all values.
    ///
    /// # Errors
    /// The first value outside its range.
    pub fn validate(&self) -> Result<(), BrushError> {
        let [r, g, b] = match self.effect {
            BrushEffect::Dye(sigma_a) => sigma_a,
            _ => [0.0; 3],
        };
        let scale = match self.effect {
            BrushEffect::WidthScale(scale) | BrushEffect::ShiftScale(scale) => scale,
            _ => 1.0,
        };
        let protect = match self.effect {
            BrushEffect::Protect(protect) => protect,
            _ => 0.0,
        };
        for (key, value, min, max) in [
            ("radius_cm", self.radius_cm, 1e-4, MAX_LENGTH_CM),
            ("strength", self.strength, 0.0, 1.0),
            ("dye[0]", r, 0.0, MAX_SIGMA_A),
            ("dye[1]", g, 0.0, MAX_SIGMA_A),
            ("dye[2]", b, 0.0, MAX_SIGMA_A),
            ("scale", scale, MIN_SCALE, MAX_SCALE),
            ("protect", protect, 0.0, 1.0),
            ("softness", self.softness, 0.0, 1.0),
            ("along_cm", self.along_cm, 0.0, MAX_LENGTH_CM),
            ("mask.to", self.mask.to, 0.0, 1.0),
            // The other way round it would paint nothing.
            ("mask.from", self.mask.from, 0.0, self.mask.to),
            ("mask.soft", self.mask.soft, 0.0, 1.0),
        ] {
            if !(min..=max).contains(&value) {
                return Err(BrushError {
                    key,
                    value,
                    min,
                    max,
                });
            }
        }
        Ok(())
    }

    /// How near the centre a point `distance` cm from it is: 1 there, 0 and below outside.
    pub(crate) fn nearness(&self, distance: f32) -> f32 {
        1.0 - distance / self.radius_cm
    }

    /// What is left of a nearness `length` cm further along the strand.
    pub fn carried(&self, nearness: f32, length: f32) -> f32 {
        if length <= 0.0 {
            return nearness;
        }
        nearness - length / self.along_cm.max(1e-9)
    }

    /// How much of the brush a point gets, 0..=1, with this nearness at this place (0 root..=1
    /// tip) of its strand.
    pub fn coverage(&self, nearness: f32, place: f32) -> f32 {
        if nearness <= 0.0 {
            return 0.0;
        }
        let edge = smooth(nearness / self.softness.max(1e-6));
        self.strength * edge * self.mask.at(place)
    }

    /// `point` under the brush with this coverage, 0..=1. Dye covers what is there; scales go
    /// towards the brush's by factors. What blur and smear lay on depends on the hair around: here they do
    /// nothing, as do brushes for the mask.
    pub fn applied(&self, point: &PaintedPoint, coverage: f32) -> PaintedPoint {
        if coverage <= 0.0 {
            return *point;
        }
        let a = coverage.min(1.0);
        let towards = |from: f32, to: f32| {
            if a >= 1.0 {
                to
            } else {
                from.powf(1.0 - a) * to.powf(a)
            }
        };
        let mut painted = *point;
        match self.effect {
            BrushEffect::Dye(sigma_a) => {
                let dye = PaintedPoint {
                    sigma_a,
                    weight: 1.0,
                    ..*point
                };
                painted = point.mix(&dye, a);
            }
            BrushEffect::WidthScale(scale) => {
                painted.width_scale = towards(point.width_scale, scale)
            }
            BrushEffect::ShiftScale(scale) => {
                painted.shift_scale = towards(point.shift_scale, scale)
            }
            BrushEffect::Blur
            | BrushEffect::Smear
            | BrushEffect::Protect(_)
            | BrushEffect::InvertProtection => return *point,
            BrushEffect::Erase => {
                painted.weight *= 1.0 - a;
                painted.width_scale = towards(point.width_scale, 1.0);
                painted.shift_scale = towards(point.shift_scale, 1.0);
                if painted.weight == 0.0 {
                    painted.sigma_a = [0.0; 3];
                }
            }
        }
        painted.clamped()
    }

    /// A point's mask, 0..=1, under the brush with this coverage, 0..=1. Brushes for paint do nothing to it.
    pub fn masked(&self, mask: f32, coverage: f32) -> f32 {
        let to = match self.effect {
            BrushEffect::Protect(protect) => protect,
            BrushEffect::InvertProtection => 1.0 - mask,
            _ => return mask,
        };
        // False for NaN; exact at the ends, so that protected is protected wholly.
        if coverage >= 1.0 {
            return to;
        }
        match coverage > 0.0 {
            true => (mask + coverage * (to - mask)).clamp(0.0, 1.0),
            false => mask,
        }
    }
}

/// Where a stroke goes.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
pub enum StrokePath {
    /// Centres of the ball in world space, cm.
    World(Vec<[f32; 3]>),
    /// Places of the cursor, px from the upper left corner of the picture.
    Pixels(Vec<[f32; 2]>),
}

/// A stroke as scripts write it: `{"brush": {...}, "path": [[x_px, y_px], ...]}`, or points of
/// three coordinates in world space.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BrushStroke {
    /// The brush; what is left out is that of [`Brush::default`].
    #[serde(default)]
    pub brush: Brush,
    /// Where it goes.
    pub path: StrokePath,
}

/// Smooth step of `x`, 0 below 0 and 1 above 1.
fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_are_read_from_scripts() {
        let text = r#"{"brush": {"radius_cm": 2, "effect": {"dye": [0.1, 0.2, 3]},
            "mask": {"from": 0.5}}, "path": [[10, 20], [30.5, 40]]}"#;
        let stroke: BrushStroke = serde_json::from_str(text).unwrap();
        assert_eq!(stroke.brush.effect, BrushEffect::Dye([0.1, 0.2, 3.0]));
        assert_eq!((stroke.brush.mask.from, stroke.brush.mask.to), (0.5, 1.0));
        assert_eq!(
            stroke.path,
            StrokePath::Pixels(vec![[10.0, 20.0], [30.5, 40.0]])
        );
        let again = serde_json::to_string(&stroke).unwrap();
        assert_eq!(serde_json::from_str::<BrushStroke>(&again).unwrap(), stroke);
        let text = r#"{"brush": {"what": "erase"}, "path": [[1, 2, 3]]}"#;
        let stroke: BrushStroke = serde_json::from_str(text).unwrap();
        assert_eq!(stroke.brush.effect, BrushEffect::Erase);
        assert_eq!(stroke.path, StrokePath::World(vec![[1.0, 2.0, 3.0]]));
        let text =
            r#"{"brush": {"effect": {"protect": 1}, "mask": {"to": 0.5}}, "path": [[1, 2]]}"#;
        let stroke: BrushStroke = serde_json::from_str(text).unwrap();
        assert_eq!(stroke.brush.effect, BrushEffect::Protect(1.0));
        assert_eq!(stroke.brush.mask.to, 0.5);
        let invert: BrushEffect = serde_json::from_str(r#""invert_protection""#).unwrap();
        assert_eq!(invert, BrushEffect::InvertProtection);
        let wrong = r#"{"brush": {"radius": 2}, "path": []}"#;
        assert!(serde_json::from_str::<BrushStroke>(wrong).is_err());
    }

    #[test]
    fn values_outside_their_range_are_named() {
        assert_eq!(Brush::default().validate(), Ok(()));
        let wrong = Brush {
            effect: BrushEffect::WidthScale(0.0),
            ..Brush::default()
        };
        assert_eq!(wrong.validate().unwrap_err().key, "scale");
        for protect in [-0.1, 1.5, f32::NAN] {
            let wrong = Brush {
                effect: BrushEffect::Protect(protect),
                ..Brush::default()
            };
            assert_eq!(wrong.validate().unwrap_err().key, "protect");
        }
        let wrong = Brush {
            radius_cm: f32::NAN,
            ..Brush::default()
        };
        assert_eq!(wrong.validate().unwrap_err().key, "radius_cm");
        let mut wrong = Brush::default();
        (wrong.mask.from, wrong.mask.to) = (0.9, 0.1);
        let error = wrong.validate().unwrap_err().to_string();
        assert_eq!(error, "brush: mask.from = 0.9 must be in 0..=0.1");
    }

    #[test]
    fn paint_covers_and_comes_off() {
        let with = |effect| Brush {
            effect,
            ..Brush::default()
        };
        let red = with(BrushEffect::Dye([0.0, 3.0, 3.0]));
        let point = red.applied(&PaintedPoint::NONE, 0.5);
        assert_eq!((point.sigma_a, point.weight), ([0.0, 3.0, 3.0], 0.5));
        let blue = with(BrushEffect::Dye([3.0, 3.0, 0.0]));
        let point = blue.applied(&point, 1.0);
        assert_eq!((point.sigma_a, point.weight), ([3.0, 3.0, 0.0], 1.0));
        let wide = with(BrushEffect::WidthScale(4.0)).applied(&point, 0.5);
        assert!((wide.width_scale - 2.0).abs() < 1e-6);
        assert_eq!(
            with(BrushEffect::Erase).applied(&wide, 1.0),
            PaintedPoint::NONE
        );
        assert_eq!(red.applied(&wide, 0.0), wide);
    }

    #[test]
    fn coverage_falls_to_the_edge_and_beyond_the_mask() {
        let brush = Brush {
            mask: BrushMask {
                from: 0.4,
                to: 0.6,
                soft: 0.2,
            },
            along_cm: 2.0,
            ..Brush::default()
        };
        assert_eq!(brush.coverage(brush.nearness(0.0), 0.5), 1.0);
        assert_eq!(brush.coverage(brush.nearness(1.5), 0.5), 0.0);
        assert_eq!(brush.coverage(1.0, 0.1), 0.0);
        let soft = brush.coverage(1.0, 0.3);
        assert!((soft - 0.5).abs() < 1e-5, "{soft}");
        assert_eq!(brush.carried(1.0, 1.0), 0.5);
        let hard = Brush {
            softness: 0.0,
            ..brush
        };
        assert_eq!(hard.coverage(hard.nearness(1.49), 0.5), 1.0);
    }
}
