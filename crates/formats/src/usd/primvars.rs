//! Values that come with curves: widths, and primvars as attributes.

use std::collections::BTreeMap;

use super::model::{Numbers, Property};
use super::pieces::{Piece, Shape, Values};
use super::stage::Stage;
use super::time::Moment;
use crate::attribute_names::{groom_name, known_attribute};
use crate::curves::Interpolation;
use crate::error::{Error, Result};
use crate::groom_format::{Note, NoteKind};

/// Largest integer up to which all are floats.
const MAX_INTEGER: f64 = 16_777_216.0;
/// Most primvars of a prim that are taken; others are left out with a line.
const MOST_PRIMVARS: usize = 256;
/// Properties of curves that mean something and that a groom has no place for.
const NO_PLACE: [&str; 3] = ["normals", "velocities", "accelerations"];

/// Adds what the prim `ix` has to its `piece`.
pub(super) fn add_values(
    stage: &Stage,
    ix: usize,
    moment: Moment,
    shape: &Shape,
    piece: &mut Piece,
    notes: &mut Vec<Note>,
) -> Result<()> {
    let own = &stage.prim(ix).properties;
    let primvars = inherited(stage, ix)?;
    if primvars.len() > MOST_PRIMVARS {
        let what = format!("primvars beyond the first {MOST_PRIMVARS}");
        leave_out(&what, &piece.path, "there are too many", notes);
    }
    for (name, property) in primvars.into_iter().take(MOST_PRIMVARS) {
        let property_name = format!("primvars:{name}");
        let indices = format!("{property_name}:indices");
        let holder = holder(stage, ix, &property_name);
        let indices = holder.and_then(|ix| stage.prim(ix).properties.get(&indices));
        let source = Source {
            property,
            indices,
            name: &property_name,
        };
        let groom_name = match (name, groom_name(name)) {
            ("widths", _) => Some("diameter".to_owned()),
            // The name of what widths become.
            (_, Some(name)) if name == "diameter" => None,
            (_, name) => name,
        };
        let result = match groom_name {
            Some(groom_name) => source.values(stage, moment, shape, groom_name)?,
            None => Err("a groom cannot have its name".to_owned()),
        };
        match result {
            Ok(values) => add(piece, values, &property_name, notes),
            // Not written, or taken back.
            Err(reason) if reason == NO_VALUE => {}
            Err(reason) => leave_out(&property_name, &piece.path, &reason, notes),
        }
    }
    let has_widths = piece.values.iter().any(|values| values.name == "diameter");
    if let (Some(property), false) = (own.get("widths"), has_widths) {
        let source = Source {
            property,
            indices: None,
            name: "widths",
        };
        match source.values(stage, moment, shape, "diameter".to_owned())? {
            Ok(values) => add(piece, values, "widths", notes),
            Err(reason) if reason == NO_VALUE => {}
            Err(reason) => leave_out("widths", &piece.path, &reason, notes),
        }
    }
    for name in NO_PLACE {
        if own.contains_key(name) {
            leave_out(name, &piece.path, "a groom has no place for them", notes);
        }
    }
    Ok(())
}

fn leave_out(name: &str, path: &str, reason: &str, notes: &mut Vec<Note>) {
    let text = format!("{name} of {path} left out: {reason}");
    notes.push(Note::new(NoteKind::Dropped, text));
}

fn add(piece: &mut Piece, mut values: Values, name: &str, notes: &mut Vec<Note>) {
    if let Some(other) = piece.values.iter().find(|other| other.name == values.name) {
        // The same under two names: `groom_color` and `displayColor`.
        if (other.domain, &other.data) == (values.domain, &values.data) {
            return;
        }
        let reason = format!("there is another {}", values.name);
        return leave_out(name, &piece.path, &reason, notes);
    }
    if values.name == "diameter" && piece.scale != 1.0 {
        for value in &mut values.data {
            *value = (f64::from(*value) * piece.scale) as f32;
        }
    }
    piece.values.push(values);
}

/// The nearest of the prim `ix` and those above it that has the property `name`.
fn holder(stage: &Stage, ix: usize, name: &str) -> Option<usize> {
    let mut upwards = stage.upwards(ix);
    upwards.find(|&ix| stage.prim(ix).properties.contains_key(name))
}

/// Primvars of the prim `ix` without `primvars:`, those of Unreal's names first; constant ones of
/// the prims above it count as its own.
fn inherited<'a>(stage: &Stage<'a>, ix: usize) -> Result<Vec<(&'a str, &'a Property)>> {
    let mut found: BTreeMap<&str, &Property> = BTreeMap::new();
    for (height, ix) in stage.upwards(ix).enumerate() {
        for (name, property) in stage.prim(ix).properties.range("primvars:".to_owned()..) {
            let Some(name) = name.strip_prefix("primvars:") else {
                break;
            };
            // Constant is what it is if nothing else is written.
            let is_constant = || {
                let label = stage.layer.word(&property.fields, "interpolation");
                label.is_ok_and(|label| label.is_none_or(|label| label == "constant"))
            };
            // Those of a prim far up are gone through for every prim below it.
            stage.layer.spend_on(1, 8)?;
            let is_part = name.ends_with(":indices");
            if !is_part && (height == 0 || is_constant()) {
                found.entry(name).or_insert(property);
            }
        }
    }
    let mut found: Vec<(&str, &Property)> = found.into_iter().collect();
    found.sort_by_key(|(name, _)| !name.starts_with("groom_"));
    Ok(found)
}

