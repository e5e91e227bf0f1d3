//! The picture from its list and the radiance of its points.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::view_uniform;
use strandlight_scene::stats::Observer;

use super::super::along_segments::along_segment;
use super::super::composite::composite;
use super::super::last_view::LastView;
use super::super::list::{Entry, Tile, VisibilityList};
use super::super::proxies::Proxies;
use super::super::radiance::{Radiance, profile_factors};
use super::super::transmittance::mix;
use super::parts::Picturing;
use super::state::Frame;

impl Frame {
    /// Linear radiance and coverage, row by row, as far as they are found.
    pub(super) fn composite(&self, picturing: &Picturing, observer: Observer) -> Vec<[f32; 4]> {
        let [width, height] = self.size;
        let mut rgba = vec![[0.0; 4]; (width * height) as usize];
        self.resolve(&mut rgba);
        composite(picturing.scene, &picturing.view, 1, &mut rgba, observer);
        rgba
    }

    /// The last picture with its depths, to be seen from elsewhere; [`None`] where there is none.
    pub fn last_view(&self, scene: &PreparedScene) -> Option<LastView> {
        let (Some((list, visible)), Some(_)) = (&self.list, &self.shaded) else {
            return None;
        };
        let size = self.size;
        let n_pixels = (size[0] * size[1]) as usize;
        let view = view_uniform(&scene.camera, &scene.strands, size, scene.radiance_scale());
        let mut rgba = vec![[0.0; 4]; n_pixels];
        self.resolve(&mut rgba);
        let (eye, forward) = (Vec3::from(view.eye), Vec3::from(view.forward));
        let depth_of = |position: Vec3| (position - eye).dot(forward);
        let points = visible.points.par_iter();
        let depths: Vec<f32> = points
            .map(|point| depth_of(Vec3::from_slice(&scene.strands.points[*point as usize])))
            .collect();
        let mut depth = vec![0.0; n_pixels];
        each_tile(list, size, &mut depth, |tile, band| {
            for (pixel, range) in tile.starts.windows(2).enumerate() {
                let entries = &tile.entries[range[0] as usize..range[1] as usize];
                let first = |entry: &Entry| entry.first as usize;
                let sum = entries.iter().map(|entry| {
                    let [a, b] = [0, 1].map(|ix: usize| depths[first(entry) + ix]);
                    entry.weight * mix(a, b, entry.t())
                });
                band[tile.place(pixel, size[0])] = sum.sum();
            }
            for entry in &tile.proxies {
                let place = tile.place(entry.pixel as usize, size[0]);
                band[place] += entry.weight * depth_of(Vec3::from(entry.position));
            }
        });
        for (depth, [.., coverage]) in depth.iter_mut().zip(&rgba) {
            *depth /= coverage.max(f32::MIN_POSITIVE);
        }
        Some(LastView { view, rgba, depth })
    }

    /// Adds up what each pixel shows: rgb times the view's radiance scale, and coverage.
    fn resolve(&self, rgba: &mut [[f32; 4]]) {
        let (Some((list, _)), Some(shaded), Some(proxies)) =
            (&self.list, &self.shaded, &self.proxies)
        else {
            return;
        };
        let profile = self.profile.filter(|_| list.has_wide);
        let strands = OfStrands {
            radiance: &shaded.radiance,
            even: profile.map(|profile| profile.even),
        };
        let width = self.size[0];
        each_tile(list, self.size, rgba, |tile, band| {
            resolve_tile(tile, (&strands, proxies), width, band);
        });
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

/// Hands each tile its band of `values`, by pixel of a picture.
fn each_tile<T: Send>(
    list: &VisibilityList,
    size: [u32; 2],
    values: &mut [T],
    op: impl Fn(&Tile, &mut [T]) + Sync,
) {
    // A row of tiles is a band of the picture.
    let tiles = list.tiles.iter();
    let across = tiles.take_while(|tile| tile.origin[1] == 0).count();
    let mut bands = Vec::new();
    let mut rest = values;
    for tiles in list.tiles.chunks(across.max(1)) {
        let (band, after) = rest.split_at_mut((size[0] * tiles[0].size[1]) as usize);
        bands.push((tiles, band));
        rest = after;
    }
    bands
        .into_par_iter()
        .for_each(|(tiles, band)| tiles.iter().for_each(|tile| op(tile, band)));
}

fn resolve_tile(
    tile: &Tile,
    (strands, proxies): (&OfStrands, &Proxies),
    width: u32,
    band: &mut [[f32; 4]],
) {
    for (pixel, range) in tile.starts.windows(2).enumerate() {
        let mut sum = [0.0; 4];
        for entry in &tile.entries[range[0] as usize..range[1] as usize] {
            for (sum, value) in sum.iter_mut().zip(strands.at(entry)) {
                *sum += entry.weight * value;
            }
            sum[3] += entry.weight;
        }
        band[tile.place(pixel, width)] = sum;
    }
    for entry in &tile.proxies {
        let position = Vec3::from(entry.position);
        let sent_back = proxies.sent_back_from(entry.surface, position, || entry.shares());
        let sum = &mut band[tile.place(entry.pixel as usize, width)];
        for (channel, value) in sent_back.into_iter().enumerate() {
            sum[channel] += entry.weight * value;
        }
        sum[3] += entry.weight;
    }
}
