//! The list itself.

use std::ops::Range;

use super::super::parts::SOFTWARE_HITS_PER_PIXEL;
use super::super::readback::Readback;
use super::super::resources::{StrandBuffers, compute_pass, failed, grow, step, submit};
use super::super::stamp::Stamp;
use super::bands::{bands, hits_of};
use super::buffers::{Buffers, HIT_BYTES, TOTALS_BYTES, limit, n_seen_words};
use super::pipelines::{Pipelines, group, groups};
use super::{Asked, Made, ShownProxies, Use, VisibilityPass};
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::camera::ViewUniform;

/// Hits for which one entry is expected; in dense hair there are fewer entries.
const HITS_PER_ENTRY: u64 = 4;

impl VisibilityPass {
    /// Begins the list of `strands` among `proxies` as `view` sees them, and that of the points which it shows; the one
    /// before is lost.
    pub fn begin(
        &mut self,
        context: &Context,
        view: &ViewUniform,
        strands: &StrandBuffers,
        (proxies, is_narrow): (Option<ShownProxies>, bool),
        stamp: Stamp,
    ) -> Result<(), RenderError> {
        self.forget();
        self.extent = view.extent;
        let meshes = proxies.and_then(|proxies| proxies.meshes);
        let n_triangles = meshes.map_or(0, |[_, corners]| (corners.size() / 12) as u32);
        let numbers = [self.n_points, n_triangles];
        let has_proxies = proxies.is_some();
        if !(self.buffers).fit(context, numbers, view.extent, has_proxies) {
            return Ok(());
        }
        context.write(&self.buffers.view, 0, bytemuck::bytes_of(view));
        self.set_kind(context, proxies, is_narrow)?;
        self.write_layout(context, 0..view.extent[1], Use::Counts);
        self.count_hits(context, strands, stamp);
        if let Some(meshes) = meshes {
            self.count_triangles(context, meshes);
        }
        self.ask(context, Asked::Rows);
        Ok(())
    }

    /// Goes on with the list that was begun, as far as the device has answered; `strands` and `proxies` are those of
    /// then.
    pub fn proceed(
        &mut self,
        context: &Context,
        strands: &StrandBuffers,
        proxies: Option<ShownProxies>,
        stamp: impl FnOnce() -> Stamp,
    ) -> Result<Made, RenderError> {
        match self.asked {
            Asked::Nothing => return Ok(Made::NoRoom),
            Asked::Rows => {}
            Asked::Seen => return self.keep(context, strands, proxies, stamp),
        }
        let Some(numbers) = self.answer.take::<u32>() else {
            return self.unanswered(context, self.answer.is_idle());
        };
        let height = self.extent[1] as usize;
        let meshes = proxies.and_then(|proxies| proxies.meshes);
        let has_room = self.make_room(context, &numbers[..height])
            && meshes.is_none_or(|meshes| {
                let n_sorted = numbers[2 * height];
                self.sort_triangles(context, meshes, n_sorted)
            });
        if !has_room {
            self.forget();
            return Ok(Made::NoRoom);
        }
        self.list_bands(context, strands, proxies, stamp())?;
        if self.keeps() {
            return Ok(Made::Listing);
        }
        (self.asked, self.is_counted) = (Asked::Nothing, true);
        Ok(Made::Listed)
    }

    /// Keeps the entries of all bands if there is room, once the device has answered how many there are; where there was
    /// too little, lists them again.
    fn keep(
        &mut self,
        context: &Context,
        strands: &StrandBuffers,
        proxies: Option<ShownProxies>,
        stamp: impl FnOnce() -> Stamp,
    ) -> Result<Made, RenderError> {
        let Some(seen) = self.take_counted() else {
            return self.unanswered(context, self.counted.is_idle());
        };
        let room = self.buffers.entries.size() / HIT_BYTES;
        self.is_kept = u64::from(seen.entries) <= room;
        if !self.is_kept && self.make_room_to_keep(context, seen.entries) {
            self.list_bands(context, strands, proxies, stamp())?;
            return Ok(Made::Listing);
        }
        self.asked = Asked::Nothing;
        self.seen = Some(seen);
        Ok(Made::Whole)
    }

