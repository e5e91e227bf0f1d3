//! How the axes of the tables map parameters to texels, in f64 for the baker and f32 for the
//! renderer.
//!
//! An axis warps its variable, `w(x)`, and spaces texel *centres* evenly in `w`: the first centre
//! (`u = 0`) is at `min`, the last (`u = 1`) at `max`,
//!
//! `u(x) = (w(x) - w(min)) / (w(max) - w(min))`, texel coordinate = `u (count - 1)`.
//!
//! Value to unit, the direction the renderer needs, costs a few square roots; the inverse is
//! only needed by the baker and may iterate.

/// The warp `w` of an axis. `w` is strictly monotone on the domain given here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spacing {
    /// `w = x`.
    Linear,
    /// `w = ln x`, x > 0.
    Log,
    /// `w = (t + sqrt t) / 2`, `t = 1 / sqrt(1 + x)`, x >= 0, falling from 1. For
    /// `x = kappa = 2 / lambda_p^2`: like `sqrt(lambda_p)` for narrow lights, and even in `kappa`
    /// near 0, so that the infinitely wide light is a texel.
    InverseSqrt,
    /// `w = 0.6 sqrt x + 0.4 x^2`, 0 <= x <= 1: dense at both ends.
    RootSquare,
    /// `w = (r + r^2) / 2`, `r = 1 - 1/x`, x >= 1: dense near 1.
    Reciprocal,
    /// `w = 1.3 x - 0.3 x^2`, 0 <= x <= 1: slope from 1.3 to 0.7, denser near 0.
    Concave,
}

/// One axis: `count` texel centres from `min` to `max`, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Value at the first texel centre.
    pub min: f64,
    /// Value at the last texel centre, above `min`.
    pub max: f64,
    /// Number of texels, at least 2.
    pub count: u32,
    /// Placement of the centres between.
    pub spacing: Spacing,
}

impl Spacing {
    /// Every spacing.
    pub const ALL: &[Spacing] = &[
        Spacing::Linear,
        Spacing::Log,
        Spacing::InverseSqrt,
        Spacing::RootSquare,
        Spacing::Reciprocal,
        Spacing::Concave,
    ];

    /// Name in files, which hold nothing else of it: variants may be added in any order.
    pub const fn name(self) -> &'static str {
        match self {
            Spacing::Linear => "linear",
            Spacing::Log => "log",
            Spacing::InverseSqrt => "inverse-sqrt",
            Spacing::RootSquare => "root-square",
            Spacing::Reciprocal => "reciprocal",
            Spacing::Concave => "concave",
        }
    }

    /// The spacing called `name`.
    pub fn from_name(name: &str) -> Option<Spacing> {
        let mut all = Spacing::ALL.iter().copied();
        all.find(|spacing| spacing.name() == name)
    }

    /// Is `w` strictly monotone from `min` to `max`?
    pub fn accepts_range(self, min: f64, max: f64) -> bool {
        match self {
            Spacing::Linear => true,
            Spacing::Log => min > 0.0,
            Spacing::InverseSqrt => min >= 0.0,
            Spacing::RootSquare | Spacing::Concave => min >= 0.0 && max <= 1.0,
            Spacing::Reciprocal => min >= 1.0,
        }
    }

    /// The warp `w(x)`.
    pub fn warp(self, x: f64) -> f64 {
        match self {
            Spacing::Linear => x,
            Spacing::Log => x.ln(),
            Spacing::InverseSqrt => {
                let t = 1.0 / (1.0 + x).sqrt();
                0.5 * (t + t.sqrt())
            }
            Spacing::RootSquare => 0.6 * x.sqrt() + 0.4 * x * x,
            Spacing::Reciprocal => {
                let r = 1.0 - 1.0 / x;
                0.5 * (r + r * r)
            }
            Spacing::Concave => x * (1.3 - 0.3 * x),
        }
    }

    /// [`Spacing::warp`] in f32, operation for operation (and in WGSL).
    pub fn warp_f32(self, x: f32) -> f32 {
        match self {
            Spacing::Linear => x,
            Spacing::Log => x.ln(),
            Spacing::InverseSqrt => {
                let t = 1.0 / (1.0 + x).sqrt();
                0.5 * (t + t.sqrt())
            }
            Spacing::RootSquare => 0.6 * x.sqrt() + 0.4 * x * x,
            Spacing::Reciprocal => {
                let r = 1.0 - 1.0 / x;
                0.5 * (r + r * r)
            }
            Spacing::Concave => x * (1.3 - 0.3 * x),
        }
    }
}

impl Axis {
    /// Position of `value` in 0..=1; values outside `min..=max` (and NaN) are clamped to an end.
    pub fn unit_from_value(&self, value: f64) -> f64 {
        self.unit_between(self.warped_ends(), value)
    }

    fn warped_ends(&self) -> [f64; 2] {
        [self.spacing.warp(self.min), self.spacing.warp(self.max)]
    }

