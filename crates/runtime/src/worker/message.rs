//! What page and worker tell each other: a head in JSON, and blobs for what is many numbers.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use strandlight_formats::{Background, Scattering, SrbfLight};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::interactive::{PictureProgress, RenderReport};
use strandlight_scene::paint::{Paint, PaintedPoint};
use strandlight_scene::stats::{Stats, Term};

/// A message that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum MessageError {
    /// It ends too early, or goes on.
    #[error("a message between page and worker is cut off")]
    Length,
    /// Its head is another.
    #[error("a message between page and worker: {0}")]
    Head(#[from] serde_json::Error),
}

/// Some edits that are made together.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Batch {
    /// The scene as a file, if an edit needs it.
    pub scene: Option<String>,
    pub edits: Vec<Edit>,
    /// Nobody looks yet: no picture is begun.
    pub is_ahead: bool,
}

/// One call of a setter, or another document. Those with blobs take the next of the message.
#[derive(Debug, Serialize, Deserialize)]
pub enum Edit {
    /// All of the scene anew. Blobs: the files of these paths, then the paint if it has its own.
    Document {
        /// Of the scene's file.
        path: PathBuf,
        files: Vec<PathBuf>,
        paint: DocumentPaint,
    },
    Hair(HairParams, Vec<Lobe>),
    Scattering(Scattering),
    Densities([f32; 2]),
    Lights(Vec<SrbfLight>),
    LightColors(Vec<[f32; 3]>),
    /// A blob: x, y, z and radius of all points.
    Points,
    /// A blob: radii of all points.
    Radii,
    /// A blob: the wind, or nothing.
    Wind,
    /// A blob: paint of points of the groom, from this one on, of so many.
    Paint {
        start: usize,
        n_points: usize,
    },
    /// Those of the scene.
    Proxies,
    /// Eye, target, up, vertical angle of view.
    Camera([[f32; 3]; 3], f32),
    /// That of the scene.
    Panorama,
    /// With the display transform of the scene.
    Grade {
        exposure: f32,
        background: Background,
    },
    Size([u32; 2]),
    Samples(u32),
}

impl Edit {
    /// Is it made of the scene?
    pub fn is_of_scene(&self) -> bool {
        matches!(
            self,
            Edit::Document { .. } | Edit::Proxies | Edit::Panorama | Edit::Grade { .. }
        )
    }
}

/// Paint of a document.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum DocumentPaint {
    /// As the groom's file has it.
    OfGroom,
    /// None, whatever the file has.
    None,
    /// A blob.
    Own,
}

/// How far the worker is.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Answer {
    /// Batches that the worker has taken.
    pub n_taken: u64,
    pub is_shown: bool,
    pub is_shaded: bool,
    pub is_done: bool,
    /// Where it is another one.
    pub report: Option<Report>,
    /// Of another picture; a blob.
    pub size: Option<[u32; 2]>,
    /// Why there will be no picture any more.
    pub failure: Option<String>,
}

impl Answer {
    pub fn progress(&self) -> PictureProgress {
        PictureProgress {
            is_shown: self.is_shown,
            is_shaded: self.is_shaded,
            is_done: self.is_done,
            ..PictureProgress::default()
        }
    }
}

/// What a [`RenderReport`] has of the CPU.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name, runs, milliseconds.
    stages: Vec<(String, u32, f64)>,
    backend: String,
    /// Strands, those without extent, points, segments, voxels.
    hair: [usize; 5],
    /// Lights, sweeps, shadow maps.
    light: [usize; 3],
    points_skipped: u64,
    scattering: String,
    /// Name, products, products left out.
    terms: Vec<(String, u64, u64)>,
    skipped: Vec<String>,
    /// Pixels visited, visible points, entries of the list, texels visited.
    drawn: [u64; 4],
    shadings: u64,
}

impl From<&RenderReport> for Report {
    fn from(report: &RenderReport) -> Report {
        let stats = &report.stats;
        let stages = report.stages.iter();
        let terms = stats.terms.iter();
        Report {
            stages: stages
                .map(|stage| (stage.name.to_owned(), stage.runs, stage.milliseconds))
                .collect(),
            backend: stats.backend.clone(),
            hair: [
                stats.strands,
                stats.degenerate_strands,
                stats.points,
                stats.segments,
                stats.voxels,
            ],
            light: [stats.lights, stats.sweeps, stats.shadow_maps],
            points_skipped: stats.points_skipped,
            scattering: stats.scattering.to_owned(),
            terms: terms
                .map(|term| (term.name.to_owned(), term.products, term.skipped))
                .collect(),
            skipped: stats.skipped.clone(),
            drawn: [
                stats.pixels_visited,
                stats.visible_points,
                stats.list_entries,
                stats.texels_visited,
            ],
            shadings: report.shadings,
        }
    }
}

