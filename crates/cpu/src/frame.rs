//! Pictures by their visibility list, in stages that are kept from one picture to the next.
//!
//! A stage runs for a picture if an edit since the last one made it stale: see [`Stage::inputs`].
//! So after an edit of the hair nothing is drawn and no shadow is cast, and after one of the
//! background nothing is shaded.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::{PackedRecord, TERM_GLOBAL, TERM_LOCAL};
use strandlight_scattering::multiple_tables::{Job, MultipleTables};
use strandlight_scene::camera::{Camera, ViewUniform, view_uniform};
use strandlight_scene::progress::timed;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::{NO_SLOT, ShadowPlan, THROUGH_SLOT};
use strandlight_scene::stats::{self, LIGHTING_SHARE, Observer};
use strandlight_scene::volume::{Grid, SELF_LIFT};
use strandlight_scene::{Picture, PreparedScene, Stats};

use super::composite::composite;
use super::list::{Tile, VisibilityList};
use super::proxies::Proxies;
use super::shade::{Counts, PointShader, record_at};
use super::shade_wide::WideShader;
use super::transmittance::{mix, transmittance_beside};
use super::unblocked::{Unblocked, VisiblePoint};
use super::visible::VisiblePoints;
use super::voxelise::{grid_position, voxelise};

/// Visible points that are shaded by one thread at a time.
const SHADED_AT_ONCE: usize = 64;

/// Shares at all points are kept if they have at most this many bytes.
const MAX_SHARE_BYTES: usize = 256 << 20;

/// What can change between two pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edit {
    /// Parameters and modes of the fibre.
    Hair,
    /// The terms that are drawn.
    Terms,
    /// d_f and d_b.
    Densities,
    /// Colours along the strands.
    Paint,
    /// Where strands are, and how wide.
    Points,
    /// Directions and widths of the lights.
    Lights,
    /// Their amplitudes.
    Colors,
    /// What stands beside the hair.
    Proxies,
    /// Camera and size of the picture.
    View,
    /// What is behind the hair.
    Background,
}

/// A part of the work for a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// The shadow volume.
    Voxelise,
    /// Records of the lights in the volume.
    Transmittance,
    /// What each pixel shows.
    List,
    /// Unblocked shares of the lights. They are found at visible points; from the second view on at
    /// all, and then serve any.
    ShadowMaps,
    /// The share of the light through to the eye.
    ThroughMaps,
    /// Tables of multiple scattering.
    MultipleTables,
    /// Radiance of the visible points.
    Shade,
}

impl Stage {
    /// All of them, in order.
    pub const ALL: [Stage; 7] = [
        Stage::Voxelise,
        Stage::Transmittance,
        Stage::List,
        Stage::ShadowMaps,
        Stage::ThroughMaps,
        Stage::MultipleTables,
        Stage::Shade,
    ];

    /// The edits that make the stage stale, by way of the stages before it too.
    pub const fn inputs(self) -> &'static [Edit] {
        use Edit::{Colors, Densities, Hair, Lights, Paint, Points, Proxies, Terms, View};
        match self {
            Stage::Voxelise => &[Points],
            Stage::Transmittance => &[Points, Lights, Proxies],
            Stage::List => &[Points, Proxies, View],
            Stage::ShadowMaps | Stage::ThroughMaps => &[Points, Lights, Proxies, View],
            Stage::MultipleTables => &[Hair, Terms],
            Stage::Shade => &[
                Hair, Terms, Densities, Paint, Points, Lights, Colors, Proxies, View,
            ],
        }
    }
}

/// The stages' results, as far as they are up to date.
#[derive(Default)]
pub(super) struct Frame {
    size: [u32; 2],
    /// Has there been a picture?
    is_drawn: bool,
    /// And one from elsewhere?
    was_turned: bool,
    volume: Option<(Grid, Vec<[f32; 8]>)>,
    /// `[light][voxel]`; none of lights that were black.
    records: Option<Records>,
    list: Option<(VisibilityList, VisiblePoints)>,
    unblocked: Option<(ShadowPlan, Unblocked)>,
    through: Option<Unblocked>,
    multiple: Option<MultipleTables>,
    shaded: Option<Shaded>,
}

struct Records {
    packed: Vec<PackedRecord>,
    /// Lights that were not black.
    is_lit: Vec<bool>,
}

