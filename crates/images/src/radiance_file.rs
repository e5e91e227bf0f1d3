//! Radiance .hdr files (Ward's RGBE): header and pixels as they are stored.

/// The first line of today's files, whose headers must parse; older ones say `#?RGBE` or anything
/// else, and what their headers have wrong is skipped.
const SIGNATURE: &[u8] = b"#?RADIANCE";

/// Lines of a header that say what the pixels mean.
#[derive(Clone, Debug)]
pub(super) struct Header {
    /// Pixels in a row.
    pub(super) width: usize,
    /// Rows, from the top.
    pub(super) height: usize,
    /// Product of the `EXPOSURE` lines: stored values are radiance times this.
    pub(super) exposure: f32,
    /// Product of the `COLORCORR` lines, for red, green and blue.
    pub(super) correction: [f32; 3],
    /// The first `PRIMARIES` line.
    pub(super) primaries: Option<String>,
}

/// Reads the header of `bytes`; answers it and the rest.
pub(super) fn header(bytes: &[u8]) -> Result<(Header, &[u8]), String> {
    let is_strict = bytes.starts_with(SIGNATURE);
    let mut rest = bytes;
    let mut header = Header {
        width: 0,
        height: 0,
        exposure: 1.0,
        correction: [1.0; 3],
        primaries: None,
    };
    loop {
        let line = next_line(&mut rest).ok_or("it ends in its header")?;
        match line {
            b"" => break,
            [b'#', ..] => continue,
            _ => header.take(&String::from_utf8_lossy(line), is_strict)?,
        }
    }
    let line = next_line(&mut rest).ok_or("it ends before its size")?;
    let line = String::from_utf8_lossy(line);
    let words: Vec<&str> = line.split_whitespace().collect();
    let number = |word: &str| match word.parse::<u32>() {
        Ok(number) => Ok(number as usize),
        Err(error) => Err(format!("size {}: {error}", short(word))),
    };
    match words[..] {
        ["-Y", height, "+X", width, ref more @ ..] if more.is_empty() || !is_strict => {
            (header.height, header.width) = (number(height)?, number(width)?);
            Ok((header, rest))
        }
        [_, _, _, _] => Err(format!(
            "orientation {} {}, not -Y +X",
            short(words[0]),
            short(words[2])
        )),
        _ => Err(format!("'{}' is no size", short(&line))),
    }
}

impl Header {
    /// Takes what a line `KEY=VALUE` says; others, the commands that made the picture, are skipped.
    fn take(&mut self, line: &str, is_strict: bool) -> Result<(), String> {
        let Some((key, value)) = line.split_once('=') else {
            return Ok(());
        };
        if key.is_empty() || value.is_empty() {
            return Ok(());
        }
        let key = key.trim();
        if key.eq_ignore_ascii_case("PRIMARIES") && self.primaries.is_none() {
            self.primaries = Some(value.trim().to_owned());
        }
        let words: Vec<&str> = value.split_whitespace().collect();
        let number = |ix: usize| words.get(ix)?.parse::<f32>().ok();
        let one = number(0).filter(|_| words.len() == 1);
        let three = [0, 1, 2].map(number);
        match (key, one, three) {
            ("FORMAT", ..) if value.trim() != "32-bit_rle_rgbe" => {
                return Err(format!("pixels of format {}", short(value)));
            }
            ("EXPOSURE", Some(exposure), _) => self.exposure *= exposure,
            ("PIXASPECT", Some(_), _) => {}
            ("COLORCORR", _, [Some(r), Some(g), Some(b)]) if words.len() == 3 || !is_strict => {
                for (product, factor) in self.correction.iter_mut().zip([r, g, b]) {
                    *product *= factor;
                }
            }
            ("EXPOSURE" | "PIXASPECT" | "COLORCORR", ..) if is_strict => {
                return Err(format!("{key}={}", short(value)));
            }
            _ => {}
        }
        Ok(())
    }
}

/// The next line, without its end; none at the end of the file.
fn next_line<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    if rest.is_empty() {
        return None;
    }
    let end = rest.iter().position(|&byte| byte == b'\n');
    let line = &rest[..end.unwrap_or(rest.len())];
    *rest = &rest[end.map_or(rest.len(), |end| end + 1)..];
    Some(line)
}

