//! Strands of the vertices of a PLY file.

use super::header::{Body, Element, Header, Scalar};
use super::layout::INFO;
use crate::error::{Error, Result};
use crate::groom::Domain;
use crate::groom_format::{Import, ImportOptions, Note, NoteKind};
use crate::hair::diameter;
use crate::strand_list::{StrandList, attribute};

/// Names of the property that says which strand a vertex is of.
const STRAND_NAMES: [&str; 6] = [
    "strand_id",
    "strand",
    "strand_index",
    "curve_id",
    "curve",
    "hair_id",
];
/// Vertices of a strand where nothing says how many.
const USUAL_POINTS: usize = 100;
/// How many times as far as from point to point it is from tip to root, on average, of vertices
/// that look like strands.
const LEAST_JUMP: f64 = 3.0;

/// Vertices, and where strands start.
#[derive(Debug, Default)]
struct Vertices {
    points: Vec<[f32; 3]>,
    thickness: Vec<f32>,
    color: Vec<f32>,
    /// First vertex of each strand, as far as vertices say so.
    starts: Vec<usize>,
}

pub(super) fn read(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let header = Header::read(bytes)?;
    refuse_others(&header)?;
    let mut vertices = Vertices::default();
    let mut segments: Option<Vec<usize>> = None;
    // Vertices that an edge joins to the next. Edges may stand before the vertices.
    let mut joined: Option<Vec<usize>> = None;
    let n_vertices = header.element("vertex").map_or(0, |vertex| vertex.count) as f64;
    let mut body = Body::new(bytes, &header);
    for element in &header.elements {
        let property = |names: &[&str]| element.property(names);
        match (&*element.name, property(&["nsegs"])) {
            ("vertex", _) => vertices = read_vertices(&mut body, element, options)?,
            ("strand", Some(at)) => {
                let mut found = Vec::new();
                body.element(element, |ix, values| {
                    let n = values[at];
                    if !(0.0..=f64::from(u32::MAX)).contains(&n) || n.fract() != 0.0 {
                        let key = format!("nsegs of strand {ix}");
                        return Err(Error::value(key, n, "a count"));
                    }
                    found.push(n as usize);
                    Ok(())
                })?;
                segments = Some(found);
            }
            ("edge", _) => {
                let ends = property(&["vertex1"]).zip(property(&["vertex2"]));
                let Some((from, to)) = ends else {
                    return Err(lacks("edge", "vertex1 and vertex2"));
                };
                let mut found = Vec::new();
                body.element(element, |ix, values| {
                    let (low, high) = match values[from] < values[to] {
                        true => (values[from], values[to]),
                        false => (values[to], values[from]),
                    };
                    if high != low + 1.0 || low < 0.0 || high >= n_vertices {
                        let found = format!("{} to {}", values[from], values[to]);
                        let range = "from one vertex to the next, as along a strand";
                        return Err(Error::value(format!("edge {ix}"), found, range));
                    }
                    found.push(low as usize);
                    Ok(())
                })?;
                joined = Some(found);
            }
            _ => body.element(element, |_, _| Ok(()))?,
        }
    }
    let mut notes = Vec::new();
    let n = vertices.points.len();
    if vertices.starts.is_empty() {
        vertices.starts = match (segments, joined) {
            (Some(segments), _) => starts_of(&segments, n)?,
            (None, Some(joined)) => starts_between(&joined, n),
            (None, None) => {
                let what = format!(
                    "the file does not say where strands end: read as {USUAL_POINTS} points each"
                );
                notes.push(Note::new(NoteKind::Assumed, what));
                usual_starts(&vertices.points)?
            }
        };
    }
    make(vertices, &header, options, notes)
}

/// Refuses meshes and splats by their names.
fn refuse_others(header: &Header) -> Result<()> {
    let range = "one of strands";
    for element in &header.elements {
        if matches!(&*element.name, "face" | "tristrips") && element.count > 0 {
            let found = format!("a mesh of {} faces", element.count);
            return Err(Error::value("PLY file", found, range));
        }
    }
    let vertex = header.element("vertex");
    if vertex.is_some_and(|vertex| vertex.property(&["f_dc_0", "rot_0"]).is_some()) {
        return Err(Error::value("PLY file", "one of Gaussian splats", range));
    }
    Ok(())
}

fn lacks(element: &str, what: &str) -> Error {
    Error::invalid(format!("element {element} lacks {what}"), 0)
}

