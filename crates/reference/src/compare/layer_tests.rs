use std::io::Write;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer as Part, LayerAttributes, Layers,
    SmallVec, WritableImage, f16,
};

use super::*;

const SIZE: (usize, usize) = (5, 3);

/// Value of a channel at a pixel: different everywhere, exact in half precision.
fn value(channel: usize, ix: usize) -> f32 {
    channel as f32 + ix as f32 / 16.0
}

fn channel(name: &str, number: usize, half: bool) -> AnyChannel<FlatSamples> {
    let values = (0..SIZE.0 * SIZE.1).map(|ix| value(number, ix));
    let samples = if half {
        FlatSamples::F16(values.map(f16::from_f32).collect())
    } else {
        FlatSamples::F32(values.collect())
    };
    AnyChannel::new(name, samples)
}

fn part(
    name: Option<&str>,
    channels: Vec<AnyChannel<FlatSamples>>,
) -> Part<AnyChannels<FlatSamples>> {
    let attributes = match name {
        Some(name) => LayerAttributes::named(name),
        None => LayerAttributes::default(),
    };
    let channels = AnyChannels::sort(SmallVec::from_vec(channels));
    Part::new(SIZE, attributes, Encoding::FAST_LOSSLESS, channels)
}

fn file(parts: Vec<Part<AnyChannels<FlatSamples>>>) -> Vec<u8> {
    let attributes =
        exr::prelude::ImageAttributes::new(exr::prelude::IntegerBounds::from_dimensions(SIZE));
    let image = Image {
        attributes,
        layer_data: parts.into_iter().collect::<Layers<_>>(),
    };
    let mut file = Cursor::new(Vec::new());
    image
        .write()
        .non_parallel()
        .to_buffered(&mut file)
        .expect("in memory");
    file.into_inner()
}

/// One part: plain RGBA, `single` without alpha, `variance`, one of them in half precision.
fn layered() -> Vec<u8> {
    let mut channels = Vec::new();
    for (layer, first, half) in [
        ("", 0, false),
        ("single.", 4, true),
        ("variance.", 7, false),
    ] {
        for (c, name) in ["R", "G", "B"].iter().enumerate() {
            channels.push(channel(&format!("{layer}{name}"), first + c, half));
        }
    }
    channels.push(channel("A", 3, true));
    file(vec![part(None, channels)])
}

fn assert_values(layer: &Layer, rgb: [usize; 3], alpha: Option<usize>) {
    assert_eq!((layer.width, layer.height), SIZE);
    for ix in 0..15 {
        assert_eq!(layer.rgb[ix], rgb.map(|channel| value(channel, ix)));
        assert_eq!(
            layer.alpha[ix],
            alpha.map_or(1.0, |channel| value(channel, ix))
        );
    }
}

#[test]
fn layers_by_name() {
    let bytes = layered();
    let plain = Layer::decode(&bytes, None).expect("plain");
    assert_values(&plain, [0, 1, 2], Some(3));
    let variance = plain.variance.expect("the plain layer's");
    assert_eq!(variance[7], [7, 8, 9].map(|channel| value(channel, 7)));
    let single = Layer::decode(&bytes, Some("single")).expect("single");
    assert_values(&single, [4, 5, 6], Some(3));
    assert_eq!(single.variance, None);
    let error = Layer::decode(&bytes, Some("global"))
        .expect_err("not there")
        .to_string();
    assert!(
        error.contains("global") && error.contains("single"),
        "{error}"
    );
    let names = (0..14).map(|ix| format!("{ix:02}.R"));
    let names = names.chain(["sums.0.total.R", "bits.R", "behind.R"].map(String::from));
    let found = Names(names.map(|name| (name, (0, 0))).collect()).layers();
    assert!(
        found.starts_with("00, 01, ") && found.ends_with(", 11 and 2 more"),
        "{found}"
    );
}

#[test]
fn layers_as_parts() {
    let colour = |first: usize| {
        ["R", "G", "B"]
            .map(|name| (name, first))
            .into_iter()
            .enumerate()
            .map(|(c, (name, first))| channel(name, first + c, false))
            .collect::<Vec<_>>()
    };
    let bytes = file(vec![
        part(Some("total"), colour(0)),
        part(Some("local"), colour(4)),
    ]);
    for name in [None, Some("total")] {
        assert_values(
            &Layer::decode(&bytes, name).expect("there"),
            [0, 1, 2],
            None,
        );
    }
    assert_values(
        &Layer::decode(&bytes, Some("local")).expect("there"),
        [4, 5, 6],
        None,
    );
}

#[test]
fn damaged_files_are_refused() {
    let bytes = layered();
    for end in (0..bytes.len()).step_by(7) {
        assert!(Layer::decode(&bytes[..end], None).is_err(), "cut at {end}");
    }
    let mut nan = vec![channel("G", 1, false), channel("B", 2, false)];
    nan.push(AnyChannel::new("R", FlatSamples::F32(vec![f32::NAN; 15])));
    let error = Layer::decode(&file(vec![part(None, nan)]), None)
        .expect_err("not finite")
        .to_string();
    assert!(error.contains("(0, 0)"), "{error}");
    let depth = vec![channel("Z", 0, false)];
    assert!(Layer::decode(&file(vec![part(None, depth)]), None).is_err());
    assert!(Layer::decode(b"\x89PNG\r\n\x1a\n????", None).is_err());
    assert!(Layer::decode(b"GIF89a", None).is_err());
}

fn png_of(color: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().expect("in memory");
    writer.write_image_data(data).expect("in memory");
    writer.finish().expect("in memory");
    bytes.flush().expect("in memory");
    bytes
}

#[test]
fn png_is_linear_and_multiplied_by_alpha() {
    use png::{BitDepth, ColorType};
    let rgba = [255, 0, 188, 51, 255, 255, 255, 255];
    let layer =
        Layer::decode(&png_of(ColorType::Rgba, BitDepth::Eight, &rgba), None).expect("a PNG");
    assert!(layer.is_display);
    assert_eq!(layer.alpha, [0.2, 1.0]);
    let [r, g, b] = layer.rgb[0];
    // 188 of sRGB is half the light.
    assert!((r - 0.2).abs() < 1e-6 && g == 0.0 && (b - 0.1).abs() < 1e-3);
    let grey = png_of(ColorType::Grayscale, BitDepth::Sixteen, &[0xff, 0xff, 0, 0]);
    let layer = Layer::decode(&grey, None).expect("a PNG");
    assert_eq!(layer.rgb, [[1.0; 3], [0.0; 3]]);
    assert!(Layer::decode(&grey, Some("single")).is_err());
}

#[test]
fn boxes_at_the_border_are_smaller() {
    let layer = Layer::decode(&layered(), None).expect("plain");
    let boxed = layer.boxed(2);
    assert_eq!((boxed.width, boxed.height), (3, 2));
    let mean =
        |pixels: &[usize]| pixels.iter().map(|ix| value(0, *ix)).sum::<f32>() / pixels.len() as f32;
    assert_eq!(boxed.rgb[0][0], mean(&[0, 1, 5, 6]));
    assert_eq!(boxed.rgb[5][0], mean(&[14]));
    assert_eq!(boxed.rgb[2][0], mean(&[4, 9]));
    let variance = boxed.variance.expect("there");
    assert_eq!(variance[5][0], value(7, 14));
    assert_eq!(variance[2][0], (value(7, 4) + value(7, 9)) / 4.0);
    assert_eq!(layer.boxed(1), layer);
}
