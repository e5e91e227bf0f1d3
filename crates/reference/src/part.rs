//! Parts of a reference picture, drawn apart and merged.
//!
//! A part is a [`ReferenceFile`] of consecutive samples of a picture, `samples_of_part` of them, and
//! may be looked at like one. It has, beside, channels `behind.R`, `.G`, `.B` and `.A`, f32, of what
//! stands behind the hair; all its sums; and attributes `strandlight/part` (which of how many, as
//! `0/3`), `strandlight/first-sample` and `strandlight/all-samples` (of the whole picture).

use std::ops::Range;

use exr::prelude::FlatSamples;
use strandlight_images::catch_decoder_panic;
use strandlight_images::exr_file::{Channel, floats};
use strandlight_scene::budget::check_target;
use strandlight_scene::provenance::Provenance;

use super::Method;
use super::backdrop::Backdrop;
use super::decode::{
    CHECKSUM, SAMPLES, attributes_of, film_of, header_of, need, number_of, size_of, text_of,
};
use super::exact::all_sums;
use super::file::{INPUTS, METHOD, PART, ReferenceFile, SEED, blamed};
use super::file_error::FileError;
use super::spans::samples_of_part;

const FIRST: &str = "first-sample";
const ALL: &str = "all-samples";
/// Attributes that differ between the parts of a picture.
const OWN: [&str; 4] = [PART, FIRST, SAMPLES, CHECKSUM];

/// Which part of a picture, and of which picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartInfo {
    /// From 0 to `count - 1`.
    pub index: u32,
    /// How many parts the picture has.
    pub count: u32,
    /// Samples a pixel of the whole picture.
    pub n_samples: u32,
    size: [u32; 2],
    /// Attributes that all parts of a picture share.
    shared: Vec<(String, String)>,
}

/// A part of a reference picture, with what its whole needs.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferencePart {
    /// Its samples, those of [`samples_of_part`].
    pub file: ReferenceFile,
    /// What stands behind the hair.
    pub backdrop: Backdrop,
    /// From 0 to `count - 1`.
    pub index: u32,
    /// How many parts the picture has.
    pub count: u32,
    /// Samples a pixel of the whole picture.
    pub n_samples: u32,
}

/// Why parts make no picture. Parts are numbered in the order in which they were given.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PartsError {
    /// A part of another picture than the first one given.
    #[error("cannot be merged with part 0: {source}")]
    Other {
        /// The part.
        part: usize,
        /// What differs.
        source: FileError,
    },
    /// A part that is there twice.
    #[error("is part {index}/{count} once more")]
    Doubled {
        /// The second.
        part: usize,
        /// The first.
        before: usize,
        /// Which part of the picture.
        index: u32,
        /// Of how many.
        count: u32,
    },
    /// Parts that are not there.
    #[error("missing of {count} parts: {}", names(missing, *count))]
    Missing {
        /// The first of them, a few at most.
        missing: Vec<u32>,
        /// How many parts the picture has.
        count: u32,
    },
}

fn names(missing: &[u32], count: u32) -> String {
    let names = missing.iter().map(|index| format!("{index}/{count}"));
    names.collect::<Vec<_>>().join(", ")
}

/// Most missing parts that are named.
const MOST_NAMED: usize = 8;

