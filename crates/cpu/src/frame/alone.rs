//! Points that are shaded one by one, all lights at once: painted ones of other widths or shifts than the scene's, and all where tables
//! do not serve, as those of elliptic fibres.

use rayon::prelude::*;
use strandlight_scattering::wide::{Level, dispatch};
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::NO_SLOT;

use super::super::bounce::BounceLight;
use super::super::radiance::Radiance;
use super::super::shade::{Counts, PointShader, record_at_point};
use super::super::through_shares::{Scratch, ThroughShares};
use super::super::unblocked::VisiblePoint;
use super::inputs::Inputs;

impl Inputs<'_> {
    /// Radiance of some visible points, bounce light included; along segments if there are narrow lights.
    pub fn shade_alone(&self, places: &[u32], has_narrow: bool) -> (Radiance, Counts) {
        let (mut radiance, counts) = self.shade_lights_alone(places, has_narrow);
        if let Some(bounce) = self.bounce {
            radiance.add_at_all(&self.shade_bounce_alone(bounce, places));
        }
        (radiance, counts)
    }

    fn shade_lights_alone(&self, places: &[u32], has_narrow: bool) -> (Radiance, Counts) {
        let (scene, view) = (self.picturing.scene, &self.picturing.view);
        let shader = PointShader::new(scene, view, self.profile, self.axis_shares);
        let n_voxels = self.grid.n_voxels();
        let through = (self.maps).map(|maps| ThroughShares::new(&scene.strands, view.eye, maps));
        let answers = self.maps.map(|maps| maps.of_lights);
        let mut found = Radiance::black(places.len(), has_narrow);
        let mut along: Vec<_> = found.along.iter_mut().map(Some).collect();
        along.resize_with(places.len(), || None);
        let counts = found
            .at
            .par_iter_mut()
            .zip(along)
            .zip(places)
            .with_min_len(16)
            .map_init(Scratch::default, |scratch, ((radiance, along), &place)| {
                let at = VisiblePoint {
                    place: place as usize,
                    point: self.visible.points[place as usize] as usize,
                };
                if let Some(through) = &through {
                    dispatch!(Level::new(), simd => through.find(simd, at, scratch));
                }
                let arriving = |ix: usize, light: &LightRecord| {
                    let records = &self.records[ix * n_voxels..];
                    let point = &scene.strands.points[at.point];
                    let record = record_at_point(self.grid, records, point, light.direction);
                    let (mut unblocked, mut unblocked_tt) = (record.shares[0], record.shares[0]);
                    let slot = light.shadow_index;
                    if let Some(maps) = self.maps.filter(|_| slot != NO_SLOT) {
                        unblocked = maps.of_lights.share(slot, at);
                        unblocked_tt = scratch.shares[slot as usize];
                    }
                    (record, unblocked, unblocked_tt)
                };
                let lights = &self.lights.records;
                shader.shade(at, lights, arriving, radiance, answers.zip(along))
            })
            .reduce(Counts::default, Counts::and);
        (found, counts)
    }

    /// Bounce light at some visible points: rgb times the view's radiance scale, and zero.
    fn shade_bounce_alone(&self, bounce: &BounceLight, places: &[u32]) -> Vec<[f32; 4]> {
        let (scene, view) = (self.picturing.scene, &self.picturing.view);
        let shader = PointShader::new(scene, view, None, self.axis_shares);
        let of_place = |&place: &u32| {
            let point = self.visible.points[place as usize] as usize;
            shader.shade_bounce(bounce, point)
        };
        places.par_iter().with_min_len(16).map(of_place).collect()
    }
}
