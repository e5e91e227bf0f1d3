//! Look-ups in tables of painted points for eight lights at a time, one view.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::painted::{PackPlace, PaintedPlaces, PaintedTables};
use super::wide::{Cells, SeenLights};

/// Of the absorptions of a pack, what a channel that stands there has.
#[inline(always)]
fn between<S: Simd>([a, b, c]: &[f32x8<S>; 3], place: &PackPlace) -> f32x8<S> {
    let [of_a, of_b, of_c] = place.weights;
    (*a * of_a + *b * of_b + *c * of_c).max(0.0)
}

impl PaintedTables {
    /// [`MultipleTables::at_lights`](super::MultipleTables::at_lights) of a point, whose packs have to be there: others
    /// give nothing.
    #[inline(always)]
    pub fn at_lights<S: Simd>(
        &self,
        at: &PaintedPlaces,
        seen: &SeenLights<S>,
        sigma_f: f32x8<S>,
    ) -> ([f32x8<S>; 3], [f32x8<S>; 3]) {
        let zero = f32x8::splat(sigma_f.token(), 0.0);
        let (mut global, mut local) = ([zero; 3], [zero; 3]);
        let mut packs = at.packs();
        // Packs mostly have the same axes.
        let mut last = None;
        while packs != 0 {
            let pack = packs.trailing_zeros() as usize;
            packs &= packs - 1;
            let Some(tables) = self.pack(pack) else {
                debug_assert!(false, "pack {pack} is not there");
                continue;
            };
            let cells = match last {
                Some((axes, cells)) if axes == tables.axes => cells,
                _ => Cells::new(&tables.axes, seen, sigma_f),
            };
            last = Some((tables.axes, cells));
            let of_pack = tables.in_cells(&cells, &seen.azimuths);
            for channel in 0..3 {
                let (own, around) = (&at.own[channel], &at.around[channel]);
                if own.pack == pack {
                    global[channel] = between(&of_pack.0, own);
                }
                if around.pack == pack {
                    local[channel] = between(&of_pack.1, around);
                }
            }
        }
        (global, local)
    }

    /// [`MultipleTables::direct_at_lights`](super::MultipleTables::direct_at_lights), likewise.
    #[inline(always)]
    pub fn direct_at_lights<S: Simd>(
        &self,
        at: &PaintedPlaces,
        seen: &SeenLights<S>,
        lambda: f32x8<S>,
    ) -> [f32x8<S>; 3] {
        let mut direct = [f32x8::splat(lambda.token(), 0.0); 3];
        let mut done = 0;
        for place in &at.around {
            if done & 1 << place.pack != 0 {
                continue;
            }
            done |= 1 << place.pack;
            let Some(tables) = self.pack(place.pack) else {
                debug_assert!(false, "pack {} is not there", place.pack);
                continue;
            };
            let of_pack = tables.direct_at_lights(seen, lambda);
            for (direct, around) in direct.iter_mut().zip(&at.around) {
                if around.pack == place.pack {
                    *direct = between(&of_pack, around);
                }
            }
        }
        direct
    }
}
