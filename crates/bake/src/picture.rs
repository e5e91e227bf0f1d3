//! Linear pictures as OpenEXR files.

use std::io::Cursor;

use exr::prelude::{Image, SpecificChannels, WritableImage};
use strandlight_runtime::Picture;

/// An OpenEXR file: float RGBA, scan lines, alpha multiplied in, linear Rec.709.
///
/// # Errors
/// What the encoder says.
pub fn exr_file(picture: &Picture) -> exr::error::Result<Vec<u8>> {
    let width = picture.width as usize;
    let channels = SpecificChannels::rgba(|at: exr::math::Vec2<usize>| {
        let [r, g, b, a] = picture.rgba[at.y() * width + at.x()];
        (r, g, b, a)
    });
    let size = (width, picture.height as usize);
    let mut file = Cursor::new(Vec::new());
    Image::from_channels(size, channels)
        .write()
        .to_buffered(&mut file)?;
    Ok(file.into_inner())
}
