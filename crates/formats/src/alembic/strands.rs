//! Strands of one object of curves.

use super::archive::{Archive, Property};
use super::attributes::{Collector, GroupNames, Source, Sources};
use super::notes::Notes;
use super::sampler::{Polyline, Sampler};
use super::shapes::{describe, is_closed_already, shapes};
use super::transform::Matrix;
use super::tree::{CurvesObject, Tree};
use crate::curves::{Interpolation, Wrap};
use crate::error::{Error, Result};
use crate::groom::{Attribute, Domain};
use crate::groom_format::{ImportOptions, NoteKind, Placement};

/// What one object becomes.
pub(super) struct Strands {
    pub path: String,
    /// `bspline`, `linear, periodic`.
    pub curves: String,
    /// Number of points of each strand.
    pub lengths: Vec<u32>,
    pub points: Vec<[f32; 3]>,
    pub attributes: Vec<Attribute>,
    /// Of each strand or of all.
    pub group_names: Option<GroupNames>,
}

/// How an object is read.
pub(super) struct Reading<'r, 'a> {
    pub archive: &'r Archive<'a>,
    pub tree: &'r Tree<'a>,
    /// Seconds.
    pub time: f64,
    pub options: &'r ImportOptions,
    pub placement: Placement,
    /// Points of the objects before.
    pub n_points_before: u64,
}

/// Points and values of the curves, one after another.
struct Output {
    lengths: Vec<u32>,
    points: Vec<[f32; 3]>,
    /// Data of each attribute.
    data: Vec<Vec<f32>>,
    /// Which curves became strands.
    is_kept: Vec<bool>,
}

impl<'a> Reading<'_, 'a> {
    /// Reads `object`, which `world` moves. `None` where there is nothing to draw.
    pub fn read(
        &self,
        object: &CurvesObject<'a>,
        world: &Matrix,
        notes: &mut Notes,
    ) -> Result<Option<Strands>> {
        let path = &*object.path;
        let archive = self.archive;
        let geom = &object.geom;
        let skip = |notes: &mut Notes, why: &str| {
            notes.add(NoteKind::Dropped, path, format!("left out: {why}"));
            Ok(None)
        };
        let (Some(positions), Some(counts)) = (geom.get("P"), geom.get("nVertices")) else {
            return skip(notes, "it has no points or no numbers of points");
        };
        check_topology(archive, counts, path)?;
        let positions = archive.values_at(positions, self.time, path)?;
        let counts = archive.values_at(counts, self.time, path)?;
        if counts.len() == 0 && positions.len() == 0 {
            return skip(notes, "it has no curves");
        }
        archive
            .ogawa
            .spend(8 * counts.len() as u64, counts.offset)?;
        let mut lengths = Vec::with_capacity(counts.len());
        for (ix, count) in counts.doubles().enumerate() {
            if !(0.0..=f64::from(i32::MAX)).contains(&count) {
                let key = format!("{path}: number of points of strand {ix}");
                return Err(Error::value(key, count, format!("in 0..={}", i32::MAX)));
            }
            lengths.push(count as u32);
        }
        let total: u64 = lengths.iter().map(|&n| u64::from(n)).sum();
        if positions.len() as u64 != 3 * total {
            let (n, curves) = (positions.len() / 3, lengths.len());
            let what = format!("{path}: its {curves} curves have {total} points in all, P has {n}");
            return Err(Error::invalid(what, positions.offset));
        }
        if world.uniform_scale() == 0.0 {
            return skip(notes, "its transform makes it flat");
        }
        if let Some(visible) = object.properties.get("visible")
            && archive
                .values_at(visible, self.time, path)?
                .doubles()
                .next()
                == Some(0.0)
        {
            let text = "it is hidden in its file, and read all the same";
            notes.add(NoteKind::Assumed, path, text);
        }
        let position = |cv: usize| [0, 1, 2].map(|axis| positions.double(3 * cv + axis));
        let mut shapes = shapes(archive, object, &lengths, self.time, notes)?;
        if is_closed_already(&shapes, &lengths, position) {
            shapes.iter_mut().for_each(|shape| shape.wrap = Wrap::Open);
            let text = "its periodic curves end in the points that they start with: \
                        they are not closed a second time";
            notes.add(NoteKind::Assumed, path, text);
        }
        let sampler = Sampler::new(
            archive,
            object,
            &shapes,
            &lengths,
            self.time,
            self.options.samples_per_segment,
        )?;
        let scale = world.uniform_scale() * self.placement.cm_per_unit;
        let mut collector = Collector {
            archive,
            path,
            time: self.time,
            counts: sampler.counts(),
            lengths: &lengths,
            width_scale: scale,
            notes,
            sources: Sources::default(),
        };
        collector.collect(self.tree, object)?;
        let sources = collector.sources;
        let output = self.draw(path, world, sampler, &sources.attributes, position)?;
        let n_curves = lengths.len();
        let n_short = n_curves - output.lengths.len();
        if n_short > 0 {
            let text = format!("{n_short} of {n_curves} curves have too few points for their kind");
            notes.add(NoteKind::Dropped, path, format!("{text} and are left out"));
        }
        if output.lengths.is_empty() {
            return skip(notes, "no curve of it has two points");
        }
        let group_names = sources.group_names.map(|(table, mut elements)| {
            if elements.len() > 1 && n_short > 0 {
                let mut kept = output.is_kept.iter();
                elements.retain(|_| kept.next() == Some(&true));
            }
            (table, elements)
        });
        Ok(Some(Strands {
            path: path.to_owned(),
            curves: describe(object, &shapes),
            lengths: output.lengths,
            points: output.points,
            attributes: attributes(sources.attributes, output.data),
            group_names,
        }))
    }

    /// Makes polylines of all curves.
    fn draw(
        &self,
        path: &str,
        world: &Matrix,
        mut sampler: Sampler<'_>,
        sources: &[Source],
        position: impl Fn(usize) -> [f64; 3],
    ) -> Result<Output> {
        let n_points = self.n_points_before + sampler.n_points();
        self.options.check_points(n_points)?;
        let mut output = Output {
            lengths: Vec::new(),
            points: Vec::new(),
            data: vec![Vec::new(); sources.len()],
            is_kept: Vec::with_capacity(sampler.lengths.len()),
        };
        let is_moved = *world != Matrix::IDENTITY;
        let (mut first_cv, mut first_end) = (0, 0);
        let mut cvs = Vec::new();
        for curve in 0..sampler.lengths.len() {
            let n_cvs = sampler.lengths[curve] as usize;
            let n_ends = sampler.n_varying(curve);
            let samples = sampler.samples(curve);
            output.is_kept.push(samples.is_some());
            if let Some(samples) = samples {
                cvs.clear();
                for point in 0..n_cvs {
                    let mut at = position(first_cv + point);
                    if is_moved {
                        at = world.apply(at);
                    }
                    let at = at.map(|x| x as f32);
                    let checked = self.placement.check(curve, point, at);
                    checked.map_err(|error| in_object(error, path))?;
                    cvs.push(self.placement.to_groom(at));
                }
                let n = match samples {
                    Polyline::Itself => {
                        output.points.extend_from_slice(&cvs);
                        cvs.len()
                    }
                    Polyline::Samples(samples) => {
                        let points = samples.iter().map(|sample| sample.point(&cvs));
                        output.points.extend(points);
                        samples.len()
                    }
                };
                output.lengths.push(n as u32);
                for (source, data) in sources.iter().zip(&mut output.data) {
                    let first = match source.interpolation {
                        Interpolation::Constant => continue,
                        Interpolation::Uniform => {
                            let k = source.components;
                            data.extend_from_slice(&source.data[curve * k..(curve + 1) * k]);
                            continue;
                        }
                        Interpolation::Varying => first_end,
                        Interpolation::Vertex => first_cv,
                    };
                    let values = &source.data[first * source.components..];
                    extend(data, source, values, samples, n_cvs);
                }
            }
            first_cv += n_cvs;
            first_end += n_ends;
        }
        Ok(output)
    }
}

