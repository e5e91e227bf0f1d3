//! Which prims of a layer are there, and where.

use std::collections::BTreeMap;

use super::layer::Layer;
use super::model::{Prim, Specifier};
use super::time::{Moment, samples_of};
use super::transform::{self, IDENTITY, Matrix};
use crate::error::{Error, Result};

/// A prim that is there: defined, active, and so are all above it.
#[derive(Clone, Copy, Debug)]
struct Visited<'a> {
    prim: &'a Prim,
    /// Index of the prim above it.
    above: Option<usize>,
}

/// The prims of a layer with chosen variants.
#[derive(Debug)]
pub(super) struct Stage<'a> {
    /// The layer.
    pub layer: &'a Layer<'a>,
    visited: Vec<Visited<'a>>,
    /// Indices of the prims of type `BasisCurves`.
    pub curves: Vec<usize>,
    /// Other prims with a shape, by type.
    pub others: BTreeMap<&'a str, Vec<usize>>,
    /// What is named and not followed, in order.
    pub assets: Vec<String>,
}

/// Types of prims that are listed when they are left out.
const SHAPES: [&str; 16] = [
    "Camera",
    "Capsule",
    "Cone",
    "Cube",
    "Cylinder",
    "HermiteCurves",
    "Mesh",
    "NurbsCurves",
    "NurbsPatch",
    "Plane",
    "PointInstancer",
    "Points",
    "Sphere",
    "TetMesh",
    "Volume",
    "SkelAnimation",
];
/// Metadata that brings in prims of other files, or other prims of the same file.
const ARCS: [&str; 6] = [
    "references",
    "payload",
    "inherits",
    "inheritPaths",
    "specializes",
    "clips",
];
/// Most assets that are listed.
const MOST_ASSETS: usize = 100;

impl<'a> Stage<'a> {
    /// Finds them.
    pub fn of(layer: &'a Layer<'a>) -> Result<Self> {
        let mut stage = Stage {
            layer,
            visited: Vec::new(),
            curves: Vec::new(),
            others: BTreeMap::new(),
            assets: Vec::new(),
        };
        if let Some(value) = layer.root.fields.get("subLayers") {
            stage.assets = layer.assets(value)?;
        }
        for prim in &layer.root.children {
            stage.visit(prim, None)?;
        }
        let first = std::mem::take(&mut stage.assets);
        for asset in first {
            if !stage.assets.contains(&asset) && stage.assets.len() < MOST_ASSETS {
                stage.assets.push(asset);
            }
        }
        Ok(stage)
    }

    fn visit(&mut self, prim: &'a Prim, above: Option<usize>) -> Result<()> {
        let is_active = self.layer.number(&prim.fields, "active")? != Some(0.0);
        if prim.specifier == Specifier::Class || !is_active {
            return Ok(());
        }
        for arc in ARCS {
            if self.assets.len() < MOST_ASSETS
                && let Some(value) = prim.fields.get(arc)
            {
                let assets = self.layer.assets(value)?;
                self.assets.extend(assets);
            }
        }
        if prim.specifier == Specifier::Over {
            return Ok(());
        }
        let ix = self.visited.len();
        self.visited.push(Visited { prim, above });
        let type_name = &*prim.type_name;
        if type_name == "BasisCurves" {
            self.curves.push(ix);
        } else if SHAPES.contains(&type_name) {
            self.others.entry(type_name).or_default().push(ix);
        }
        // What is below is copied to where the points are, which is not done.
        if type_name == "PointInstancer" {
            return Ok(());
        }
        prim.children
            .iter()
            .try_for_each(|child| self.visit(child, Some(ix)))
    }

