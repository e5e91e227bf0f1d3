//! The picture from its list and the radiance of its points.

use glam::Vec3;
use rayon::prelude::*;

use super::super::along_segments::along_segment;
use super::super::composite::composite;
use super::super::list::{Entry, Tile, VisibilityList};
use super::super::proxies::Proxies;
use super::super::radiance::{Radiance, profile_factors};
use super::super::transmittance::mix;
use super::state::{Frame, Picturing};

impl Frame {
    /// Linear radiance and coverage, row by row, as far as they are found.
    pub(super) fn composite(&self, picturing: &Picturing) -> Vec<[f32; 4]> {
        let [width, height] = self.size;
        let mut rgba = vec![[0.0; 4]; (width * height) as usize];
        if let (Some((list, _)), Some(shaded), Some(proxies)) =
            (&self.list, &self.shaded, &self.proxies)
        {
            let profile = self.profile.filter(|_| list.has_wide);
            let strands = OfStrands {
                radiance: &shaded.radiance,
                even: profile.map(|profile| profile.even),
            };
            resolve(list, &strands, proxies, self.size, &mut rgba);
        }
        composite(picturing.scene, &picturing.view, 1, &mut rgba);
        rgba
    }
}

/// What the strands of a list send to the eye.
struct OfStrands<'a> {
    radiance: &'a Radiance,
    /// Of their profile over the width, where there are wide ones.
    even: Option<[f32; 4]>,
}

impl OfStrands<'_> {
    /// Radiance of an entry, times the view's radiance scale.
    #[inline(always)]
    fn at(&self, entry: &Entry) -> [f32; 3] {
        let (first, t) = (entry.first as usize, entry.t());
        let (a, b) = (&self.radiance.at[first], &self.radiance.at[first + 1]);
        let mut rgb = [0, 1, 2].map(|channel: usize| mix(a[channel], b[channel], t));
        if let Some([first, second]) = self.radiance.along_from(first) {
            let light = along_segment(first, second, t);
            for (value, light) in rgb.iter_mut().zip(light) {
                *value += light;
            }
        }
        if let Some(even) = &self.even {
            let factors = profile_factors(rgb, mix(a[3], b[3], t), even, entry.across());
            for (value, factor) in rgb.iter_mut().zip(factors) {
                *value *= factor;
            }
        }
        rgb
    }
}

/// Adds up what each pixel shows: rgb times the view's radiance scale, and coverage.
fn resolve(
    list: &VisibilityList,
    strands: &OfStrands,
    proxies: &Proxies,
    size: [u32; 2],
    rgba: &mut [[f32; 4]],
) {
    // A row of tiles is a band of the picture.
    let across = list
        .tiles
        .iter()
        .take_while(|tile| tile.origin[1] == 0)
        .count();
    let rows = list.tiles.chunks(across.max(1));
    let mut bands = Vec::new();
    let mut rest = rgba;
    for tiles in rows {
        let height = tiles[0].size[1];
        let (band, after) = rest.split_at_mut((size[0] * height) as usize);
        bands.push((tiles, band));
        rest = after;
    }
    bands.into_par_iter().for_each(|(tiles, band)| {
        for tile in tiles {
            resolve_tile(tile, (strands, proxies), size[0], band);
        }
    });
}

fn resolve_tile(
    tile: &Tile,
    (strands, proxies): (&OfStrands, &Proxies),
    width: u32,
    band: &mut [[f32; 4]],
) {
    let place = |pixel: usize| {
        let [x, y] = [pixel as u32 % tile.size[0], pixel as u32 / tile.size[0]];
        (tile.origin[0] + x + width * y) as usize
    };
    for (pixel, range) in tile.starts.windows(2).enumerate() {
        let mut sum = [0.0; 4];
        for entry in &tile.entries[range[0] as usize..range[1] as usize] {
            for (sum, value) in sum.iter_mut().zip(strands.at(entry)) {
                *sum += entry.weight * value;
            }
            sum[3] += entry.weight;
        }
        band[place(pixel)] = sum;
    }
    for entry in &tile.proxies {
        let sent_back = proxies.sent_back(entry.surface, Vec3::from(entry.position));
        let sum = &mut band[place(entry.pixel as usize)];
        for (channel, value) in sent_back.into_iter().enumerate() {
            sum[channel] += entry.weight * value;
        }
        sum[3] += entry.weight;
    }
}
