//! What paths read of a scene.

use strandlight_scattering::exact::{Bcsdf, BcsdfError, PaintedBcsdf};
use strandlight_scene::PreparedScene;
use strandlight_scene::proxy::ProxyRecords;

use crate::mesh_rays::MeshRays;
use crate::rays::Rays;
use crate::{Environment, Fibres, Painted, PathTracer};

/// A scene made ready for path tracing: its exact fibres and the hierarchies of what rays meet.
pub struct TracedScene<'a> {
    scene: &'a PreparedScene,
    fibres: Tables<'a>,
    rays: Rays,
    proxies: ProxyRecords,
    meshes: Vec<MeshRays>,
}

/// What the fibres scatter by.
enum Tables<'a> {
    Alike(Box<Bcsdf>),
    Painted(Painted<'a>, Box<PaintedBcsdf>),
}

impl<'a> TracedScene<'a> {
    /// `scene` as it is now.
    ///
    /// # Errors
    /// Fibres without an exact model.
    pub fn new(scene: &'a PreparedScene) -> Result<Self, BcsdfError> {
        let hair = &scene.hair;
        let fibres = match scene.paint() {
            None => Tables::Alike(Box::new(Bcsdf::new(
                hair.hair(),
                hair.fresnel(),
                hair.modes(),
            )?)),
            Some(points) => {
                let painted = Painted {
                    hair: hair.hair(),
                    points,
                };
                let bcsdf = PaintedBcsdf::new(hair.hair(), hair.fresnel(), hair.modes())?;
                Tables::Painted(painted, Box::new(bcsdf))
            }
        };
        Ok(TracedScene {
            scene,
            fibres,
            rays: Rays::new(&scene.strands),
            proxies: scene.proxy_records(),
            meshes: scene.beside().meshes().iter().map(MeshRays::new).collect(),
        })
    }

    /// Paths in the scene under `environment`.
    pub fn tracer<'b>(&'b self, environment: &'b Environment) -> PathTracer<'b> {
        let fibres = match &self.fibres {
            Tables::Alike(bcsdf) => Fibres::Alike(bcsdf),
            Tables::Painted(painted, bcsdf) => Fibres::Painted(*painted, bcsdf),
        };
        PathTracer::new(&self.scene.strands, &self.rays, fibres, environment)
            .with_proxies(self.proxies.list())
            .with_meshes(&self.meshes)
    }
}
