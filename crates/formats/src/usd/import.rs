//! From a layer to a groom.

use std::collections::BTreeMap;

use super::info::INFO;
use super::layer::{Layer, Source};
use super::merge::merge;
use super::package;
use super::pieces::Shape;
use super::primvars::add_values;
use super::stage::Stage;
use super::{binary, text};
use crate::counted::counted;
use crate::curves::Wrap;
use crate::error::{Error, Result};
use crate::groom::{GroomSource, Original, UpAxis};
use crate::groom_format::{CurveBasis, Import, ImportOptions, Note, NoteKind, Placement, StatedBy};
use crate::validate::in_range;

/// The layer of a file in any encoding.
fn layer_of(bytes: &[u8]) -> Result<Layer<'_>> {
    let bytes = match package::is_package(bytes) {
        true => package::root_layer(bytes)?,
        false => bytes,
    };
    if bytes.starts_with(binary::SIGNATURE) {
        let (root, file) = binary::parse(bytes)?;
        Ok(Layer::new(root, Source::Crate(Box::new(file)), bytes.len()))
    } else if text::SIGNATURES
        .iter()
        .any(|start| bytes.starts_with(start))
    {
        let root = text::parse(bytes)?;
        Ok(Layer::new(root, Source::Text(bytes), bytes.len()))
    } else {
        let what = "neither a text nor a binary layer of USD";
        Err(Error::invalid(what, 0))
    }
}

/// Times of the frames, seconds.
pub(super) fn frame_times(bytes: &[u8]) -> Result<Vec<f64>> {
    let mut layer = layer_of(bytes)?;
    layer.select_variants()?;
    let stage = Stage::of(&layer)?;
    let per_second = stage.codes_per_second()?;
    let mut times = stage.times()?;
    if times.is_empty() {
        times.push(0.0);
    }
    Ok(times.into_iter().map(|time| time / per_second).collect())
}

/// What the file states of its unit, cm, and its up axis.
fn stated(layer: &Layer) -> Result<(Option<f64>, Option<UpAxis>)> {
    let fields = &layer.root.fields;
    let unit = layer.number(fields, "metersPerUnit")?;
    let up = match layer.word(fields, "upAxis")?.as_deref() {
        None => None,
        Some("X" | "x") => Some(UpAxis::X),
        Some("Y" | "y") => Some(UpAxis::Y),
        Some("Z" | "z") => Some(UpAxis::Z),
        Some(other) => return Err(Error::value("upAxis", other, "Y or Z")),
    };
    Ok((unit.map(|meters| meters * 100.0), up))
}