/// Where values come from.
struct Source<'a> {
    property: &'a Property,
    indices: Option<&'a Property>,
    name: &'a str,
}

/// Why there are no values, if nothing is wrong.
const NO_VALUE: &str = "it has no value";

impl Source<'_> {
    /// The values as those of an attribute called `name`, or why they cannot be.
    fn values(
        &self,
        stage: &Stage,
        moment: Moment,
        shape: &Shape,
        name: String,
    ) -> Result<std::result::Result<Values, String>> {
        let layer = stage.layer;
        let type_name = self.property.type_name.trim_end_matches("[]");
        let is_integer = ["int", "uint", "int64", "uint64", "uchar", "bool"].contains(&type_name)
            || type_name.starts_with("int");
        let mut is_large = false;
        let numbers = match is_integer {
            true => moment.held(layer, self.property)?.map(|held| {
                is_large = held.data.iter().any(|value| value.abs() > MAX_INTEGER);
                Numbers {
                    width: held.width,
                    data: held.data.iter().map(|&value| value as f32).collect(),
                }
            }),
            false => moment.numbers::<f32>(layer, self.property)?,
        };
        let Some(mut numbers) = numbers.filter(|numbers| !numbers.data.is_empty()) else {
            let is_text = ["string", "token", "asset"].contains(&type_name);
            let reason = if is_text { "it is text" } else { NO_VALUE };
            return Ok(Err(reason.to_owned()));
        };
        let size = layer.number(&self.property.fields, "elementSize")?;
        let size = size.filter(|size| (2.0..=4.0).contains(size) && size.fract() == 0.0);
        let mut components = numbers.width * size.map_or(1, |size| size as usize);
        if !numbers.data.len().is_multiple_of(components) {
            components = numbers.width;
        }
        if let Some(indices) = self.indices
            && let Some(indices) = moment.held(layer, indices)?
        {
            layer.spend_on(indices.data.len(), size_of::<f32>() * components)?;
            numbers.data = self.expand(&numbers.data, components, &indices.data)?;
        }
        let known = known_attribute(&name);
        if let Some(known) = known
            && known.components as usize != components
        {
            let wanted = known.components as usize;
            // Texture coordinates are often given a third.
            if name == "root_uv" && components > wanted {
                let kept = numbers.data.chunks_exact(components);
                numbers.data = kept.flat_map(|value| &value[..wanted]).copied().collect();
                components = wanted;
            } else {
                let reason = format!("{components} numbers a value, {name} has {wanted}");
                return Ok(Err(reason));
            }
        }
        if !(1..=4).contains(&components) || (name == "diameter" && components != 1) {
            return Ok(Err(format!("{components} numbers a value")));
        }
        if is_large {
            return Ok(Err(format!("integers beyond {MAX_INTEGER}")));
        }
        // Widths that are no numbers are judged with the others.
        let is_finite = numbers.data.iter().all(|value| value.is_finite());
        if !is_finite && name != "diameter" {
            return Ok(Err("not all of it is finite".to_owned()));
        }
        if let Err(error) = crate::paint::check(&name, components as u32, &numbers.data) {
            return Ok(Err(error.to_string()));
        }
        let n = numbers.data.len() / components;
        let label = layer.word(&self.property.fields, "interpolation")?;
        // What is not said is USD's default: constant, but of widths one for each point.
        let usual = (self.name != "widths").then_some(Interpolation::Constant);
        let label = label.map_or(usual, |label| interpolation(&label));
        let Some(interpolation) = shape.interpolation(n, label) else {
            return Ok(Err(format!("{n} values fit neither curves nor points")));
        };
        let (domain, data) = shape.values(&numbers.data, components, interpolation, is_integer);
        Ok(Ok(Values {
            name,
            domain,
            components,
            data,
        }))
    }

    /// One value for each index.
    fn expand(&self, data: &[f32], components: usize, indices: &[f64]) -> Result<Vec<f32>> {
        let n = data.len() / components;
        let mut expanded = Vec::with_capacity(indices.len().saturating_mul(components));
        for &index in indices {
            if !(0.0..n as f64).contains(&index) {
                let key = format!("{}:indices", self.name);
                return Err(Error::value(key, index, format!("below {n}")));
            }
            expanded.extend_from_slice(&data[index as usize * components..][..components]);
        }
        Ok(expanded)
    }
}

fn interpolation(label: &str) -> Option<Interpolation> {
    Some(match label {
        "constant" => Interpolation::Constant,
        "uniform" => Interpolation::Uniform,
        "varying" | "faceVarying" => Interpolation::Varying,
        "vertex" => Interpolation::Vertex,
        _ => return None,
    })
}