struct Shaded {
    /// By visible point: rgb times the view's radiance scale, and zero.
    radiance: Vec<[f32; 4]>,
    proxies: Proxies,
    counts: Counts,
}

impl Frame {
    /// Forgets what `edit` makes stale.
    pub fn edited(&mut self, edit: Edit) {
        let serves_any = |(_, unblocked): &(_, Unblocked)| unblocked.is_everywhere();
        let are_kept = edit == Edit::View && self.unblocked.as_ref().is_some_and(serves_any);
        for stage in Stage::ALL {
            let is_stale = stage.inputs().contains(&edit);
            if is_stale && !(are_kept && stage == Stage::ShadowMaps) {
                self.forget(stage);
            }
        }
        self.was_turned |= edit == Edit::View && self.is_drawn;
    }

    fn forget(&mut self, stage: Stage) {
        match stage {
            Stage::Voxelise => self.volume = None,
            Stage::Transmittance => self.records = None,
            Stage::List => self.list = None,
            Stage::ShadowMaps => self.unblocked = None,
            Stage::ThroughMaps => self.through = None,
            Stage::MultipleTables => self.multiple = None,
            Stage::Shade => self.shaded = None,
        }
    }

    /// Draws `scene` as `camera` sees it, which is the camera of the last picture unless
    /// [`Edit::View`] said otherwise.
    pub fn draw(
        &mut self,
        scene: &PreparedScene,
        camera: &Camera,
        size: [u32; 2],
        observer: Observer,
    ) -> (Picture, Stats) {
        if self.size != size {
            self.size = size;
            self.edited(Edit::View);
        }
        let threads = rayon::current_num_threads();
        let mut stats = scene.counts(format!("cpu: {threads} threads"));
        let strands = &scene.strands;
        let view = view_uniform(camera, strands, size, scene.radiance_scale());
        let beside = scene.proxy_records();
        self.voxelise(scene, &mut stats);
        let (list, visible) = self.list.get_or_insert_with(|| {
            let ((list, visible), seconds) = timed(|| {
                let mut list = VisibilityList::new(&view, strands, &beside);
                let visible = VisiblePoints::number(&mut list, strands);
                (list, visible)
            });
            let bytes = list.bytes() + size_of_val(&visible.points[..]) as u64;
            stats.stages.push(stage("list", seconds, bytes));
            (list, visible)
        });
        stats.pixels_visited = list.counts[0];
        stats.list_entries = list.n_entries() as u64;
        stats.visible_points = visible.points.len() as u64;
        observer(0.25 * LIGHTING_SHARE);
        let plan = scene.shadow_plan();
        if self
            .unblocked
            .as_ref()
            .is_some_and(|(before, _)| !serves(before, &plan))
        {
            self.unblocked = None;
            self.through = None;
        }
        let (plan, unblocked) = self.unblocked.get_or_insert_with(|| {
            let (unblocked, seconds) = timed(|| {
                let bytes = Unblocked::bytes_of(plan.n_slots, strands.points.len());
                let mut unblocked = match self.was_turned && bytes <= MAX_SHARE_BYTES {
                    true => Unblocked::everywhere(plan.n_slots),
                    false => Unblocked::new(plan.n_slots),
                };
                unblocked.draw(strands, &plan.views, beside.list(), &visible.points);
                unblocked
            });
            stats.texels_visited += unblocked.n_texels;
            let done = stage("shadow maps", seconds, unblocked.bytes());
            stats.stages.push(done);
            (plan, unblocked)
        });
        let through = self.through.get_or_insert_with(|| {
            let (through, seconds) = timed(|| {
                let views = plan.through(view.forward);
                let mut through = Unblocked::new(u32::from(!views.is_empty()));
                through.draw(strands, &views, beside.list(), &visible.points);
                through
            });
            stats.texels_visited += through.n_texels;
            let done = stage("through maps", seconds, through.bytes());
            stats.stages.push(done);
            through
        });
        observer(0.75 * LIGHTING_SHARE);
        let (lights, sweeps) = scene.records_with(plan);
        let Some((grid, volume)) = &self.volume else {
            unreachable!("voxelised above");
        };
        let is_lit: Vec<bool> = lights.iter().map(|light| light.power > 0.0).collect();
        let is_there = |records: &Records| {
            let mut pairs = records.is_lit.iter().zip(&is_lit);
            pairs.all(|(before, now)| *before || !now)
        };
        if !self.records.as_ref().is_some_and(is_there) {
            self.records = None;
        }
        let records = self.records.get_or_insert_with(|| {
            let (packed, seconds) =
                timed(|| transmittance_beside(grid, volume, &lights, &sweeps, beside.list()));
            let bytes = size_of_val(&packed[..]) as u64;
            stats.stages.push(stage("transmittance", seconds, bytes));
            Records { packed, is_lit }
        });
        if self.multiple.is_none() && has_one_fibre(scene) {
            let (tables, seconds) = timed(|| multiple_tables(scene));
            stats
                .stages
                .push(stage("tables", seconds, tables.bytes() as u64));
            self.multiple = Some(tables);
        }
        let multiple = self.multiple.as_ref().filter(|_| has_one_fibre(scene));
        let shaded = self.shaded.get_or_insert_with(|| {
            let (shaded, seconds) = timed(|| {
                let records = &records.packed;
                let (radiance, counts) = match multiple {
                    Some(tables) if serve(tables, scene) => WideShader {
                        scene,
                        view: &view,
                        grid,
                        tables,
                        lights: &lights,
                        records,
                        unblocked,
                        through,
                    }
                    .shade(&visible.points),
                    _ => Lit {
                        scene,
                        view: &view,
                        grid,
                        lights: &lights,
                        records,
                        unblocked,
                        through,
                    }
                    .shade(&visible.points),
                };
                let mut proxies = Proxies::new(scene);
                if !proxies.is_empty() {
                    proxies.light(&view, grid, &lights, &sweeps, records);
                }
                Shaded {
                    radiance,
                    proxies,
                    counts,
                }
            });
            let bytes = size_of_val(&shaded.radiance[..]) as u64;
            stats.stages.push(stage("shade", seconds, bytes));
            shaded
        });
        self.is_drawn = true;
        observer(LIGHTING_SHARE);
        stats.points_skipped = (strands.points.len() - visible.points.len()) as u64;
        stats.set_terms(&shaded.counts.terms);
        let (rgba, seconds) = timed(|| {
            let mut rgba = vec![[0.0; 4]; (size[0] * size[1]) as usize];
            resolve(list, shaded, size, &mut rgba);
            composite(scene, &view, 1, &mut rgba);
            rgba
        });
        let bytes = size_of_val(&rgba[..]) as u64;
        stats.stages.push(stage("composite", seconds, bytes));
        let [width, height] = size;
        let picture = Picture {
            width,
            height,
            rgba,
        };
        (picture, stats)
    }