/// Appends the values of one curve, which `values` starts with.
fn extend(
    data: &mut Vec<f32>,
    source: &Source,
    values: &[f32],
    samples: Polyline<'_>,
    n_cvs: usize,
) {
    let k = source.components;
    match samples {
        // Of an open polyline both kinds of values are one per point.
        Polyline::Itself => data.extend_from_slice(&values[..n_cvs * k]),
        Polyline::Samples(samples) => {
            for sample in samples {
                data.extend((0..k).map(|component| match source.interpolation {
                    Interpolation::Varying => sample.varying(values, k, component),
                    _ => sample.vertex(values, k, component),
                }));
            }
        }
    }
}

/// The sources as attributes; `data` are the values that were drawn.
fn attributes(sources: Vec<Source>, data: Vec<Vec<f32>>) -> Vec<Attribute> {
    let attributes = sources.into_iter().zip(data).map(|(source, data)| {
        let (domain, data) = match source.interpolation {
            Interpolation::Constant => (Domain::Groom, source.data),
            Interpolation::Uniform => (Domain::Strand, data),
            Interpolation::Varying | Interpolation::Vertex => (Domain::Point, data),
        };
        Attribute {
            name: source.name,
            domain,
            components: source.components as u32,
            data,
        }
    });
    attributes.collect()
}

/// The error, about something of the object called `path`.
fn in_object(mut error: Error, path: &str) -> Error {
    if let Error::Value { key, .. } = &mut error {
        *key = format!("{path}: {key}");
    }
    error
}

/// Numbers of points of curves must be the same at all times, or strands would come and go.
pub(super) fn check_topology(
    archive: &Archive<'_>,
    counts: &Property<'_>,
    path: &str,
) -> Result<()> {
    if !counts.varies() {
        return Ok(());
    }
    let first = archive.values(counts, 0, path)?;
    for ix in counts.changes[0]..=counts.changes[1] {
        let other = archive.values(counts, ix, path)?;
        let same = std::ptr::eq(other.bytes, first.bytes) || other.bytes == first.bytes;
        if !same {
            let key = format!("{path}: number of points of the strands");
            let range = "the same in all samples: strands that come and go are not read";
            return Err(Error::value(key, format!("another in sample {ix}"), range));
        }
    }
    Ok(())
}
