//! From the tables of a binary layer to its prims.

use std::collections::BTreeMap;

use super::file::Crate;
use crate::error::{Error, Result};
use crate::usd::model::{MAX_DEPTH, Prim, Property, Specifier, Value};

/// Kinds of spec that matter.
const ATTRIBUTE: u32 = 1;
const PRIM: u32 = 6;
const VARIANT: u32 = 10;

/// What the tables say about a path.
#[derive(Clone, Copy)]
struct Spec {
    fields: u32,
    kind: u32,
}

struct Builder<'a> {
    file: &'a Crate<'a>,
    fields: &'a [(u32, u64)],
    field_sets: &'a [u32],
    specs: Vec<Option<Spec>>,
    /// Paths below each path.
    children: BTreeMap<u32, Vec<u32>>,
}

/// The root of all prims.
pub(super) fn build(
    file: &Crate,
    fields: &[(u32, u64)],
    field_sets: &[u32],
    specs: &[[u32; 3]],
) -> Result<Prim> {
    let mut builder = Builder {
        file,
        fields,
        field_sets,
        specs: vec![None; file.paths.len()],
        children: BTreeMap::new(),
    };
    for &[path, fields, kind] in specs {
        let Some(place) = builder.specs.get_mut(path as usize) else {
            return Err(Error::invalid(format!("a spec has path {path}"), 0));
        };
        if place.replace(Spec { fields, kind }).is_some() {
            return Err(Error::invalid(format!("path {path} has two specs"), 0));
        }
        let path_of = &file.paths[path as usize];
        if let (ATTRIBUTE | PRIM | VARIANT, Some(parent)) = (kind, path_of.parent) {
            builder.children.entry(parent).or_default().push(path);
        }
    }
    let root = (0u32..)
        .zip(&file.paths)
        .find(|(_, path)| path.is_known && path.parent.is_none());
    let mut prim = Prim::default();
    if let Some((root, _)) = root {
        builder.fill(root, &mut prim, 0)?;
    }
    Ok(prim)
}

impl Builder<'_> {
    /// Names and values of the fields of `path`.
    fn fields(&self, path: u32) -> Result<Vec<(&str, u64)>> {
        let Some(spec) = self.specs[path as usize] else {
            return Ok(Vec::new());
        };
        let Some(set) = self.field_sets.get(spec.fields as usize..) else {
            let what = format!("path {path} has field set {}", spec.fields);
            return Err(Error::invalid(what, 0));
        };
        let ends = |ix: &&u32| **ix != u32::MAX;
        let set = set.iter().take_while(ends);
        let mut fields = Vec::new();
        for &ix in set {
            let Some(&(name, value)) = self.fields.get(ix as usize) else {
                return Err(Error::invalid(format!("field {ix}"), 0));
            };
            let name = self.file.token(name)?;
            // It is copied.
            self.file.bytes.spend(1, 32 + name.len() as u64, 0)?;
            fields.push((name, value));
        }
        Ok(fields)
    }

    /// What the file has about `path` and below it.
    fn fill(&self, path: u32, prim: &mut Prim, depth: usize) -> Result<()> {
        if depth > MAX_DEPTH {
            let what = format!("more than {MAX_DEPTH} prims within prims");
            return Err(Error::invalid(what, 0));
        }
        let mut order = Vec::new();
        for (name, rep) in self.fields(path)? {
            let value = Value::Rep(rep);
            match name {
                "specifier" => {
                    prim.specifier = match rep & 0xff {
                        0 => Specifier::Def,
                        2 => Specifier::Class,
                        _ => Specifier::Over,
                    }
                }
                "typeName" => prim.type_name = self.file.strings(rep)?.pop().unwrap_or_default(),
                "primChildren" => order = self.file.strings(rep)?,
                "properties" => {}
                "variantSelection" => prim.choices.push(value),
                _ => {
                    prim.fields.insert(name.to_owned(), value);
                }
            }
        }
        let below = self.children.get(&path).map_or(&[][..], Vec::as_slice);
        for &child in below {
            let kind = self.specs[child as usize].map(|spec| spec.kind);
            let name = self.file.token(self.file.paths[child as usize].token)?;
            // Any number of prims can share a long one.
            self.file.bytes.spend(2, 32 + name.len() as u64, 0)?;
            let mut below = Prim {
                name: name.to_owned(),
                ..Prim::default()
            };
            match kind {
                Some(ATTRIBUTE) => {
                    prim.properties
                        .insert(name.to_owned(), self.property(child)?);
                }
                Some(VARIANT) => {
                    let chosen = name
                        .strip_prefix('{')
                        .and_then(|name| name.strip_suffix('}'));
                    let (set, variant) = chosen
                        .and_then(|name| name.split_once('='))
                        .unwrap_or_default();
                    below.name = variant.to_owned();
                    self.fill(child, &mut below, depth + 1)?;
                    prim.variants.entry(set.to_owned()).or_default().push(below);
                }
                _ => {
                    self.fill(child, &mut below, depth + 1)?;
                    prim.children.push(below);
                }
            }
        }
        let places = order.into_iter().zip(0usize..);
        let places: BTreeMap<String, usize> = places.collect();
        prim.children
            .sort_by_key(|child| places.get(&child.name).copied().unwrap_or(usize::MAX));
        Ok(())
    }

    fn property(&self, path: u32) -> Result<Property> {
        let mut property = Property::default();
        for (name, rep) in self.fields(path)? {
            match name {
                "typeName" => {
                    property.type_name = self.file.strings(rep)?.pop().unwrap_or_default()
                }
                "default" => property.default = Some(Value::Rep(rep)),
                "timeSamples" => property.samples = self.file.samples(rep)?,
                "interpolation" | "elementSize" => {
                    property.fields.insert(name.to_owned(), Value::Rep(rep));
                }
                _ => {}
            }
        }
        Ok(property)
    }
}
