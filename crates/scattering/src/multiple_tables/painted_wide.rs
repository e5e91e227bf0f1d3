//! Look-ups in tables of painted points for eight lights at a time, one view.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::painted::{LayerPlace, PaintedPlaces, PaintedTables};
use super::wide::AzimuthsOfLights;
use crate::wide::math::mul_add;

/// Of the layers of a pack, what a channel that stands there has.
#[inline(always)]
fn between<S: Simd>(layers: &[f32x8<S>; 3], place: &LayerPlace) -> f32x8<S> {
    // Places are 0 or 1.
    let (low, high) = match place.lower {
        0 => (layers[0], layers[1]),
        _ => (layers[1], layers[2]),
    };
    let fraction = f32x8::splat(low.token(), place.fraction);
    mul_add(high - low, fraction, low)
}

impl PaintedTables {
    /// [`MultipleTables::at_lights`](super::MultipleTables::at_lights) of a point, whose packs have to be there: others
    /// give nothing.
    #[inline(always)]
    pub fn at_lights<S: Simd>(
        &self,
        at: &PaintedPlaces,
        theta_j: f32x8<S>,
        theta_o: f32,
        azimuths: &AzimuthsOfLights<S>,
        sigma_f: f32x8<S>,
    ) -> ([f32x8<S>; 3], [f32x8<S>; 3]) {
        let zero = f32x8::splat(theta_j.token(), 0.0);
        let (mut global, mut local) = ([zero; 3], [zero; 3]);
        let mut packs = at.packs();
        while packs != 0 {
            let pack = packs.trailing_zeros() as usize;
            packs &= packs - 1;
            let Some(tables) = self.pack(pack) else {
                debug_assert!(false, "pack {pack} is not there");
                continue;
            };
            let of_layers = tables.at_lights(theta_j, theta_o, azimuths, sigma_f);
            for channel in 0..3 {
                let (own, around) = (&at.own[channel], &at.around[channel]);
                if own.pack == pack {
                    global[channel] = between(&of_layers.0, own);
                }
                if around.pack == pack {
                    local[channel] = between(&of_layers.1, around);
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
        (theta_j, cos_theta_j): (f32x8<S>, f32x8<S>),
        theta_o: f32,
        cos_delta: f32x8<S>,
        lambda: f32x8<S>,
    ) -> [f32x8<S>; 3] {
        let mut direct = [f32x8::splat(theta_j.token(), 0.0); 3];
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
            let of_layers =
                tables.direct_at_lights(theta_j, cos_theta_j, theta_o, cos_delta, lambda);
            for (direct, around) in direct.iter_mut().zip(&at.around) {
                if around.pack == place.pack {
                    *direct = between(&of_layers, around);
                }
            }
        }
        direct
    }
}
