//! OpenEXR maps: scan lines or tiles, the largest level of mip and rip maps, every compression
//! that the `exr` crate decodes.

use std::io::Cursor;

use exr::block::reader::ChunksReader;
use exr::block::{UncompressedBlock, chunk::Chunk};
use exr::meta::attribute::{
    ChannelDescription, Chromaticities, EnvironmentMap, LevelMode, SampleType,
};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use rayon::prelude::*;

use super::map::{Map, MapSource, check_size};
use super::primaries::{Primaries, convert};
use super::quiet::quietly;

/// First bytes of every OpenEXR file.
pub(crate) const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Chunks that are decompressed at once: bounds the memory of decompressed blocks.
const BATCH: usize = 64;

/// Most channels of the part that is read: a block holds all of them while it is decoded.
const MAX_CHANNELS: usize = 64;

/// Decodes a whole file.
///
/// The first part (layer) with colour is read: channels named `R`, `G`, `B` or `Y`, also with a
/// layer name before them (`diffuse.R`). The map is the data window, as the OpenEXR library
/// defines for `latlong`. Chromaticities are converted to Rec.709. Refused by name: deep data,
/// cube maps, subsampled luminance/chroma, compressions that `exr` cannot decode.
///
/// # Errors
/// What is wrong, in one line.
pub(super) fn decode(bytes: &[u8], hash: String) -> Result<Map, String> {
    quietly(|| decode_unguarded(bytes, hash))
}

fn decode_unguarded(bytes: &[u8], hash: String) -> Result<Map, String> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(bad)?;
    let (layer, channels) = choose_layer(reader.headers())?;
    let header = &reader.headers()[layer];
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    check_header(header, bytes.len())?;
    let matrix = match header.shared_attributes.chromaticities {
        Some(chromaticities) => primaries(chromaticities).to_rec_709()?,
        None => None,
    };
    let format = describe(header, &channels);

    let mut chunks = reader
        .filter_chunks(false, |_, tile, block| {
            block.layer == layer && tile.level_index.x() == 0 && tile.level_index.y() == 0
        })
        .map_err(bad)?;
    let mut pixels = vec![[0.0f32; 3]; width * height];
    let mut filled = 0;
    loop {
        let batch: Vec<Chunk> = chunks
            .by_ref()
            .take(BATCH)
            .collect::<Result<_, _>>()
            .map_err(bad)?;
        if batch.is_empty() {
            break;
        }
        let meta_data = chunks.meta_data();
        let blocks: Vec<UncompressedBlock> = batch
            .into_par_iter()
            .map(|chunk| {
                quietly(|| {
                    UncompressedBlock::decompress_chunk(chunk, meta_data, false).map_err(bad)
                })
            })
            .collect::<Result<_, _>>()?;
        for block in blocks {
            filled += insert(&block, meta_data, &channels, width, &mut pixels)?;
        }
    }
    if filled < width * height {
        return Err(format!(
            "the file is incomplete: {} of {} pixels are missing",
            width * height - filled,
            width * height
        ));
    }
    if let Some(matrix) = matrix {
        pixels
            .par_iter_mut()
            .for_each(|pixel| *pixel = convert(&matrix, *pixel));
    }
    Ok(Map::from_decoded(
        width,
        height,
        pixels,
        MapSource { hash, format },
    ))
}

/// What the decoder says, in our words where its own do not help.
pub(crate) fn bad(error: exr::error::Error) -> String {
    use exr::error::Error;
    match error {
        Error::NotSupported(what) => format!("OpenEXR with {what}, which is not supported"),
        Error::Io(error) => format!("not a readable OpenEXR file: {error}"),
        Error::Invalid(what) if what.contains("missing bytes") => {
            "not a readable OpenEXR file: it is truncated, or refers to bytes that are not there"
                .to_owned()
        }
        error => format!("not a readable OpenEXR file: {error}"),
    }
}

/// The channel indices of red, green and blue; the same index three times for luminance.
type Rgb = [usize; 3];

/// The first part that has colour, and where in it.
fn choose_layer(headers: &[Header]) -> Result<(usize, Rgb), String> {
    for (layer, header) in headers.iter().enumerate() {
        if let Some(channels) = find_rgb(&header.channels.list) {
            return Ok((layer, channels));
        }
    }
    let names: Vec<String> = headers
        .iter()
        .flat_map(|header| header.channels.list.iter().map(|c| c.name.to_string()))
        .take(8)
        .collect();
    Err(format!(
        "no channels R, G, B or Y: the file has {}",
        names.join(", ")
    ))
}

/// Finds R, G, B of one layer name, the plain names first; else luminance.
fn find_rgb(channels: &[ChannelDescription]) -> Option<Rgb> {
    let names: Vec<String> = channels
        .iter()
        .map(|channel| channel.name.to_string())
        .collect();
    let find = |name: &str| names.iter().position(|other| other == name);
    // "" first, then the layer names in the order of the file (OpenEXR sorts channels).
    let mut prefixes = vec![""];
    prefixes.extend(names.iter().filter_map(|name| {
        let end = name.rfind('.')? + 1;
        Some(&name[..end])
    }));
    let rgb = prefixes.iter().find_map(|prefix| {
        Some([
            find(&format!("{prefix}R"))?,
            find(&format!("{prefix}G"))?,
            find(&format!("{prefix}B"))?,
        ])
    });
    rgb.or_else(|| {
        let luminance = |prefix: &&str| find(&format!("{prefix}Y"));
        prefixes.iter().find_map(luminance).map(|y| [y; 3])
    })
}

