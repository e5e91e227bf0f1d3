//! What reader and writer of pbrt's curves both know.

use crate::groom::UpAxis;
use crate::groom_format::{AttributeSupport, Capabilities, CurveBasis, FormatInfo};

/// The format's row.
pub static INFO: FormatInfo = FormatInfo {
    name: "pbrt",
    title: "a pbrt scene with curves",
    extensions: &["pbrt"],
    cm_per_unit: 1.0,
    up: UpAxis::Y,
    can: Capabilities {
        reads: true,
        writes: true,
        attributes: AttributeSupport::Only(&["thickness", "diameter"]),
        bases: &[CurveBasis::Linear, CurveBasis::Bezier, CurveBasis::BSpline],
        frames: false,
        objects: false,
    },
};

/// The inner control points of a straight segment.
pub fn thirds(from: [f32; 3], to: [f32; 3]) -> [[f32; 3]; 2] {
    [1.0, 2.0].map(|third| {
        [0, 1, 2].map(|axis: usize| {
            let (a, b) = (f64::from(from[axis]), f64::from(to[axis]));
            (a + (b - a) * third / 3.0) as f32
        })
    })
}
