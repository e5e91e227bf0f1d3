//! How colours look, as ACES 2 reckons: Hellwig and Fairchild 2022 ("Brightness, lightness,
//! colorfulness, and chroma in CIECAM02 and CAM16") without the eccentricity of hues, in dim
//! surroundings and for an eye that is adapted to the white of the RGB space wholly.

use glam::{DMat3, DVec2, DVec3};

/// Lightness of white.
pub const J_WHITE: f64 = 100.0;

/// Lightness of middle grey on the display, which is to have 10.013 nits.
pub const GREY_J: f64 = 34.096_534_820_384_93;

/// F_L of CIECAM02 for the adapting luminance of 100 cd/m2 that ACES 2 takes: with k = 1 / 501,
/// `0.2 k^4 * 500 + 0.1 (1 - k^4)^2 * 500^(1/3)`.
const F_L: f64 = 0.793_700_527_546_167_3;

/// Response of a cone to `F_L`, thus to white.
const WHITE_RESPONSE: f64 = 0.032_368_026_251_385_52;

/// c z: exponent of lightness over the achromatic signal, 0.59 (1.48 + sqrt(0.2)); backgrounds have a
/// fifth of white's luminance.
pub const C_Z: f64 = 1.137_056_021_344_975;

/// Chromaticities of red, green, blue and white.
pub type Primaries = [[f64; 2]; 4];

pub const REC709: Primaries = [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.3290]];

pub const AP1: Primaries = [
    [0.713, 0.293],
    [0.165, 0.830],
    [0.128, 0.044],
    [0.32168, 0.33767],
];

/// Cones as ACES 2 has them, as if they were an RGB space.
const CONES: Primaries = [
    [0.8336, 0.1735],
    [2.3854, -1.4659],
    [0.087, -0.125],
    [0.333, 0.333],
];

/// XYZ of a chromaticity at Y = 1.
fn xyz_from_xy([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// XYZ, at Y = 1 for white.
fn xyz_from_rgb(primaries: &Primaries) -> DMat3 {
    let [red, green, blue, white] = primaries.map(xyz_from_xy);
    let unscaled = DMat3::from_cols(red, green, blue);
    unscaled * DMat3::from_diagonal(unscaled.inverse() * white)
}

/// From one RGB space to another, whose white is adapted to by Bradford's matrix as in the config of
/// ACES for OpenColorIO.
pub fn rgb_from_rgb(to: &Primaries, from: &Primaries) -> DMat3 {
    let bradford = DMat3::from_cols_array(&[
        0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296,
    ]);
    let [there, here] = [to[3], from[3]].map(|white| bradford * xyz_from_xy(white));
    let adapted = bradford.inverse() * DMat3::from_diagonal(there / here) * bradford;
    xyz_from_rgb(to).inverse() * adapted * xyz_from_rgb(from)
}

/// Response of a cone, in shares of the strongest; odd.
fn response(cone: f64) -> f64 {
    let x = cone.abs().powf(0.42);
    (x / (27.13 + x)).copysign(cone)
}

/// What a cone responds to so. Stronger responses than 0.99, which no picture has, count as that.
fn cone_of(response: f64) -> f64 {
    let x = response.abs().min(0.99);
    (27.13 * x / (1.0 - x)).powf(1.0 / 0.42).copysign(response)
}

/// Lightness of luminance in shares of white's.
pub fn lightness(luminance: f64) -> f64 {
    J_WHITE * (response(F_L * luminance) / WHITE_RESPONSE).powf(C_Z)
}

/// Luminance of an achromatic signal, both in shares of white's.
pub fn luminance(achromatic: f64) -> f64 {
    cone_of(WHITE_RESPONSE * achromatic) / F_L
}

/// Lightness of an achromatic signal.
fn lightness_of_signal(achromatic: f64) -> f64 {
    J_WHITE * achromatic.powf(C_Z)
}

/// Achromatic signal of lightness, in shares of white's.
pub fn signal(j: f64) -> f64 {
    (j / J_WHITE).powf(1.0 / C_Z)
}

/// A colour as it looks.
#[derive(Clone, Copy, Debug)]
pub struct Jmh {
    /// Lightness J, [`J_WHITE`] for white.
    pub j: f64,
    /// Colourfulness M.
    pub m: f64,
    /// Cosine and sine of the hue angle h.
    pub hue: DVec2,
}

/// The hue at an angle in degrees.
pub fn hue_at(degrees: f64) -> DVec2 {
    DVec2::from_angle(degrees.to_radians())
}

/// The angle of a hue, 0..360 degrees.
pub fn degrees(hue: DVec2) -> f64 {
    hue.to_angle().to_degrees().rem_euclid(360.0)
}

/// The signals A, a and b of the responses of cones: A is 1 for white.
fn opponents() -> DMat3 {
    // 43 N_c, of the 400 that responses end at in CAM16.
    const COLORFULNESS: f64 = 43.0 * 0.9 * 400.0;
    let achromatic = DVec3::new(2.0, 1.0, 0.05) / (3.05 * WHITE_RESPONSE);
    let a = COLORFULNESS * DVec3::new(1.0, -12.0 / 11.0, 1.0 / 11.0);
    let b = COLORFULNESS / 9.0 * DVec3::new(1.0, 1.0, -2.0);
    DMat3::from_cols(achromatic, a, b).transpose()
}

/// An RGB space as it looks to an eye that is adapted to its white.
pub struct Appearance {
    cones_from_rgb: DMat3,
    rgb_from_cones: DMat3,
    signals_from_responses: DMat3,
    responses_from_signals: DMat3,
}

impl Appearance {
    pub fn new(primaries: &Primaries) -> Appearance {
        let cones_from_rgb = xyz_from_rgb(&CONES).inverse() * xyz_from_rgb(primaries);
        let adapted = DMat3::from_diagonal(F_L / (cones_from_rgb * DVec3::ONE)) * cones_from_rgb;
        Appearance {
            cones_from_rgb: adapted,
            rgb_from_cones: adapted.inverse(),
            signals_from_responses: opponents(),
            responses_from_signals: opponents().inverse(),
        }
    }

    /// The achromatic signal and the look of linear RGB. What is darker than black is black.
    pub fn look(&self, rgb: DVec3) -> (f64, Jmh) {
        let cones = self.cones_from_rgb * rgb;
        let signals = self.signals_from_responses * cones.map(response);
        let chromatic = DVec2::new(signals.y, signals.z);
        let (m, hue) = match chromatic.length() {
            m if m > 0.0 && signals.x > 0.0 => (m, chromatic / m),
            _ => (0.0, DVec2::X),
        };
        let achromatic = signals.x.max(0.0);
        let j = lightness_of_signal(achromatic);
        (achromatic, Jmh { j, m, hue })
    }

    /// Linear RGB that looks so.
    pub fn rgb(&self, Jmh { j, m, hue }: Jmh) -> DVec3 {
        let signals = DVec3::new(signal(j), m * hue.x, m * hue.y);
        self.rgb_from_cones * (self.responses_from_signals * signals).map(cone_of)
    }
}
