//! The OpenEXR reader on files that the `exr` crate writes.

use std::io::Cursor;

use exr::math::RoundingMode;
use exr::meta::attribute::{Chromaticities, EnvironmentMap};
use exr::prelude::*;

use super::{Map, decode};

const SIZE: Vec2<usize> = Vec2(96, 48);

/// A smooth picture, exact in half floats.
fn value(x: usize, y: usize, c: usize) -> f32 {
    ((x + 2 * y + 5 * c) % 64) as f32 * 0.25 + 0.5
}

fn samples(kind: SampleType, c: usize) -> FlatSamples {
    let all = (0..SIZE.area()).map(|ix| value(ix % SIZE.0, ix / SIZE.0, c));
    match kind {
        SampleType::F16 => FlatSamples::F16(all.map(f16::from_f32).collect()),
        SampleType::F32 => FlatSamples::F32(all.collect()),
        SampleType::U32 => FlatSamples::U32(all.map(|x| (4.0 * x) as u32).collect()),
    }
}

/// A file with these channels, each named and made from component `c`.
fn write(
    kind: SampleType,
    compression: Compression,
    blocks: Blocks,
    channels: &[(&str, usize)],
    attributes: impl FnOnce(&mut ImageAttributes, &mut LayerAttributes),
) -> exr::error::Result<Vec<u8>> {
    let list = channels
        .iter()
        .map(|(name, c)| AnyChannel::new(*name, samples(kind, *c)))
        .collect();
    let encoding = Encoding {
        compression,
        blocks,
        line_order: LineOrder::Increasing,
    };
    let mut layer = LayerAttributes::named("main");
    let mut shared = ImageAttributes::with_size(SIZE);
    attributes(&mut shared, &mut layer);
    let layer = Layer::new(SIZE, layer, encoding, AnyChannels::sort(list));
    let image = Image::new(shared, layer);
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

const RGB: [(&str, usize); 3] = [("R", 0), ("G", 1), ("B", 2)];

fn plain(kind: SampleType, compression: Compression, blocks: Blocks) -> Vec<u8> {
    write(kind, compression, blocks, &RGB, |_, _| {}).expect("the exr crate writes this")
}

fn assert_pixels(map: &Map, scale: f32, tolerance: f32, what: &str) {
    assert_eq!((map.width(), map.height()), (SIZE.0, SIZE.1), "{what}");
    for (ix, pixel) in map.pixels().iter().enumerate() {
        for (c, x) in pixel.iter().enumerate() {
            let expected = scale * value(ix % SIZE.0, ix / SIZE.0, c);
            assert!(
                (x - expected).abs() <= tolerance * expected,
                "{what}: pixel {ix} channel {c} is {x}, not {expected}"
            );
        }
    }
}

#[test]
fn every_compression_layout_and_sample_type() {
    let mut read = 0;
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
    ] {
        for kind in [SampleType::F16, SampleType::F32, SampleType::U32] {
            for blocks in [
                Blocks::ScanLines,
                Blocks::Tiles(Vec2(32, 32)),
                Blocks::Tiles(Vec2(20, 7)),
            ] {
                let what = format!("{compression} {kind:?} {blocks:?}");
                let map = decode(&plain(kind, compression, blocks), String::new())
                    .unwrap_or_else(|error| panic!("{what}: {error}"));
                // B44 keeps about six bits of a half.
                let lossy = matches!(compression, Compression::B44 | Compression::B44A)
                    && kind == SampleType::F16;
                let tolerance = if lossy { 0.2 } else { 1e-4 };
                let scale = if kind == SampleType::U32 { 4.0 } else { 1.0 };
                assert_pixels(&map, scale, tolerance, &what);
                read += 1;
            }
        }
    }
    assert_eq!(read, 72);
}