impl PartInfo {
    /// What the header of a file says.
    ///
    /// # Errors
    /// A file that is no part of a reference picture.
    pub fn read(bytes: &[u8]) -> Result<PartInfo, FileError> {
        catch_decoder_panic(|| {
            let header = &header_of(bytes)?;
            // Another picture has no such attribute.
            need(header, METHOD)?;
            let part = text_of(header, PART).ok_or(FileError::NotAPart("it is a whole one"))?;
            need(header, CHECKSUM)?;
            let number = |text: &str| text.parse::<u32>().ok();
            let parsed = part.split_once('/');
            let parsed = parsed.and_then(|(index, count)| Some((number(index)?, number(count)?)));
            let (index, count) = parsed
                .filter(|(index, count)| index < count)
                .ok_or(FileError::NotAPart("it does not say which"))?;
            let size = size_of(header).map(|side| u32::try_from(side).unwrap_or(u32::MAX));
            check_target(size).map_err(|_| FileError::NotAPart("its size is out of range"))?;
            let mut shared = attributes_of(header);
            shared.retain(|(name, _)| !OWN.contains(&&**name));
            let info = PartInfo {
                index,
                count,
                n_samples: number_of(header, ALL)?,
                size,
                shared,
            };
            let samples = info.samples();
            let found = [number_of(header, FIRST)?, number_of(header, SAMPLES)?];
            match found == [samples.start, samples.end - samples.start] {
                true => Ok(info),
                false => Err(FileError::NotAPart("its samples are others")),
            }
        })
    }

    /// Numbers of its samples.
    pub fn samples(&self) -> Range<u32> {
        samples_of_part(self.index, self.count, self.n_samples)
    }

    fn shared(&self, name: &str) -> Option<&str> {
        let found = self.shared.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| &**value)
    }

    /// Whether this part is of the same picture as `first`.
    fn check_beside(&self, first: &PartInfo) -> Result<(), FileError> {
        let check = |what, found: String, expected: String| match found == expected {
            true => Ok(()),
            false => Err(FileError::Other {
                what,
                found,
                expected,
            }),
        };
        let text = |value: Option<&str>| value.unwrap_or("none").to_owned();
        let shape = |[width, height]: [u32; 2]| format!("{width}x{height}");
        let [count, n_samples] = [[self.count, first.count], [self.n_samples, first.n_samples]]
            .map(|both| both.map(|number| number.to_string()));
        let [found, expected] = count;
        check("number of parts is", found, expected)?;
        let [found, expected] = n_samples;
        check("number of samples in all is", found, expected)?;
        check("size is", shape(self.size), shape(first.size))?;
        // That of both, or else it is what differs.
        let method = self.shared(METHOD).unwrap_or_default();
        let blamed = blamed(method).map(|(name, what)| {
            let name = name.strip_prefix("strandlight/").unwrap_or(name);
            (name, what)
        });
        let named = [
            (METHOD, "method is"),
            (SEED, "seed is"),
            ("version", "program is"),
        ];
        for (name, what) in named.into_iter().chain(blamed) {
            check(what, text(self.shared(name)), text(first.shared(name)))?;
        }
        match self.shared == first.shared {
            true => Ok(()),
            false => Err(FileError::OtherInputs),
        }
    }
}

/// The order in which `parts`, in any order, are to be appended to one another.
///
/// # Errors
/// A part of another picture, a part that is there twice or not at all.
pub fn order_of_parts(parts: &[PartInfo]) -> Result<Vec<usize>, PartsError> {
    let count = parts.first().map_or(1, |first| first.count);
    for (part, info) in parts.iter().enumerate() {
        info.check_beside(&parts[0])
            .map_err(|source| PartsError::Other { part, source })?;
    }
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by_key(|&part| parts[part].index);
    for pair in order.windows(2) {
        if parts[pair[0]].index == parts[pair[1]].index {
            return Err(PartsError::Doubled {
                part: pair[1],
                before: pair[0],
                index: parts[pair[0]].index,
                count,
            });
        }
    }
    let is_there = |index: &u32| {
        order
            .binary_search_by_key(index, |&ix| parts[ix].index)
            .is_ok()
    };
    let missing = (0..count).filter(|index| !is_there(index));
    let missing: Vec<u32> = missing.take(MOST_NAMED).collect();
    match missing.is_empty() {
        true => Ok(order),
        false => Err(PartsError::Missing { missing, count }),
    }
}

