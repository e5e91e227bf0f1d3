//! What paths read of a scene.

use strandlight_scattering::exact::BcsdfError;
use strandlight_scene::PreparedScene;
use strandlight_scene::proxy::ProxyRecords;

use crate::mesh_rays::MeshRays;
use crate::rays::Rays;
use crate::{Environment, FibreTables, PathTracer};

/// A scene made ready for path tracing: its exact fibres and the hierarchies of what rays meet.
pub struct TracedScene<'a> {
    scene: &'a PreparedScene,
    fibres: FibreTables<'a>,
    rays: Rays,
    proxies: ProxyRecords,
    meshes: Vec<MeshRays>,
}

impl<'a> TracedScene<'a> {
    /// `scene` as it is now.
    ///
    /// # Errors
    /// Fibres without an exact model.
    pub fn new(scene: &'a PreparedScene) -> Result<Self, BcsdfError> {
        Ok(TracedScene {
            scene,
            fibres: FibreTables::new(scene)?,
            rays: Rays::new(&scene.strands),
            proxies: scene.proxy_records(),
            meshes: scene.beside().meshes().iter().map(MeshRays::new).collect(),
        })
    }

    /// Paths in the scene under `environment`.
    pub fn tracer<'b>(&'b self, environment: &'b Environment) -> PathTracer<'b> {
        PathTracer::new(
            &self.scene.strands,
            &self.rays,
            self.fibres.fibres(),
            environment,
        )
        .with_proxies(self.proxies.list())
        .with_meshes(&self.meshes)
    }
}
