//! Strands without samples: a list of what each pixel shows, the points that this is, and the list times their
//! radiance. See `shaders/pass/visibility.wgsl`.

use std::ops::Range;

use super::draw::LitPoints;
use super::parts::PartLimits;
use super::resources::{
    StrandBuffers, bind, compute, compute_pass, failed, grow, module_with, read_back, step,
    storage, submit, uniform,
};
use super::stamp::Stamp;
use super::{meshes, proxies};
use crate::gpu::Context;
use strandlight_scene::RenderError;
use strandlight_scene::camera::ViewUniform;

/// Side of a tile, px.
const TILE: u32 = 16;

/// Surfaces of a pixel that are kept: two proxies and a triangle.
const N_BEHIND: u32 = 3;

/// Threads of a group that goes through segments, triangles or a row.
const GROUP: u32 = 256;

/// Bytes of a hit or an entry.
const HIT_BYTES: u64 = 12;

/// Light of narrow lights along segments.
const NARROW: &str = "NARROW";

/// Mirrored by `ListLayout` in `shaders/pass/visibility.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct ListLayout {
    n_tiles: [u32; 2],
    first_row: u32,
    end_row: u32,
    n_segments: u32,
    is_writing: u32,
    is_draft: u32,
    pad: u32,
    even: [f32; 4],
}

/// Mirrored by `Pixel` there.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Pixel {
    n_hits: u32,
    next: u32,
    n_entries: u32,
    pad: u32,
}

/// Mirrored by `SeenSurface` there.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct SeenSurface {
    surface: u32,
    weight: f32,
    moved: u32,
    depth: f32,
}

/// Mirrored by `Triangle` there.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Triangle {
    sides: [[f32; 4]; 3],
    corners: [u32; 3],
    depth: f32,
}

strandlight_scattering::mirrors! {
    ListLayout as "ListLayout" in "pass/visibility" {
        n_tiles, first_row, end_row, n_segments, is_writing, is_draft, pad, even,
    }
    Pixel as "Pixel" in "pass/visibility" { n_hits, next, n_entries, pad }
    SeenSurface as "SeenSurface" in "pass/visibility" { surface, weight, moved, depth }
    Triangle as "Triangle" in "pass/visibility" { sides, corners, depth }
}

/// What stands before and behind the hair.
#[derive(Clone, Copy)]
pub(crate) struct ShownProxies<'a> {
    /// Records of the proxies.
    pub records: &'a wgpu::Buffer,
    /// Their light, and that of the vertices of meshes.
    pub light: &'a wgpu::Buffer,
    /// Vertices of meshes and corners of their triangles, if there are any.
    pub meshes: Option<[&'a wgpu::Buffer; 2]>,
}

/// How much of a view the picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Seen {
    /// Points.
    pub points: u32,
    /// Pairs of a pixel and a ribbon.
    pub entries: u32,
}

/// The light in which a list is drawn.
#[derive(Clone, Copy)]
pub(crate) struct ListedLight<'a> {
    /// Radiance of the points.
    pub points: LitPoints<'a>,
    /// The profile over the width of wide strands.
    pub even: [f32; 4],
    /// Points that were not lit are black, and those of their pixel that were stand for them.
    pub is_draft: bool,
}

/// What a layout is for.
enum Use {
    /// Hits are counted.
    Counts,
    /// Hits are written.
    Writes,
    /// The list is drawn, as [`ListedLight::even`] and [`ListedLight::is_draft`] say.
    Draws([f32; 4], bool),
}

/// What all scenes need.
struct Pipelines {
    place_points: wgpu::ComputePipeline,
    find_hits: wgpu::ComputePipeline,
    sum_rows: wgpu::ComputePipeline,
    place_rows: wgpu::ComputePipeline,
    place_pixels: wgpu::ComputePipeline,
    list_seen: wgpu::ComputePipeline,
}

/// What depends on the lights, and on what is beside the hair.
struct Kind {
    features: Vec<&'static str>,
    list_pixels: wgpu::ComputePipeline,
    resolve: wgpu::ComputePipeline,
    /// Where there are meshes: counts, places and sorts their triangles.
    triangles: Option<[wgpu::ComputePipeline; 3]>,
}

