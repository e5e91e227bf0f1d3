//! Triangles of meshes, sorted into tiles of the picture.

use super::super::resources::{compute_pass, grow, step, submit};
use super::super::stamp::Stamp;
use super::VisibilityPass;
use super::buffers::{Buffers, limit};
use super::pipelines::{group, groups};
use crate::gpu::Context;

/// Groups that go through all triangles of these corners.
fn groups_of(corners: &wgpu::Buffer) -> [u32; 2] {
    groups((corners.size() / 12) as u32)
}

impl VisibilityPass {
    /// Counts the triangles of every tile; the total of all is left in `totals`.
    pub(super) fn count_triangles(
        &mut self,
        context: &Context,
        [surfaces, corners]: [&wgpu::Buffer; 2],
    ) {
        let Some([count, place, _]) = self.kind.as_ref().and_then(|kind| kind.triangles.as_ref())
        else {
            return;
        };
        let n_tiles: u64 = self.n_tiles().map(u64::from).iter().product();
        grow(context, &mut self.buffers.tiles, 4 * n_tiles);
        let Buffers {
            view,
            layout,
            totals,
            triangles,
            tiles,
            ..
        } = &self.buffers;
        let read = [(0, view), (1, layout), (20, surfaces), (21, corners)];
        let counted = [&read[..], &[(22, triangles), (24, tiles)]].concat();
        let counted = group(context, count, &counted);
        let placed = group(context, place, &[(1, layout), (13, totals), (24, tiles)]);
        submit(context, |encoder| {
            encoder.clear_buffer(tiles, 0, None);
            let mut pass = compute_pass(context, encoder, Stamp::default());
            step(&mut pass, count, &counted, groups_of(corners));
            step(&mut pass, place, &placed, [1, 1]);
        });
    }

    /// Sorts the triangles into their tiles, where they take so many words with the tiles themselves. Answers whether
    /// they fit the device.
    pub(super) fn sort_triangles(
        &mut self,
        context: &Context,
        [surfaces, corners]: [&wgpu::Buffer; 2],
        n_words: u32,
    ) -> bool {
        let Some([_, _, sort]) = self.kind.as_ref().and_then(|kind| kind.triangles.as_ref()) else {
            return true;
        };
        let bytes = 4 * u64::from(n_words);
        if bytes > limit(context) {
            return false;
        }
        let n_tiles: u64 = self.n_tiles().map(u64::from).iter().product();
        let Buffers {
            view,
            layout,
            tiles,
            ..
        } = &self.buffers;
        let mut larger = tiles.clone();
        if grow(context, &mut larger, bytes) {
            submit(context, |encoder| {
                encoder.copy_buffer_to_buffer(tiles, 0, &larger, 0, 4 * n_tiles);
            });
        }
        let read = [(0, view), (1, layout), (20, surfaces), (21, corners)];
        let sorted = group(context, sort, &[&read[..], &[(24, &larger)]].concat());
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, Stamp::default());
            step(&mut pass, sort, &sorted, groups_of(corners));
        });
        self.buffers.tiles = larger;
        true
    }
}
