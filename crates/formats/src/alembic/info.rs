//! What is known about the format before any file of it is seen.

use crate::groom::UpAxis;
use crate::groom_format::{AttributeSupport, Capabilities, CurveBasis, FormatInfo};

pub(super) static INFO: FormatInfo = FormatInfo {
    name: "alembic",
    title: "an Alembic archive (Ogawa)",
    extensions: &["abc"],
    cm_per_unit: 1.0,
    up: UpAxis::Y,
    can: Capabilities {
        reads: true,
        writes: true,
        attributes: AttributeSupport::Any,
        bases: &[
            CurveBasis::Linear,
            CurveBasis::Bezier,
            CurveBasis::BSpline,
            CurveBasis::CatmullRom,
        ],
        frames: true,
        objects: true,
    },
};
