//! Writing the container: blocks, properties, objects.

use std::collections::HashMap;

use super::murmur::murmur;
use super::ogawa::{HEADER_BYTES, IS_DATA, MAGIC};
use super::pod::Pod;

/// The library whose layout this is: 1.8.12.
const LIBRARY_VERSION: i32 = 10812;

/// A property that is written, for the list of the compound around it.
pub(super) struct Written {
    header: Vec<u8>,
    reference: u64,
}

/// An object that is written, for the list of the one around it.
pub(super) struct WrittenObject {
    name: &'static str,
    metadata: String,
    reference: u64,
}

/// What a property is.
#[derive(Clone)]
pub(super) struct PropertySpec<'s> {
    pub name: &'s str,
    pub pod: Pod,
    /// Values of the type that make one element.
    pub extent: u8,
    pub metadata: String,
    pub is_array: bool,
    /// Index of its sampling.
    pub sampling: u8,
}

/// A file that grows.
pub(super) struct Writer {
    bytes: Vec<u8>,
    /// Texts that headers name by index.
    metadata: Vec<String>,
    /// Samples by hash and length: equal ones are written once.
    samples: HashMap<([u8; 16], usize), u64>,
}

impl Writer {
    pub fn new() -> Self {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([0, 1]);
        bytes.resize(HEADER_BYTES, 0);
        Writer {
            bytes,
            metadata: vec![String::new()],
            samples: HashMap::new(),
        }
    }

    fn data(&mut self, parts: &[&[u8]]) -> u64 {
        let length: usize = parts.iter().map(|part| part.len()).sum();
        if length == 0 {
            return IS_DATA;
        }
        let position = self.bytes.len() as u64;
        self.bytes.extend((length as u64).to_le_bytes());
        for part in parts {
            self.bytes.extend_from_slice(part);
        }
        position | IS_DATA
    }

    fn group(&mut self, children: &[u64]) -> u64 {
        if children.is_empty() {
            return 0;
        }
        let position = self.bytes.len() as u64;
        self.bytes.extend((children.len() as u64).to_le_bytes());
        self.bytes
            .extend(children.iter().flat_map(|child| child.to_le_bytes()));
        position
    }

    /// Index of `metadata`, 255 where it has to stand in place.
    fn metadata_index(&mut self, metadata: &str) -> u8 {
        if let Some(ix) = self.metadata.iter().position(|known| known == metadata) {
            return ix as u8;
        }
        // 255 has a meaning of its own, and lengths in the table are bytes.
        if self.metadata.len() >= 255 || metadata.len() > 255 {
            return 255;
        }
        self.metadata.push(metadata.to_owned());
        (self.metadata.len() - 1) as u8
    }

    fn sample(&mut self, values: &[u8]) -> u64 {
        let hash = murmur(values);
        if let Some(known) = self.samples.get(&(hash, values.len())) {
            return *known;
        }
        let reference = self.data(&[&hash, values]);
        self.samples.insert((hash, values.len()), reference);
        reference
    }

