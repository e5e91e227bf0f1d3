//! What of hair is painted.

use super::PaintedPoint;

/// Which factors other than 1 are painted anywhere; dye may be in any case. Shading reads tables
/// over those factors, and is compiled for them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct PaintKinds {
    /// Of widths.
    pub widths: bool,
    /// Of shifts.
    pub shifts: bool,
}

impl PaintKinds {
    /// Of these points.
    pub fn of(points: &[PaintedPoint]) -> PaintKinds {
        PaintKinds {
            widths: points.iter().any(|point| point.width_scale != 1.0),
            shifts: points.iter().any(|point| point.shift_scale != 1.0),
        }
    }

    /// The features that the shaders of painted hair are compiled with.
    pub fn features(self) -> Vec<&'static str> {
        let mut features = vec!["PAINTED"];
        if self.widths {
            features.push("PAINTED_WIDTHS");
        }
        if self.shifts {
            features.push("PAINTED_SHIFTS");
        }
        features
    }

    /// Of both.
    pub fn or(self, other: PaintKinds) -> PaintKinds {
        PaintKinds {
            widths: self.widths || other.widths,
            shifts: self.shifts || other.shifts,
        }
    }
}