    /// The prim of index `ix`.
    pub fn prim(&self, ix: usize) -> &'a Prim {
        self.visited[ix].prim
    }

    /// The prim of index `ix`, then those above it, up to the first below the root.
    pub fn upwards(&self, ix: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(ix), |&ix| self.visited[ix].above)
    }

    /// Its path, `/head/hair`.
    pub fn path(&self, ix: usize) -> String {
        let names: Vec<&str> = self.upwards(ix).map(|ix| &*self.prim(ix).name).collect();
        let parts = names.iter().rev().map(|name| format!("/{name}"));
        parts.collect()
    }

    /// The curves to import: all, or those of `object` and below it.
    pub fn chosen(&self, object: Option<&str>) -> Result<Vec<usize>> {
        let Some(object) = object else {
            return Ok(self.curves.clone());
        };
        let names: Vec<&str> = object.split('/').filter(|name| !name.is_empty()).collect();
        let is_below = |&ix: &usize| {
            let path: Vec<&str> = self.upwards(ix).map(|ix| &*self.prim(ix).name).collect();
            path.iter()
                .rev()
                .zip(&names)
                .filter(|(a, b)| a == b)
                .count()
                == names.len()
        };
        let chosen: Vec<usize> = self.curves.iter().copied().filter(is_below).collect();
        match chosen.is_empty() {
            true => Err(Error::value("object", object, self.choices())),
            false => Ok(chosen),
        }
    }

    /// Paths of curves in words.
    fn choices(&self) -> String {
        match self.curves.is_empty() {
            true => format!("a prim with BasisCurves: there are none{}", self.hidden()),
            false => format!("one of {}, or a prim above", self.list(&self.curves)),
        }
    }

    /// The first few paths.
    pub fn list(&self, prims: &[usize]) -> String {
        let mut list: Vec<String> = prims.iter().take(5).map(|&ix| self.path(ix)).collect();
        if prims.len() > list.len() {
            list.push(format!("{} more", prims.len() - list.len()));
        }
        list.join(", ")
    }

    /// What may hide hair, in words that can end a sentence; empty if nothing does.
    pub fn hidden(&self) -> String {
        match self.assets.is_empty() {
            true => String::new(),
            false => {
                let list = self.assets.iter().take(5).map(String::as_str);
                let list: Vec<&str> = list.collect();
                format!(
                    "; {} {} not followed: flatten the file with `usdcat --flatten`",
                    list.join(", "),
                    if self.assets.len() == 1 { "is" } else { "are" }
                )
            }
        }
    }

    /// From the prim of index `ix` to the world.
    pub fn world_from(&self, ix: usize, moment: Moment) -> Result<Matrix> {
        let mut matrix = IDENTITY;
        for ix in self.upwards(ix) {
            let local = transform::local(self.layer, self.prim(ix), &self.path(ix), moment)?;
            matrix = transform::product(&matrix, &local.matrix);
            if local.resets {
                break;
            }
        }
        Ok(matrix)
    }

    /// Time codes at which points or transforms of any curves are written, rising.
    pub fn times(&self) -> Result<Vec<f64>> {
        let mut is_above = vec![false; self.visited.len()];
        let mut times = Vec::new();
        for &ix in &self.curves {
            times.extend(samples_of(self.prim(ix).properties.get("points")));
            for ix in self.upwards(ix) {
                if std::mem::replace(&mut is_above[ix], true) {
                    break;
                }
                times.extend(transform::times(self.layer, self.prim(ix))?);
            }
        }
        times.sort_by(f64::total_cmp);
        times.dedup();
        Ok(times)
    }

    /// Time codes in a second.
    pub fn codes_per_second(&self) -> Result<f64> {
        let fields = &self.layer.root.fields;
        for key in ["timeCodesPerSecond", "framesPerSecond"] {
            match self.layer.number(fields, key)? {
                Some(rate) if rate.is_finite() && rate > 0.0 => return Ok(rate),
                Some(rate) => return Err(Error::value(key, rate, "positive")),
                None => {}
            }
        }
        Ok(24.0)
    }

    /// The moment of frame `frame`.
    pub fn moment(&self, frame: u32) -> Result<Moment> {
        let times = self.times()?;
        match (times.get(frame as usize), frame) {
            (Some(&time), _) => Ok(Moment::Code(time)),
            (None, 0) => Ok(Moment::Default),
            (None, _) => {
                let last = times.len().saturating_sub(1);
                Err(Error::value("frame", frame, format!("in 0..={last}")))
            }
        }
    }
}
