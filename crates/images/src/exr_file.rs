//! Writing OpenEXR files: every one of this crate is encoded here, so that equal content gives
//! equal bytes, whatever the number of threads.

use std::io::Cursor;

use exr::error::{Error, Result};
use exr::image::write::channels::WritableChannels;
use exr::meta::attribute::EnvironmentMap;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    LineOrder, SmallVec, Text, WritableImage,
};

/// A channel: its name, and its samples in rows, top first.
pub type Channel = (String, FlatSamples);

/// A channel of floats.
pub fn floats(name: impl Into<String>, values: Vec<f32>) -> Channel {
    (name.into(), FlatSamples::F32(values))
}

/// A lossless file of one part: scan lines, ZIP; `attributes` are names and texts for its header.
///
/// # Errors
/// What the encoder says.
pub fn encode(
    size: (usize, usize),
    channels: Vec<Channel>,
    attributes: &[(String, String)],
) -> Result<Vec<u8>> {
    let mut header = LayerAttributes::default();
    for (name, value) in attributes {
        let value = AttributeValue::Text(Text::from(&**value));
        header.other.insert(Text::from(&**name), value);
    }
    encode_with(size, channels, header)
}

/// As [`encode`], an environment map: the header has `envmap`, latitude-longitude.
///
/// # Errors
/// What the encoder says.
pub fn encode_map(size: (usize, usize), channels: Vec<Channel>) -> Result<Vec<u8>> {
    let header = LayerAttributes {
        environment_map: Some(EnvironmentMap::LatitudeLongitude),
        ..LayerAttributes::default()
    };
    encode_with(size, channels, header)
}

fn encode_with(
    (width, height): (usize, usize),
    channels: Vec<Channel>,
    header: LayerAttributes,
) -> Result<Vec<u8>> {
    let list: SmallVec<[_; 4]> = channels
        .into_iter()
        .map(|(name, samples)| AnyChannel::new(&*name, samples))
        .collect();
    let layer = Layer::new(
        (width, height),
        header,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(list),
    );
    encode_layer(layer)
}

/// A file of `layer` alone, of any channels.
///
/// # Errors
/// What the encoder says.
pub fn encode_layer<C>(layer: Layer<C>) -> Result<Vec<u8>>
where
    C: for<'a> WritableChannels<'a>,
{
    let n_attributes = layer.attributes.other.len();
    // Threads hand in blocks as they finish; only an order that the file asks for puts them right.
    let is_ordered = layer.encoding.line_order != LineOrder::Unspecified;
    let image = Image::from_layer(layer);
    let mut bytes = Cursor::new(Vec::new());
    match is_ordered && rayon::current_num_threads() > 1 {
        true => image.write().to_buffered(&mut bytes)?,
        false => image.write().non_parallel().to_buffered(&mut bytes)?,
    }
    let mut bytes = bytes.into_inner();
    sort_last_attributes(&mut bytes, n_attributes).ok_or(Error::Invalid("header".into()))?;
    Ok(bytes)
}

/// Puts the last `n` attributes of the header in the order of their names: those that are not
/// OpenEXR's own come last, in the order of a hash map, which differs from run to run. Nothing
/// else moves, so offsets stay right.
fn sort_last_attributes(bytes: &mut [u8], n: usize) -> Option<()> {
    let text_end = |from: usize| {
        let length = bytes.get(from..)?.iter().position(|&byte| byte == 0)?;
        Some(from + length + 1)
    };
    // After magic number and version: name, type, length and value of each; an empty name ends
    // them.
    let mut attributes = Vec::new();
    let mut at = 8;
    while *bytes.get(at)? != 0 {
        let value = text_end(text_end(at)?)? + 4;
        let length = bytes.get(value - 4..value)?.try_into().ok()?;
        let end = value + u32::from_le_bytes(length) as usize;
        attributes.push(bytes.get(at..end)?.to_vec());
        at = end;
    }
    let mut last = attributes.split_off(attributes.len().checked_sub(n)?);
    last.sort_unstable();
    let last = last.concat();
    bytes.get_mut(at - last.len()..at)?.copy_from_slice(&last);
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(n_threads: usize) -> Vec<u8> {
        let names = ["scene", "groom", "a", "lights", "zebra", "time", "version"];
        // Names with a stroke, as ours have: OpenEXR knows some of the bare ones.
        let attributes = names.map(|name| (format!("our/{name}"), format!("our/{name} of it")));
        let (width, height) = (100, 700);
        let ramp = |step: f32| {
            (0..width * height)
                .map(|ix| (ix as f32 * step).sin())
                .collect()
        };
        let channels = vec![floats("R", ramp(0.1)), floats("b.Y", ramp(0.7))];
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads);
        let pool = pool.build().expect("a thread pool");
        pool.install(|| encode((width, height), channels, &attributes))
            .expect("encoded")
    }

    #[test]
    fn equal_content_gives_equal_bytes_on_any_number_of_threads() {
        let first = file(1);
        for n_threads in [1, 2, 3, 8, 8, 8] {
            assert!(file(n_threads) == first, "{n_threads} threads");
        }
        let places: Vec<usize> = ["a", "groom", "lights", "scene", "time", "version", "zebra"]
            .into_iter()
            .map(|name| {
                let header = format!("our/{name}\0string\0");
                let found = first
                    .windows(header.len())
                    .position(|w| w == header.as_bytes());
                found.unwrap_or_else(|| panic!("no {name}"))
            })
            .collect();
        assert!(places.is_sorted(), "{places:?}");
    }

    #[test]
    fn sorted_headers_are_read_as_they_were() {
        let bytes = file(2);
        let reader = exr::block::read(Cursor::new(&bytes[..]), true).expect("readable");
        let other = &reader.headers()[0].own_attributes.other;
        assert_eq!(other.len(), 7);
        for (name, value) in other {
            assert_eq!(
                *value,
                AttributeValue::Text(Text::from(&*format!("{name} of it")))
            );
        }
        for (ix, cut) in [0, 8, 40, 300].into_iter().enumerate() {
            let mut bytes = bytes[..cut].to_vec();
            assert_eq!(sort_last_attributes(&mut bytes, 7), None, "{ix}");
        }
    }
}
