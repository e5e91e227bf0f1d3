//! Paint of one point.

use strandlight_formats::{MAX_SCALE, MAX_SIGMA_A, MIN_SCALE};
use strandlight_scattering::HairParams;
use strandlight_scattering::closed_form::{PaintTexel, PointPaint, pack_paint};

/// What is painted on a point of a strand.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PaintedPoint {
    /// Absorption of the dye per fibre radius, linear RGB, 0..=50. Means nothing at weight 0.
    pub sigma_a: [f32; 3],
    /// How much of the dye there is, 0..=1: the fibre has `mix(hair.sigma_a, sigma_a, weight)`.
    pub weight: f32,
    /// Factor of all longitudinal widths beta, 0.05..=20.
    pub width_scale: f32,
    /// Factor of all longitudinal shifts alpha, 0.05..=20.
    pub shift_scale: f32,
    /// Absorption of the hair around, 0..=50, where strands differ from one another; [`None`] where it is as the point. No
    /// part of what is painted: [`FibreVariation`](crate::variation::FibreVariation) finds it.
    #[serde(skip)]
    pub around: Option<[f32; 3]>,
}

impl Default for PaintedPoint {
    fn default() -> Self {
        PaintedPoint::NONE
    }
}

impl PaintedPoint {
    /// No paint: the hair as it is.
    pub const NONE: PaintedPoint = PaintedPoint {
        sigma_a: [0.0; 3],
        weight: 0.0,
        width_scale: 1.0,
        shift_scale: 1.0,
        around: None,
    };

    /// Does it make a difference to the hair?
    pub fn is_painted(&self) -> bool {
        let has_scales = self.width_scale != 1.0 || self.shift_scale != 1.0;
        self.weight > 0.0 || has_scales || self.around.is_some()
    }

    /// The point with every value inside its range; what is not a number becomes that of
    /// [`PaintedPoint::NONE`].
    pub fn clamped(self) -> PaintedPoint {
        let within = |x: f32, low: f32, high: f32, none: f32| {
            if x.is_nan() { none } else { x.clamp(low, high) }
        };
        let absorption = |sigma_a: [f32; 3]| sigma_a.map(|x| within(x, 0.0, MAX_SIGMA_A, 0.0));
        PaintedPoint {
            sigma_a: absorption(self.sigma_a),
            weight: within(self.weight, 0.0, 1.0, 0.0),
            width_scale: within(self.width_scale, MIN_SCALE, MAX_SCALE, 1.0),
            shift_scale: within(self.shift_scale, MIN_SCALE, MAX_SCALE, 1.0),
            around: self.around.map(absorption),
        }
    }

    /// A share `t` (0..=1) of the way to `other`, such that the fibre's absorption goes linearly:
    /// dyes count by their weights. At the ends exactly these.
    pub fn mix(&self, other: &PaintedPoint, t: f32) -> PaintedPoint {
        if t <= 0.0 || self == other {
            return *self;
        }
        if t >= 1.0 {
            return *other;
        }
        let (a, b) = ((1.0 - t) * self.weight, t * other.weight);
        let weight = a + b;
        let sigma_a = match weight > 0.0 {
            true => [0, 1, 2].map(|c| (a * self.sigma_a[c] + b * other.sigma_a[c]) / weight),
            false => [0.0; 3],
        };
        let around = self.around.zip(other.around);
        PaintedPoint {
            sigma_a,
            weight,
            width_scale: (1.0 - t) * self.width_scale + t * other.width_scale,
            shift_scale: (1.0 - t) * self.shift_scale + t * other.shift_scale,
            around: around.map(|(a, b)| [0, 1, 2].map(|c| (1.0 - t) * a[c] + t * b[c])),
        }
    }

    /// [`PaintedPoint::mix`], factors going by their logarithms, as brushes have it.
    pub fn towards(&self, other: &PaintedPoint, t: f32) -> PaintedPoint {
        if t <= 0.0 || t >= 1.0 {
            return self.mix(other, t);
        }
        let factor = |a: f32, b: f32| {
            if a == b {
                a
            } else {
                a.powf(1.0 - t) * b.powf(t)
            }
        };
        PaintedPoint {
            width_scale: factor(self.width_scale, other.width_scale),
            shift_scale: factor(self.shift_scale, other.shift_scale),
            ..self.mix(other, t)
        }
        .clamped()
    }

    /// The parameters of hair with this paint, for those who look at one fibre at a time: widths
    /// and shifts are kept in their ranges.
    pub fn on(&self, hair: &HairParams) -> HairParams {
        let weight = f64::from(self.weight);
        let mut painted = *hair;
        for (sigma_a, dye) in painted.sigma_a.iter_mut().zip(self.sigma_a) {
            *sigma_a = (1.0 - weight) * *sigma_a + weight * f64::from(dye);
        }
        painted.scaled(f64::from(self.width_scale), f64::from(self.shift_scale))
    }

    /// As the shaders have it.
    pub fn texel(&self) -> PaintTexel {
        pack_paint(&PointPaint {
            dye: self.sigma_a,
            weight: self.weight,
            width_scale: self.width_scale,
            shift_scale: self.shift_scale,
            around: self.around,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absorption_goes_linearly_between_points() {
        let hair = HairParams::default();
        let dyed = PaintedPoint {
            sigma_a: [3.0, 0.0, 1.0],
            weight: 0.8,
            width_scale: 2.0,
            shift_scale: 0.5,
            ..PaintedPoint::NONE
        };
        let bare = PaintedPoint::NONE;
        let (a, b) = (bare.on(&hair), dyed.on(&hair));
        for t in [0.0f32, 0.1, 0.5, 0.9, 1.0] {
            let mixed = bare.mix(&dyed, t).on(&hair);
            for c in 0..3 {
                let t = f64::from(t);
                let expected = (1.0 - t) * a.sigma_a[c] + t * b.sigma_a[c];
                assert!((mixed.sigma_a[c] - expected).abs() < 1e-6);
            }
            let width = hair.width.tt * (1.0 + f64::from(t));
            assert!((mixed.width.tt - width).abs() < 1e-7);
        }
        assert_eq!(bare.mix(&dyed, 1.0), dyed);
        assert_eq!(bare.mix(&bare, 0.3), bare);
    }

    #[test]
    fn values_are_brought_into_range() {
        let odd = PaintedPoint {
            sigma_a: [f32::NAN, -1.0, f32::INFINITY],
            weight: 7.0,
            width_scale: 0.0,
            shift_scale: f32::NAN,
            around: Some([-1.0, 60.0, 2.0]),
        };
        let clamped = odd.clamped();
        assert_eq!(clamped.sigma_a, [0.0, 0.0, 50.0]);
        assert_eq!((clamped.weight, clamped.width_scale), (1.0, 0.05));
        assert_eq!(clamped.shift_scale, 1.0);
        assert_eq!(clamped.around, Some([0.0, 50.0, 2.0]));
        assert_eq!(PaintedPoint::NONE.clamped(), PaintedPoint::NONE);
    }
}
