//! Attributes of one object of curves: of its schema, of itself, and of the objects around it.

use super::archive::{Archive, Compound};
use super::notes::Notes;
use super::params::Param;
use super::tree::{CurvesObject, Tree};
use crate::attribute_names::{groom_name, known_attribute};
use crate::curves::{Counts, Interpolation};
use crate::error::{Error, Result};
use crate::groom_format::NoteKind;

/// An attribute in terms of control points and curves.
pub(super) struct Source {
    /// Name in a groom.
    pub name: String,
    /// Floats per value.
    pub components: usize,
    pub interpolation: Interpolation,
    /// All finite.
    pub data: Vec<f32>,
}

/// Names of groups, none twice, and which of them each curve has; one if it holds for all.
pub(super) type GroupNames = (Vec<String>, Vec<u32>);

/// What there is beyond points.
#[derive(Default)]
pub(super) struct Sources {
    pub attributes: Vec<Source>,
    pub group_names: Option<GroupNames>,
}

/// Properties of the groom as a whole; they become parameters of its source.
pub(super) const OF_THE_GROOM: [&str; 4] = [
    "groom_version_major",
    "groom_version_minor",
    "groom_tool",
    "groom_properties",
];
/// Strings that name the group of a curve.
const GROUP_NAME: &str = "groom_group_name";
/// Names that widths have beside the schema's own.
const WIDTHS: [&str; 2] = ["groom_width", "width"];
/// More attributes than this do not fit into a `.groom` file.
const MAX_ATTRIBUTES: usize = 1000;
/// Largest integer up to which a float holds all of them.
const EXACT: f64 = 16_777_216.0;

/// Reads the attributes of one object.
pub(super) struct Collector<'c, 'a> {
    pub archive: &'c Archive<'a>,
    /// Path of the object.
    pub path: &'c str,
    pub time: f64,
    /// How many values there are of what.
    pub counts: Counts,
    /// Number of control points of each curve.
    pub lengths: &'c [u32],
    /// Centimetres per unit of a width.
    pub width_scale: f64,
    pub notes: &'c mut Notes,
    pub sources: Sources,
}

