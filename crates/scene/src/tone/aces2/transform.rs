//! Tone scale and compression of chroma of ACES 2, and the whole transform.

use std::sync::OnceLock;

use glam::{DMat3, DVec3};

use super::appearance::{
    AP1, Appearance, C_Z, J_WHITE, Jmh, REC709, degrees, lightness, luminance, rgb_from_rgb,
};
use super::gamut::Gamut;

/// Brightest radiance in AP1 that the transform takes: eight times that which is shown as white.
const BRIGHTEST: f64 = 1024.0;

/// Made once, in some milliseconds.
pub fn transform() -> &'static OutputTransform {
    static TRANSFORM: OnceLock<OutputTransform> = OnceLock::new();
    TRANSFORM.get_or_init(OutputTransform::new)
}

pub struct OutputTransform {
    ap1_from_rec709: DMat3,
    scene: Appearance,
    display: Appearance,
    gamut: Gamut,
}

impl OutputTransform {
    fn new() -> OutputTransform {
        let (scene, display) = (Appearance::new(&AP1), Appearance::new(&REC709));
        OutputTransform {
            ap1_from_rec709: rgb_from_rgb(&AP1, &REC709),
            gamut: Gamut::new(&scene, &display),
            scene,
            display,
        }
    }

    /// As [`aces2`](super::aces2), not clipped to 0..=1: compression ends near the edge of the display's gamut.
    pub fn shown(&self, rgb: [f32; 3]) -> [f32; 3] {
        let rgb = DVec3::from(rgb.map(|x| f64::from(x.max(0.0))));
        let in_ap1 = (self.ap1_from_rec709 * rgb).min(DVec3::splat(BRIGHTEST));
        let (achromatic, look) = self.scene.look(in_ap1);
        let gamut = self.gamut.at(degrees(look.hue));
        let j = lightness(tone_scale(luminance(achromatic)));
        let m = compressed_chroma(look, j, gamut.reach_m);
        let shown = gamut.compressed(Jmh { j, m, ..look });
        self.display.rgb(shown).as_vec3().to_array()
    }
}

/// Luminance in the scene at which [`tone_scale`], but for contrast and toe, is half of [`SCALE`]. Such
/// that 0.18 in the scene has 10 nits, and 128 has 100.
pub const HALF: f64 = 0.919_858_254_178_288_8;

/// What [`tone_scale`] tends to, but for its toe.
pub const SCALE: f64 = 1.047_103_762_443_455;

/// Scale of [`unit_of_m`] for white of 100 nits: `(0.03379 * 100)^0.30596 - 0.45135`.
pub const UNIT: f64 = 1.000_053_062_619_541_4;

/// The tone scale (Daniele): luminance on the display, in shares of white's, of luminance in the
/// scene. A curve of Michaelis and Menten with a toe: 0.18 is 0.1, 128 is 1.
pub fn tone_scale(luminance: f64) -> f64 {
    const CONTRAST: f64 = 1.15;
    const FLARE: f64 = 0.04;
    let x = SCALE * (luminance / (luminance + HALF)).powf(CONTRAST);
    x * x / (x + FLARE)
}

/// M after the tone scale has made the lightness of `look` `j`: scaled along, then compressed where
/// colours are bright and expanded where they are dark. `reach_m` is that of the hue.
fn compressed_chroma(look: Jmh, j: f64, reach_m: f64) -> f64 {
    const COMPRESSION: f64 = 2.4;
    const EXPANSION: f64 = 1.3;
    const EXPANSION_FROM: f64 = 0.005;
    if look.m == 0.0 {
        return 0.0;
    }
    let unit = unit_of_m(look);
    let light = j / J_WHITE;
    let dark = (1.0 - light).max(0.0);
    let limit = light.powf(1.0 / C_Z) * reach_m / unit;
    let scaled = look.m * (j / look.j).powf(1.0 / C_Z) / unit;
    let from = (light * light + EXPANSION_FROM).sqrt();
    let expanded = limit - toe(limit - scaled, limit - 0.001, EXPANSION * dark, from);
    unit * toe(expanded, limit, COMPRESSION * light, dark)
}

/// What M is measured in when chroma is compressed, by hue.
fn unit_of_m(Jmh { hue, .. }: Jmh) -> f64 {
    let twice = hue.rotate(hue);
    let thrice = twice.rotate(hue);
    let cosines = 11.34072 * hue.x + 16.46899 * twice.x + 7.88380 * thrice.x;
    let sines = 14.66441 * hue.y - 6.37224 * twice.y + 9.19364 * thrice.y;
    UNIT * (77.12896 + cosines + sines)
}

/// A curve through 0 and `limit` that is below `x` between them, the more the larger `k1` is and the
/// smaller `k2`. Beyond `limit`, `x`.
fn toe(x: f64, limit: f64, k1: f64, k2: f64) -> f64 {
    if x > limit {
        return x;
    }
    let k2 = k2.max(0.001);
    let k1 = k1.hypot(k2);
    let k3 = (limit + k1) / (limit + k2);
    let b = k3 * x - k1;
    0.5 * (b + (b * b + 4.0 * k2 * k3 * x).sqrt())
}