/// Imports a whole file.
pub(super) fn read(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let mut layer = layer_of(bytes)?;
    let n_open_sets = layer.select_variants()?;
    let (unit, up) = stated(&layer)?;
    let placement = Placement {
        cm_per_unit: options.cm_per_unit.or(unit).unwrap_or(INFO.cm_per_unit),
        up: options.up.or(up).unwrap_or(INFO.up),
    };
    in_range("metersPerUnit", placement.cm_per_unit / 100.0, 1e-8, 1e4)?;
    let stage = Stage::of(&layer)?;
    let mut notes = Vec::new();
    if n_open_sets > 0 {
        let text = counted(
            n_open_sets,
            "set of variants has none chosen and is",
            "sets of variants have none chosen and are",
        ) + " left out";
        notes.push(Note::new(NoteKind::Dropped, text));
    }
    let chosen = stage.chosen(options.object.as_deref())?;
    let moment = stage.moment(options.frame)?;

    let mut pieces = Vec::new();
    let mut n_points = 0;
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    for ix in chosen {
        let skipped = |reason: &str| {
            let text = format!("{} is skipped: {reason}", stage.path(ix));
            stage.layer.spend_on(1, text.len())?;
            Ok::<_, Error>(Note::new(NoteKind::Dropped, text))
        };
        let (mut shape, cvs) = match Shape::of(&stage, ix, moment, options)? {
            Ok(shape) => shape,
            Err(reason) => {
                notes.push(skipped(&reason)?);
                continue;
            }
        };
        if shape.n_points == 0 {
            notes.push(skipped("none of its curves has enough points")?);
            continue;
        }
        if shape.n_left_out > 0 {
            let text = format!(
                "{} curves of {} left out: {} ones do not have so many points",
                shape.n_left_out,
                stage.path(ix),
                kind_of(&shape)
            );
            notes.push(Note::new(NoteKind::Dropped, text));
        }
        n_points += shape.n_points;
        options.check_points(n_points)?;
        shape.prepare(options);
        let mut piece = shape.piece(&stage, ix, moment, &cvs, placement)?;
        drop(cvs);
        add_values(&stage, ix, moment, &shape, &mut piece, &mut notes)?;
        note_purpose(&stage, ix, &piece.path, &mut notes)?;
        note_hidden(&stage, ix, &piece.path, &mut notes)?;
        *kinds.entry(kind_of(&shape)).or_default() += 1;
        pieces.push(piece);
    }
    for (type_name, prims) in &stage.others {
        let text = format!(
            "{} {type_name} left out: {}",
            prims.len(),
            stage.list(prims)
        );
        notes.push(Note::new(NoteKind::Dropped, text));
    }
    if pieces.is_empty() {
        let reasons = notes
            .iter()
            .filter(|note| note.text.contains(" is skipped: "));
        let reasons: String = reasons.take(3).map(|note| format!("; {note}")).collect();
        return Err(Error::value(
            "number of BasisCurves with points",
            0,
            format!("at least 1{reasons}{}", stage.hidden()),
        ));
    }
    let hidden = stage.hidden();
    if let Some(hidden) = hidden.strip_prefix("; ") {
        notes.push(Note::new(NoteKind::Dropped, hidden));
    }
    let mut groom = merge(pieces, &mut notes, &layer)?;
    groom.source = GroomSource {
        cm_per_unit: placement.cm_per_unit,
        up: placement.up,
        parameters: parameters(&kinds, options),
        original: Some(Original {
            format: INFO.name.to_owned(),
            data: Vec::new(),
        }),
        ..GroomSource::default()
    };
    let mut import = Import::new(groom, notes);
    if unit.is_some() {
        import.unit_by = StatedBy::File;
    }
    if up.is_some() {
        import.up_by = StatedBy::File;
    }
    Ok(import)
}

/// `pinned bspline`.
fn kind_of(shape: &Shape) -> String {
    let wrap = match shape.wrap {
        Wrap::Open => "",
        Wrap::Pinned => "pinned ",
        Wrap::Periodic => "periodic ",
    };
    format!("{wrap}{}", shape.basis.name())
}

/// What the polylines were made of, where that was not polylines.
fn parameters(kinds: &BTreeMap<String, usize>, options: &ImportOptions) -> Vec<(String, String)> {
    let linear = CurveBasis::Linear.name();
    if kinds.keys().all(|kind| kind.ends_with(linear)) {
        return Vec::new();
    }
    let list: Vec<&str> = kinds.keys().map(String::as_str).collect();
    let samples = options.samples_per_segment.to_string();
    vec![
        ("curves".to_owned(), list.join(", ")),
        ("samples_per_segment".to_owned(), samples),
    ]
}

/// Hair that other programs hide is imported all the same.
fn note_hidden(stage: &Stage, ix: usize, path: &str, notes: &mut Vec<Note>) -> Result<()> {
    for ix in stage.upwards(ix) {
        if let Some(property) = stage.prim(ix).properties.get("visibility")
            && let first = property.samples.first().map(|(_, value)| value)
            && let Some(value) = property.default.as_ref().or(first)
            && stage
                .layer
                .strings(value)?
                .first()
                .is_some_and(|visibility| visibility == "invisible")
        {
            let text = format!("{path} is hidden in its file, and read all the same");
            notes.push(Note::new(NoteKind::Assumed, text));
            break;
        }
    }
    Ok(())
}

/// So is hair that is not there to be rendered.
fn note_purpose(stage: &Stage, ix: usize, path: &str, notes: &mut Vec<Note>) -> Result<()> {
    for ix in stage.upwards(ix) {
        let property = stage.prim(ix).properties.get("purpose");
        let Some(value) = property.and_then(|property| property.default.as_ref()) else {
            continue;
        };
        if let Some(purpose) = stage.layer.strings(value)?.first()
            && ["proxy", "guide"].contains(&&**purpose)
        {
            let text = format!("the purpose of {path} is {purpose}, not to be rendered");
            notes.push(Note::new(NoteKind::Assumed, text));
        }
        break;
    }
    Ok(())
}
