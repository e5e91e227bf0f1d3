//! What shading reads of one fibre: its parameters, R's coefficients, the lobes of TT and TRT and
//! the averages of multiple scattering, in memory and on the GPU.

use strandlight_scattering::closed_form::{
    AverageTexel, Fibre, LobeDecode, N_LOBE_NUMBERS, PaintedHair, PaintedViews, Reflectance,
    Shading, Tables,
};
use strandlight_scattering::lobes::LobeTexture;
use strandlight_scattering::multiple_tables::MultipleSource;

use crate::paint::PaintedOptics;

/// The optics of one fibre, ready for shading.
#[derive(Clone, Debug, PartialEq)]
pub struct Optics {
    /// The fibre.
    pub fibre: Fibre,
    /// Coefficients of R.
    pub reflectance: Reflectance,
    /// Lobes of TT; `no_lobes` where the mode is not enabled.
    pub tt: LobeTexture,
    /// Lobes of TRT, likewise.
    pub trt: LobeTexture,
    /// Averages for multiple scattering over the inclination; none where that is switched off.
    pub averages: Vec<AverageTexel>,
    /// What the tables of multiple scattering are made from; none where that is switched off.
    pub multiple: Option<MultipleSource>,
    /// What takes the place of lobes and averages where hair is painted.
    pub painted: PaintedOptics,
}

/// Stands for the lobes of a mode that is not enabled; must not be sampled.
pub(crate) fn no_lobes() -> LobeTexture {
    LobeTexture {
        decode: LobeDecode {
            warp: 1.0,
            last: 1.0,
            ..bytemuck::Zeroable::zeroed()
        },
        texels: vec![[0; 8]; 2],
        decoded: vec![[0.0; N_LOBE_NUMBERS]; 2],
    }
}

impl Optics {
    /// What the paper's scheme reads: the fibre alone.
    pub fn paper(fibre: Fibre) -> Optics {
        Optics {
            fibre,
            reflectance: bytemuck::Zeroable::zeroed(),
            tt: no_lobes(),
            trt: no_lobes(),
            averages: Vec::new(),
            multiple: None,
            painted: PaintedOptics::default(),
        }
    }

    /// What the closed form reads; `tables` holds C.
    pub fn shading<'a>(&'a self, tables: Tables<'a>) -> Shading<'a> {
        Shading {
            fibre: &self.fibre,
            reflectance: &self.reflectance,
            tables,
            tt: self.tt.view(),
            trt: self.trt.view(),
        }
    }

    /// The uniform of the shaders, lobes in the first rows of their textures.
    pub fn uniform(&self) -> ShadingUniform {
        ShadingUniform {
            fibre: self.fibre,
            reflectance: self.reflectance,
            tt: self.tt.decode,
            trt: self.trt.decode,
        }
    }

    /// What painted points have in common; the uniform of the shaders.
    pub fn painted_hair(&self) -> PaintedHair {
        PaintedHair {
            fibre: self.fibre,
            reflectance: self.reflectance,
            tt: self.painted.tt.decode,
            trt: self.painted.trt.decode,
            averages: self.painted.averages.decode,
        }
    }

    /// What the closed form reads of painted hair; `hair` is [`Optics::painted_hair`]'s answer,
    /// `tables` holds C.
    pub fn painted_views<'a>(
        &'a self,
        hair: &'a PaintedHair,
        tables: Tables<'a>,
    ) -> PaintedViews<'a> {
        PaintedViews {
            hair,
            tables,
            tt: self.painted.tt.view(),
            trt: self.painted.trt.view(),
            averages: self.painted.averages.view(),
        }
    }

    /// Bytes on the GPU: uniform, lobes and averages.
    pub fn gpu_bytes(&self) -> usize {
        let lobes = size_of_val(&self.tt.texels[..]) + size_of_val(&self.trt.texels[..]);
        size_of::<ShadingUniform>() + lobes + size_of_val(&self.averages[..])
    }
}

/// Byte for byte the struct `Shading` of the shaders (544 bytes).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ShadingUniform {
    /// The fibre.
    pub fibre: Fibre,
    /// Coefficients of R.
    pub reflectance: Reflectance,
    /// Placement of the lobes of TT.
    pub tt: LobeDecode,
    /// Placement of the lobes of TRT.
    pub trt: LobeDecode,
}

strandlight_scattering::mirrors! {
    ShadingUniform as "Shading" in "lib/single_scattering" { fibre, reflectance, tt, trt }
}
