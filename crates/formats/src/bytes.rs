//! Little-endian numbers in slices of bytes.

/// The u32 at `at`, which must lie inside.
pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// The f32 at `at`, which must lie inside.
pub(crate) fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_bits(u32_at(bytes, at))
}

/// The three f32 at `at`, which must lie inside.
pub(crate) fn point_at(bytes: &[u8], at: usize) -> [f32; 3] {
    [0, 1, 2].map(|axis| f32_at(bytes, at + 4 * axis))
}

/// Appends `values`.
pub(crate) fn extend_floats(bytes: &mut Vec<u8>, values: &[f32]) {
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
}