impl Kind {
    fn new(context: &Context, features: Vec<&'static str>) -> Result<Kind, RenderError> {
        let module = module_with(context, "pass/visibility", &features)?;
        let pipeline = |entry| compute(context, &module, entry);
        let of_triangles = ["count_triangles", "place_triangles", "sort_triangles"];
        Ok(Kind {
            list_pixels: pipeline("list_pixels"),
            resolve: pipeline("resolve"),
            triangles: (features.contains(&meshes::FEATURE)).then(|| of_triangles.map(pipeline)),
            features,
        })
    }
}

/// What lists are made of.
struct Buffers {
    view: wgpu::Buffer,
    layout: wgpu::Buffer,
    points: wgpu::Buffer,
    pixels: wgpu::Buffer,
    rows: wgpu::Buffer,
    hits: wgpu::Buffer,
    seen: wgpu::Buffer,
    /// The points among `seen`, in order.
    seen_points: wgpu::Buffer,
    totals: wgpu::Buffer,
    /// Of proxies.
    behind: wgpu::Buffer,
    /// Of meshes.
    triangles: wgpu::Buffer,
    tiles: wgpu::Buffer,
}

/// The list of a picture, and what makes and draws it.
pub(crate) struct VisibilityPass {
    pipelines: Pipelines,
    kind: Option<Kind>,
    buffers: Buffers,
    extent: [u32; 2],
    n_segments: u32,
    n_points: u32,
    /// Most hits of a band; a row may have more.
    pub most_hits: u32,
    /// Rows whose hits there is room for at a time.
    bands: Vec<Range<u32>>,
    /// The band whose list is there.
    listed: Option<usize>,
}

impl VisibilityPass {
    /// For `strands`.
    pub fn new(context: &Context, strands: &StrandBuffers) -> Result<VisibilityPass, RenderError> {
        let module = module_with(context, "pass/visibility", &[])?;
        let pipeline = |entry| compute(context, &module, entry);
        let view: ViewUniform = bytemuck::Zeroable::zeroed();
        let layout: ListLayout = bytemuck::Zeroable::zeroed();
        let n_points = strands.n_points;
        let empty = |label| storage(context, label, 0);
        Ok(VisibilityPass {
            pipelines: Pipelines {
                place_points: pipeline("place_points"),
                find_hits: pipeline("find_hits"),
                sum_rows: pipeline("sum_rows"),
                place_rows: pipeline("place_rows"),
                place_pixels: pipeline("place_pixels"),
                list_seen: pipeline("list_seen"),
            },
            kind: None,
            buffers: Buffers {
                view: uniform(context, "view", &view),
                layout: uniform(context, "layout of a list", &layout),
                points: empty("points on the screen"),
                pixels: empty("pixels"),
                rows: empty("rows"),
                hits: empty("hits"),
                // A bit for each point, and the number of entries.
                seen: storage(
                    context,
                    "seen points",
                    (u64::from(n_points.div_ceil(32)) + 1) * 4,
                ),
                seen_points: storage(context, "points of a list", 4 * u64::from(n_points)),
                totals: storage(context, "totals of a list", 8),
                behind: empty("surfaces behind"),
                triangles: empty("triangles"),
                tiles: empty("tiles"),
            },
            extent: [0; 2],
            n_segments: strands.n_segments,
            n_points,
            most_hits: PartLimits::default().hits,
            bands: Vec::new(),
            listed: None,
        })
    }

