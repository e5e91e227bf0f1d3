//! The objects of an archive: curves with the transforms above them, and what else there is.

use std::collections::BTreeMap;

use super::archive::{Archive, Compound, Object, metadata_value};
use super::notes::Notes;
use super::transform::{Matrix, transform};
use crate::error::{Error, Result};
use crate::groom_format::NoteKind;

/// Objects in objects that are followed. No program goes so deep, and the stack holds more.
const MAX_DEPTH: usize = 256;

/// An object with others below it.
pub(super) struct Node<'a> {
    pub path: String,
    /// Index of the one around it.
    pub parent: Option<usize>,
    /// Its own properties.
    pub properties: Compound<'a>,
    /// Those of its transform; empty if it has none.
    pub xform: Compound<'a>,
}

/// An object of curves.
pub(super) struct CurvesObject<'a> {
    pub path: String,
    /// Index of the node around it.
    pub parent: usize,
    /// Its own properties.
    pub properties: Compound<'a>,
    /// Those of its schema.
    pub geom: Compound<'a>,
}

/// What there is in an archive.
#[derive(Default)]
pub(super) struct Tree<'a> {
    /// Parents before children.
    pub nodes: Vec<Node<'a>>,
    /// In the order of the file.
    pub curves: Vec<CurvesObject<'a>>,
    /// Kinds of objects that hold no curves, and how many.
    others: BTreeMap<&'static str, usize>,
}

/// Schemas by the start of their names; what they are called, one and several.
const OTHERS: [(&str, &str); 9] = [
    ("AbcGeom_PolyMesh", "meshes"),
    ("AbcGeom_SubD", "subdivision surfaces"),
    ("AbcGeom_FaceSet", "sets of faces"),
    ("AbcGeom_Points", "sets of points"),
    ("AbcGeom_Camera", "cameras"),
    ("AbcGeom_NuPatch", "NURBS surfaces"),
    ("AbcGeom_Light", "lights"),
    ("AbcMaterial", "materials"),
    ("AbcCollection", "collections"),
];

impl<'a> Tree<'a> {
    /// Walks the whole archive.
    pub fn new(archive: &Archive<'a>, notes: &mut Notes) -> Result<Self> {
        let mut tree = Tree::default();
        let path = String::new();
        tree.walk(archive, &archive.top, path, None, 0, notes)?;
        if !tree.others.is_empty() {
            let list = tree.others.iter().map(|(name, n)| format!("{n} {name}"));
            let list = list.collect::<Vec<_>>().join(", ");
            notes.add(
                NoteKind::Dropped,
                "",
                format!("no curves, so not read: {list}"),
            );
        }
        Ok(tree)
    }

    fn walk(
        &mut self,
        archive: &Archive<'a>,
        object: &Object<'a>,
        path: String,
        parent: Option<usize>,
        depth: usize,
        notes: &mut Notes,
    ) -> Result<()> {
        if depth > MAX_DEPTH {
            let what = format!("objects are nested more than {MAX_DEPTH} deep");
            return Err(Error::invalid(what, 0));
        }
        archive.ogawa.spend(2 * path.len() as u64, 0)?;
        let properties = archive.properties(object, &path)?;
        let schema = metadata_value(object.metadata, "schema").unwrap_or_default();
        if let Some(source) = properties.get(".instanceSource") {
            let source = archive.values(source, 0, &path)?;
            let text = format!(
                "an instance of {:?}, whose copies are not made",
                source.texts().concat()
            );
            notes.add(NoteKind::Dropped, &path, text);
            return Ok(());
        }
        if schema.starts_with("AbcGeom_Curve_") {
            if schema == "AbcGeom_Curve_v2" {
                let geom = archive.compound(properties.get(".geom"), &path)?;
                self.curves.push(CurvesObject {
                    path: path.clone(),
                    parent: parent.unwrap_or(0),
                    properties: properties.clone(),
                    geom,
                });
            } else {
                let text = format!("curves of the schema {schema}, which is not known");
                notes.add(NoteKind::Dropped, &path, text);
            }
        }
        if let Some((_, name)) = OTHERS.iter().find(|(start, _)| schema.starts_with(start)) {
            *self.others.entry(name).or_default() += 1;
        }
        let xform = match schema {
            "AbcGeom_Xform_v3" => archive.compound(properties.get(".xform"), &path)?,
            other if other.starts_with("AbcGeom_Xform_") => {
                let key = format!("schema of the transform {path:?}");
                return Err(Error::value(key, other, "AbcGeom_Xform_v3"));
            }
            _ => Compound::default(),
        };
        let node = self.nodes.len();
        self.nodes.push(Node {
            path: path.clone(),
            parent,
            properties,
            xform,
        });
        for child in archive.children(object, &path)? {
            let path = format!("{path}/{}", child.name);
            self.walk(archive, &child, path, Some(node), depth + 1, notes)?;
        }
        Ok(())
    }

    /// Keeps the curves of the object called `path` and of those below it.
    pub fn select(&mut self, path: &str) -> Result<()> {
        let wanted = path.trim_matches('/');
        let is_below = |path: &str| {
            let rest = path.trim_start_matches('/').strip_prefix(wanted);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/') || wanted.is_empty())
        };
        if !self.curves.iter().any(|curves| is_below(&curves.path)) {
            let paths = self.curves.iter().map(|curves| curves.path.as_str());
            let mut list = paths.take(8).collect::<Vec<_>>().join(", ");
            if self.curves.len() > 8 {
                list += ", ...";
            }
            let range = match self.curves.is_empty() {
                true => "that of an object of curves, and the file has none".to_owned(),
                false => format!("that of an object of curves, or of one above it: {list}"),
            };
            return Err(Error::value("object", format!("{path:?}"), range));
        }
        self.curves.retain(|curves| is_below(&curves.path));
        Ok(())
    }

    /// From each node around curves to the world at `time`, seconds.
    pub fn matrices(&self, archive: &Archive<'a>, time: f64) -> Result<Vec<Matrix>> {
        let mut is_needed = vec![false; self.nodes.len()];
        for curves in &self.curves {
            let mut node = Some(curves.parent);
            while let Some(ix) = node.filter(|&ix| !std::mem::replace(&mut is_needed[ix], true)) {
                node = self.nodes[ix].parent;
            }
        }
        let mut matrices: Vec<Matrix> = Vec::new();
        for (node, is_needed) in self.nodes.iter().zip(is_needed) {
            if !is_needed {
                matrices.push(Matrix::IDENTITY);
                continue;
            }
            let (own, inherits) = transform(archive, &node.xform, time, &node.path)?;
            let parent = node.parent.filter(|_| inherits);
            matrices.push(match parent {
                Some(parent) => own.then(&matrices[parent]),
                None => own,
            });
        }
        Ok(matrices)
    }

    /// The node around `curves` and those around that, from the inside out.
    pub fn ancestors(&self, curves: &CurvesObject<'a>) -> impl Iterator<Item = &Node<'a>> {
        let parent = |ix: &usize| self.nodes[*ix].parent;
        std::iter::successors(Some(curves.parent), parent).map(|ix| &self.nodes[ix])
    }
}
