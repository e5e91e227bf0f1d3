//! Strands without samples: a list of what each pixel shows, the points that this is, and the list times their
//! radiance. See `shaders/pass/visibility.wgsl`, and `listed_pixels.wgsl`, `listed_triangles.wgsl` and `listed_picture.wgsl` beside it.
//!
//! How much room a list takes is known when the device has counted: [`VisibilityPass::begin`] has it count, and
//! [`VisibilityPass::proceed`] goes on with what has been answered. Nobody waits but who wants to. How much is seen is
//! answered later, [`VisibilityPass::take_seen`]: nobody waits for that, but where room for the entries of several bands
//! depends on it.

mod bands;
mod buffers;
mod drawing;
mod making;
mod pipelines;
mod triangles;

use std::ops::Range;

use super::draw::LitPoints;
use super::parts::{PartLimits, SOFTWARE_HITS};
use super::readback::Readback;
use super::resources::{StrandBuffers, failed};
use super::{meshes, proxies};
use crate::gpu::Context;
use buffers::{Buffers, ListLayout, TOTALS_BYTES};
use pipelines::{Kind, Pipelines};
use strandlight_scene::RenderError;

pub(crate) use buffers::LAYOUTS;

/// Side of a tile, px.
const TILE: u32 = 16;

/// Light of narrow lights along segments.
const NARROW: &str = "NARROW";

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

/// How far the list is that was begun last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Made {
    /// The device has not answered yet.
    NotYet,
    /// It has, and lists now; another answer has to come.
    Listing,
    /// It has, and lists now: what is submitted from here on finds the list.
    Listed,
    /// The list is there.
    Whole,
    /// The device has no room for it, and nothing can be drawn.
    NoRoom,
}

/// The points that a list shows, on the device.
#[derive(Clone, Copy)]
pub(crate) struct SeenPoints<'a> {
    /// In order.
    pub points: &'a wgpu::Buffer,
    /// How many, in its first word.
    pub number: &'a wgpu::Buffer,
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
    /// Hits are written, and the entries that come of them kept beside those of other bands or not.
    Writes { is_keeping: bool },
    /// The list is drawn, as [`ListedLight::even`] and [`ListedLight::is_draft`] say.
    Draws([f32; 4], bool),
}

/// What the device has been asked for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Asked {
    /// Nothing.
    Nothing,
    /// How many hits the rows have, and how many triangles the tiles.
    Rows,
    /// How much is seen.
    Seen,
}

/// The list of a picture, and what makes and draws it.
pub(crate) struct VisibilityPass {
    pipelines: Pipelines,
    kind: Option<Kind>,
    buffers: Buffers,
    extent: [u32; 2],
    n_segments: u32,
    n_points: u32,
    /// Most hits of a band, of which a row may have more, and most entries that are kept of several.
    pub most_hits: u32,
    /// Whoever asks waits for the device: for answers, and on a software device for each band.
    pub is_waiting: bool,
    /// Rows whose hits there is room for at a time.
    bands: Vec<Range<u32>>,
    /// The band whose list is there.
    listed: Option<usize>,
    /// The entries of all bands are kept: the whole picture is drawn from them.
    is_kept: bool,
    asked: Asked,
    answer: Readback,
    /// How much is seen.
    counted: Readback,
    /// That is of a list which is there, not of one that was given up.
    is_counted: bool,
    /// It, once answered, until it is taken.
    seen: Option<Seen>,
}

impl VisibilityPass {
    /// For `strands`; see [`VisibilityPass::is_waiting`].
    pub fn new(
        context: &Context,
        strands: &StrandBuffers,
        is_waiting: bool,
    ) -> Result<VisibilityPass, RenderError> {
        Ok(VisibilityPass {
            pipelines: Pipelines::new(context)?,
            kind: None,
            buffers: Buffers::new(context, strands),
            extent: [0; 2],
            n_segments: strands.n_segments,
            n_points: strands.n_points,
            most_hits: match context.is_software() {
                true => SOFTWARE_HITS,
                false => PartLimits::default().hits,
            },
            is_waiting,
            bands: Vec::new(),
            listed: None,
            is_kept: false,
            asked: Asked::Nothing,
            answer: Readback::new(context, TOTALS_BYTES),
            counted: Readback::new(context, TOTALS_BYTES),
            is_counted: false,
            seen: None,
        })
    }

    /// The points that the last list shows.
    pub fn seen_points(&self) -> SeenPoints<'_> {
        SeenPoints {
            points: &self.buffers.seen_points,
            number: &self.buffers.totals,
        }
    }

    /// How much the last list shows that was [`Made::Listed`] or [`Made::Whole`], once, when the device has answered.
    pub fn take_seen(&mut self) -> Option<Seen> {
        if self.asked == Asked::Seen {
            return None;
        }
        self.seen.take().or_else(|| {
            let counted = self.take_counted();
            counted.filter(|_| self.is_counted)
        })
    }

    fn take_counted(&mut self) -> Option<Seen> {
        let numbers = self.counted.take::<[u32; 2]>()?;
        let [points, entries] = *numbers.first()?;
        Some(Seen { points, entries })
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.buffers.bytes()
    }

    fn set_kind(
        &mut self,
        context: &Context,
        proxies: Option<ShownProxies>,
        is_narrow: bool,
    ) -> Result<(), RenderError> {
        let mut features = Vec::new();
        features.extend(proxies.map(|_| proxies::FEATURE));
        let meshes = proxies.and_then(|proxies| proxies.meshes);
        features.extend(meshes.map(|_| meshes::FEATURE));
        features.extend(is_narrow.then_some(NARROW));
        let has_other = |kind: &Kind| kind.features != features;
        if self.kind.as_ref().is_none_or(has_other) {
            self.kind = Some(Kind::new(context, features)?);
        }
        Ok(())
    }

    fn write_layout(&self, context: &Context, rows: Range<u32>, of: Use) {
        let (even, is_draft) = match of {
            Use::Draws(even, is_draft) => (even, is_draft),
            Use::Counts | Use::Writes { .. } => ([0.0; 4], false),
        };
        let layout = ListLayout {
            n_tiles: self.n_tiles(),
            first_row: rows.start,
            end_row: rows.end,
            n_segments: self.n_segments,
            is_writing: u32::from(matches!(of, Use::Writes { .. })),
            is_draft: u32::from(is_draft),
            is_keeping: u32::from(matches!(of, Use::Writes { is_keeping: true })),
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

    /// Ends what is done for one of several bands. Who waits has no more than one on its way to a software device, which
    /// takes long for each.
    fn end_band(&self, context: &Context) -> Result<(), RenderError> {
        match (self.is_waiting, context.is_software()) {
            (true, true) => context.wait("visibility list").map_err(failed),
            (true, false) => {
                context.flush();
                Ok(())
            }
            (false, _) => Ok(()),
        }
    }
}
