//! Linear pictures as OpenEXR files.

use strandlight_scene::Picture;
use strandlight_scene::provenance::Provenance;

use crate::exr_file;

/// An OpenEXR file: float RGBA, scan lines, alpha multiplied in, linear Rec.709.
///
/// # Errors
/// What the encoder says.
pub fn exr_file(picture: &Picture) -> exr::error::Result<Vec<u8>> {
    exr_file_of(picture, &Provenance::default())
}

/// [`exr_file()`] with what the picture was made from in its header.
///
/// # Errors
/// What the encoder says.
pub fn exr_file_of(picture: &Picture, provenance: &Provenance) -> exr::error::Result<Vec<u8>> {
    let plane = |c: usize| picture.rgba.iter().map(|rgba| rgba[c]).collect();
    let channels = ["R", "G", "B", "A"].into_iter().enumerate();
    let channels = channels.map(|(c, name)| exr_file::floats(name, plane(c)));
    let size = (picture.width as usize, picture.height as usize);
    exr_file::encode(size, channels.collect(), provenance.entries())
}
