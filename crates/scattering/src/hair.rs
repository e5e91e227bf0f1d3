//! The parameters of the fibre model and their valid ranges.

/// A scattering mode of Marschner's model; the number of internal path segments is `p`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Lobe {
    /// Surface reflection, p = 0.
    R,
    /// Transmission through the fibre, p = 1.
    #[cfg_attr(feature = "serde", serde(rename = "TT"))]
    Tt,
    /// One internal reflection, p = 2.
    #[cfg_attr(feature = "serde", serde(rename = "TRT"))]
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

/// The fibre model: the form of M_t, where N_t is taken, and which orders there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
pub enum Model {
    /// Marschner's R, TT and TRT: a Gaussian M_t over `cos^2 theta_d`, N_t at theta_d. Reciprocal; loses
    /// and gains energy.
    #[default]
    Marschner,
    /// M_t of d'Eon 2011, a von Mises-Fisher lobe; N_t at theta_o; TRT with all orders beyond it. A
    /// fibre without absorption sends on all of the light, whichever direction it is seen from.
    Energy,
}

impl Model {
    /// All of them.
    pub const ALL: [Model; 2] = [Model::Marschner, Model::Energy];

    /// The name used in files, flags and JSON: `marschner`, `energy`.
    pub const fn name(self) -> &'static str {
        match self {
            Model::Marschner => "marschner",
            Model::Energy => "energy",
        }
    }

    /// The model called `name` (see [`Model::name`]), or `None`.
    pub fn from_name(name: &str) -> Option<Model> {
        Model::ALL.into_iter().find(|model| model.name() == name)
    }
}

/// One value per mode.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
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

/// One degree in radians.
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Xu's width of a lobe whose standard deviation is one degree.
const STD_DEV: f64 = std::f64::consts::SQRT_2 * DEGREE;

/// A parameter's numbers as three: one number fills all of them.
trait Triple: Copy {
    fn to_triple(self) -> [f64; 3];
    fn from_triple(triple: [f64; 3]) -> Self;
}

impl Triple for f64 {
    fn to_triple(self) -> [f64; 3] {
        [self; 3]
    }

    fn from_triple([value, ..]: [f64; 3]) -> f64 {
        value
    }
}

impl Triple for [f64; 3] {
    fn to_triple(self) -> [f64; 3] {
        self
    }

    fn from_triple(triple: [f64; 3]) -> [f64; 3] {
        triple
    }
}

impl Triple for PerLobe<f64> {
    fn to_triple(self) -> [f64; 3] {
        [self.r, self.tt, self.trt]
    }

    fn from_triple([r, tt, trt]: [f64; 3]) -> PerLobe<f64> {
        PerLobe { r, tt, trt }
    }
}

/// What the numbers of a [`Parameter`] are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterShape {
    /// One number.
    Number,
    /// One for each of red, green and blue.
    Rgb,
    /// One for each mode.
    PerLobe,
}