    /// What is made while an answer is awaited that is not there, or that `is_lost` on its way.
    fn unanswered(&mut self, context: &Context, is_lost: bool) -> Result<Made, RenderError> {
        if !is_lost {
            return Ok(Made::NotYet);
        }
        self.forget();
        // It has the reason.
        context.check("visibility list").map_err(failed)?;
        Ok(Made::NoRoom)
    }

    /// Makes the lists of all bands, and has the device answer how much is seen.
    fn list_bands(
        &mut self,
        context: &Context,
        strands: &StrandBuffers,
        proxies: Option<ShownProxies>,
        stamp: Stamp,
    ) -> Result<(), RenderError> {
        submit(context, |encoder| {
            encoder.clear_buffer(&self.buffers.seen, 0, None)
        });
        self.listed = None;
        for ix in 0..self.bands.len() {
            let stamp = match ix {
                0 => stamp.clone().first(),
                _ => Stamp::default(),
            };
            self.list_band(context, strands, proxies, ix, self.keeps(), stamp)?;
        }
        self.list_seen(context, stamp.last());
        (self.seen, self.is_counted) = (None, false);
        self.ask(context, Asked::Seen);
        Ok(())
    }

    /// Are there several bands, whose entries are kept if there is room?
    fn keeps(&self) -> bool {
        self.bands.len() > 1
    }

    /// Makes room for so many entries of all bands, if so many may be kept. Answers whether there is.
    fn make_room_to_keep(&mut self, context: &Context, n_entries: u32) -> bool {
        let bytes = u64::from(n_entries) * HIT_BYTES;
        let may_be_kept = n_entries <= self.most_hits && bytes <= limit(context);
        if may_be_kept {
            grow(context, &mut self.buffers.entries, bytes);
        }
        may_be_kept
    }

    /// There is no list, nor is one under way.
    pub fn forget(&mut self) {
        self.listed = None;
        self.is_kept = false;
        self.asked = Asked::Nothing;
        self.bands.clear();
    }

    /// Has the device answer what it has counted.
    fn ask(&mut self, context: &Context, asked: Asked) {
        let Buffers { rows, totals, .. } = &self.buffers;
        let of_rows = 2 * 4 * u64::from(self.extent[1]);
        let (from, bytes, answer) = match asked {
            Asked::Rows => (rows, of_rows + TOTALS_BYTES, &mut self.answer),
            Asked::Seen | Asked::Nothing => (totals, TOTALS_BYTES, &mut self.counted),
        };
        // An answer that nobody took may still be on its way.
        if !answer.has_room(bytes) {
            *answer = Readback::new(context, bytes);
        }
        answer.send(context, from, bytes, |encoder| {
            if asked == Asked::Rows {
                encoder.copy_buffer_to_buffer(totals, 0, rows, of_rows, TOTALS_BYTES);
            }
        });
        self.asked = asked;
    }

    /// Counts the hits of all pixels.
    fn count_hits(&self, context: &Context, strands: &StrandBuffers, stamp: Stamp) {
        let Buffers {
            view,
            points,
            pixels,
            rows,
            ..
        } = &self.buffers;
        let Pipelines {
            place_points,
            find_hits,
            sum_rows,
            ..
        } = &self.pipelines;
        let of_strands = [
            (3, &strands.points),
            (4, &strands.tangents),
            (5, &strands.normals),
        ];
        let placed = [&[(0, view), (6, points)], &of_strands[..]].concat();
        let placed = group(context, place_points, &placed);
        let counted = self.bind_hits(context, strands);
        let summed = group(context, sum_rows, &[(0, view), (8, pixels), (9, rows)]);
        submit(context, |encoder| {
            encoder.clear_buffer(pixels, 0, None);
            let mut pass = compute_pass(context, encoder, stamp);
            step(&mut pass, place_points, &placed, groups(self.n_points));
            step(&mut pass, find_hits, &counted, groups(self.n_segments));
            step(&mut pass, sum_rows, &summed, [self.extent[1], 1]);
        });
    }