    /// Makes the list of `strands` among `proxies` as `view` sees them, and that of the points which it shows.
    /// [`None`] if it does not fit the device; nothing can be drawn then.
    pub fn list(
        &mut self,
        context: &Context,
        view: &ViewUniform,
        strands: &StrandBuffers,
        (proxies, is_narrow): (Option<ShownProxies>, bool),
        stamp: &Stamp,
    ) -> Result<Option<Seen>, RenderError> {
        self.listed = None;
        if !self.fit(context, view, proxies) {
            return Ok(None);
        }
        self.set_kind(context, proxies, is_narrow)?;
        self.write_layout(context, 0..view.extent[1], Use::Counts);
        let meshes = proxies.and_then(|proxies| proxies.meshes);
        if let Some(meshes) = meshes
            && !self.sort_triangles(context, meshes)?
        {
            return Ok(None);
        }
        let Some(bands) = self.count(context, strands, stamp)? else {
            return Ok(None);
        };
        self.bands = bands;
        submit(context, |encoder| {
            encoder.clear_buffer(&self.buffers.seen, 0, None)
        });
        for ix in 0..self.bands.len() {
            self.list_band(context, strands, proxies, ix)?;
        }
        let Buffers {
            view,
            seen,
            seen_points,
            totals,
            ..
        } = &self.buffers;
        let resources = [(0, view), (11, seen), (12, seen_points), (13, totals)];
        let list_seen = &self.pipelines.list_seen;
        let group = group(context, list_seen, &resources);
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp.clone().last());
            step(&mut pass, list_seen, &group, [1, 1]);
        });
        let totals: Vec<u32> = read_back(context, "totals of a list", totals)?;
        Ok(Some(Seen {
            points: totals[0],
            entries: totals[1],
        }))
    }

    /// The points that the last list shows, [`Seen::points`] of them.
    pub fn seen_points(&self) -> &wgpu::Buffer {
        &self.buffers.seen_points
    }

    /// Draws the picture that was listed of `strands` among `proxies` into `sums`, one sample a pixel, as `lit`. Tells
    /// `observer` the share that is done.
    pub fn draw(
        &mut self,
        context: &Context,
        strands: &StrandBuffers,
        proxies: Option<ShownProxies>,
        lit: ListedLight,
        sums: &wgpu::Buffer,
        observer: &mut dyn FnMut(f64),
    ) -> Result<(), RenderError> {
        let (radiance, along) = lit.points;
        self.set_kind(context, proxies, along.is_some())?;
        let n_bands = self.bands.len();
        for ix in 0..n_bands {
            self.list_band(context, strands, proxies, ix)?;
            let rows = self.bands[ix].clone();
            self.write_layout(context, rows.clone(), Use::Draws(lit.even, lit.is_draft));
            let Some(kind) = &self.kind else {
                return Ok(());
            };
            let Buffers {
                view,
                layout,
                pixels,
                hits,
                ..
            } = &self.buffers;
            let mut resources = vec![(0, view), (1, layout), (8, pixels), (10, hits)];
            resources.extend([(14, radiance), (15, sums)]);
            resources.extend(along.map(|along| (16, along)));
            if let Some(proxies) = proxies {
                let light = [(17, proxies.records), (19, proxies.light)];
                resources.extend(light);
                resources.push((18, &self.buffers.behind));
                resources.extend(proxies.meshes.map(|_| (23, &self.buffers.triangles)));
            }
            let group = group(context, &kind.resolve, &resources);
            submit(context, |encoder| {
                let mut pass = compute_pass(context, encoder, Stamp::default());
                step(
                    &mut pass,
                    &kind.resolve,
                    &group,
                    self.groups_of_pixels(&rows),
                );
            });
            context.wait("visibility list").map_err(failed)?;
            observer((ix + 1) as f64 / n_bands as f64);
        }
        Ok(())
    }

    /// Makes room for what does not depend on the number of hits. Answers whether it fits the device.
    fn fit(
        &mut self,
        context: &Context,
        view: &ViewUniform,
        proxies: Option<ShownProxies>,
    ) -> bool {
        self.extent = view.extent;
        let [width, height] = view.extent.map(u64::from);
        let n_pixels = width * height;
        let meshes = proxies.and_then(|proxies| proxies.meshes);
        let n_triangles = meshes.map_or(0, |[_, corners]| corners.size() / 12);
        let of_behind = match proxies {
            Some(_) => n_pixels * u64::from(N_BEHIND) * size_of::<SeenSurface>() as u64,
            None => 0,
        };
        let buffers = &mut self.buffers;
        let room = [
            (&mut buffers.points, u64::from(self.n_points) * 32),
            (&mut buffers.pixels, n_pixels * size_of::<Pixel>() as u64),
            (&mut buffers.rows, 2 * height * 4),
            (&mut buffers.behind, of_behind),
            (
                &mut buffers.triangles,
                n_triangles * size_of::<Triangle>() as u64,
            ),
        ];
        let limit = limit(context);
        for (buffer, bytes) in room {
            if bytes > limit {
                return false;
            }
            grow(context, buffer, bytes);
        }
        context.write(&buffers.view, 0, bytemuck::bytes_of(view));
        true
    }

    fn set_kind(
        &mut self,
        context: &Context,
        proxies: Option<ShownProxies>,
        is_narrow: bool,
    ) -> Result<(), RenderError> {
        let mut features = Vec::new();
        features.extend(proxies.map(|_| proxies::FEATURE));
        features.extend(
            proxies
                .and_then(|proxies| proxies.meshes)
                .map(|_| meshes::FEATURE),
        );
        features.extend(is_narrow.then_some(NARROW));
        if self
            .kind
            .as_ref()
            .is_none_or(|kind| kind.features != features)
        {
            self.kind = Some(Kind::new(context, features)?);
        }
        Ok(())
    }

    /// Sorts the triangles of meshes into tiles. Answers whether they fit the device.
    fn sort_triangles(
        &mut self,
        context: &Context,
        [surfaces, corners]: [&wgpu::Buffer; 2],
    ) -> Result<bool, RenderError> {
        let Some([count, place, sort]) =
            self.kind.as_ref().and_then(|kind| kind.triangles.as_ref())
        else {
            return Ok(true);
        };
        let n_tiles: u64 = self.n_tiles().map(u64::from).iter().product();
        grow(context, &mut self.buffers.tiles, 4 * n_tiles);
        let n_triangles = groups((corners.size() / 12) as u32);
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
            step(&mut pass, count, &counted, n_triangles);
            step(&mut pass, place, &placed, [1, 1]);
        });
        let totals: Vec<u32> = read_back(context, "totals of a list", totals)?;
        let bytes = 4 * u64::from(totals[0]);
        if bytes > limit(context) {
            return Ok(false);
        }
        let mut larger = tiles.clone();
        if grow(context, &mut larger, bytes) {
            submit(context, |encoder| {
                encoder.copy_buffer_to_buffer(tiles, 0, &larger, 0, 4 * n_tiles);
            });
        }
        let sorted = group(context, sort, &[&read[..], &[(24, &larger)]].concat());
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, Stamp::default());
            step(&mut pass, sort, &sorted, n_triangles);
        });
        self.buffers.tiles = larger;
        Ok(true)
    }

    /// Counts the hits of all pixels, and shares their rows out into bands; [`None`] if not even one fits the device.
    fn count(
        &mut self,
        context: &Context,
        strands: &StrandBuffers,
        stamp: &Stamp,
    ) -> Result<Option<Vec<Range<u32>>>, RenderError> {
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
        let height = self.extent[1];
        submit(context, |encoder| {
            encoder.clear_buffer(pixels, 0, None);
            let mut pass = compute_pass(context, encoder, stamp.clone().first());
            step(&mut pass, place_points, &placed, groups(self.n_points));
            step(&mut pass, find_hits, &counted, groups(self.n_segments));
            step(&mut pass, sum_rows, &summed, [height, 1]);
        });
        let mut rows: Vec<u32> = read_back(context, "rows", rows)?;
        rows.truncate(height as usize);
        let fitting = u32::try_from(limit(context) / HIT_BYTES).unwrap_or(u32::MAX);
        let bands = bands(&rows, self.most_hits.min(fitting));
        let most = bands
            .iter()
            .map(|band| hits_of(&rows, band))
            .max()
            .unwrap_or(0);
        let bytes = most * HIT_BYTES;
        if bytes > limit(context) || most > u64::from(u32::MAX) / 3 {
            return Ok(None);
        }
        grow(context, &mut self.buffers.hits, bytes);
        Ok(Some(bands))
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

    /// Makes the list of a band, unless it is there.
    fn list_band(
        &mut self,
        context: &Context,
        strands: &StrandBuffers,
        proxies: Option<ShownProxies>,
        ix: usize,
    ) -> Result<(), RenderError> {
        let (Some(kind), false) = (&self.kind, self.listed == Some(ix)) else {
            return Ok(());
        };
        let band = self.bands[ix].clone();
        self.write_layout(context, band.clone(), Use::Writes);
        let Buffers {
            view,
            layout,
            points,
            pixels,
            rows,
            hits,
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
        resources.push((11, seen));
        if let Some(proxies) = proxies {
            resources.extend([(17, proxies.records), (18, behind)]);
            let of_meshes = [(23, triangles), (24, tiles)];
            resources.extend(proxies.meshes.iter().flat_map(|_| of_meshes));
        }
        let listed = group(context, &kind.list_pixels, &resources);
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, Stamp::default());
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
            // No more than one is on its way.
            context.wait("visibility list").map_err(failed)?;
        }
        self.listed = Some(ix);
        Ok(())
    }

    fn write_layout(&self, context: &Context, rows: Range<u32>, of: Use) {
        let (even, is_draft) = match of {
            Use::Draws(even, is_draft) => (even, is_draft),
            Use::Counts | Use::Writes => ([0.0; 4], false),
        };
        let layout = ListLayout {
            n_tiles: self.n_tiles(),
            first_row: rows.start,
            end_row: rows.end,
            n_segments: self.n_segments,
            is_writing: u32::from(matches!(of, Use::Writes)),
            is_draft: u32::from(is_draft),
            pad: 0,
            even,
        };
        context.write(&self.buffers.layout, 0, bytemuck::bytes_of(&layout));
    }

    fn n_tiles(&self) -> [u32; 2] {
        self.extent.map(|n| n.div_ceil(TILE))
    }

    fn groups_of_pixels(&self, rows: &Range<u32>) -> [u32; 2] {
        [self.extent[0].div_ceil(8), (rows.len() as u32).div_ceil(8)]
    }

    pub fn bytes(&self) -> u64 {
        let Buffers {
            points,
            pixels,
            rows,
            hits,
            seen,
            seen_points,
            behind,
            triangles,
            tiles,
            ..
        } = &self.buffers;
        let of_hair = [points, pixels, rows, hits, seen, seen_points];
        let beside = [behind, triangles, tiles];
        of_hair
            .iter()
            .chain(&beside)
            .map(|buffer| buffer.size())
            .sum()
    }
}