fn read_vertices(
    body: &mut Body<'_>,
    element: &Element,
    options: &ImportOptions,
) -> Result<Vertices> {
    options.check_points(element.count)?;
    let property = |names: &[&str]| element.property(names);
    let axes = ["x", "y", "z"].map(|name| property(&[name]));
    let [Some(x), Some(y), Some(z)] = axes else {
        return Err(lacks("vertex", "x, y and z"));
    };
    let color = ["red", "green", "blue"].map(|name| property(&[name]));
    let strand = property(&STRAND_NAMES);
    let (thick, factor) = match (property(&["thickness", "width"]), property(&["radius"])) {
        (Some(at), _) => (Some(at), 1.0),
        (None, radius) => (radius, 2.0),
    };
    let mut vertices = Vertices::default();
    let mut last = None;
    let mut seen = std::collections::HashSet::new();
    body.element(element, |ix, values| {
        vertices.points.push([x, y, z].map(|at| values[at] as f32));
        vertices
            .thickness
            .extend(thick.map(|at| factor * values[at] as f32));
        if let [Some(red), Some(green), Some(blue)] = color {
            let share = |at: usize| match element.properties[at].scalar {
                Scalar::F32 | Scalar::F64 => values[at] as f32,
                _ => (values[at] / 255.0) as f32,
            };
            vertices.color.extend([red, green, blue].map(share));
        }
        let Some(id) = strand.map(|at| values[at].to_bits()) else {
            return Ok(());
        };
        if last.replace(id) != Some(id) {
            vertices.starts.push(ix as usize);
            if !seen.insert(id) {
                let key = format!("strand of vertex {ix}");
                let range = "that of the vertex before, or a new one";
                return Err(Error::value(key, f64::from_bits(id), range));
            }
        }
        Ok(())
    })?;
    Ok(vertices)
}

/// First vertices of strands of so many segments, `n` vertices in all.
fn starts_of(segments: &[usize], n: usize) -> Result<Vec<usize>> {
    let mut starts = Vec::with_capacity(segments.len());
    let mut total = 0usize;
    for &count in segments {
        starts.push(total);
        total = total.saturating_add(count).saturating_add(1);
    }
    if total != n {
        let what = format!("the strands have {total} points in all, the file has {n} vertices");
        return Err(Error::invalid(what, 0));
    }
    Ok(starts)
}

/// First vertices of strands, where `joined` vertices of `n` go on to the next.
fn starts_between(joined: &[usize], n: usize) -> Vec<usize> {
    let mut is_start = vec![true; n];
    for &ix in joined {
        is_start[ix + 1] = false;
    }
    (0..n).filter(|&ix| is_start[ix]).collect()
}

/// First vertices of strands of the usual number of points.
fn usual_starts(points: &[[f32; 3]]) -> Result<Vec<usize>> {
    let range =
        format!("a multiple of {USUAL_POINTS}, or strands said by strand_id, nsegs or edges");
    if !points.len().is_multiple_of(USUAL_POINTS) {
        return Err(Error::value("number of vertices", points.len(), range));
    }
    let step = |ix: usize| {
        let [from, to] = [points[ix - 1], points[ix]];
        let square = |axis: usize| (f64::from(to[axis]) - f64::from(from[axis])).powi(2);
        (0..3).map(square).sum::<f64>().sqrt()
    };
    let (mut steps, mut jumps) = (0.0, 0.0);
    for ix in 1..points.len() {
        match ix % USUAL_POINTS {
            0 => jumps += step(ix),
            _ => steps += step(ix),
        }
    }
    let n_strands = points.len() / USUAL_POINTS;
    let mean_step = steps / (n_strands * (USUAL_POINTS - 1)).max(1) as f64;
    let mean_jump = jumps / n_strands.saturating_sub(1).max(1) as f64;
    if n_strands > 1 && mean_jump < LEAST_JUMP * mean_step {
        let found = format!("{} that do not lie along strands", points.len());
        return Err(Error::value("vertices", found, range));
    }
    Ok((0..points.len()).step_by(USUAL_POINTS).collect())
}

fn make(
    vertices: Vertices,
    header: &Header,
    options: &ImportOptions,
    mut notes: Vec<Note>,
) -> Result<Import> {
    let placement = options.placement(&INFO);
    let Vertices {
        points,
        thickness,
        color,
        starts,
    } = vertices;
    let mut list = StrandList::new(placement, options);
    let (mut kept_thickness, mut kept_color) = (Vec::new(), Vec::new());
    let ends = starts.iter().skip(1).copied().chain([points.len()]);
    for (ix, (&start, end)) in starts.iter().zip(ends).enumerate() {
        if list.push(ix, points[start..end].iter().copied())? {
            if !thickness.is_empty() {
                kept_thickness.extend(&thickness[start..end]);
            }
            if !color.is_empty() {
                kept_color.extend(&color[3 * start..3 * end]);
            }
        }
    }
    let mut groom = list.finish(INFO.name, &mut notes)?;
    if !kept_color.is_empty() {
        let color = attribute("color", Domain::Point, 3, kept_color);
        groom.attributes.push(color);
    }
    if !kept_thickness.is_empty() {
        let thickness = attribute("thickness", Domain::Point, 1, kept_thickness);
        groom.attributes.push(thickness);
        let diameter = diameter(&groom, placement.cm_per_unit);
        groom.attributes.extend(diameter);
    }
    notes.extend(left_out(header));
    Ok(Import::new(groom, notes))
}

/// A line on properties of vertices that nothing is made of.
fn left_out(header: &Header) -> Option<Note> {
    let used = [
        "x",
        "y",
        "z",
        "thickness",
        "width",
        "radius",
        "red",
        "green",
        "blue",
    ];
    let names: Vec<&str> = header
        .element("vertex")?
        .properties
        .iter()
        .map(|property| &*property.name)
        .filter(|name| !used.contains(name) && !STRAND_NAMES.contains(name))
        .take(20)
        .collect();
    let what = format!(
        "properties of vertices that are left out: {}",
        names.join(", ")
    );
    (!names.is_empty()).then(|| Note::new(NoteKind::Dropped, what))
}
