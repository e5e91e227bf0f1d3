//! The texture of one mode's lobes, step by step.

use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::lobes::{
    DEFAULT_LOBE_TEXELS, Energies, LobePlaces, LobeRows, LobeTable, LobeTexture, PackedShapes,
    Shares,
};
use strandlight_scattering::{HairParams, Lobe};

use super::parts::Part;
use crate::optics::no_lobes;

/// What the texture of TT's or TRT's lobes is made of.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LobeSources {
    pub row: Option<LobeRows>,
    pub energies: Option<Energies>,
    pub shapes: Option<PackedShapes>,
    pub shares: Option<Shares>,
}

/// Makes the texture of one mode's lobes, and what it is made of.
#[derive(Clone, Copy)]
pub(super) struct LobeMaker<'a> {
    pub mode: Lobe,
    pub hair: &'a HairParams,
    pub fresnel: Fresnel,
    pub table: Option<&'a LobeTable>,
}

impl LobeMaker<'_> {
    /// Makes `part`, which is one of this mode, of what is there.
    pub fn make(&self, part: Part, sources: &mut LobeSources, texture: &mut LobeTexture) {
        let hair = self.hair;
        let places = || LobePlaces::new(self.mode, hair, DEFAULT_LOBE_TEXELS);
        let row = sources.row.as_ref();
        match part {
            Part::RowTt | Part::RowTrt => {
                sources.row = self.table.map(|table| LobeRows::new(table, &places()));
            }
            Part::EnergiesTt | Part::EnergiesTrt => {
                let energies = Energies::new(&places(), hair.sigma_a, self.fresnel);
                sources.energies = Some(energies);
            }
            Part::ShapesTt | Part::ShapesTrt => {
                sources.shapes = row.map(|row| PackedShapes::new(row, hair.caustic_width));
            }
            Part::SharesTt | Part::SharesTrt => {
                sources.shares = row.map(|row| Shares::new(row, hair.sigma_a));
            }
            Part::LobesTt | Part::LobesTrt => {
                let lobes = match (&sources.shapes, &sources.energies, &sources.shares) {
                    (Some(shapes), Some(energies), Some(shares)) => {
                        LobeTexture::new(shapes, energies, shares)
                    }
                    _ => no_lobes(),
                };
                *texture = lobes.scaled(hair.intensity.get(self.mode));
            }
            Part::Fibre
            | Part::Reflectance
            | Part::Averages
            | Part::Multiple
            | Part::PaintedTt
            | Part::PaintedTrt
            | Part::PaintedAverages => {}
        }
    }
}