/// What a message has room for.
fn short(text: &str) -> String {
    match text.char_indices().nth(20) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

/// Reads the rows of pixels, each flat or run-length encoded in one of two ways, from `bytes`.
pub(super) fn pixels(bytes: &[u8], width: usize, height: usize) -> Result<Vec<[f32; 3]>, String> {
    let mut reader = Reader(bytes);
    let mut row = vec![[0; 4]; width];
    let mut pixels = Vec::with_capacity(width * height);
    for _ in 0..height {
        reader.row(&mut row)?;
        pixels.extend(row.iter().copied().map(radiance));
    }
    Ok(pixels)
}

/// mantissa 2^(exponent - 136); an exponent of 0 is black.
fn radiance([r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
    // 2^(exponent - 128), subnormal for 1.
    let scale = match exponent {
        0 => 0.0,
        1 => f32::from_bits(1 << 22),
        exponent => f32::from_bits((u32::from(exponent) - 1) << 23),
    };
    [r, g, b].map(|mantissa| scale / 256.0 * f32::from(mantissa))
}

/// What is left of the file.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.0.split_at_checked(n).ok_or("it is truncated")?;
        self.0 = rest;
        Ok(taken)
    }

    fn texel(&mut self) -> Result<[u8; 4], String> {
        let texel = self.take(4)?;
        Ok([texel[0], texel[1], texel[2], texel[3]])
    }

    fn row(&mut self, row: &mut [[u8; 4]]) -> Result<(), String> {
        if row.is_empty() {
            return Ok(());
        }
        let first = self.texel()?;
        if let [2, 2, 0..128, _] = first {
            (0..4).try_for_each(|channel| self.channel(row, channel))
        } else {
            self.old_row(first, row)
        }
    }

    /// A channel of a row: counts, each with so many values, or one that is repeated 128 fewer
    /// times.
    fn channel(&mut self, row: &mut [[u8; 4]], channel: usize) -> Result<(), String> {
        let mut at = 0;
        while at < row.len() {
            let count = usize::from(self.take(1)?[0]);
            let n = if count <= 128 { count } else { count - 128 };
            let texels = row.get_mut(at..at + n).ok_or("a run ends after its row")?;
            let values = self.take(if count <= 128 { n } else { 1 })?;
            for (ix, texel) in texels.iter_mut().enumerate() {
                texel[channel] = if count <= 128 { values[ix] } else { values[0] };
            }
            at += n;
        }
        Ok(())
    }

    /// Pixels, each of which may be followed by how often it is repeated: 1, 1, 1 and a count;
    /// the next such count in succession is of 256 times as many.
    fn old_row(&mut self, first: [u8; 4], row: &mut [[u8; 4]]) -> Result<(), String> {
        let (mut at, mut unit, mut texel) = (0, Some(1_usize), None);
        let mut next = first;
        loop {
            let n = match next {
                [1, 1, 1, count] => {
                    let n = unit.and_then(|unit| unit.checked_mul(usize::from(count)));
                    unit = unit.and_then(|unit| unit.checked_mul(256));
                    n.ok_or("a run ends after its row")?
                }
                _ => {
                    (unit, texel) = (Some(1), Some(next));
                    1
                }
            };
            let value = texel.ok_or("a row starts with a run")?;
            let end = at + n.min(row.len() + 1);
            let texels = row.get_mut(at..end).ok_or("a run ends after its row")?;
            texels.fill(value);
            at = end;
            if at == row.len() {
                return Ok(());
            }
            next = self.texel()?;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Row of 10: 3 of one pixel, 7 of another.
    const ROW: [[f32; 3]; 10] = {
        let (a, b) = ([1.0, 0.5, 0.25], [0.5, 0.5, 2.0]);
        [a, a, a, b, b, b, b, b, b, b]
    };

    #[test]
    fn rows_of_every_encoding_are_alike() {
        let (a, b) = ([128, 64, 32, 129], [32, 32, 128, 130]);
        let flat = [[a; 3].as_flattened(), [b; 7].as_flattened()].concat();
        let old = [a, [1, 1, 1, 2], b, [1, 1, 1, 6]].concat();
        let mut new = vec![2, 2, 0, 10];
        for channel in 0..4 {
            new.extend([3, a[channel], a[channel], a[channel], 128 + 7, b[channel]]);
        }
        for bytes in [&flat, &old, &new] {
            assert_eq!(pixels(bytes, 10, 1).as_deref(), Ok(&ROW[..]));
            for length in 0..bytes.len() {
                assert!(pixels(&bytes[..length], 10, 1).is_err(), "{length}");
            }
        }
        // A run that is too long for the row; the new encoding of a row that starts with a run.
        assert!(pixels(&new, 9, 1).is_err() && pixels(&old, 9, 1).is_err());
        assert!(pixels(&old[4..], 10, 1).is_err());
    }

    #[test]
    fn counts_in_succession_are_digits() {
        let bytes = [[9, 8, 7, 136], [1, 1, 1, 3], [1, 1, 1, 2]].concat();
        let row = pixels(&bytes, 1 + 3 + 2 * 256, 1).unwrap();
        assert!(row.iter().all(|pixel| *pixel == [9.0, 8.0, 7.0]));
        let many = [
            vec![9, 8, 7, 136],
            [1, 1, 1, 0].repeat(20),
            vec![1, 1, 1, 1],
        ]
        .concat();
        assert!(pixels(&many, 10, 1).is_err());
    }

    #[test]
    fn exponents_are_powers_of_two() {
        assert_eq!(radiance([255, 1, 0, 0]), [0.0; 3]);
        for exponent in 1..=255_u8 {
            let expected = 2.0_f64.powi(i32::from(exponent) - 136) * 255.0;
            let [found, ..] = radiance([255, 0, 0, exponent]);
            assert_eq!(f64::from(found), expected, "{exponent}");
        }
    }
}
