//! NumPy's .npy files, version 1.0.

/// `data` in C order, of the given shape, float32.
pub fn float32(shape: &[usize], data: &[f32]) -> Vec<u8> {
    encode(
        "<f4",
        shape,
        data.iter().flat_map(|value| value.to_le_bytes()),
    )
}

/// A vector of float64.
pub fn float64(data: &[f64]) -> Vec<u8> {
    encode(
        "<f8",
        &[data.len()],
        data.iter().flat_map(|value| value.to_le_bytes()),
    )
}

fn encode(kind: &str, shape: &[usize], data: impl Iterator<Item = u8>) -> Vec<u8> {
    let shape: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut header = format!(
        "{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}",
        shape.trim_end()
    );
    // Magic, version, length and header together fill a multiple of 64 bytes, ending in a
    // newline. Shapes have at most a handful of numbers, so the length fits into 16 bits.
    let prefix = 10;
    let padded = (prefix + header.len() + 1).next_multiple_of(64) - prefix;
    while header.len() + 1 < padded {
        header.push(' ');
    }
    header.push('\n');
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((padded as u16).to_le_bytes());
    file.extend(header.bytes());
    file.extend(data);
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_is_as_numpy_writes_it() {
        let file = float32(&[2, 3], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(file.len(), 128 + 24);
        assert_eq!(&file[..10], b"\x93NUMPY\x01\x00\x76\x00");
        let text = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3,), }";
        assert_eq!(&file[10..10 + text.len()], text.as_bytes());
        assert_eq!(file[127], b'\n');
        assert_eq!(file[132..136], 1.0f32.to_le_bytes());
        let vector = float64(&[1.5]);
        assert!(vector.windows(4).any(|four| four == b"(1,)"));
        assert_eq!(vector[vector.len() - 8..], 1.5f64.to_le_bytes());
    }
}