impl From<&Report> for RenderReport {
    fn from(report: &Report) -> RenderReport {
        let [strands, degenerate_strands, points, segments, voxels] = report.hair;
        let [lights, sweeps, shadow_maps] = report.light;
        let [pixels_visited, visible_points, list_entries, texels_visited] = report.drawn;
        let term = |(name, products, skipped): &(String, u64, u64)| Term {
            name: kept(name),
            products: *products,
            skipped: *skipped,
        };
        let mut all = RenderReport {
            stats: Stats {
                backend: report.backend.clone(),
                strands,
                degenerate_strands,
                points,
                segments,
                voxels,
                lights,
                sweeps,
                shadow_maps,
                points_skipped: report.points_skipped,
                scattering: kept(&report.scattering),
                terms: report.terms.iter().map(term).collect(),
                skipped: report.skipped.clone(),
                pixels_visited,
                visible_points,
                list_entries,
                texels_visited,
                ..Stats::default()
            },
            shadings: report.shadings,
            ..RenderReport::default()
        };
        for (name, runs, milliseconds) in &report.stages {
            let name = kept(name);
            all.took(name, 1e-3 * milliseconds);
            for _ in 0..*runs {
                all.ran(name);
            }
        }
        all
    }
}

/// The same name for as long as the program runs. There are some dozens.
fn kept(name: &str) -> &'static str {
    static NAMES: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.iter().find(|known| **known == name) {
        return known;
    }
    let name: &'static str = name.to_owned().leak();
    names.push(name);
    name
}

/// `head` and `blobs` as bytes: the number of parts, the length of each, and all parts, the head's first.
pub fn encode(head: &impl Serialize, blobs: &[&[u8]]) -> Result<Vec<u8>, MessageError> {
    let head = serde_json::to_vec(head)?;
    let parts = [&[&head[..]], blobs].concat();
    let length: usize = parts.iter().map(|part| part.len()).sum();
    let mut bytes = Vec::with_capacity(8 * (1 + parts.len()) + length);
    bytes.extend((parts.len() as u64).to_le_bytes());
    for part in &parts {
        bytes.extend((part.len() as u64).to_le_bytes());
    }
    for part in parts {
        bytes.extend(part);
    }
    Ok(bytes)
}

/// What [`encode`] has made bytes of.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<(T, Blobs<'_>), MessageError> {
    fn number<'a>(bytes: &mut &'a [u8]) -> Result<usize, MessageError> {
        let (number, rest): (&'a [u8; 8], _) =
            bytes.split_first_chunk().ok_or(MessageError::Length)?;
        *bytes = rest;
        usize::try_from(u64::from_le_bytes(*number)).map_err(|_| MessageError::Length)
    }
    let mut rest = bytes;
    let n_parts = number(&mut rest)?;
    // Each has a length here.
    if n_parts > rest.len() / 8 {
        return Err(MessageError::Length);
    }
    let lengths = (0..n_parts).map(|_| number(&mut rest));
    let lengths: Vec<usize> = lengths.collect::<Result<_, _>>()?;
    let mut parts = Vec::with_capacity(n_parts);
    for length in lengths {
        let (part, after) = rest.split_at_checked(length).ok_or(MessageError::Length)?;
        parts.push(part);
        rest = after;
    }
    if parts.is_empty() || !rest.is_empty() {
        return Err(MessageError::Length);
    }
    let head = serde_json::from_slice(parts[0])?;
    Ok((head, Blobs(parts.into_iter().skip(1))))
}

/// The blobs of a message, in order.
pub struct Blobs<'a>(std::iter::Skip<std::vec::IntoIter<&'a [u8]>>);

impl<'a> Blobs<'a> {
    /// The next one.
    pub fn next(&mut self) -> Result<&'a [u8], MessageError> {
        self.0.next().ok_or(MessageError::Length)
    }

    /// The next one, as numbers.
    pub fn values<T: bytemuck::AnyBitPattern + bytemuck::NoUninit>(
        &mut self,
    ) -> Result<Vec<T>, MessageError> {
        let bytes = self.next()?;
        match bytes.len() % size_of::<T>() {
            0 => Ok(bytemuck::pod_collect_to_vec(bytes)),
            _ => Err(MessageError::Length),
        }
    }

    /// The next one, as paint.
    pub fn paint(&mut self) -> Result<Paint, MessageError> {
        let points = self.values::<PaintNumbers>()?.into_iter();
        let point =
            |[r, g, b, weight, width_scale, shift_scale, around @ ..]: PaintNumbers| PaintedPoint {
                sigma_a: [r, g, b],
                weight,
                width_scale,
                shift_scale,
                around: (!around[0].is_nan()).then_some(around),
            };
        Ok(Paint {
            points: points.map(point).collect(),
        })
    }
}

/// The numbers of a painted point; not a number where nothing is known of the hair around.
type PaintNumbers = [f32; 9];

/// What [`Blobs::paint`] reads.
pub fn paint_blob(points: &[PaintedPoint]) -> Vec<u8> {
    let numbers = points.iter().map(|point| {
        let ([r, g, b], [x, y, z]) = (point.sigma_a, point.around.unwrap_or([f32::NAN; 3]));
        [
            r,
            g,
            b,
            point.weight,
            point.width_scale,
            point.shift_scale,
            x,
            y,
            z,
        ]
    });
    bytemuck::cast_slice(&numbers.collect::<Vec<PaintNumbers>>()).to_vec()
}
