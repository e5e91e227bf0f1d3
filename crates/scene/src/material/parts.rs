//! What is derived from the parameters of hair, and of what it is made.

use strandlight_scattering::{Lobe, Parameter};

/// Something derived from the parameters; `usize::from(trt)` of the arrays in [`HairMaterial`](super::HairMaterial) is
/// 0 for TT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The parameters themselves in single precision; on the GPU.
    Fibre,
    /// R's coefficients; on the GPU.
    Reflectance,
    /// The baked lobes of TT at this eta.
    RowTt,
    /// Exact energies of TT over theta_d.
    EnergiesTt,
    /// Widths and places of TT's lobes over theta_d.
    ShapesTt,
    /// Shares of TT's lobes over theta_d.
    SharesTt,
    /// The texture of TT's lobes; on the GPU.
    LobesTt,
    /// The baked lobes of TRT at this eta, or the several of an elliptic fibre.
    RowTrt,
    /// Exact energies of TRT over theta_d.
    EnergiesTrt,
    /// Widths, w_c included, and places of TRT's lobes over theta_d.
    ShapesTrt,
    /// Shares of TRT's lobes over theta_d.
    SharesTrt,
    /// The texture of TRT's lobes; on the GPU.
    LobesTrt,
    /// The averages of multiple scattering, of all modes whichever are enabled; on the GPU.
    Averages,
    /// What the tables of multiple scattering of the enabled modes are filled from; on the GPU,
    /// which fills them.
    Multiple,
    /// The lobes of TT over theta_d and absorption, in the place of those of one fibre where hair
    /// is painted; on the GPU.
    PaintedTt,
    /// Those of TRT; on the GPU.
    PaintedTrt,
    /// The averages over inclination, absorption and whichever factors are painted; on the GPU.
    PaintedAverages,
}

impl Part {
    /// Is it for painted hair? The other parts but the fibre and R are for hair that is not.
    pub const fn is_painted(self) -> bool {
        matches!(
            self,
            Part::PaintedTt | Part::PaintedTrt | Part::PaintedAverages
        )
    }
}

/// One row of [`RULES`].
#[derive(Clone, Copy, Debug)]
#[doc(hidden)]
pub struct Rule {
    /// What is made.
    pub part: Part,
    /// Its name in reports.
    pub name: &'static str,
    /// It exists if one of these modes is enabled; the fibre always, the averages and what is made
    /// of them if multiple scattering is. Painted hair has parts of its own, see [`Part::is_painted`].
    pub modes: &'static [Lobe],
    /// Parameters it is made of.
    pub parameters: &'static [Parameter],
    /// Parts it is made of; they stand above it.
    pub sources: &'static [Part],
}

const fn rule(
    part: Part,
    name: &'static str,
    modes: &'static [Lobe],
    parameters: &'static [Parameter],
    sources: &'static [Part],
) -> Rule {
    Rule {
        part,
        name,
        modes,
        parameters,
        sources,
    }
}

/// From parameter to texture, sources first.
#[rustfmt::skip]
#[doc(hidden)]
pub const RULES: [Rule; 17] = {
    use Parameter::{CausticWidth, Eccentricity, Eta, Intensity, Shift, SigmaA, Width};
    use Part::*;
    const TT: &[Lobe] = &[Lobe::Tt];
    const TRT: &[Lobe] = &[Lobe::Trt];
    [
        rule(Fibre,       "fibre",       &Lobe::ALL,  &[Eta, SigmaA, Shift, Width, CausticWidth, Eccentricity], &[]),
        rule(Reflectance, "reflectance", &[Lobe::R],  &[Eta, Intensity], &[]),
        rule(RowTt,       "row TT",       TT,         &[Eta],                       &[]),
        rule(EnergiesTt,  "energies TT",  TT,         &[Eta, SigmaA],               &[]),
        rule(ShapesTt,    "shapes TT",    TT,         &[],                          &[RowTt]),
        rule(SharesTt,    "shares TT",    TT,         &[SigmaA],                    &[RowTt]),
        rule(LobesTt,     "lobes TT",     TT,         &[Intensity],                 &[ShapesTt, EnergiesTt, SharesTt]),
        rule(RowTrt,      "row TRT",      TRT,        &[Eta, Eccentricity],         &[]),
        rule(EnergiesTrt, "energies TRT", TRT,        &[Eta, Eccentricity, SigmaA], &[]),
        rule(ShapesTrt,   "shapes TRT",   TRT,        &[CausticWidth],              &[RowTrt]),
        rule(SharesTrt,   "shares TRT",   TRT,        &[SigmaA],                    &[RowTrt]),
        rule(LobesTrt,    "lobes TRT",    TRT,        &[Intensity],                 &[ShapesTrt, EnergiesTrt, SharesTrt]),
        rule(Averages,    "averages",     &[],        &Parameter::ALL,              &[]),
        rule(Multiple,    "multiple",    &[],         &[],                          &[Fibre, Reflectance, LobesTt, LobesTrt, Averages]),
        // Of no absorption: neither its edit nor paint recomputes them.
        rule(PaintedTt,       "painted lobes TT",  TT,  &[Eta, Intensity],                             &[]),
        rule(PaintedTrt,      "painted lobes TRT", TRT, &[Eta, CausticWidth, Intensity],               &[]),
        rule(PaintedAverages, "painted averages",  &[], &[Eta, Shift, Width, CausticWidth, Intensity], &[]),
    ]
};

/// The texture of TT's lobes and what it is made of.
pub(super) const OF_TT: [Part; 5] = [
    Part::RowTt,
    Part::EnergiesTt,
    Part::ShapesTt,
    Part::SharesTt,
    Part::LobesTt,
];

/// The texture of TRT's lobes and what it is made of.
pub(super) const OF_TRT: [Part; 5] = [
    Part::RowTrt,
    Part::EnergiesTrt,
    Part::ShapesTrt,
    Part::SharesTrt,
    Part::LobesTrt,
];