/// Refuses what is no latitude-longitude map before anything is allocated for it.
fn check_header(header: &Header, file_bytes: usize) -> Result<(), String> {
    if header.deep {
        return Err("deep data are not supported".to_owned());
    }
    if header.own_attributes.environment_map == Some(EnvironmentMap::Cube) {
        return Err(
            "a cube map (envmap attribute); only latitude-longitude maps are supported".to_owned(),
        );
    }
    let channels = &header.channels.list;
    if channels.iter().any(|channel| channel.sampling.area() != 1) {
        return Err("subsampled channels (luminance/chroma) are not supported".to_owned());
    }
    if channels.len() > MAX_CHANNELS {
        return Err(format!(
            "{} channels are too many, at most {MAX_CHANNELS}",
            channels.len()
        ));
    }
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    check_size(width, height)?;
    // Deflate shrinks at most 1032:1, and PIZ, B44, DWA less on anything but constants: a header
    // that promises more is lying, and would only buy an allocation.
    if width * height / 2048 > file_bytes {
        return Err(format!(
            "the file is truncated: {file_bytes} bytes cannot hold {width} x {height} pixels"
        ));
    }
    Ok(())
}

/// Copies the colour channels of a block; answers how many pixels it covered.
fn insert(
    block: &UncompressedBlock,
    meta_data: &MetaData,
    channels: &Rgb,
    width: usize,
    pixels: &mut [[f32; 3]],
) -> Result<usize, String> {
    let list = &meta_data.headers[block.index.layer].channels;
    let mut samples = Vec::new();
    let mut covered = 0;
    for line in block.lines(list) {
        let (x, y) = (line.location.position.x(), line.location.position.y());
        let count = line.location.sample_count;
        if !channels.contains(&line.location.channel) {
            continue;
        }
        let row = (x + count <= width)
            .then(|| pixels.get_mut(y * width + x..y * width + x + count))
            .flatten()
            .ok_or_else(|| format!("a block at ({x}, {y}) lies outside the map"))?;
        read_samples(
            line.value,
            list.list[line.location.channel].sample_type,
            &mut samples,
        );
        if samples.len() != count {
            return Err(format!("a row at ({x}, {y}) is too short"));
        }
        for (c, _) in channels
            .iter()
            .enumerate()
            .filter(|(_, channel)| **channel == line.location.channel)
        {
            for (pixel, sample) in row.iter_mut().zip(&samples) {
                pixel[c] = *sample;
            }
            covered += if c == 0 { count } else { 0 };
        }
    }
    Ok(covered)
}

/// Native-endian bytes of one channel's row as f32. Unsigned integers are taken as they are.
pub(crate) fn read_samples(bytes: &[u8], sample_type: SampleType, samples: &mut Vec<f32>) {
    samples.clear();
    match sample_type {
        SampleType::F16 => {
            let (words, _) = bytes.as_chunks::<2>();
            samples.extend(
                words
                    .iter()
                    .map(|word| half::f16::from_ne_bytes(*word).to_f32()),
            );
        }
        SampleType::F32 => {
            let (words, _) = bytes.as_chunks::<4>();
            samples.extend(words.iter().map(|word| f32::from_ne_bytes(*word)));
        }
        SampleType::U32 => {
            let (words, _) = bytes.as_chunks::<4>();
            samples.extend(words.iter().map(|word| u32::from_ne_bytes(*word) as f32));
        }
    }
}

fn primaries(chromaticities: Chromaticities) -> Primaries {
    let xy = |v: exr::math::Vec2<f32>| [f64::from(v.x()), f64::from(v.y())];
    Primaries {
        red: xy(chromaticities.red),
        green: xy(chromaticities.green),
        blue: xy(chromaticities.blue),
        white: xy(chromaticities.white),
    }
}

/// The layout in words.
fn describe(header: &Header, channels: &Rgb) -> String {
    let blocks = match header.blocks {
        BlockDescription::ScanLines => "scan lines",
        BlockDescription::Tiles(tiles) => match tiles.level_mode {
            LevelMode::Singular => "tiles",
            LevelMode::MipMap => "tiles, mip map",
            LevelMode::RipMap => "tiles, rip map",
        },
    };
    let sample = match header.channels.list[channels[0]].sample_type {
        SampleType::F16 => "half",
        SampleType::F32 => "float",
        SampleType::U32 => "uint",
    };
    let kind = if channels[0] == channels[1] {
        "Y"
    } else {
        "RGB"
    };
    format!("OpenEXR, {blocks}, {}, {sample} {kind}", header.compression)
}

#[cfg(test)]
#[path = "exr_map_tests.rs"]
mod tests;