#[test]
fn the_largest_level_of_a_mip_map_is_read() {
    let levels = |c: usize| {
        let mut size = SIZE;
        let mut levels = vec![samples(SampleType::F32, c)];
        while size != Vec2(1, 1) {
            size = Vec2((size.0 / 2).max(1), (size.1 / 2).max(1));
            levels.push(FlatSamples::F32(vec![99.0; size.area()]));
        }
        Levels::Mip {
            rounding_mode: RoundingMode::Down,
            level_data: levels,
        }
    };
    let list = RGB
        .iter()
        .map(|(name, c)| AnyChannel::new(*name, levels(*c)))
        .collect();
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::Tiles(Vec2(16, 16)),
        line_order: LineOrder::Unspecified,
    };
    let layer = Layer::new(
        SIZE,
        LayerAttributes::named("m"),
        encoding,
        AnyChannels::sort(list),
    );
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .unwrap();
    let map = decode(&bytes.into_inner(), String::new()).unwrap();
    assert_pixels(&map, 1.0, 0.0, "mip map");
    assert!(map.source().format.contains("mip map"));
}

#[test]
fn channels_are_found_by_name() {
    let read = |channels: &[(&str, usize)]| {
        let bytes = write(
            SampleType::F32,
            Compression::ZIP16,
            Blocks::ScanLines,
            channels,
            |_, _| {},
        )
        .unwrap();
        decode(&bytes, String::new())
    };
    let alpha = [("A", 7), ("B", 2), ("G", 1), ("R", 0), ("Z", 9)];
    assert_pixels(&read(&alpha).unwrap(), 1.0, 0.0, "RGBA and depth");
    let layered = [("sky.B", 2), ("sky.G", 1), ("sky.R", 0), ("z.Z", 3)];
    assert_pixels(&read(&layered).unwrap(), 1.0, 0.0, "a layer name");
    let grey = read(&[("Y", 0)]).unwrap();
    assert!(grey.pixels().iter().all(|p| p[0] == p[1] && p[1] == p[2]));
    assert_eq!(grey.pixels()[3][0], value(3, 0, 0));
    let error = read(&[("depth", 0)]).unwrap_err();
    assert!(error.contains("depth"), "{error}");
}

#[test]
fn attributes_are_honoured_or_refused_by_name() {
    let with = |set: &dyn Fn(&mut ImageAttributes, &mut LayerAttributes)| {
        let bytes = write(
            SampleType::F32,
            Compression::ZIP16,
            Blocks::ScanLines,
            &RGB,
            |shared, layer| set(shared, layer),
        )
        .unwrap();
        decode(&bytes, String::new())
    };
    let latlong = with(&|_, layer| {
        layer.environment_map = Some(EnvironmentMap::LatitudeLongitude);
    });
    assert_pixels(&latlong.unwrap(), 1.0, 0.0, "latlong");
    let cube = with(&|_, layer| layer.environment_map = Some(EnvironmentMap::Cube));
    assert!(cube.unwrap_err().contains("cube"));
    // Display P3: greener green and redder red than Rec.709, the same white.
    let wide = with(&|shared, _| {
        shared.chromaticities = Some(Chromaticities {
            red: Vec2(0.68, 0.32),
            green: Vec2(0.265, 0.69),
            blue: Vec2(0.15, 0.06),
            white: Vec2(0.3127, 0.3290),
        });
    })
    .unwrap();
    let [r, g, b] = [0, 1, 2].map(|c| value(0, 0, c));
    let expected = 1.2249 * r - 0.2247 * g;
    assert!((wide.pixels()[0][0] - expected.max(0.0)).abs() < 0.01 * (r + g + b));
    let nonsense = with(&|shared, _| {
        shared.chromaticities = Some(Chromaticities {
            red: Vec2(0.3, 0.3),
            green: Vec2(0.3, 0.3),
            blue: Vec2(0.3, 0.3),
            white: Vec2(0.3, 0.3),
        });
    });
    assert!(nonsense.unwrap_err().contains("primaries"));
}

#[test]
fn damaged_files_are_errors() {
    let bytes = plain(SampleType::F16, Compression::PIZ, Blocks::ScanLines);
    for length in (0..bytes.len()).step_by(97).chain([bytes.len() - 1]) {
        let error = Map::decode(&bytes[..length]).unwrap_err();
        assert!(
            !error.is_empty() && !error.contains('\n'),
            "{length}: {error}"
        );
    }
    // A flipped byte anywhere must not panic; many flips still decode.
    for at in (0..bytes.len()).step_by(31) {
        let mut bytes = bytes.clone();
        bytes[at] ^= 0x5a;
        let _ = Map::decode(&bytes);
    }
}
