//! Integers as differences: the commonest difference, then two bits for each integer that say how
//! many bytes its difference takes, then these.

/// Size of the integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Width {
    /// Differences of 1, 2 or 4 bytes.
    Bits32,
    /// Differences of 2, 4 or 8 bytes.
    Bits64,
}

impl Width {
    fn bytes(self) -> usize {
        match self {
            Width::Bits32 => 4,
            Width::Bits64 => 8,
        }
    }
}

/// Length of `n` integers at most.
pub(super) fn most_bytes(n: u64, width: Width) -> Option<u64> {
    let size = width.bytes() as u64;
    n.checked_mul(size + 1)?.checked_add(size + 1)
}

/// Decodes `n` integers; `None` where `bytes` are too few.
pub(super) fn decode(bytes: &[u8], n: usize, width: Width) -> Option<Vec<i64>> {
    let size = width.bytes();
    let (common, rest) = bytes.split_at_checked(size)?;
    let common = signed(common);
    let (codes, mut rest) = rest.split_at_checked(n.div_ceil(4))?;
    let mut values = Vec::with_capacity(n);
    let mut value = 0i64;
    for ix in 0..n {
        let code = (codes[ix / 4] >> (2 * (ix % 4))) & 3;
        let difference = if code == 0 {
            common
        } else {
            let (difference, after) = rest.split_at_checked((size >> 2) << (code - 1))?;
            rest = after;
            signed(difference)
        };
        value = value.wrapping_add(difference);
        if width == Width::Bits32 {
            value = i64::from(value as i32);
        }
        values.push(value);
    }
    Some(values)
}

/// A little-endian integer of 1, 2, 4 or 8 bytes.
fn signed(bytes: &[u8]) -> i64 {
    let mut wide = [0; 8];
    wide[..bytes.len()].copy_from_slice(bytes);
    let shift = 64 - 8 * bytes.len() as u32;
    i64::from_le_bytes(wide) << shift >> shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_summed() {
        // 5, 10, 7, 1007, -99_000: differences 5 (common), 5, -3, 1000, -100_007.
        let mut bytes = 5i32.to_le_bytes().to_vec();
        bytes.extend([0b10_01_00_00, 0b11]);
        bytes.extend((-3i8).to_le_bytes());
        bytes.extend(1000i16.to_le_bytes());
        bytes.extend((-100_007i32).to_le_bytes());
        let expected = [5, 10, 7, 1007, -99_000];
        assert_eq!(decode(&bytes, 5, Width::Bits32).unwrap(), expected);
        for end in 0..bytes.len() {
            assert_eq!(decode(&bytes[..end], 5, Width::Bits32), None);
        }
        let mut wide = (1i64 << 40).to_le_bytes().to_vec();
        wide.push(0b01_00);
        wide.extend((-1i16).to_le_bytes());
        let expected = [1 << 40, (1 << 40) - 1];
        assert_eq!(decode(&wide, 2, Width::Bits64).unwrap(), expected);
        assert_eq!(most_bytes(u64::MAX, Width::Bits32), None);
    }
}
