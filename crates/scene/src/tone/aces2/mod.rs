//! ACES 2.

mod appearance;
mod gamut;

use glam::{DMat3, DVec3};

use appearance::{AP1, Appearance, C_Z, J_WHITE, Jmh, REC709, degrees, lightness, luminance, rgb_from_rgb};
use gamut::Gamut;

/// Luminance that the display has for middle grey, 0.18, in shares of white's.
const GREY_LUMINANCE: f64 = 0.10013;

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// The tone scale (Daniele): luminance that the display has for luminance in the scene.
fn tone_scale(luminance: f64) -> f64 {
    const CONTRAST: f64 = 1.15;
    const TOE: f64 = 0.04;
    const SHOULDER: f64 = 0.919_858_254_178_288_8;
    const SCALE: f64 = 1.047_103_762_443_455;
    let f = SCALE * (luminance / (luminance + SHOULDER)).powf(CONTRAST);
    f * f / (f + TOE)
}

/// About `x` above `limit`.
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

/// Colourfulness by which chroma is measured, by the hue.
fn usual_m(Jmh { hue, .. }: Jmh) -> f64 {
    let twice = hue.rotate(hue);
    let thrice = twice.rotate(hue);
    let m = 77.12896 + 11.34072 * hue.x + 16.46899 * twice.x + 7.88380 * thrice.x
        + 14.66441 * hue.y - 6.37224 * twice.y + 9.19364 * thrice.y;
    m * 1.000_053_062_619_541_4
}

fn chroma_compressed(color: Jmh, j: f64, reach_m: f64) -> f64 {
    if color.m == 0.0 {
        return 0.0;
    }
    let usual = usual_m(color);
    let share = j / J_WHITE;
    let rest = (1.0 - share).max(0.0);
    let limit = share.powf(1.0 / C_Z) * reach_m / usual;
    let m = color.m * (j / color.j).powf(1.0 / C_Z) / usual;
    let m = limit - toe(limit - m, limit - 0.001, 1.3 * rest, (share * share + 0.005).sqrt());
    toe(m, limit, 2.4 * share, rest) * usual
}

/// The whole.
pub(crate) struct OutputTransform {
    ap1_from_rec709: DMat3,
    source: Appearance,
    display: Appearance,
    gamut: Gamut,
}

impl OutputTransform {
    pub(crate) fn new() -> OutputTransform {
        OutputTransform {
            ap1_from_rec709: rgb_from_rgb(&AP1, &REC709),
            source: Appearance::new(&AP1),
            display: Appearance::new(&REC709),
            gamut: Gamut::new(),
        }
    }

    /// Linear.
    pub(crate) fn shown(&self, rgb: [f32; 3]) -> [f32; 3] {
        let rgb = DVec3::from(rgb.map(|x| f64::from(x.clamp(-1e6, 1e6))));
        let rgb = (self.ap1_from_rec709 * rgb).map(|x| x.max(0.0).min(1024.0));
        let (achromatic, look) = self.source.look(rgb);
        let j = lightness(tone_scale(luminance(achromatic)));
        let gamut = self.gamut.at(degrees(look.hue));
        let m = chroma_compressed(look, j, gamut.reach_m);
        let color = gamut.compressed(Jmh { j, m, ..look });
        let rgb = self.display.rgb(color);
        rgb.clamp(DVec3::ZERO, DVec3::ONE).as_vec3().to_array()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[ignore = "prints"]
    fn compare() {
        let t = std::time::Instant::now();
        let transform = OutputTransform::new();
        eprintln!("new {:?}", t.elapsed());
        let bytes = std::fs::read("/tmp/colors.bin").unwrap();
        let v: Vec<f32> = bytes.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        let t = std::time::Instant::now();
        let out: Vec<u8> = v.chunks(3).flat_map(|c| transform.shown([c[0], c[1], c[2]])).flat_map(f32::to_le_bytes).collect();
        eprintln!("{} colours {:?}", v.len() / 3, t.elapsed());
        std::fs::write("/tmp/found.bin", out).unwrap();
    }
}
