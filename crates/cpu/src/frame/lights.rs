//! The lights of the scene as stages read them.

use strandlight_formats::SrbfLight;
use strandlight_scene::PreparedScene;
use strandlight_scene::shadow_maps::{NO_SLOT, ShadowPlan};
use strandlight_scene::volume::{largest, power};

use super::parts::Lights;
use super::stage::Stage;
use super::state::Frame;

/// Share of all power up to which a light that should have maps may do without: four times that from
/// which on it gets some.
const LITTLE: f32 = 0.008;

impl Frame {
    /// Finds the lights and their maps after an edit of them.
    pub(super) fn prepare_lights(&mut self, scene: &PreparedScene) {
        if self.are_lights_current {
            return;
        }
        self.are_lights_current = true;
        let now = scene.shadow_plan();
        let mut lights = scene.lights.clone();
        for (light, rgb) in lights.iter_mut().zip(&self.planned) {
            light.rgb = *rgb;
        }
        let mut plan = ShadowPlan::new(&lights, &scene.strands, scene.shadow_maps);
        if scene.reference_amplitudes.is_some() || !serves(&plan, &now, &scene.lights) {
            plan = now;
        }
        let before = self.lights.take().map(|before| before.plan);
        if before.as_ref() != Some(&plan) {
            self.served.kept = None;
            self.forget(Stage::ShadowMaps);
            self.served.arriving_before = None;
        }
        if !before.is_some_and(|before| before.has_through_of(&plan)) {
            self.forget(Stage::ThroughMaps);
            self.through_before = None;
        }
        let (records, sweeps) = scene.records_with(&plan);
        let is_lit: Vec<bool> = records.iter().map(|light| light.power > 0.0).collect();
        // Narrow lights first, so that the lanes of a vector ask for as many nodes.
        let mut lit: Vec<u32> = (0..)
            .zip(&is_lit)
            .filter_map(|(ix, is)| is.then_some(ix))
            .collect();
        lit.sort_by(|&a, &b| {
            let lambda = |ix: u32| records[ix as usize].lambda;
            lambda(a).total_cmp(&lambda(b))
        });
        if let Some(before) = &mut self.records {
            // Those that are black now are no work.
            before.under_way.retain(|sweep| is_lit[sweep.light_ix]);
            let mut pairs = before.is_lit.iter().zip(&is_lit);
            if !pairs.all(|(before, now)| before.unwrap_or(true) || !now) {
                self.forget(Stage::Transmittance);
                self.forget(Stage::ProxyLight);
            }
        }
        self.lights = Some(Lights {
            plan,
            records,
            sweeps,
            is_lit,
            lit,
        });
    }
}

/// Has `plan` maps of all `lights` that have some by the plan `now`, but for some of hardly any power?
/// Amplitudes share out the maps, but those of other amplitudes are as right; and a light that is tinted
/// or off lifts others just above the share from which on there are maps, which is no reason to draw all
/// of them again.
fn serves(plan: &ShadowPlan, now: &ShadowPlan, lights: &[SrbfLight]) -> bool {
    let power: Vec<f32> = lights.iter().map(|light| largest(power(light))).collect();
    let least = LITTLE * power.iter().sum::<f32>();
    let mut pairs = plan.slots.iter().zip(&now.slots).zip(&power);
    plan.slots.len() == now.slots.len()
        && pairs.all(|((slot, now), power)| *slot != NO_SLOT || *now == NO_SLOT || *power < least)
}
