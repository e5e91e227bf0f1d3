//! Single scattering of narrow lights.

use glam::Vec3;
use strandlight_scattering::wide::{Place, Simd, single_scattering};

use super::super::along_segments::{Along, add_along, frames_about, shares_along};
use super::super::radiance::mean;
use super::super::unblocked::VisiblePoint;
use super::narrow_light::AlongOf;
use super::optics::PointOptics;
use super::{Scratch, WideShader, sides};

impl WideShader<'_> {
    /// Adds what narrow lights came to about a point.
    #[inline(always)]
    pub(super) fn add_narrow(&self, scratch: &Scratch, along: &mut Along) {
        for (narrow, of) in self.narrow.iter().zip(&scratch.narrow) {
            if let Some(shares) = &of.shares {
                let mut nodes = of.nodes;
                for (value, color) in nodes
                    .as_flattened_mut()
                    .iter_mut()
                    .zip(narrow.record.rgb.iter().cycle())
                {
                    *value *= color;
                }
                add_along(along, shares, &nodes);
            }
        }
    }

    /// What single scattering of the narrow lights comes to about a point.
    #[inline(always)]
    pub(super) fn narrow<S: Simd>(
        &self,
        simd: S,
        at: VisiblePoint,
        optics: &impl PointOptics,
        scratch: &mut Scratch,
    ) {
        let strands = &self.scene.strands;
        let Scratch {
            responses,
            narrow,
            narrow_weights,
            ..
        } = scratch;
        narrow.clear();
        narrow_weights.clear();
        for of in &self.narrow {
            let maps = self.maps.filter(|_| self.terms.has_single_of(&of.record));
            let scale = self.view.radiance_scale;
            let shares = maps.and_then(|maps| shares_along(strands, maps, &of.record, at, scale));
            narrow_weights.push(if shares.is_some() { 1.0 } else { 0.0 });
            narrow.push(AlongOf {
                shares,
                ..AlongOf::default()
            });
        }
        if narrow.iter().all(|of| of.shares.is_none()) {
            return;
        }
        let eye = Vec3::from(self.view.eye);
        for (node, (frame, view)) in frames_about(strands, at.point, eye).into_iter().enumerate() {
            let place = Place {
                frame: frame.map(|axis: Vec3| axis.to_array()),
                view,
            };
            let (lights, shading) = (&self.wide_narrow, optics.shading());
            single_scattering(
                simd,
                lights,
                narrow_weights,
                &place,
                shading,
                None,
                responses,
            );
            for entry in responses.entries() {
                let of = &mut narrow[entry.light as usize];
                for (sum, value) in of.nodes[node].iter_mut().zip(entry.rgb) {
                    *sum += value;
                }
                // At the point itself.
                if let (Some(profile), 1) = (self.profile, node) {
                    let record = &self.narrow[entry.light as usize].record;
                    let sides = sides(profile, record.direction, record.lambda, &place);
                    let rgb = [0, 1, 2].map(|c: usize| record.rgb[c] * entry.rgb[c]);
                    of.side += sides[entry.mode as usize] * mean(rgb);
                }
            }
        }
    }
}
