//! What edits set.

use super::super::bounce::{self, BouncePass};
use super::super::meshes::Meshes;
use super::super::proxies::Proxies;
use super::super::resources::{StrandBuffers, write};
use super::super::shadows::SweptLights;
use super::super::visibility::ShownProxies;
use super::super::volume::Volume;
use super::{Kind, Lighting, Lit, Shade};
use crate::gpu::Context;
use std::ops::Range;
use std::sync::Arc;
use strandlight_formats::SrbfLight;
use strandlight_scattering::closed_form::WidthProfile;
use strandlight_scene::RenderError;
use strandlight_scene::bounce::passed_weights;
use strandlight_scene::budget::LIGHT_BATCH;
use strandlight_scene::material::{EditReport, HairMaterial};
use strandlight_scene::scene::{LightRecord, PreparedScene};
use strandlight_scene::shadow_maps::{NO_SLOT, ShadowPlan};

impl Lighting {
    /// Shares out the shadow maps of the lights to come, [`Lighting::set_lights`], by the power of
    /// these, which differ from them in nothing else.
    pub fn plan_for(&mut self, lights: &[SrbfLight]) {
        self.planned_lights = lights.to_vec();
    }

    /// Takes the lights of `scene` for those there were; [`Lighting::shadow_steps`] finds their
    /// shadows.
    pub fn set_lights(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        strands: &StrandBuffers,
    ) {
        self.plan_maps(context, scene, strands);
        self.stale_bounce();
        let (records, directions) = scene.records_with(&self.plan);
        self.n_lights = records.len();
        self.n_directions = records.chunks(LIGHT_BATCH).map(most_directions).collect();
        write(context, &mut self.directions, &directions);
        write(context, &mut self.lights, &records);
        self.write_lit(context, scene, &records);
        self.hide(context, scene, volume, &directions);
        let lights = SweptLights {
            lights: &self.lights,
            directions: &self.directions,
            n_lights: self.n_lights,
        };
        self.sweep
            .fit(context, volume, &lights, scene.record_budget);
        self.forget_groups();
    }

    /// Takes other amplitudes of the same lights. Answers whether a light got so bright that it
    /// needs a shadow map which it has not: the maps are then replanned, and have to be drawn.
    pub fn set_colors(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        strands: &StrandBuffers,
    ) -> bool {
        self.stale_bounce();
        let wanted = scene.shadow_plan();
        let has_all = self
            .plan
            .slots
            .iter()
            .zip(&wanted.slots)
            .all(|(&has, &wants)| has != NO_SLOT || wants == NO_SLOT);
        if !has_all {
            self.planned_lights.clone_from(&scene.lights);
            self.plan_maps(context, scene, strands);
        }
        let (records, _) = scene.records_with(&self.plan);
        self.write_lit(context, scene, &records);
        !has_all
    }

    /// Takes the proxies of `scene` for those there were. [`Lighting::shadow_steps`] finds the
    /// shadows.
    pub fn set_proxies(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        strands: &StrandBuffers,
    ) -> Result<(), RenderError> {
        let has_bounce = match &mut self.bounce {
            Some(bounce) => bounce.refresh(context, scene)?,
            None => false,
        };
        if !has_bounce {
            self.bounce = BouncePass::new(context, scene)?;
        }
        self.set_kind(context, scene)?;
        let records = scene.proxy_records();
        let has_meshes = !scene.beside().meshes().is_empty();
        if let Some(proxies) = &self.proxies
            && proxies.write(context, &records)
            && !has_meshes
        {
            return Ok(());
        }
        self.proxies = Proxies::new(context, scene, self.radiance.len())?;
        self.block_light(context)?;
        self.set_lights(context, scene, volume, strands);
        Ok(())
    }

    /// Has the shaders of the shadows know of the proxies.
    pub(super) fn block_light(&mut self, context: &Context) -> Result<(), RenderError> {
        let blockers = self.proxies.as_ref().map(Proxies::blockers);
        let [of_maps, of_sweeps] = match blockers {
            Some(blockers) => blockers.map(Some),
            None => [None, None],
        };
        self.maps.set_proxies(context, of_maps)?;
        self.sweep.set_proxies(context, of_sweeps)
    }

    /// Finds what meshes hide of lights along `directions`. The sweep's groups are to be bound again.
    pub(super) fn hide(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        directions: &[[f32; 4]],
    ) {
        if let Some(proxies) = &mut self.proxies
            && proxies.refresh(context, scene, &volume.grid, directions)
        {
            let [_, of_sweeps] = proxies.blockers();
            self.sweep.renew_blocker(of_sweeps);
        }
    }

    pub(super) fn meshes(&self) -> Option<&Meshes> {
        self.proxies.as_ref().and_then(Proxies::meshes)
    }

    pub(super) fn meshes_mut(&mut self) -> Option<&mut Meshes> {
        self.proxies.as_mut().and_then(Proxies::meshes_mut)
    }

