//! Parameters: arrays that have a scope, with or without indices.

use std::collections::HashMap;

use super::archive::{Archive, Kind, Property, metadata_value};
use super::pod::Values;
use crate::counted::counted;
use crate::curves::Interpolation;
use crate::error::{Error, Result};

/// The values of a parameter at one point in time.
pub(super) struct Param<'a> {
    /// Name in the file.
    pub name: &'a str,
    /// What its scope says there is one value for; often wrong.
    pub label: Option<Interpolation>,
    /// Numbers per value.
    pub components: usize,
    pub values: Values<'a>,
    /// Which value each element has; `None`: one each.
    indices: Option<Vec<u32>>,
}

/// What the scope in `metadata` stands for.
fn label(metadata: &str) -> Option<Interpolation> {
    Some(match metadata_value(metadata, "geoScope")? {
        "con" => Interpolation::Constant,
        "uni" => Interpolation::Uniform,
        "var" => Interpolation::Varying,
        "vtx" | "fvr" => Interpolation::Vertex,
        _ => return None,
    })
}

impl<'a> Param<'a> {
    /// The parameter `property` of the object called `path` at `time`, seconds; `None` for a
    /// compound that is none.
    pub fn read(
        archive: &Archive<'a>,
        property: &Property<'a>,
        time: f64,
        path: &str,
    ) -> Result<Option<Self>> {
        let parts = archive.compound(Some(property), path)?;
        let (array, indices) = match property.kind {
            Kind::Compound => (parts.get(".vals"), parts.get(".indices")),
            _ => (Some(property), None),
        };
        let Some(array) = array.filter(|array| array.kind != Kind::Compound) else {
            return Ok(None);
        };
        let values = archive.values_at(array, time, path)?;
        let extent = usize::from(array.extent).max(1);
        let times = metadata_value(property.metadata, "arrayExtent");
        let times = times.and_then(|text| text.parse::<u8>().ok()).unwrap_or(1);
        let whole = extent * usize::from(times).max(1);
        let components = match values.pod.is_text() || values.len() % whole == 0 {
            true => whole,
            false => extent,
        };
        let mut param = Param {
            name: property.name,
            label: label(property.metadata).or_else(|| label(array.metadata)),
            components,
            values,
            indices: None,
        };
        if values.len() % components != 0 && !values.pod.is_text() {
            let n = values.len();
            return Err(param.invalid(path, format!("has {n} numbers for {components} a value")));
        }
        if let Some(indices) = indices {
            let indices = archive.values_at(indices, time, path)?;
            if !indices.pod.is_integer() {
                return Err(param.invalid(path, "has indices that are no integers".to_owned()));
            }
            archive
                .ogawa
                .spend(4 * indices.len() as u64, indices.offset)?;
            // What does not fit is beyond the end of any array.
            let narrow = indices.doubles().map(|ix| match (0.0..4e9).contains(&ix) {
                true => ix as u32,
                false => u32::MAX,
            });
            param.indices = Some(narrow.collect());
        }
        Ok(Some(param))
    }

    /// Number of elements; not of texts.
    pub fn len(&self) -> usize {
        let n_values = self.values.len() / self.components;
        self.indices.as_ref().map_or(n_values, Vec::len)
    }

    fn invalid(&self, path: &str, fault: String) -> Error {
        let what = format!("parameter {:?} of {path:?} {fault}", self.name);
        Error::invalid(what, self.values.offset)
    }

    fn beyond(&self, path: &str, element: usize, ix: usize, n: usize) -> Error {
        self.invalid(
            path,
            format!(
                "has index {ix} at {element}, and {}",
                counted(n, "value", "values")
            ),
        )
    }

    /// The first `components` numbers of all elements.
    pub fn doubles(
        &self,
        archive: &Archive<'a>,
        components: usize,
        path: &str,
    ) -> Result<Vec<f64>> {
        let n_values = self.values.len() / self.components;
        let n = self.len() * components;
        archive.ogawa.spend(8 * n as u64, self.values.offset)?;
        let mut doubles = Vec::with_capacity(n);
        for element in 0..self.len() {
            let ix = self
                .indices
                .as_ref()
                .map_or(element, |all| all[element] as usize);
            if ix >= n_values {
                return Err(self.beyond(path, element, ix, n_values));
            }
            let first = ix * self.components;
            doubles.extend((first..first + components).map(|ix| self.values.double(ix)));
        }
        Ok(doubles)
    }

    /// Texts, none twice, and which of them each element has.
    pub fn texts(&self, archive: &Archive<'a>, path: &str) -> Result<(Vec<String>, Vec<u32>)> {
        // A text of one letter takes as much in memory.
        archive
            .ogawa
            .spend(48 * self.values.bytes.len() as u64, self.values.offset)?;
        let mut known: HashMap<String, u32> = HashMap::new();
        let mut table = Vec::new();
        let mut of_value = Vec::new();
        for text in self.values.texts() {
            let next = table.len() as u32;
            let ix = *known.entry(text).or_insert_with_key(|text| {
                table.push(text.clone());
                next
            });
            of_value.push(ix);
        }
        let Some(indices) = &self.indices else {
            return Ok((table, of_value));
        };
        let mut elements = Vec::with_capacity(indices.len());
        for (element, &ix) in indices.iter().enumerate() {
            let value = of_value.get(ix as usize).copied();
            elements.push(
                value.ok_or_else(|| self.beyond(path, element, ix as usize, of_value.len()))?,
            );
        }
        Ok((table, elements))
    }
}
