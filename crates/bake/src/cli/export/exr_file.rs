//! OpenEXR files of any channels.

use std::io::Cursor;

use exr::prelude::SmallVec;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage,
};

/// A lossless float32 file of `width` x `height` pixels; each channel holds rows, top first.
pub fn encode(
    width: usize,
    height: usize,
    channels: Vec<(String, Vec<f32>)>,
) -> Result<Vec<u8>, String> {
    let list: SmallVec<[_; 4]> = channels
        .into_iter()
        .map(|(name, values)| AnyChannel::new(&*name, FlatSamples::F32(values)))
        .collect();
    let layer = Layer::new(
        (width, height),
        LayerAttributes::default(),
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(list),
    );
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| format!("cannot be encoded: {error}"))?;
    Ok(bytes.into_inner())
}