    /// The proxies in the light that radiance buffer `ix` has, if there are any.
    pub fn shown_proxies(&self, ix: usize) -> Option<ShownProxies<'_>> {
        let proxies = self.proxies.as_ref()?;
        Some(ShownProxies {
            records: proxies.records(),
            light: proxies.light_map(ix),
            meshes: self.meshes().map(Meshes::shape),
        })
    }

    /// The proxies, if there are any.
    pub(in super::super) fn proxies(&self) -> Option<&Proxies> {
        self.proxies.as_ref()
    }

    /// Takes strands that have moved within `volume`, and replans the maps.
    pub fn set_points(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        strands: &StrandBuffers,
        is_other_volume: bool,
    ) -> Result<(), RenderError> {
        if let Some(proxies) = &self.proxies {
            proxies.write(context, &scene.proxy_records());
        }
        // Wind bends what is at rest as it was: nothing that was found from that changes.
        let are_others = !Arc::ptr_eq(&self.strands, &scene.strands);
        self.strands = Arc::clone(&scene.strands);
        match &mut self.bounce {
            Some(bounce) if are_others => {
                bounce.refresh(context, scene)?;
            }
            Some(bounce) => bounce.stale_hair(),
            None => {}
        }
        self.plan_maps(context, scene, strands);
        let is_hidden = are_others && self.meshes().is_some();
        if is_hidden {
            let (_, directions) = scene.records_with(&self.plan);
            self.hide(context, scene, volume, &directions);
        }
        let lights = SweptLights {
            lights: &self.lights,
            directions: &self.directions,
            n_lights: self.n_lights,
        };
        let budget = scene.record_budget;
        if is_hidden || is_other_volume || !self.sweep.has_room(&volume.grid, self.n_lights, budget)
        {
            self.sweep.fit(context, volume, &lights, budget);
            self.forget_groups();
        }
        Ok(())
    }

    /// Takes the densities of `scene`.
    pub fn set_densities(&mut self, scene: &PreparedScene) {
        self.densities = scene.densities;
        self.max_local = scene.max_local(&scene.hair);
    }

    /// Writes what an edit of the hair recomputed.
    pub fn set_hair(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        hair: &HairMaterial,
        report: &EditReport,
    ) {
        self.max_local = scene.max_local(hair);
        if self.scattering.update(context, hair, report) {
            self.forget_groups();
        }
    }

    /// Writes the paint of `changed` points; all of it where there was none.
    pub fn set_paint(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        hair: &HairMaterial,
        changed: Range<usize>,
    ) {
        let points = scene.paint();
        if self.scattering.set_paint(context, points, hair, changed) {
            self.max_local = scene.max_local(hair);
            self.forget_groups();
        }
    }

    /// Makes room for the tables of multiple scattering where they serve `scene`, or writes what of
    /// them an edit recomputed; [`Lighting::table_steps`] fills them.
    pub fn set_multiple(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        report: Option<&EditReport>,
    ) -> Result<(), RenderError> {
        if self.scattering.set_multiple(context, scene, report)? {
            self.forget_groups();
        }
        Ok(())
    }

    /// Takes the profile of wide strands, if there are some.
    pub fn set_profile(&mut self, context: &Context, profile: Option<WidthProfile>) {
        self.profile.set(context, profile);
    }

    /// The one that was set.
    pub fn profile(&self) -> Option<WidthProfile> {
        self.profile.now()
    }

    /// Are there wide strands?
    pub fn has_profile(&self) -> bool {
        self.profile.is_there()
    }

    /// Compiles what the terms and modes of `scene` need, unless they were drawn before.
    pub fn set_kind(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
    ) -> Result<(), RenderError> {
        let kind = Kind::of(scene, self.has_profile());
        if self.proxies.is_some() {
            let weights = passed_weights(scene);
            if weights != self.passed.1 {
                context.write(&self.passed.0, 0, bytemuck::bytes_of(&weights));
                self.passed.1 = weights;
                self.stale_bounce();
            }
        }
        self.current = match self.shades.iter().position(|shade| shade.kind == kind) {
            Some(ix) => ix,
            None => {
                let (module, pipeline) = kind.compile(context, &[])?;
                self.shades.push(Shade {
                    kind,
                    pipeline,
                    groups: Vec::new(),
                    narrow: None,
                    bounce: None,
                    module,
                });
                self.shades.len() - 1
            }
        };
        let shade = &mut self.shades[self.current];
        if self.bounce.is_some() && shade.bounce.is_none() {
            let (_, pipeline) = kind.compile(context, &[bounce::FEATURE])?;
            shade.bounce = Some(pipeline);
        }
        Ok(())
    }

    /// The light that comes from the proxies is another.
    pub(super) fn stale_bounce(&mut self) {
        if let Some(bounce) = &mut self.bounce {
            bounce.is_stale = true;
        }
    }

    pub(super) fn plan_maps(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        strands: &StrandBuffers,
    ) {
        self.plan = ShadowPlan::new(&self.planned_lights, &scene.strands, scene.shadow_maps);
        self.through = None;
        if self.maps.fit(context, strands, &self.plan) {
            self.forget_groups();
        }
    }

    /// Writes the lights that are not black, batch by batch.
    pub(super) fn write_lit(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        records: &[LightRecord],
    ) {
        self.min_power = scene.min_power();
        let mut lit = Vec::with_capacity(records.len());
        self.batches.clear();
        for batch in records.chunks(LIGHT_BATCH) {
            let first = lit.len() as u32;
            lit.extend(batch.iter().filter(|light| light.power > 0.0).copied());
            let n = lit.len() as u32 - first;
            self.batches.push(Lit { first, n });
        }
        if self.batches.is_empty() {
            // Without lights all points are black.
            self.batches.push(Lit::default());
        }
        self.n_lit = lit.len() as u32;
        let room = (self.n_points, self.radiance.len());
        let has_grown = self.narrow.write(context, &lit, room);
        if write(context, &mut self.lit, &lit) | has_grown {
            self.forget_groups();
        }
    }

    pub(super) fn forget_groups(&mut self) {
        for shade in &mut self.shades {
            shade.groups.clear();
            shade.narrow = None;
        }
    }
}

/// Directions of the light that has most.
fn most_directions(lights: &[LightRecord]) -> u32 {
    lights.iter().map(|light| light.n_sweeps).max().unwrap_or(0)
}