/// Bytes of the largest buffer that can be bound.
fn limit(context: &Context) -> u64 {
    let limits = context.device.limits();
    limits
        .max_storage_buffer_binding_size
        .min(limits.max_buffer_size)
}

/// Groups of [`GROUP`] threads for `n`; more than one dimension takes go into the second.
fn groups(n: u32) -> [u32; 2] {
    let groups = n.div_ceil(GROUP);
    let rows = groups.div_ceil(32_768).max(1);
    [groups.div_ceil(rows), rows]
}

fn group(
    context: &Context,
    pipeline: &wgpu::ComputePipeline,
    buffers: &[(u32, &wgpu::Buffer)],
) -> wgpu::BindGroup {
    let resources = buffers
        .iter()
        .map(|(binding, buffer)| (*binding, buffer.as_entire_binding()));
    let resources: Vec<_> = resources.collect();
    bind(context, &pipeline.get_bind_group_layout(0), &resources)
}

fn hits_of(rows: &[u32], band: &Range<u32>) -> u64 {
    let rows = &rows[band.start as usize..band.end as usize];
    rows.iter().map(|n| u64::from(*n)).sum()
}

/// Bands of rows with so many hits each, of at most `most_hits` or one row.
fn bands(rows: &[u32], most_hits: u32) -> Vec<Range<u32>> {
    let mut bands = Vec::new();
    let (mut start, mut sum) = (0, 0);
    for (row, n) in (0..).zip(rows) {
        if row > start && sum + u64::from(*n) > u64::from(most_hits) {
            bands.push(start..row);
            (start, sum) = (row, 0);
        }
        sum += u64::from(*n);
    }
    bands.push(start..rows.len() as u32);
    bands
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_have_every_row_once_and_no_more_hits_than_they_may() {
        assert_eq!(bands(&[5, 5, 90, 1, 0], 100), [0..3, 3..5]);
        // A row may have more by itself.
        assert_eq!(bands(&[1, 300, 1, 100], 100), [0..1, 1..2, 2..3, 3..4]);
        assert_eq!(bands(&[0; 7], 100), vec![0..7]);
    }
}