    fn voxelise(&mut self, scene: &PreparedScene, stats: &mut Stats) {
        self.volume.get_or_insert_with(|| {
            let grid = Grid::around(&scene.strands);
            let (volume, seconds) = timed(|| voxelise(&scene.strands, &grid));
            let bytes = size_of_val(&volume[..]) as u64;
            stats.stages.push(stage("voxelise", seconds, bytes));
            (grid, volume)
        });
    }
}

fn stage(name: &'static str, seconds: f64, bytes: u64) -> stats::Stage {
    stats::Stage {
        name,
        milliseconds: 1e3 * seconds,
        bytes,
        runs: 1,
        gpu_milliseconds: None,
    }
}

/// Has `before` maps of all lights that have some by the plan `now`? Amplitudes share out the maps,
/// but those of other amplitudes are as right.
fn serves(before: &ShadowPlan, now: &ShadowPlan) -> bool {
    let mut pairs = before.slots.iter().zip(&now.slots);
    before.slots.len() == now.slots.len()
        && pairs.all(|(before, now)| *before != NO_SLOT || *now == NO_SLOT)
}

/// Do tables of one fibre serve the scene? Not where each point has a fibre of its own; nor where
/// pictures of single modes must add up to that of all, which those of their tables do to 0.1 %.
fn has_one_fibre(scene: &PreparedScene) -> bool {
    scene.paint().is_none() && scene.reference_amplitudes.is_none()
}

