//! LZ4 blocks, as Collet's description of the format has them, in one or several chunks.

/// Decompresses `data`: a byte with the number of chunks, then for each its length (i32) and block;
/// of no chunks a single block without a length. At most `limit` bytes; `None` where the data are
/// damaged or make more.
pub(super) fn decompress(data: &[u8], limit: usize) -> Option<Vec<u8>> {
    let (&n_chunks, mut rest) = data.split_first()?;
    let mut output = Vec::new();
    if n_chunks == 0 {
        block(rest, &mut output, limit)?;
    }
    for _ in 0..n_chunks {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let length = usize::try_from(i32::from_le_bytes(*length)).ok()?;
        let (chunk, after) = after.split_at_checked(length)?;
        block(chunk, &mut output, limit)?;
        rest = after;
    }
    Some(output)
}

/// Appends what `block` stands for, as long as `output` does not exceed `limit`.
fn block(mut block: &[u8], output: &mut Vec<u8>, limit: usize) -> Option<()> {
    let start = output.len();
    loop {
        let (&token, rest) = block.split_first()?;
        block = rest;
        let n_literals = length(token >> 4, &mut block)?;
        let (literals, rest) = block.split_at_checked(n_literals)?;
        if literals.len() > limit - output.len() {
            return None;
        }
        output.extend_from_slice(literals);
        block = rest;
        // The last sequence has literals only.
        if block.is_empty() {
            return Some(());
        }
        let (distance, rest) = block.split_first_chunk::<2>()?;
        let distance = usize::from(u16::from_le_bytes(*distance));
        block = rest;
        let n_copied = length(token & 15, &mut block)?.checked_add(4)?;
        if distance == 0 || distance > output.len() - start || n_copied > limit - output.len() {
            return None;
        }
        // The copy may run into what it writes.
        let from = output.len() - distance;
        if distance >= n_copied {
            output.extend_from_within(from..from + n_copied);
        } else {
            for ix in 0..n_copied {
                output.push(output[from + ix]);
            }
        }
    }
}

/// A length of four bits; 15 goes on in bytes up to one below 255.
fn length(bits: u8, block: &mut &[u8]) -> Option<usize> {
    let mut length = usize::from(bits);
    if bits < 15 {
        return Some(length);
    }
    loop {
        let (&byte, rest) = block.split_first()?;
        *block = rest;
        length = length.checked_add(usize::from(byte))?;
        if byte < 255 {
            return Some(length);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_decompressed() {
        // "ab", then 9 bytes from 2 before, then "c".
        let data = [0, 0x25, b'a', b'b', 2, 0, 0x10, b'c'];
        assert_eq!(decompress(&data, 12).unwrap(), b"abababababac");
        assert_eq!(decompress(&data, 11), None);
        // Twenty letters, in a chunk of its own; then another chunk, which does not look back.
        let mut long = vec![2, 22, 0, 0, 0, 0xf0, 5];
        long.extend([b'x'; 20]);
        long.extend([2, 0, 0, 0, 0x10, b'y']);
        let output = decompress(&long, 21).unwrap();
        assert_eq!(output, [&[b'x'; 20][..], b"y"].concat());
        for end in 0..long.len() {
            assert_eq!(decompress(&long[..end], 100), None);
        }
        for damaged in [
            &[0, 0x05, 1, 0][..],
            &[0, 0x15, b'a', 2, 0, 0],
            &[0, 0x15, b'a', 0, 0, 0],
            &[0, 0xf0, 255, 255],
            &[1, 0xff, 0xff, 0xff, 0xff],
            &[],
        ] {
            assert_eq!(decompress(damaged, 1 << 20), None, "{damaged:?}");
        }
    }
}
