//! LUTs for tests.

use std::fmt::Write;
use std::sync::Arc;

use strandlight_formats::{Cube, LutInput};
use strandlight_scene::DisplayTransform;
use strandlight_scene::lut::Lut;

/// Rows of a grid of `size` samples along an edge: `color` of places in 0..=1.
pub fn grid_rows(size: u32, color: impl Fn([f32; 3]) -> [f32; 3]) -> String {
    let mut text = String::new();
    let at = |ix: u32| ix as f32 / (size - 1) as f32;
    for ix in 0..size.pow(3) {
        let [r, g, b] = color([ix % size, ix / size % size, ix / size / size].map(at));
        // Writing to a string does not fail.
        let _ = writeln!(text, "{r} {g} {b}");
    }
    text
}

/// The text of a `.cube` file of such a grid.
pub fn grid_cube(size: u32, color: impl Fn([f32; 3]) -> [f32; 3]) -> String {
    format!("LUT_3D_SIZE {size}\n{}", grid_rows(size, color))
}

/// A LUT of the text of a `.cube` file.
pub fn lut_of(text: &str, input: LutInput) -> DisplayTransform {
    let cube = Cube::from_bytes(text.as_bytes()).expect("a LUT");
    let cube = Arc::new(cube);
    DisplayTransform::Lut(Lut { cube, input })
}