    /// A property of `samples`: values, and of texts how many.
    pub fn property(
        &mut self,
        spec: &PropertySpec<'_>,
        samples: impl Iterator<Item = (Vec<u8>, usize)>,
    ) -> Written {
        let mut children = Vec::new();
        let (mut n, mut is_constant, mut all_single) = (0u32, true, true);
        let (mut is_homogenous, mut length) = (true, None);
        for (values, n_texts) in samples {
            let sample = self.sample(&values);
            is_constant &= children.first().is_none_or(|first| *first == sample);
            let n_values = match spec.pod.is_text() {
                true => n_texts,
                false => values.len() / (spec.pod.bytes() * usize::from(spec.extent)),
            };
            all_single &= n_values == 1;
            is_homogenous &= length.is_none_or(|length| length == n_values);
            length = Some(n_values);
            children.push(sample);
            if spec.is_array {
                let dimensions = match spec.pod.is_text() {
                    true => self.data(&[&(n_texts as u64).to_le_bytes()]),
                    false => IS_DATA,
                };
                children.push(dimensions);
            }
            n += 1;
        }
        if is_constant {
            children.truncate(if spec.is_array { 2 } else { 1 });
        }
        let reference = self.group(&children);
        let metadata = self.metadata_index(&spec.metadata);
        let longest = [n as usize, spec.name.len(), spec.metadata.len()];
        let width = match longest.into_iter().max() {
            Some(..256) => 0u32,
            Some(..65536) => 1,
            _ => 2,
        };
        let kind = match (spec.is_array, all_single) {
            (false, _) => 1,
            (true, false) => 2,
            (true, true) => 3,
        };
        let flag = |is_set: bool, bit: u32| u32::from(is_set) << bit;
        let info = kind
            | (width << 2)
            | (spec.pod.code() << 4)
            | flag(spec.sampling > 0, 8)
            | flag(is_homogenous, 10)
            | flag(is_constant, 11)
            | (u32::from(spec.extent) << 12)
            | (u32::from(metadata) << 20);
        let mut header = info.to_le_bytes().to_vec();
        let number = |header: &mut Vec<u8>, x: usize| {
            header.extend(&(x as u32).to_le_bytes()[..1 << width]);
        };
        number(&mut header, n as usize);
        if spec.sampling > 0 {
            number(&mut header, usize::from(spec.sampling));
        }
        number(&mut header, spec.name.len());
        header.extend_from_slice(spec.name.as_bytes());
        if metadata == 255 {
            number(&mut header, spec.metadata.len());
            header.extend_from_slice(spec.metadata.as_bytes());
        }
        Written { header, reference }
    }

    fn list(&mut self, properties: &[Written]) -> u64 {
        if properties.is_empty() {
            return 0;
        }
        let mut children: Vec<u64> = properties.iter().map(|each| each.reference).collect();
        let headers: Vec<&[u8]> = properties.iter().map(|each| &*each.header).collect();
        children.push(self.data(&headers));
        self.group(&children)
    }

    /// A property of properties.
    pub fn compound(&mut self, name: &str, metadata: &str, properties: &[Written]) -> Written {
        let reference = self.list(properties);
        let ix = self.metadata_index(metadata);
        let mut header = (u32::from(ix) << 20).to_le_bytes().to_vec();
        header.push(name.len() as u8);
        header.extend_from_slice(name.as_bytes());
        Written { header, reference }
    }

    /// An object.
    pub fn object(
        &mut self,
        name: &'static str,
        metadata: String,
        properties: &[Written],
        children: &[WrittenObject],
    ) -> WrittenObject {
        let mut list = vec![self.list(properties)];
        let mut headers = Vec::new();
        for child in children {
            list.push(child.reference);
            headers.extend((child.name.len() as u32).to_le_bytes());
            headers.extend_from_slice(child.name.as_bytes());
            let ix = self.metadata_index(&child.metadata);
            headers.push(ix);
            if ix == 255 {
                headers.extend((child.metadata.len() as u32).to_le_bytes());
                headers.extend_from_slice(child.metadata.as_bytes());
            }
        }
        // Hashes of properties and children, by which readers only tell objects apart.
        let of_properties: Vec<u8> = properties
            .iter()
            .flat_map(|each| [&each.header[..], &each.reference.to_le_bytes()].concat())
            .collect();
        let hashes = [murmur(&of_properties), murmur(&headers)].concat();
        list.push(self.data(&[&headers, &hashes]));
        WrittenObject {
            name,
            metadata,
            reference: self.group(&list),
        }
    }

    /// The file, with the time samplings `(number of samples, seconds between them)`.
    pub fn finish(mut self, top: &WrittenObject, samplings: &[(u32, f64)]) -> Vec<u8> {
        let mut times = Vec::new();
        for (n, step) in samplings {
            times.extend(n.to_le_bytes());
            times.extend(step.to_le_bytes());
            times.extend(1u32.to_le_bytes());
            times.extend(0f64.to_le_bytes());
        }
        let mut metadata = Vec::new();
        for text in &self.metadata[1..] {
            metadata.push(text.len() as u8);
            metadata.extend_from_slice(text.as_bytes());
        }
        let children = [
            self.data(&[&0i32.to_le_bytes()]),
            self.data(&[&LIBRARY_VERSION.to_le_bytes()]),
            top.reference,
            self.data(&[b"_ai_Application=Strandlight"]),
            self.data(&[&times]),
            self.data(&[&metadata]),
        ];
        let root = self.group(&children);
        self.bytes[8..16].copy_from_slice(&root.to_le_bytes());
        self.bytes
    }
}
