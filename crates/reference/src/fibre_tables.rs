//! The exact model of a scene's fibres.

use strandlight_scattering::exact::{Bcsdf, BcsdfError, PaintedBcsdf};
use strandlight_scene::PreparedScene;

use crate::{Fibres, Painted};

/// What fibres scatter by: tables that [`Fibres`] read.
pub struct FibreTables<'a>(Tables<'a>);

enum Tables<'a> {
    Alike(Box<Bcsdf>),
    Painted(Painted<'a>, Box<PaintedBcsdf>),
}

impl<'a> FibreTables<'a> {
    /// Of the hair of `scene`, with its paint.
    ///
    /// # Errors
    /// Fibres without an exact model.
    pub fn new(scene: &'a PreparedScene) -> Result<Self, BcsdfError> {
        let hair = &scene.hair;
        let (params, fresnel, modes) = (hair.hair(), hair.fresnel(), hair.modes());
        Ok(FibreTables(match scene.paint() {
            None => Tables::Alike(Box::new(Bcsdf::new(params, fresnel, modes)?)),
            Some(points) => {
                let painted = Painted {
                    hair: params,
                    points,
                };
                let bcsdf = PaintedBcsdf::new(params, fresnel, modes)?;
                Tables::Painted(painted, Box::new(bcsdf))
            }
        }))
    }

    /// The fibres.
    pub fn fibres(&self) -> Fibres<'_> {
        match &self.0 {
            Tables::Alike(bcsdf) => Fibres::Alike(bcsdf),
            Tables::Painted(painted, bcsdf) => Fibres::Painted(*painted, bcsdf),
        }
    }
}