    /// Shares rows of so many hits out into bands, and makes room for those of one. Answers whether it fits the device.
    fn make_room(&mut self, context: &Context, rows: &[u32]) -> bool {
        let most_of_row = u64::from(SOFTWARE_HITS_PER_PIXEL) * u64::from(self.extent[0]);
        if context.is_software() && rows.iter().any(|&n| u64::from(n) > most_of_row) {
            return false;
        }
        let fitting = u32::try_from(limit(context) / HIT_BYTES).unwrap_or(u32::MAX);
        self.bands = bands(rows, self.most_hits.min(fitting));
        let most = self.bands.iter().map(|band| hits_of(rows, band));
        let most = most.max().unwrap_or(0);
        let bytes = most * HIT_BYTES;
        if bytes > limit(context) || most > u64::from(u32::MAX) / 3 {
            return false;
        }
        grow(context, &mut self.buffers.hits, bytes);
        if self.keeps() {
            // A guess; the device answers whether it is enough.
            let n_hits = rows.iter().map(|n| u64::from(*n)).sum::<u64>();
            let n_entries = (n_hits / HITS_PER_ENTRY).min(self.most_hits.into());
            self.make_room_to_keep(context, n_entries as u32);
        }
        true
    }

    fn bind_hits(&self, context: &Context, strands: &StrandBuffers) -> wgpu::BindGroup {
        let Buffers {
            view,
            layout,
            points,
            pixels,
            hits,
            ..
        } = &self.buffers;
        let resources = [
            (0, view),
            (1, layout),
            (2, &strands.segments),
            (7, points),
            (8, pixels),
            (10, hits),
        ];
        group(context, &self.pipelines.find_hits, &resources)
    }

    /// Makes the list of a band, unless it is there; its entries are kept beside those of other bands or not.
    pub(super) fn list_band(
        &mut self,
        context: &Context,
        strands: &StrandBuffers,
        proxies: Option<ShownProxies>,
        ix: usize,
        is_keeping: bool,
        stamp: Stamp,
    ) -> Result<(), RenderError> {
        let (Some(kind), false) = (&self.kind, self.listed == Some(ix)) else {
            return Ok(());
        };
        let band: Range<u32> = self.bands[ix].clone();
        self.write_layout(context, band.clone(), Use::Writes { is_keeping });
        let Buffers {
            view,
            layout,
            points,
            pixels,
            rows,
            hits,
            entries,
            seen,
            behind,
            triangles,
            tiles,
            ..
        } = &self.buffers;
        let Pipelines {
            find_hits,
            place_rows,
            place_pixels,
            ..
        } = &self.pipelines;
        let placed_rows = group(context, place_rows, &[(0, view), (1, layout), (9, rows)]);
        let of_rows = [(0, view), (1, layout), (8, pixels), (9, rows)];
        let placed_pixels = group(context, place_pixels, &of_rows);
        let written = self.bind_hits(context, strands);
        let mut resources = vec![(0, view), (1, layout), (7, points), (8, pixels), (10, hits)];
        resources.extend([(11, seen), (14, entries)]);
        if let Some(proxies) = proxies {
            resources.extend([(17, proxies.records), (18, behind)]);
            let of_meshes = [(23, triangles), (24, tiles)];
            resources.extend(proxies.meshes.iter().flat_map(|_| of_meshes));
        }
        let listed = group(context, &kind.list_pixels, &resources);
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            step(&mut pass, place_rows, &placed_rows, [1, 1]);
            step(
                &mut pass,
                place_pixels,
                &placed_pixels,
                [band.len() as u32, 1],
            );
            step(&mut pass, find_hits, &written, groups(self.n_segments));
            step(
                &mut pass,
                &kind.list_pixels,
                &listed,
                self.groups_of_pixels(&band),
            );
        });
        if self.bands.len() > 1 {
            self.end_band(context)?;
        }
        self.listed = Some(ix);
        Ok(())
    }

    /// Lists the points that are seen.
    fn list_seen(&self, context: &Context, stamp: Stamp) {
        let Buffers {
            view,
            seen,
            seen_points,
            totals,
            ..
        } = &self.buffers;
        let Pipelines {
            count_seen,
            list_seen,
            ..
        } = &self.pipelines;
        let counted = [(0, view), (11, seen), (13, totals)];
        let listed = [&counted[..], &[(12, seen_points)]].concat();
        let counted = group(context, count_seen, &counted);
        let listed = group(context, list_seen, &listed);
        let groups = groups(n_seen_words(self.n_points));
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            step(&mut pass, count_seen, &counted, groups);
            step(&mut pass, list_seen, &listed, groups);
        });
    }
}