    /// [`Axis::unit_from_value`], given the warped ends.
    fn unit_between(&self, [first, last]: [f64; 2], value: f64) -> f64 {
        let x = value.max(self.min).min(self.max);
        ((self.spacing.warp(x) - first) / (last - first)).clamp(0.0, 1.0)
    }

    /// The value at `unit` in 0..=1 (clamped): inverse of [`Axis::unit_from_value`] by bisection,
    /// to the resolution of f64; exact at both ends.
    pub fn value_from_unit(&self, unit: f64) -> f64 {
        if unit.is_nan() || unit <= 0.0 {
            return self.min;
        }
        if unit >= 1.0 {
            return self.max;
        }
        if self.spacing == Spacing::Linear {
            return self.min + (self.max - self.min) * unit;
        }
        let ends = self.warped_ends();
        let (mut low, mut high) = (self.min, self.max);
        // Ends when the midpoint no longer splits the interval; some 1100 halvings at most,
        // 60 to 90 in practice.
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return middle;
            }
            if self.unit_between(ends, middle) < unit {
                low = middle;
            } else {
                high = middle;
            }
        }
    }

    /// The value at texel centre `ix`.
    pub fn value_at(&self, ix: u32) -> f64 {
        self.value_from_unit(f64::from(ix) / f64::from(self.count.max(2) - 1))
    }

    /// The f32 form, prepared for sampling.
    pub fn to_f32(&self) -> AxisF32 {
        let first = self.spacing.warp(self.min);
        let scale = f64::from(self.count.max(1) - 1) / (self.spacing.warp(self.max) - first);
        AxisF32 {
            spacing: self.spacing,
            min: self.min as f32,
            max: self.max as f32,
            warp_min: first as f32,
            scale: scale as f32,
            last: (self.count.max(1) - 1) as f32,
        }
    }
}

/// The f32 twin of [`Axis`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisF32 {
    /// The warp.
    pub spacing: Spacing,
    /// Smallest value.
    pub min: f32,
    /// Largest value.
    pub max: f32,
    /// `w(min)`.
    pub warp_min: f32,
    /// `(count - 1) / (w(max) - w(min))`.
    pub scale: f32,
    /// `count - 1`.
    pub last: f32,
}

impl AxisF32 {
    /// Texel coordinate of `value`, 0 at the first centre, `count - 1` at the last; clamped:
    /// `clamp((w(clamp(value, min, max)) - warp_min) * scale, 0, last)`.
    pub fn texel_from_value(&self, value: f32) -> f32 {
        let x = value.max(self.min).min(self.max);
        ((self.spacing.warp_f32(x) - self.warp_min) * self.scale)
            .max(0.0)
            .min(self.last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table_layout;

    fn axes() -> Vec<Axis> {
        let axis = |min, max, spacing| Axis {
            min,
            max,
            count: 37,
            spacing,
        };
        vec![
            axis(-2.0, 5.0, Spacing::Linear),
            axis(0.001, 10.0, Spacing::Log),
            table_layout::C_ROWS,
            table_layout::C_COLUMNS,
            table_layout::H_ROWS,
            table_layout::H_COLUMNS,
        ]
    }

    #[test]
    fn the_two_directions_are_inverse() {
        for axis in axes() {
            let mut before = f64::NEG_INFINITY;
            for step in 0..=1000 {
                let unit = f64::from(step) / 1000.0;
                let value = axis.value_from_unit(unit);
                assert!(value > before, "{axis:?} is not monotone at {unit}");
                before = value;
                let back = axis.unit_from_value(value);
                assert!((back - unit).abs() < 1e-12, "{axis:?} {unit} {back}");
            }
        }
    }

    #[test]
    fn ends_are_exact_and_outside_is_clamped() {
        for axis in axes() {
            assert_eq!(axis.value_at(0), axis.min);
            assert_eq!(axis.value_at(axis.count - 1), axis.max);
            assert_eq!(axis.unit_from_value(axis.min), 0.0);
            assert_eq!(axis.unit_from_value(axis.max), 1.0);
            assert_eq!(axis.unit_from_value(axis.min - 1.0), 0.0);
            assert_eq!(axis.unit_from_value(f64::INFINITY), 1.0);
            let twin = axis.to_f32();
            assert!(twin.texel_from_value(f32::NEG_INFINITY) < 1e-4);
            assert!((twin.texel_from_value(f32::MAX) - twin.last).abs() < 1e-4);
        }
    }

    #[test]
    fn f32_twin_agrees() {
        // 2e-4 of a texel moves a table value by less than 4e-6: neighbours differ by < 0.02.
        for axis in axes() {
            let twin = axis.to_f32();
            for step in 0..=1000 {
                let value = axis.value_from_unit(f64::from(step) / 1000.0) as f32;
                let exact = axis.unit_from_value(f64::from(value)) * f64::from(axis.count - 1);
                let got = f64::from(twin.texel_from_value(value));
                assert!((got - exact).abs() < 2e-4, "{axis:?} {value} {got} {exact}");
            }
        }
    }
}
