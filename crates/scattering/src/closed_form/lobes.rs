//! The lobes of TT and TRT as a fibre's textures hold them. Twin: `shaders/lib/lobes.wgsl`.

/// Numbers a texel: `lambda_0, lambda_1, lambda_2, cos(mu_1/2), sin(mu_1/2), cos(mu_2/2),
/// sin(mu_2/2)`, then per channel (r, g, b) the amplitudes `a_l / u^2`, l = 0..3.
pub const N_LOBE_NUMBERS: usize = 16;

/// The share e of texels that are even in cos(theta_d), for strong absorption; the others are dense
/// at grazing angles, where the effective index leaves eta.
pub const EVEN_TEXELS: f32 = 0.4;

/// How the texels of one mode are placed and decoded, byte for byte the struct `LobeDecode` of the
/// shaders (32 bytes).
///
/// Texel `i` of 0..=last stands at `u = i / last`,
/// `u = c ((1 - e) (1 + warp) / (c + warp) + e)`, c = |cos(theta_d)|, e = [`EVEN_TEXELS`];
/// between, numbers are interpolated linearly in u. A texel is eight words, two numbers of
/// [`N_LOBE_NUMBERS`] each, the first in the low half: the first seven as 16 bit fractions of 1
/// (unorm), to be multiplied by `lambda_scale` (widths) or by 2, less 1 (sines and cosines);
/// amplitudes as 16 bit floats, to be multiplied by `amplitude_scale`. Energies fall with cos^2 at
/// grazing angles; what is stored is smooth there and not 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LobeDecode {
    /// See above, > 0.
    pub warp: f32,
    /// Index of the last texel, at least 1.
    pub last: f32,
    /// Width of a full fraction.
    pub lambda_scale: f32,
    /// Amplitude of 1.
    pub amplitude_scale: f32,
    /// Row of the texture where the texels lie, in textures that hold several fibres; the shaders
    /// alone look at it.
    pub first_row: u32,
    /// Index of refraction of the first row of texels.
    pub eta_first: f32,
    /// Rows per unit of the index.
    pub eta_scale: f32,
    /// Index of the last row; 0 for circular fibres, whose one row serves.
    pub last_row: f32,
}

crate::mirrors! {
    LobeDecode as "LobeDecode" in "lib/lobes" {
        warp, last, lambda_scale, amplitude_scale, first_row, eta_first, eta_scale, last_row,
    }
}

/// A view of one mode's texels.
#[derive(Clone, Copy, Debug)]
pub struct LobeView<'a> {
    /// Decoded texels, `last + 1` of them a row.
    pub texels: &'a [[f32; N_LOBE_NUMBERS]],
    /// Their placement.
    pub decode: &'a LobeDecode,
}

/// The three lobes at one theta_d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobes {
    /// Widths.
    pub lambda: [f32; 3],
    /// cos(mu/2) of the two pairs.
    pub cos_half: [f32; 2],
    /// sin(mu/2) of the two pairs.
    pub sin_half: [f32; 2],
    /// Amplitudes per lobe, then channel: energy times share over I0e(kappa_l), halved for the
    /// pairs.
    pub amplitude: [[f32; 3]; 3],
}

/// Lobes about a direction.
pub(crate) struct LobeAngles {
    /// Their sharpnesses, 2 / lambda^2.
    pub kappa: [f32; 3],
    /// Sine of half the azimuth from the nearer lobe of each pair to the direction.
    pub near: [f32; 2],
    /// The same of the farther.
    pub far: [f32; 2],
}

/// Lobes seen from a direction; `sin_half` and `cos_half` of half the azimuth from their common centre to it.
#[inline]
pub(crate) fn angles_to(lobes: &Lobes, sin_half: f32, cos_half: f32) -> LobeAngles {
    let middle = lobes.cos_half.map(|cos| sin_half * cos);
    let apart = lobes.sin_half.map(|sin| cos_half * sin);
    LobeAngles {
        kappa: lobes.lambda.map(|lambda| 2.0 / (lambda * lambda)),
        near: [middle[0] - apart[0], middle[1] - apart[1]],
        far: [middle[0] + apart[0], middle[1] + apart[1]],
    }
}

/// Where shading finds the lobes of a mode: those of one fibre, or of a painted point.
pub trait SampleLobes {
    /// The lobes at `cos_theta_d` >= 0; `eta` is looked at by elliptic fibres alone.
    fn lobes_at(&self, eta: f32, cos_theta_d: f32) -> Lobes;
}

impl SampleLobes for LobeView<'_> {
    fn lobes_at(&self, eta: f32, cos_theta_d: f32) -> Lobes {
        sample_lobes(self, eta, cos_theta_d)
    }
}

/// Where `cos_theta_d` >= 0 stands among the texels, u of [`LobeDecode`].
pub fn lobe_place(warp: f32, cos_theta_d: f32) -> f32 {
    let dense = (1.0 - EVEN_TEXELS) * (1.0 + warp) / (cos_theta_d + warp);
    (cos_theta_d * (dense + EVEN_TEXELS)).min(1.0)
}

/// The lobes at `cos_theta_d` >= 0. `eta` is looked at where there are several rows, and clamped
/// to the first and last: four texels then, else two.
pub fn sample_lobes(view: &LobeView, eta: f32, cos_theta_d: f32) -> Lobes {
    let decode = view.decode;
    let u = lobe_place(decode.warp, cos_theta_d);
    let at = u * decode.last;
    let first = at.floor().min(decode.last - 1.0);
    let fraction = at - first;
    let mut ix = first as usize;
    let mut x = [0.0f32; N_LOBE_NUMBERS];
    if decode.last_row > 0.0 {
        let at = ((eta - decode.eta_first) * decode.eta_scale)
            .max(0.0)
            .min(decode.last_row);
        let row = at.floor().min(decode.last_row - 1.0);
        let weight = at - row;
        let width = decode.last as usize + 1;
        ix += row as usize * width;
        let texels = [ix, ix + 1, ix + width, ix + width + 1].map(|ix| &view.texels[ix]);
        for (i, x) in x.iter_mut().enumerate() {
            let below = texels[0][i] + (texels[1][i] - texels[0][i]) * fraction;
            let above = texels[2][i] + (texels[3][i] - texels[2][i]) * fraction;
            *x = below + (above - below) * weight;
        }
    } else {
        let (low, high) = (&view.texels[ix], &view.texels[ix + 1]);
        for (i, x) in x.iter_mut().enumerate() {
            *x = low[i] + (high[i] - low[i]) * fraction;
        }
    }
    let square = u * u;
    Lobes {
        lambda: [x[0], x[1], x[2]],
        cos_half: [x[3], x[5]],
        sin_half: [x[4], x[6]],
        amplitude: std::array::from_fn(|l| {
            std::array::from_fn(|channel| square * x[7 + 3 * channel + l])
        }),
    }
}