/// Makes [`HairParams`] and [`Parameter`] of one row a parameter: its name in [`Parameter`] and
/// in [`HairParams`], what it has of numbers, their range, and the default.
macro_rules! hair_params {
    ($($(#[$doc:meta])* $variant:ident = $field:ident: $shape:ident, $min:expr, $max:expr, $default:expr;)*) => {
        /// Parameters of one hair fibre (Xu 2011 Table 1). All angles in radians; ranges are
        /// those of [`Parameter::range`].
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        pub struct HairParams {
            $($(#[$doc])* pub $field: hair_params!(@type $shape),)*
            /// The fibre model.
            pub model: Model,
        }

        impl Default for HairParams {
            /// Brown hair: widths and shifts in the middle of Marschner's Table 1.
            fn default() -> Self {
                HairParams { $($field: $default,)* model: Model::Marschner }
            }
        }

        /// A field of [`HairParams`] that is numbers.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Parameter {
            $($(#[$doc])* $variant,)*
        }

        impl Parameter {
            /// All of them, in the order of their numbers.
            pub const ALL: [Parameter; [$(stringify!($field)),*].len()] = [$(Parameter::$variant),*];

            /// Name of the field.
            pub const fn name(self) -> &'static str {
                match self { $(Parameter::$variant => stringify!($field),)* }
            }

            /// What its numbers are.
            pub const fn shape(self) -> ParameterShape {
                match self { $(Parameter::$variant => hair_params!(@shape $shape),)* }
            }

            /// Names of its numbers, as in `width.tt` and `sigma_a[0]`.
            pub const fn numbers(self) -> &'static [&'static str] {
                match self { $(Parameter::$variant => hair_params!(@numbers $shape $field),)* }
            }

            /// Smallest and largest value of each of its numbers.
            pub const fn range(self) -> [f64; 2] {
                match self { $(Parameter::$variant => [$min, $max],)* }
            }

            /// Its numbers; a single one fills all three.
            pub fn get(self, hair: &HairParams) -> [f64; 3] {
                match self { $(Parameter::$variant => hair.$field.to_triple(),)* }
            }

            /// Sets its numbers, of which a parameter of a single one takes the first.
            pub fn set(self, hair: &mut HairParams, values: [f64; 3]) {
                match self { $(Parameter::$variant => hair.$field = Triple::from_triple(values),)* }
            }
        }
    };
    (@type number) => { f64 };
    (@type rgb) => { [f64; 3] };
    (@type per_lobe) => { PerLobe<f64> };
    (@shape number) => { ParameterShape::Number };
    (@shape rgb) => { ParameterShape::Rgb };
    (@shape per_lobe) => { ParameterShape::PerLobe };
    (@numbers number $field:ident) => { &[stringify!($field)] };
    (@numbers rgb $field:ident) => {
        &[
            concat!(stringify!($field), "[0]"),
            concat!(stringify!($field), "[1]"),
            concat!(stringify!($field), "[2]"),
        ]
    };
    (@numbers per_lobe $field:ident) => {
        &[
            concat!(stringify!($field), ".r"),
            concat!(stringify!($field), ".tt"),
            concat!(stringify!($field), ".trt"),
        ]
    };
}

hair_params! {
    /// Index of refraction.
    Eta = eta: number, 1.0001, 3.0, 1.55;
    /// Absorption per fibre radius, linear RGB.
    SigmaA = sigma_a: rgb, 0.0, 50.0, [0.26, 0.42, 0.83];
    /// Longitudinal shift alpha_t in the half angle theta_h.
    Shift = shift: per_lobe, -0.5, 0.5, HairParams::DEFAULT_SHIFT_DEG.map(|shift| shift * DEGREE);
    /// Longitudinal width beta_t in theta_h in Xu's sense, sqrt(2) * standard deviation.
    Width = width: per_lobe, 0.001, 1.5, HairParams::DEFAULT_WIDTH_DEG.map(|width| width * STD_DEV);
    /// Azimuthal width w_c of the TRT caustic in Xu's sense.
    CausticWidth = caustic_width: number, 0.01, 1.5, HairParams::DEFAULT_CAUSTIC_WIDTH_DEG * STD_DEV;
    /// Eccentricity a of the cross section (Eq 24); 1 is circular.
    Eccentricity = eccentricity: number, 0.5, 2.0, 1.0;
    /// Factor on what each mode scatters; 1 is the fibre of the model.
    Intensity = intensity: per_lobe, 0.0, 1.0, PerLobe { r: 1.0, tt: 1.0, trt: 1.0 };
}

/// All that tells one fibre from another.
pub type HairBits = (Model, [[u64; 3]; Parameter::ALL.len()]);

impl Parameter {
    /// Does it differ between `a` and `b`, in any bit? -0 and 0 make textures that differ in
    /// theirs.
    pub fn differs(self, a: &HairParams, b: &HairParams) -> bool {
        self.get(a).map(f64::to_bits) != self.get(b).map(f64::to_bits)
    }

    /// `value` inside the range.
    pub fn clamp(self, value: f64) -> f64 {
        let [min, max] = self.range();
        value.clamp(min, max)
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
    /// Shifts of the default hair, degrees.
    pub const DEFAULT_SHIFT_DEG: PerLobe<f64> = PerLobe {
        r: -7.0,
        tt: 3.5,
        trt: 10.5,
    };
    /// Widths of the default hair as standard deviations, degrees.
    pub const DEFAULT_WIDTH_DEG: PerLobe<f64> = PerLobe {
        r: 7.0,
        tt: 3.5,
        trt: 14.0,
    };
    /// Width of the default hair's caustic as a standard deviation, degrees.
    pub const DEFAULT_CAUSTIC_WIDTH_DEG: f64 = 6.0;

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
            width: self.width.map(|beta| Parameter::Width.clamp(beta * width)),
            shift: self
                .shift
                .map(|alpha| Parameter::Shift.clamp(alpha * shift)),
            ..*self
        }
    }

    /// The model and the bits of all numbers: hair of the same has the same textures.
    pub fn bits(&self) -> HairBits {
        let numbers = Parameter::ALL.map(|parameter| parameter.get(self).map(f64::to_bits));
        (self.model, numbers)
    }

    /// Checks every field against its documented range; NaN is outside every range.
    ///
    /// # Errors
    /// The first field outside its range, by name and value.
    pub fn validate(&self) -> Result<(), ParamError> {
        for parameter in Parameter::ALL {
            let [min, max] = parameter.range();
            let values = parameter.get(self);
            for (field, value) in parameter.numbers().iter().zip(values) {
                in_range(field, value, min, max)?;
            }
        }
        match self.model {
            Model::Marschner => Ok(()),
            // All orders of an elliptic fibre would need their share at every half angle.
            Model::Energy => in_range("eccentricity of model energy", self.eccentricity, 1.0, 1.0),
        }
    }
}
