//! Reading of OpenEXR files that hold samples.

use std::io::Cursor;

use exr::meta::header::Header;
use exr::prelude::{AttributeValue, FlatSamples, ReadChannels, ReadLayers, Text, read};
use strandlight_formats::content_hash;
use strandlight_images::exr_file::Channel;

use super::camera::MAX_TRUTH_SAMPLES;
use super::exact::{has_all_sums, most_channels, read_all_sums, read_bits};
use super::file_error::FileError;
use super::film::Film;
use super::spans::spans_of;
use super::stored::Stored;

/// What the names of all attributes start with.
const PREFIX: &str = "strandlight/";
/// Attribute with the hash of the content.
pub(super) const CHECKSUM: &str = "checksum";
/// Attribute with the number of samples a pixel.
pub(super) const SAMPLES: &str = "samples";

/// Most channels beside those of [`most_channels`].
const OTHER_CHANNELS: usize = 64;
/// Bytes that one compressed byte may stand for: Deflate's limit is 1032.
const MOST_COMPRESSED: u64 = 1100;

/// The header of a file, read and checked by itself.
pub(super) fn header_of(bytes: &[u8]) -> Result<Header, FileError> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(FileError::OpenExr)?;
    let header = reader.headers().first().cloned();
    header.ok_or_else(|| FileError::Missing("layer".to_owned()))
}

/// The text of an attribute, in files of 0.1.0 by the name that it had there.
pub(super) fn text_of(header: &Header, name: &str) -> Option<String> {
    let first = name.get(..1)?.to_uppercase();
    let names = [
        format!("{PREFIX}{name}"),
        format!("strandlight{first}{}", &name[1..]),
    ];
    names.into_iter().find_map(
        |name| match header.own_attributes.other.get(&Text::from(&*name)) {
            Some(AttributeValue::Text(text)) => Some(text.to_string()),
            _ => None,
        },
    )
}

/// The text of an attribute.
///
/// # Errors
/// There is none.
pub(super) fn need(header: &Header, name: &str) -> Result<String, FileError> {
    text_of(header, name).ok_or_else(|| FileError::Missing(name.to_owned()))
}

/// All attributes of ours, by name without [`PREFIX`], in the order of their names.
pub(super) fn attributes_of(header: &Header) -> Vec<(String, String)> {
    let other = header.own_attributes.other.iter();
    let ours = other.filter_map(|(name, value)| {
        let name = name.to_string().strip_prefix(PREFIX)?.to_owned();
        match value {
            AttributeValue::Text(text) => Some((name, text.to_string())),
            _ => None,
        }
    });
    let mut ours: Vec<(String, String)> = ours.collect();
    ours.sort_unstable();
    ours
}

/// Width and height.
pub(super) fn size_of(header: &Header) -> [usize; 2] {
    [header.layer_size.width(), header.layer_size.height()]
}

/// The number that an attribute is, at most [`MAX_TRUTH_SAMPLES`].
///
/// # Errors
/// There is none such.
pub(super) fn number_of(header: &Header, name: &str) -> Result<u32, FileError> {
    let number = need(header, name)?.parse().ok();
    let number = number.filter(|n| (0..=MAX_TRUTH_SAMPLES).contains(n));
    number.ok_or_else(|| FileError::Missing(name.to_owned()))
}

/// Hash of what a file holds: its channels, and its attributes by name without prefix.
pub(super) fn checksum(channels: &[Channel], attributes: &[(String, String)]) -> String {
    let channel = |(name, samples): &Channel| {
        let (kind, bytes): (_, &[u8]) = match samples {
            FlatSamples::F32(values) => ("f32", bytemuck::cast_slice(values)),
            FlatSamples::U32(values) => ("u32", bytemuck::cast_slice(values)),
            // None that we write.
            FlatSamples::F16(_) => ("f16", &[]),
        };
        format!("{name} {kind} {}", content_hash(bytes))
    };
    let mut lines: Vec<String> = channels.iter().map(channel).collect();
    let attributes = attributes.iter().filter(|(name, _)| name != CHECKSUM);
    lines.extend(attributes.map(|(name, value)| format!("{name} = {value:?}")));
    lines.sort_unstable();
    content_hash(lines.join("\n").as_bytes())
}

/// The samples of a file: `n_samples` from number `first` on, of a picture of `size`, which its
/// header promises; and all of its channels.
///
/// # Errors
/// What is damaged or missing.
pub(super) fn film_of(
    bytes: &[u8],
    header: &Header,
    size: [u32; 2],
    [first, n_samples]: [u32; 2],
) -> Result<(Film, Vec<Channel>), FileError> {
    let mut film = Film::from_sample(size, first);
    film.n_samples = n_samples;
    film.spans = spans_of(first..first + n_samples);
    let n_channels = header.channels.list.len();
    let n_bytes = 4 * n_channels as u64 * film.n_pixels() as u64;
    if n_channels > OTHER_CHANNELS + most_channels(film.spans.len())
        || n_bytes / MOST_COMPRESSED > bytes.len() as u64
    {
        return Err(FileError::Missing("such channels".to_owned()));
    }
    let channels = channels_of(bytes)?;
    let checked = text_of(header, CHECKSUM);
    if checked.is_some_and(|found| found != checksum(&channels, &attributes_of(header))) {
        return Err(FileError::Checksum);
    }
    if n_samples > 0 {
        let stored = Stored::of(&channels, f64::from(n_samples), film.n_pixels())?;
        match has_all_sums(&channels) {
            true => read_all_sums(&mut film, &channels, stored.has_proxies())?,
            false => read_bits(&mut film, &channels, &stored),
        }
    }
    match film.sums.iter().all(|pixel| pixel.is_finite()) {
        true => Ok((film, channels)),
        false => Err(FileError::NotFinite),
    }
}

fn channels_of(bytes: &[u8]) -> Result<Vec<Channel>, FileError> {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(FileError::OpenExr)?;
    let channels = image.layer_data.channel_data.list.into_iter();
    let channels = channels.map(|channel| (channel.name.to_string(), channel.sample_data));
    Ok(channels.collect())
}
