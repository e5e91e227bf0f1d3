//! The parameters of the fibre model and their valid ranges.

/// A scattering mode of Marschner's model; the number of internal path segments is `p`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Lobe {
    /// Surface reflection, p = 0.
    R,
    /// Transmission through the fibre, p = 1.
    Tt,
    /// One internal reflection, p = 2.
    Trt,
}

impl Lobe {
    /// All modes, in the order of `p`.
    pub const ALL: [Lobe; 3] = [Lobe::R, Lobe::Tt, Lobe::Trt];

    /// Number of internal path segments: 0, 1, 2.
    pub const fn p(self) -> u32 {
        self as u32
    }

    /// The name used in files, flags and JSON: `R`, `TT`, `TRT`.
    pub const fn name(self) -> &'static str {
        match self {
            Lobe::R => "R",
            Lobe::Tt => "TT",
            Lobe::Trt => "TRT",
        }
    }

    /// The mode called `name` (see [`Lobe::name`]), or `None`.
    pub fn from_name(name: &str) -> Option<Lobe> {
        Lobe::ALL.into_iter().find(|lobe| lobe.name() == name)
    }
}

/// One value per mode.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PerLobe<T> {
    /// Value of R.
    pub r: T,
    /// Value of TT.
    pub tt: T,
    /// Value of TRT.
    pub trt: T,
}

impl<T: Copy> PerLobe<T> {
    /// The value of `lobe`.
    pub fn get(&self, lobe: Lobe) -> T {
        match lobe {
            Lobe::R => self.r,
            Lobe::Tt => self.tt,
            Lobe::Trt => self.trt,
        }
    }

    /// Applies `f` to each value.
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> PerLobe<U> {
        PerLobe {
            r: f(self.r),
            tt: f(self.tt),
            trt: f(self.trt),
        }
    }
}

/// Parameters of one hair fibre (Xu 2011 Table 1). All angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HairParams {
    /// Index of refraction, 1.0001..=3.
    pub eta: f64,
    /// Absorption per fibre radius, linear RGB, 0..=50.
    pub sigma_a: [f64; 3],
    /// Longitudinal shift alpha_t in the half angle theta_h, +-0.5.
    pub shift: PerLobe<f64>,
    /// Longitudinal width beta_t in theta_h in Xu's sense, sqrt(2) * standard deviation,
    /// 0.001..=1.5.
    pub width: PerLobe<f64>,
    /// Azimuthal width w_c of the TRT caustic in Xu's sense, 0.01..=1.5.
    pub caustic_width: f64,
    /// Eccentricity a of the cross section (Eq 24), 0.5..=2; 1 is circular.
    pub eccentricity: f64,
}

impl Default for HairParams {
    /// Brown hair: eta 1.55, widths and shifts in the middle of Marschner's Table 1, a caustic
    /// of 6 degrees standard deviation.
    fn default() -> Self {
        let deg = std::f64::consts::PI / 180.0;
        let std_dev = std::f64::consts::SQRT_2 * deg;
        HairParams {
            eta: 1.55,
            sigma_a: [0.26, 0.42, 0.83],
            shift: PerLobe {
                r: -7.0 * deg,
                tt: 3.5 * deg,
                trt: 10.5 * deg,
            },
            width: PerLobe {
                r: 7.0 * std_dev,
                tt: 3.5 * std_dev,
                trt: 14.0 * std_dev,
            },
            caustic_width: 6.0 * std_dev,
            eccentricity: 1.0,
        }
    }
}

/// A parameter of a fibre or a light outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("parameter {field} is {value:?}, outside {min}..={max}")]
pub struct ParamError {
    /// Name of the field, e.g. `width.tt`.
    pub field: &'static str,
    /// The offending value.
    pub value: f64,
    /// Smallest accepted value.
    pub min: f64,
    /// Largest accepted value.
    pub max: f64,
}

/// Range of the widths beta.
pub(crate) const WIDTH_MIN: f64 = 0.001;
/// See [`WIDTH_MIN`].
pub(crate) const WIDTH_MAX: f64 = 1.5;
/// Largest shift alpha to either side.
pub(crate) const SHIFT_MAX: f64 = 0.5;

/// `value` must be a number in `min..=max`; NaN is outside every range.
pub(crate) fn in_range(
    field: &'static str,
    value: f64,
    min: f64,
    max: f64,
) -> Result<(), ParamError> {
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(ParamError {
            field,
            value,
            min,
            max,
        })
    }
}

impl HairParams {
    /// `[eta*_1, eta*_2]` of Xu 2011 Eq 24, the indices of an elliptic fibre along its axes, both
    /// eta for a circular one; not clamped: strong eccentricities take them below 1.
    pub fn elliptic_indices(&self) -> [f64; 2] {
        let square = self.eccentricity * self.eccentricity;
        let excess = 2.0 * (self.eta - 1.0);
        [excess * square, excess / square].map(|part| part - self.eta + 2.0)
    }

    /// The hair with all widths times `width` and all shifts times `shift`, kept in their ranges.
    pub fn scaled(&self, width: f64, shift: f64) -> HairParams {
        HairParams {
            width: self
                .width
                .map(|beta| (beta * width).clamp(WIDTH_MIN, WIDTH_MAX)),
            shift: self
                .shift
                .map(|alpha| (alpha * shift).clamp(-SHIFT_MAX, SHIFT_MAX)),
            ..*self
        }
    }

    /// Every number of a fibre: its name, smallest and largest accepted value; in the order of
    /// [`HairParams::to_array`].
    pub const RANGES: [(&'static str, f64, f64); 12] = [
        ("eta", 1.0001, 3.0),
        ("sigma_a[0]", 0.0, 50.0),
        ("sigma_a[1]", 0.0, 50.0),
        ("sigma_a[2]", 0.0, 50.0),
        ("shift.r", -SHIFT_MAX, SHIFT_MAX),
        ("shift.tt", -SHIFT_MAX, SHIFT_MAX),
        ("shift.trt", -SHIFT_MAX, SHIFT_MAX),
        ("width.r", WIDTH_MIN, WIDTH_MAX),
        ("width.tt", WIDTH_MIN, WIDTH_MAX),
        ("width.trt", WIDTH_MIN, WIDTH_MAX),
        ("caustic_width", 0.01, 1.5),
        ("eccentricity", 0.5, 2.0),
    ];

    /// All numbers, in the order of [`HairParams::RANGES`].
    pub fn to_array(&self) -> [f64; 12] {
        let [r, g, b] = self.sigma_a;
        let (shift, width) = (self.shift, self.width);
        [
            self.eta,
            r,
            g,
            b,
            shift.r,
            shift.tt,
            shift.trt,
            width.r,
            width.tt,
            width.trt,
            self.caustic_width,
            self.eccentricity,
        ]
    }

    /// Checks every field against its documented range; NaN is outside every range.
    ///
    /// # Errors
    /// The first field outside its range, by name and value.
    pub fn validate(&self) -> Result<(), ParamError> {
        let fields = Self::RANGES.into_iter().zip(self.to_array());
        for ((field, min, max), value) in fields {
            in_range(field, value, min, max)?;
        }
        Ok(())
    }
}
