//! PNG files of 8-bit sRGB.

/// A PNG of `size` pixels, width and height, rows from the top: RGB of three numbers a pixel, RGBA with straight
/// alpha of four. `texts`, names and values, become `tEXt` chunks.
///
/// # Errors
/// What the encoder says: no pixels, or other than there are to be, or texts that are not Latin-1.
pub fn encode<const N: usize>(
    [width, height]: [u32; 2],
    pixels: &[[u8; N]],
    texts: &[(String, String)],
) -> Result<Vec<u8>, png::EncodingError> {
    let color = const {
        match N {
            3 => png::ColorType::Rgb,
            4 => png::ColorType::Rgba,
            _ => panic!("three or four numbers a pixel"),
        }
    };
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    for (name, value) in texts {
        encoder.add_text_chunk(name.clone(), value.clone())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels.as_flattened())?;
    writer.finish()?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_hold_colour_alpha_and_texts() {
        let texts = [("name".to_owned(), "value".to_owned())];
        let pixels = [[1, 2, 3, 4], [5, 6, 7, 8]];
        let file = encode([2, 1], &pixels, &texts).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&file))
            .read_info()
            .unwrap();
        let mut found = [0; 8];
        reader.next_frame(&mut found).unwrap();
        assert_eq!(found, [1, 2, 3, 4, 5, 6, 7, 8]);
        let [text] = &*reader.info().uncompressed_latin1_text else {
            panic!("one text")
        };
        assert_eq!([&text.keyword, &text.text], [&texts[0].0, &texts[0].1]);
        assert!(encode([2, 2], &pixels, &[]).is_err());
    }
}
