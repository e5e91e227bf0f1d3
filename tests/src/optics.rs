//! What shading reads of fibres, from the bundled tables.

use std::sync::{Arc, OnceLock};

use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, TableFile};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::material::{HairMaterial, LobeTables};
use strandlight_scene::optics::Optics;

/// The bundled lobes of TT and TRT.
pub fn lobes() -> Arc<LobeTables> {
    static LOBES: OnceLock<Arc<LobeTables>> = OnceLock::new();
    let lobes = LOBES.get_or_init(|| {
        let file = TableFile::from_bytes(DEFAULT_TABLES).expect("the bundled tables are readable");
        Arc::new(LobeTables::from_file(&file, &Lobe::ALL).expect("they hold lobes"))
    });
    Arc::clone(lobes)
}

/// The textures of `hair` with all modes.
pub fn textures(hair: &HairParams) -> HairMaterial {
    HairMaterial::new(lobes(), Fresnel::Dielectric, hair, &Lobe::ALL, 4)
        .expect("parameters inside their ranges")
}

/// The textures of `hair` with all modes and the averages of multiple scattering.
pub fn multiple_textures(hair: &HairParams) -> HairMaterial {
    let mut textures = textures(hair);
    textures.enable_multiple(true);
    textures
}

/// What shading reads of each fibre.
pub fn optics<'a>(hairs: impl IntoIterator<Item = &'a HairParams>) -> Vec<Optics> {
    let optics = |hair| textures(hair).optics().clone();
    hairs.into_iter().map(optics).collect()
}