/// Tables of multiple scattering of the fibre, for the terms that are drawn.
fn multiple_tables(scene: &PreparedScene) -> MultipleTables {
    let shading = scene.hair.optics().shading(scene.tables.view());
    MultipleTables::new(&shading, scene.hair.averages(), scene.terms(), |jobs| {
        jobs.into_par_iter().for_each(Job::run);
    })
}

/// Do the tables have all terms of multiple scattering that are drawn?
fn serve(tables: &MultipleTables, scene: &PreparedScene) -> bool {
    scene.terms() & (TERM_GLOBAL | TERM_LOCAL) & !tables.terms() == 0
}

/// What shades visible points that have fibres of their own, and elliptic ones.
struct Lit<'a> {
    scene: &'a PreparedScene,
    view: &'a ViewUniform,
    grid: &'a Grid,
    lights: &'a [LightRecord],
    records: &'a [PackedRecord],
    unblocked: &'a Unblocked,
    through: &'a Unblocked,
}

impl Lit<'_> {
    fn shade(&self, visible: &[u32]) -> (Vec<[f32; 4]>, Counts) {
        let shader = PointShader::new(self.scene, self.view);
        let n_voxels = self.grid.n_voxels();
        let lift = SELF_LIFT * self.grid.h;
        let mut radiance = vec![[0.0; 4]; visible.len()];
        let counts = radiance
            .par_chunks_mut(SHADED_AT_ONCE)
            .zip(visible.par_chunks(SHADED_AT_ONCE))
            .enumerate()
            .map(|(chunk, (radiance, points))| {
                let mut counts = Counts::default();
                for (ix, (radiance, &point)) in radiance.iter_mut().zip(points).enumerate() {
                    let at = VisiblePoint {
                        place: chunk * SHADED_AT_ONCE + ix,
                        point: point as usize,
                    };
                    let position = Vec3::from_slice(&self.scene.strands.points[point as usize]);
                    let arriving = |ix: usize, light: &LightRecord| {
                        let lifted = position + Vec3::from(light.direction) * lift;
                        let g = grid_position(self.grid, lifted);
                        let record = record_at(self.grid, &self.records[ix * n_voxels..], g);
                        let (mut unblocked, mut unblocked_tt) =
                            (record.shares[0], record.shares[0]);
                        if light.shadow_index != NO_SLOT {
                            unblocked = self.unblocked.share(light.shadow_index, at);
                            let through = self.through.share(THROUGH_SLOT, at);
                            unblocked_tt = mix(unblocked, through, light.forward_weight);
                        }
                        (record, unblocked, unblocked_tt)
                    };
                    let shaded = shader.shade(point as usize, self.lights, arriving, radiance);
                    counts = counts.and(shaded);
                }
                counts
            })
            .reduce(Counts::default, Counts::and);
        (radiance, counts)
    }
}

/// Adds up what each pixel shows: rgb times the view's radiance scale, and coverage.
fn resolve(list: &VisibilityList, shaded: &Shaded, size: [u32; 2], rgba: &mut [[f32; 4]]) {
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
            resolve_tile(tile, shaded, size[0], band);
        }
    });
}

fn resolve_tile(tile: &Tile, shaded: &Shaded, width: u32, band: &mut [[f32; 4]]) {
    let place = |pixel: usize| {
        let [x, y] = [pixel as u32 % tile.size[0], pixel as u32 / tile.size[0]];
        (tile.origin[0] + x + width * y) as usize
    };
    for (pixel, range) in tile.starts.windows(2).enumerate() {
        let mut sum = [0.0; 4];
        for entry in &tile.entries[range[0] as usize..range[1] as usize] {
            let first = entry.first as usize;
            let (a, b) = (&shaded.radiance[first], &shaded.radiance[first + 1]);
            let t = entry.t();
            for (channel, sum) in sum.iter_mut().enumerate().take(3) {
                *sum += entry.weight * mix(a[channel], b[channel], t);
            }
            sum[3] += entry.weight;
        }
        band[place(pixel)] = sum;
    }
    for entry in &tile.proxies {
        let sent_back = shaded
            .proxies
            .sent_back(entry.proxy as usize, Vec3::from(entry.position));
        let sum = &mut band[place(entry.pixel as usize)];
        for (channel, value) in sent_back.into_iter().enumerate() {
            sum[channel] += entry.weight * value;
        }
        sum[3] += entry.weight;
    }
}
