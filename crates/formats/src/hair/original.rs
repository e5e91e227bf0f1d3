//! What is needed to write the `.hair` file again that a groom was imported from.

use super::layout::{HEADER_BYTES, THICKNESS_AT};
use crate::bytes::{f32_at, point_at, u32_at};
use crate::error::{Error, Result};
use crate::groom_format::Placement;
use crate::validate::finite;

/// Bytes of a single point.
const SINGLE_BYTES: usize = 36;

/// The content of an [`Original`](crate::Original) of this format.
#[derive(Debug)]
pub(super) struct HairOriginal {
    /// The 128 bytes of the header, info string included.
    pub header: Vec<u8>,
    /// Strands of a single point.
    pub single_points: Vec<SinglePoint>,
}

/// A strand of one point.
#[derive(Debug)]
pub(super) struct SinglePoint {
    /// Index of the strand in the file.
    pub strand: u32,
    /// Position in the file's own unit and axes.
    pub position: [f32; 3],
    /// Entry of the thickness array; 0 if there is none.
    pub thickness: f32,
    /// Entry of the transparency array; 0 if there is none.
    pub transparency: f32,
    /// Entry of the colour array; 0 if there is none.
    pub color: [f32; 3],
}

/// Number of single points in the bytes of an original.
pub(super) fn n_single_points(bytes: &[u8]) -> usize {
    bytes.len().saturating_sub(HEADER_BYTES) / SINGLE_BYTES
}

impl HairOriginal {
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = self.header.clone();
        for point in &self.single_points {
            bytes.extend(point.strand.to_le_bytes());
            let numbers = [point.thickness, point.transparency];
            let values = point.position.iter().chain(&numbers).chain(&point.color);
            bytes.extend(values.flat_map(|value| value.to_le_bytes()));
        }
        bytes
    }

    /// Decodes what a groom of `n_strands` strands keeps, and checks what a damaged or hand-made
    /// groom could get wrong.
    pub fn from_bytes(bytes: &[u8], n_strands: usize) -> Result<Self> {
        let singles = bytes.get(HEADER_BYTES..).unwrap_or_default();
        if !bytes.starts_with(b"HAIR")
            || bytes.len() < HEADER_BYTES
            || singles.len() % SINGLE_BYTES != 0
        {
            return Err(Error::value(
                "original .hair header",
                format!("{} bytes", bytes.len()),
                format!("{HEADER_BYTES} + {SINGLE_BYTES} n bytes that start with HAIR"),
            ));
        }
        let original = HairOriginal {
            header: bytes[..HEADER_BYTES].to_vec(),
            single_points: singles.chunks_exact(SINGLE_BYTES).map(single).collect(),
        };
        original.check(n_strands)?;
        Ok(original)
    }

    /// The same in another unit and other axes.
    pub fn moved(mut self, from: Placement, to: Placement) -> Self {
        if from == to {
            return self;
        }
        let scale = |value: f32| (f64::from(value) * from.cm_per_unit / to.cm_per_unit) as f32;
        let thickness = scale(f32_at(&self.header, THICKNESS_AT));
        self.header[THICKNESS_AT..THICKNESS_AT + 4].copy_from_slice(&thickness.to_le_bytes());
        for point in &mut self.single_points {
            point.position = to.to_file(from.to_groom(point.position));
            point.thickness = scale(point.thickness);
        }
        self
    }

    fn check(&self, n_strands: usize) -> Result<()> {
        let singles = &self.single_points;
        for single in singles {
            let values = single.position.iter().chain(&single.color);
            for &value in values.chain([&single.thickness, &single.transparency]) {
                finite(
                    || format!("single point of strand {}", single.strand),
                    value,
                )?;
            }
        }
        let strands = || singles.iter().map(|point| point.strand as usize);
        let rising = strands().is_sorted_by(|a, b| a < b);
        let total = n_strands + singles.len();
        if !rising || strands().next_back().is_some_and(|last| last >= total) {
            return Err(Error::value(
                "strand indices of single points",
                format!("{:?}", strands().take(8).collect::<Vec<_>>()),
                "rising and below the number of strands",
            ));
        }
        Ok(())
    }
}

fn single(bytes: &[u8]) -> SinglePoint {
    SinglePoint {
        strand: u32_at(bytes, 0),
        position: point_at(bytes, 4),
        thickness: f32_at(bytes, 16),
        transparency: f32_at(bytes, 20),
        color: point_at(bytes, 24),
    }
}
