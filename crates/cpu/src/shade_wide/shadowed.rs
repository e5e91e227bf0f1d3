//! A first picture in the shadows of shadow maps: single scattering by their shares, and the draft's multiple scattering and light of
//! lights without maps.

use rayon::prelude::*;
use strandlight_scattering::wide::{LANES, Level, dispatch};

use super::super::draft_multiple::{DraftMultiple, DraftPoint, LightColumns};
use super::super::halves::half;
use super::super::radiance::{Between, Radiance};
use super::super::shade::Counts;
use super::super::through_shares::{self, Maps, ThroughShares};
use super::super::unblocked::VisiblePoint;
use super::{CHUNK, Scratch, WideShader, Written, with_optics};

impl WideShader<'_> {
    /// Writes the numbers of a point of a draft that came to `sum`; answers its rest.
    #[inline(always)]
    pub(super) fn write_draft(
        &self,
        columns: &LightColumns,
        scratch: &Scratch,
        sum: &[f32; 4],
        numbers: &mut [u16],
    ) -> [f32; 4] {
        let scale = self.view.radiance_scale;
        let DraftPoint { single, direct } = &scratch.of_draft;
        let unblocked = scratch.unblocked.as_flattened();
        let n_row = numbers.len() / 3;
        let mut rest = [0, 1, 2, 3].map(|ix: usize| sum[ix] - single[ix]);
        for (channel, numbers) in numbers.chunks_exact_mut(n_row.max(1)).enumerate() {
            let direct = direct[channel].as_flattened();
            for (column, rgb) in self.colors.iter().enumerate() {
                if columns.has_maps(column) {
                    let direct = rgb[channel] * direct[column];
                    rest[channel] -= unblocked[column] * direct;
                    numbers[column] = half(scale * direct);
                }
            }
        }
        let [r, g, b, side] = rest.map(|value| scale * value);
        // What is left of rounding may be less than nothing.
        [r.max(0.0), g.max(0.0), b.max(0.0), side]
    }

    /// Radiance of some visible points in the shadows of `maps`; each lies `between` points of the `draft`.
    pub fn shade_shadowed(
        &self,
        maps: Maps,
        draft: &DraftMultiple,
        (places, visible): (&[u32], &[u32]),
        between: &[Between],
    ) -> Radiance {
        let through = ThroughShares::new(&self.scene.strands, self.view.eye, maps);
        let drawn = maps.drawn_of_slots();
        let mut radiance = Radiance::black(places.len(), !self.narrow.is_empty());
        let chunks: Vec<_> = radiance.chunks_mut(CHUNK).collect();
        let of_chunk =
            |(scratch, shares): &mut (Scratch, through_shares::Scratch),
             ((radiance, along), places): ((&mut [[f32; 4]], &mut [_]), &[u32])| {
                let mut counts = Counts::default();
                dispatch!(Level::new(), simd => {
                    for (ix, (radiance, &place)) in radiance.iter_mut().zip(places).enumerate() {
                        let at = VisiblePoint {
                            place: place as usize,
                            point: visible[place as usize] as usize,
                        };
                        through.find(simd, at, shares);
                        self.take_shares(&draft.columns, (maps, &drawn), (at, &shares.shares), scratch);
                        let place = self.place(at.point);
                        let mut last = std::mem::take(&mut scratch.last_painted);
                        let single = with_optics!(self, at.point, &mut last, optics => {
                            self.narrow(simd, at, optics, scratch);
                            let of_point = (&place, optics);
                            self.single(simd, at, of_point, Written::Nothing, scratch, &mut counts)
                        });
                        scratch.last_painted = last;
                        let single = single.unwrap_or_default();
                        *radiance = single.map(|value| value * self.view.radiance_scale);
                        let multiple = draft.at(&between[at.place], &scratch.unblocked);
                        for (sum, value) in radiance.iter_mut().zip(multiple) {
                            *sum += value;
                        }
                        if let Some(along) = along.get_mut(ix) {
                            self.add_narrow(scratch, along);
                        }
                    }
                });
            };
        chunks
            .into_par_iter()
            .zip(places.par_chunks(CHUNK))
            .for_each_init(Default::default, of_chunk);
        radiance
    }

    /// Unblocked shares of all lights at a point, by those of its slots for TT; none of lights without maps, whose light is in the rest.
    #[inline(always)]
    fn take_shares(
        &self,
        columns: &LightColumns,
        (maps, drawn): (Maps, &[Vec<u32>]),
        (at, of_tt): (VisiblePoint, &[f32]),
        scratch: &mut Scratch,
    ) {
        for shares in [&mut scratch.unblocked, &mut scratch.unblocked_tt] {
            shares.clear();
            shares.resize(self.lights.len(), [0.0; LANES]);
        }
        let unblocked = scratch.unblocked.as_flattened_mut();
        let unblocked_tt = scratch.unblocked_tt.as_flattened_mut();
        for (column, &slot) in columns.slots.iter().enumerate() {
            if columns.has_maps(column) {
                unblocked[column] = maps
                    .of_lights
                    .share_of(drawn[slot as usize].iter().copied(), at);
                unblocked_tt[column] = of_tt[slot as usize];
            }
        }
    }
}