impl ReferencePart {
    /// The file's bytes.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn encode(&self) -> Result<Vec<u8>, FileError> {
        let (file, behind) = (&self.file, &self.backdrop.behind);
        let mut channels = file.layers(&self.backdrop);
        channels.extend(all_sums(&file.film, self.backdrop.has_proxies));
        for (c, name) in BEHIND.into_iter().enumerate() {
            let value = |behind: &Option<[f32; 3]>| match (behind, c) {
                (Some(rgb), 0..3) => rgb[c],
                (Some(_), _) => 1.0,
                (None, _) => 0.0,
            };
            channels.push(floats(name, behind.iter().map(value).collect()));
        }
        let provenance = file.provenance.clone();
        let provenance = provenance
            .with(PART, format_args!("{}/{}", self.index, self.count))
            .with(FIRST, file.film.first)
            .with(ALL, self.n_samples);
        file.encode_channels(channels, provenance)
    }

    /// Reads a part that [`PartInfo::read`] has read before.
    ///
    /// # Errors
    /// What is damaged, or not as `info` says.
    pub fn decode(bytes: &[u8], info: &PartInfo) -> Result<ReferencePart, FileError> {
        if PartInfo::read(bytes)? != *info {
            return Err(FileError::OtherInputs);
        }
        catch_decoder_panic(|| {
            let header = &header_of(bytes)?;
            let samples = info.samples();
            let range = [samples.start, samples.end - samples.start];
            let (film, channels) = film_of(bytes, header, info.size, range)?;
            let missing = |what: &str| FileError::Missing(what.to_owned());
            let method = need(header, METHOD)?;
            let mut methods = [Method::Path, Method::RayShoot, Method::Directional].into_iter();
            let method = methods.find(|known| known.name() == method);
            let own = [METHOD, INPUTS, SEED, ALL];
            let others = info.shared.iter();
            let others = others.filter(|(name, _)| !own.contains(&&**name));
            let provenance = others.fold(Provenance::default(), |provenance, (name, value)| {
                provenance.with(name, value)
            });
            let backdrop = Backdrop {
                behind: behind_of(&channels, film.n_pixels())?,
                has_proxies: channels.iter().any(|(name, _)| name == "proxies.Y"),
            };
            Ok(ReferencePart {
                file: ReferenceFile {
                    method: method.ok_or_else(|| missing(METHOD))?,
                    inputs: need(header, INPUTS)?,
                    seed: need(header, SEED)?.parse().map_err(|_| missing(SEED))?,
                    provenance,
                    film,
                },
                backdrop,
                index: info.index,
                count: info.count,
                n_samples: info.n_samples,
            })
        })
    }

    /// Adds the samples of the part that comes next. After the last one `file` is the picture.
    ///
    /// # Errors
    /// A part that is not the next of the same picture.
    pub fn append(&mut self, next: &ReferencePart) -> Result<(), FileError> {
        let film = &self.file.film;
        let is_next = film.first + film.n_samples == next.file.film.first;
        if self.backdrop != next.backdrop || film.size != next.file.film.size || !is_next {
            return Err(FileError::OtherInputs);
        }
        self.file.film.append(&next.file.film);
        Ok(())
    }
}

/// Channels of what stands behind the hair.
const BEHIND: [&str; 4] = ["behind.R", "behind.G", "behind.B", "behind.A"];

fn behind_of(channels: &[Channel], n_pixels: usize) -> Result<Vec<Option<[f32; 3]>>, FileError> {
    let channel = |name: &str| {
        let found = channels.iter().find(|(known, _)| known == name);
        match found.map(|(_, samples)| samples) {
            Some(FlatSamples::F32(values)) if values.len() == n_pixels => Ok(values),
            _ => Err(FileError::Missing(name.to_owned())),
        }
    };
    let [r, g, b, a] = BEHIND.map(channel);
    let (r, g, b, a) = (r?, g?, b?, a?);
    let at = |ix: usize| (a[ix] > 0.0).then(|| [r[ix], g[ix], b[ix]]);
    Ok((0..n_pixels).map(at).collect())
}