impl<'a> Collector<'_, 'a> {
    /// All attributes of `object`, the nearest of each name.
    pub fn collect(&mut self, tree: &Tree<'a>, object: &CurvesObject<'a>) -> Result<()> {
        let geom = &object.geom;
        if let Some(width) = geom.get("width") {
            let param = Param::read(self.archive, width, self.time, self.path)?;
            if let Some(param) = param.filter(|param| param.len() > 0) {
                self.add(&param, "diameter")?;
            }
        }
        let inner =
            |name: &str, of: &Compound<'a>, path: &str| self.archive.compound(of.get(name), path);
        let own = [
            inner(".arbGeomParams", geom, self.path)?,
            inner(".userProperties", geom, self.path)?,
        ];
        let mut around = vec![object.properties.clone()];
        for node in tree.ancestors(object) {
            around.push(inner(".arbGeomParams", &node.xform, &node.path)?);
            around.push(inner(".userProperties", &node.xform, &node.path)?);
            around.push(inner(".arbGeomParams", &node.properties, &node.path)?);
            around.push(inner(".userProperties", &node.properties, &node.path)?);
            around.push(node.properties.clone());
        }
        // Unreal's names go before others for the same.
        for is_first in [true, false] {
            for (ix, compound) in own.iter().chain(&around).enumerate() {
                let is_own = ix < own.len();
                for property in &compound.properties {
                    let name = property.name;
                    let is_known = name.starts_with("groom_") || known_attribute(name).is_some();
                    let skipped = OF_THE_GROOM.contains(&name) || (!is_own && !is_known);
                    if skipped || name.starts_with("groom_") != is_first {
                        continue;
                    }
                    let param = Param::read(self.archive, property, self.time, self.path)?;
                    if let Some(param) = param {
                        self.take(&param, is_own)?;
                    }
                }
            }
        }
        if let Some(uv) = geom.get("uv") {
            let param = Param::read(self.archive, uv, self.time, self.path)?;
            if let Some(param) = param.filter(|param| param.len() > 0) {
                self.take(&param, true)?;
            }
        }
        for name in ["N", ".velocities"] {
            if geom
                .get(name)
                .is_some_and(|property| property.n_samples > 0)
            {
                self.drop(format!("{name} is not kept"));
            }
        }
        Ok(())
    }

    fn drop(&mut self, text: String) {
        self.notes.add(NoteKind::Dropped, self.path, text);
    }

    /// A parameter under its name in a groom.
    fn take(&mut self, param: &Param<'a>, is_own: bool) -> Result<()> {
        let foreign = param.name;
        if param.values.pod.is_text() {
            if foreign == GROUP_NAME {
                if self.sources.group_names.is_none() {
                    self.take_group_names(param)?;
                }
            } else if is_own {
                self.drop(format!("{foreign:?}, which is text, is not kept"));
            }
            return Ok(());
        }
        if WIDTHS.contains(&foreign) {
            // What the schema has of its own goes before.
            return match self.has("diameter") {
                true => Ok(()),
                false => self.add(param, "diameter"),
            };
        }
        match groom_name(foreign) {
            Some(name) if name == "diameter" || name == "group_name" => {
                self.drop(format!(
                    "{foreign:?} is not kept, for widths and groups say it"
                ));
                Ok(())
            }
            Some(name) if self.has(&name) => {
                let same = known_attribute(foreign).is_some() || !is_own;
                if !same {
                    self.drop(format!("{foreign:?} is not kept, another one is {name}"));
                }
                Ok(())
            }
            Some(name) => self.add(param, &name),
            None => {
                self.drop(format!("{foreign:?} is not kept, its name has no letters"));
                Ok(())
            }
        }
    }

    fn has(&self, name: &str) -> bool {
        self.sources
            .attributes
            .iter()
            .any(|source| source.name == name)
    }

    /// `param` as attribute `name`, where it can be one.
    fn add(&mut self, param: &Param<'a>, name: &str) -> Result<()> {
        let foreign = param.name;
        let is_width = name == "diameter";
        let known = known_attribute(name);
        let wanted = match is_width {
            true => Some(1),
            false => known.map(|known| known.components as usize),
        };
        let mut n = param.len();
        // Of an array of plain numbers the number of values tells how many make one.
        let mut components = param.components;
        if let Some(wanted) = wanted {
            if components < wanted {
                self.drop(format!(
                    "{foreign:?} has {components} numbers a value, {name} {wanted}; it is not kept"
                ));
                return Ok(());
            }
            components = wanted;
        }
        if !(1..=4).contains(&components) {
            self.drop(format!(
                "{foreign:?} has {components} numbers a value; it is not kept"
            ));
            return Ok(());
        }
        if n == 0 {
            self.drop(format!("{foreign:?} is empty"));
            return Ok(());
        }
        let Some(interpolation) = Interpolation::of(n, &self.counts, param.label) else {
            let Counts {
                uniform, vertex, ..
            } = self.counts;
            self.drop(format!(
                "{foreign:?} has {n} values for {uniform} curves and {vertex} points; it is not kept"
            ));
            return Ok(());
        };
        let doubles = param.doubles(self.archive, components, self.path)?;
        if param.components > components {
            let text = format!(
                "of {foreign:?} the first {components} of {} numbers a value are kept",
                param.components
            );
            self.drop(text);
        }
        if let Some(big) = doubles
            .iter()
            .find(|value| param.values.pod.is_integer() && value.abs() > EXACT)
        {
            self.drop(format!(
                "{foreign:?} is not kept, for a float does not hold its {big} exactly"
            ));
            return Ok(());
        }
        let scale = if is_width { self.width_scale } else { 1.0 };
        let mut data = Vec::with_capacity(doubles.len());
        for (ix, value) in doubles.into_iter().enumerate() {
            let float = (value * scale) as f32;
            if !float.is_finite() {
                n = ix / components;
                let place = self.place(interpolation, n);
                let key = format!("{}: {foreign} of {place}", self.path);
                return Err(Error::value(key, value, "finite"));
            }
            data.push(float);
        }
        if self.sources.attributes.len() == MAX_ATTRIBUTES {
            self.drop(format!(
                "attributes beyond the first {MAX_ATTRIBUTES} are not kept"
            ));
            return Ok(());
        }
        self.sources.attributes.push(Source {
            name: name.to_owned(),
            components,
            interpolation,
            data,
        });
        Ok(())
    }

    /// Element `ix` in words.
    fn place(&self, interpolation: Interpolation, ix: usize) -> String {
        match interpolation {
            Interpolation::Constant => "all".to_owned(),
            Interpolation::Uniform => format!("strand {ix}"),
            Interpolation::Varying => format!("end {ix} of all segments"),
            Interpolation::Vertex => {
                let mut point = ix;
                for (strand, &length) in self.lengths.iter().enumerate() {
                    if point < length as usize {
                        return format!("strand {strand}, point {point}");
                    }
                    point -= length as usize;
                }
                format!("point {ix}")
            }
        }
    }

    fn take_group_names(&mut self, param: &Param<'a>) -> Result<()> {
        let (table, elements) = param.texts(self.archive, self.path)?;
        let n = elements.len();
        match n == 1 || n == self.counts.uniform {
            true if n > 0 => self.sources.group_names = Some((table, elements)),
            _ => self.drop(format!(
                "{GROUP_NAME:?} has {n} values for {} curves; it is not kept",
                self.counts.uniform
            )),
        }
        Ok(())
    }
}
