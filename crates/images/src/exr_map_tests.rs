//! The OpenEXR reader on files that the `exr` crate writes.

use std::io::Cursor;

use exr::math::RoundingMode;
use exr::meta::attribute::{Chromaticities, EnvironmentMap};
use exr::prelude::*;

use super::{MAX_WIDTH, Map, MapSelection};

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
                let map = Map::decode(&plain(kind, compression, blocks))
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
    let map = Map::decode(&bytes.into_inner()).unwrap();
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
        Map::decode(&bytes)
    };
    let alpha = [("A", 7), ("B", 2), ("G", 1), ("R", 0), ("Z", 9)];
    assert_pixels(&read(&alpha).unwrap(), 1.0, 0.0, "RGBA and depth");
    let layered = [("sky.B", 2), ("sky.G", 1), ("sky.R", 0), ("z.Z", 3)];
    assert_pixels(&read(&layered).unwrap(), 1.0, 0.0, "a layer name");
    let grey = read(&[("Y", 0)]).unwrap();
    assert!(grey.pixels().iter().all(|p| p[0] == p[1] && p[1] == p[2]));
    assert_eq!(grey.pixels()[3][0], value(3, 0, 0));
    let error = read(&[("depth", 0)]).unwrap_err().to_string();
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
        Map::decode(&bytes)
    };
    let latlong = with(&|_, layer| {
        layer.environment_map = Some(EnvironmentMap::LatitudeLongitude);
    });
    assert_pixels(&latlong.unwrap(), 1.0, 0.0, "latlong");
    let cube = with(&|_, layer| layer.environment_map = Some(EnvironmentMap::Cube));
    assert!(cube.unwrap_err().to_string().contains("cube"));
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
    assert!(nonsense.unwrap_err().to_string().contains("primaries"));
}

#[test]
fn damaged_files_are_errors() {
    let bytes = plain(SampleType::F16, Compression::PIZ, Blocks::ScanLines);
    for length in (0..bytes.len()).step_by(97).chain([bytes.len() - 1]) {
        let error = Map::decode(&bytes[..length]).unwrap_err().to_string();
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

/// A rectangle of the plane of the file.
fn bounds(x: i32, y: i32, width: usize, height: usize) -> IntegerBounds {
    IntegerBounds::new(Vec2(x, y), Vec2(width, height))
}

/// Sample `c` of a pixel of the plane, never 0.
fn plane_value(x: i32, y: i32, c: usize) -> f32 {
    value(x.rem_euclid(1024) as usize, y.rem_euclid(1024) as usize, c)
}

/// A layer that holds `data` of the plane.
fn windowed_layer(
    name: &str,
    channels: &[(&str, usize)],
    encoding: Encoding,
    data: IntegerBounds,
) -> Layer<AnyChannels<FlatSamples>> {
    let Vec2(x, y) = data.position;
    let size = data.size;
    let list = channels
        .iter()
        .map(|(name, c)| {
            let samples = (0..size.area())
                .map(|ix| plane_value(x + (ix % size.0) as i32, y + (ix / size.0) as i32, *c));
            AnyChannel::new(*name, FlatSamples::F32(samples.collect()))
        })
        .collect();
    let attributes = LayerAttributes::named(name).with_position(data.position);
    Layer::new(size, attributes, encoding, AnyChannels::sort(list))
}

fn encoding(compression: Compression, blocks: Blocks) -> Encoding {
    Encoding {
        compression,
        blocks,
        line_order: LineOrder::Increasing,
    }
}

const ZIP: Encoding = Encoding {
    compression: Compression::ZIP16,
    blocks: Blocks::ScanLines,
    line_order: LineOrder::Increasing,
};

/// A file of these parts.
fn parts(display: IntegerBounds, layers: Vec<Layer<AnyChannels<FlatSamples>>>) -> Vec<u8> {
    let image = Image::from_layers(ImageAttributes::new(display), layers);
    let mut bytes = Cursor::new(Vec::new());
    image
        .write()
        .to_buffered(&mut bytes)
        .expect("it is written");
    bytes.into_inner()
}

#[test]
fn the_display_window_is_the_sphere() {
    let mut read = 0;
    let display = bounds(10, -5, 96, 48);
    for (data, black, dropped) in [
        // A crop, overscan on all sides, and both at once.
        (bounds(30, 3, 40, 20), 96 * 48 - 800, 0),
        (bounds(-6, -20, 120, 80), 0, 120 * 80 - 96 * 48),
        (
            bounds(-20, 30, 60, 40),
            96 * 48 - 30 * 13,
            60 * 40 - 30 * 13,
        ),
        (bounds(50, -5, 96, 48), 96 * 48 - 56 * 48, 96 * 48 - 56 * 48),
    ] {
        for (compression, blocks) in [
            (Compression::ZIP16, Blocks::ScanLines),
            (Compression::Uncompressed, Blocks::ScanLines),
            (Compression::PIZ, Blocks::Tiles(Vec2(16, 16))),
            (Compression::RLE, Blocks::Tiles(Vec2(33, 7))),
        ] {
            let what = format!("{data:?} {compression} {blocks:?}");
            let layer = windowed_layer("main", &RGB, encoding(compression, blocks), data);
            let map = Map::decode(&parts(display, vec![layer])).expect(&what);
            assert_eq!((map.width(), map.height()), (96, 48), "{what}");
            for (ix, pixel) in map.pixels().iter().enumerate() {
                let (x, y) = (10 + (ix % 96) as i32, (ix / 96) as i32 - 5);
                let Vec2(x0, y0) = data.position;
                let held = (x0..x0 + data.size.0 as i32).contains(&x)
                    && (y0..y0 + data.size.1 as i32).contains(&y);
                let expected = [0, 1, 2].map(|c| if held { plane_value(x, y, c) } else { 0.0 });
                assert_eq!(*pixel, expected, "{what}: ({x}, {y})");
            }
            let windows = map.source().windows.expect("they differ");
            assert_eq!(windows.black_pixels, black as u64, "{what}");
            assert_eq!(windows.dropped_pixels, dropped as u64, "{what}");
            let said = windows.to_string();
            assert_eq!(said.contains("are black"), black > 0, "{said}");
            assert_eq!(said.contains("left out"), dropped > 0, "{said}");
            assert!(
                (map.parameters().iter()).any(|(name, _)| name == "map_data_window"),
                "{what}"
            );
            read += 1;
        }
    }
    assert_eq!(read, 16);
    // Where both are one there is nothing to say, wherever they are.
    let layer = windowed_layer("main", &RGB, ZIP, display);
    let map = Map::decode(&parts(display, vec![layer])).expect("a map");
    assert_eq!(map.source().windows, None);
    assert_eq!(map.pixels()[0][1], plane_value(10, -5, 1));
}

#[test]
fn a_cropped_mip_map_lies_where_its_window_says() {
    let levels = |c: usize| {
        let samples = |size: Vec2<usize>, value: &dyn Fn(usize) -> f32| {
            FlatSamples::F32((0..size.area()).map(value).collect())
        };
        let mut size = Vec2(40, 20);
        let mut level_data = vec![samples(size, &|ix| value(ix % 40, ix / 40, c))];
        while size != Vec2(1, 1) {
            size = Vec2((size.0 / 2).max(1), (size.1 / 2).max(1));
            level_data.push(samples(size, &|_| 99.0));
        }
        Levels::Mip {
            rounding_mode: RoundingMode::Down,
            level_data,
        }
    };
    let list = (RGB.iter())
        .map(|(name, c)| AnyChannel::new(*name, levels(*c)))
        .collect();
    let layer = Layer::new(
        Vec2(40, 20),
        LayerAttributes::named("m").with_position(Vec2(8, 4)),
        encoding(Compression::ZIP16, Blocks::Tiles(Vec2(16, 16))),
        AnyChannels::sort(list),
    );
    let image = Image::new(ImageAttributes::new(bounds(0, 0, 96, 48)), layer);
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).expect("written");
    let map = Map::decode(&bytes.into_inner()).expect("a map");
    assert_eq!(map.pixels()[4 * 96 + 8], [0, 1, 2].map(|c| value(0, 0, c)));
    let last = map.pixels()[23 * 96 + 47];
    assert_eq!(last, [0, 1, 2].map(|c| value(39, 19, c)));
    let black = map.pixels().iter().filter(|p| **p == [0.0; 3]).count();
    assert_eq!(black, 96 * 48 - 40 * 20);
}

/// The bytes of a file that does not tell its number of blocks, as many do not: then the reader has
/// to trust its windows.
fn without_block_count(mut bytes: Vec<u8>) -> Vec<u8> {
    let name = b"chunkCount\0";
    let at = (bytes.windows(name.len())).position(|bytes| bytes == name);
    bytes[at.expect("a count")] = b'C';
    bytes
}

/// The bytes of a file with the corners of the window attribute `name` replaced everywhere.
fn with_corners(bytes: &[u8], name: &str, corners: [i32; 4]) -> Vec<u8> {
    let attribute = [name.as_bytes(), b"\0box2i\0\x10\0\0\0"].concat();
    let mut out = bytes.to_vec();
    let mut replaced = 0;
    for at in 0..bytes.len() - attribute.len() {
        if bytes[at..].starts_with(&attribute) {
            let value = corners.map(i32::to_le_bytes).concat();
            out[at + attribute.len()..][..16].copy_from_slice(&value);
            replaced += 1;
        }
    }
    assert!(replaced > 0, "no {name}");
    out
}

#[test]
fn windows_that_make_no_sense_are_refused_at_once() {
    let sphere = bounds(0, 0, 96, 48);
    let file = |data| parts(sphere, vec![windowed_layer("main", &RGB, ZIP, data)]);
    let refused = |bytes: &[u8], needles: &[&str]| {
        let error = Map::decode(bytes).expect_err("refused").to_string();
        assert!(!error.contains('\n'), "{error}");
        for needle in needles {
            assert!(error.contains(needle), "{error} lacks {needle}");
        }
    };
    refused(
        &file(bounds(96, 0, 40, 20)),
        &[
            "no pixel of the data window",
            "40 x 20 at (96, 0)",
            "96 x 48 at (0, 0)",
        ],
    );
    let plain = without_block_count(file(sphere));
    let whole = Map::decode(&plain).expect("a map");
    assert_eq!(whole.pixels().len(), 96 * 48);
    let display = |corners| with_corners(&plain, "displayWindow", corners);
    let data = |corners| with_corners(&plain, "dataWindow", corners);
    let both = |corners| with_corners(&data(corners), "displayWindow", corners);
    refused(
        &display([0, 0, 63, 63]),
        &[
            "64 x 64",
            "twice as wide",
            "display window",
            "data window is 96 x 48",
        ],
    );
    refused(&display([0, 0, -1, -1]), &["displayWindow", "empty"]);
    refused(&data([5, 5, 4, 4]), &["dataWindow", "empty"]);
    // More memory than such a file is worth.
    let huge = MAX_WIDTH as i32;
    refused(
        &display([0, 0, huge - 1, huge / 2 - 1]),
        &["32768 x 16384", "bytes", "data window is 96 x 48"],
    );
    refused(&display([0, 0, 2 * huge - 1, huge - 1]), &["too many"]);
    refused(&both([0, 0, huge - 1, huge / 2 - 1]), &["truncated"]);
    refused(&data([0, 0, huge - 1, huge - 1]), &["truncated"]);
    refused(&data([-500_000_000, 0, 500_000_000, 0]), &["larger than"]);
    for corners in [
        [i32::MIN, i32::MIN, i32::MAX, i32::MAX],
        [i32::MAX; 4],
        [i32::MIN; 4],
        [0, 0, i32::MAX, i32::MAX],
        [i32::MIN, 0, 95, 47],
    ] {
        for bytes in [display(corners), data(corners), both(corners)] {
            refused(&bytes, &[]);
        }
    }
}

#[test]
fn absurd_tiles_are_refused_at_once() {
    let layer = windowed_layer(
        "main",
        &RGB,
        encoding(Compression::RLE, Blocks::Tiles(Vec2(16, 16))),
        bounds(0, 0, 96, 48),
    );
    let plain = without_block_count(parts(bounds(0, 0, 96, 48), vec![layer]));
    let whole = Map::decode(&plain).expect("a map");
    assert_eq!(whole.pixels().len(), 96 * 48);
    let name = b"tiles\0tiledesc\0\x09\0\0\0";
    let at = (plain.windows(name.len()))
        .position(|bytes| bytes == name)
        .expect("tiles")
        + name.len();
    let huge = [-1_000_000, -1_000_000, 1_000_000, 1_000_000];
    for (size, mode) in [
        ([1u32, 1], 0u8),
        ([1, 1], 1),
        ([1, 1], 2),
        ([0, 16], 0),
        ([u32::MAX, u32::MAX], 0),
        ([1 << 29, 1 << 29], 0),
        ([16, 16], 1),
        ([16, 16], 2),
        ([16, 16], 0xff),
    ] {
        let mut bytes = plain.clone();
        bytes[at..at + 4].copy_from_slice(&size[0].to_le_bytes());
        bytes[at + 4..at + 8].copy_from_slice(&size[1].to_le_bytes());
        bytes[at + 8] = mode;
        let many = with_corners(&bytes, "dataWindow", huge);
        for bytes in [bytes, many] {
            match Map::decode(&bytes) {
                Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
                // Said to have mip maps that are not there: the largest level is, whole.
                Ok(map) => {
                    assert!(size == [16, 16] && mode < 3, "{size:?} {mode}");
                    assert_eq!(map.pixels(), whole.pixels());
                }
            }
        }
    }
}

#[test]
fn a_block_that_is_there_twice_is_refused() {
    let layer = windowed_layer("main", &RGB, ZIP, bounds(0, 0, 96, 48));
    let mut bytes = parts(bounds(0, 0, 96, 48), vec![layer]);
    // The table of three blocks follows the headers: the second entry becomes the first.
    let table = (8..bytes.len() - 24)
        .find(|at| {
            let entry = |ix: usize| {
                let bytes: [u8; 8] = bytes[at + 8 * ix..][..8].try_into().expect("eight");
                u64::from_le_bytes(bytes)
            };
            entry(0) == (at + 24) as u64 && entry(1) > entry(0) && entry(2) > entry(1)
        })
        .expect("the table");
    bytes.copy_within(table..table + 8, table + 8);
    let error = Map::decode(&bytes).unwrap_err().to_string();
    assert!(error.contains("twice"), "{error}");
}

const LAYERS: [(&str, usize); 7] = [
    ("B", 2),
    ("G", 1),
    ("R", 0),
    ("sky.B", 5),
    ("sky.G", 4),
    ("sky.R", 3),
    ("mask.Y", 6),
];

/// A file of three parts with data windows of their own: plain, two layers, luminance.
fn several_images() -> Vec<u8> {
    parts(
        bounds(0, 0, 96, 48),
        vec![
            windowed_layer("id", &[("id", 0)], ZIP, bounds(0, 0, 96, 48)),
            windowed_layer("beauty", &LAYERS, ZIP, bounds(0, 0, 96, 48)),
            windowed_layer("2", &[("Y", 9)], ZIP, bounds(8, 4, 40, 20)),
        ],
    )
}

fn selection(part: Option<&str>, layer: Option<&str>) -> MapSelection {
    MapSelection {
        part: part.map(str::to_owned),
        layer: layer.map(str::to_owned),
    }
}

#[test]
fn parts_and_layers_are_chosen_by_name() {
    let bytes = several_images();
    let mut read = 0;
    for (part, layer, [r, b], expected) in [
        (None, None, [0, 2], (1, "")),
        (Some("beauty"), None, [0, 2], (1, "")),
        (Some("1"), Some(""), [0, 2], (1, "")),
        (None, Some("sky"), [3, 5], (1, "sky")),
        (Some("1"), Some("mask"), [6, 6], (1, "mask")),
        (Some("2"), None, [9, 9], (2, "")),
    ] {
        let map = Map::decode_selected(&bytes, &selection(part, layer)).expect("it is there");
        let image = map.source().image.clone().expect("there is a choice");
        assert_eq!((image.part, image.layer.as_str()), expected);
        // Inside the data windows of all parts.
        let pixel = map.pixels()[5 * 96 + 9];
        let value = |c| plane_value(9, 5, c);
        assert_eq!(
            [pixel[0], pixel[2]],
            [value(r), value(b)],
            "{part:?} {layer:?}"
        );
        assert_eq!(map.source().windows.is_some(), expected.0 == 2);
        // What a light set records finds it again.
        let again = Map::decode_selected(&bytes, &MapSelection::recorded(&map.parameters()));
        let again = again.expect("it is there");
        assert_eq!(again.source(), map.source());
        assert_eq!(again.pixels(), map.pixels());
        read += 1;
    }
    assert_eq!(read, 6);
    // One image: nothing to choose, nothing to say.
    let single = plain(SampleType::F32, Compression::ZIP16, Blocks::ScanLines);
    assert_eq!(Map::decode(&single).expect("a map").source().image, None);
}

#[test]
fn unknown_parts_and_layers_list_what_there_is() {
    let bytes = several_images();
    for (part, layer, needles) in [
        (
            Some("sky"),
            None,
            ["\"sky\"", "part 1 \"beauty\""].as_slice(),
        ),
        (Some("3"), None, &["\"3\"", "part 0 \"id\""]),
        (
            Some("id"),
            None,
            &["part 0 \"id\"", "no colour", "layer \"sky\""],
        ),
        (
            None,
            Some("sun"),
            &["\"sun\"", "plain channels", "layer \"mask\""],
        ),
        (
            Some("2"),
            Some("sky"),
            &["part 2 \"2\"", "\"sky\"", "layer \"sky\""],
        ),
    ] {
        let error = Map::decode_selected(&bytes, &selection(part, layer))
            .unwrap_err()
            .to_string();
        for needle in needles {
            assert!(error.contains(needle), "{error} lacks {needle}");
        }
    }
    let radiance = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n";
    let error = Map::decode_selected(radiance, &selection(Some("0"), None))
        .unwrap_err()
        .to_string();
    assert!(error.contains("no parts"), "{error}");
}

/// `bytes` with part `name` declared deep, the flag of the file with it. The declaration is a byte
/// shorter; the name of the part, made longer, keeps the places of the blocks.
fn with_deep_part(bytes: &[u8], name: &str) -> Vec<u8> {
    let text = |value: &str| {
        let length = (value.len() as u32).to_le_bytes();
        [length.as_slice(), value.as_bytes()].concat()
    };
    let replace = |bytes: &[u8], from: usize, old: &[u8], new: &[u8]| {
        let at = bytes[from..]
            .windows(old.len())
            .position(|bytes| bytes == old)
            .expect("it is there")
            + from;
        ([&bytes[..at], new, &bytes[at + old.len()..]].concat(), at)
    };
    let named = |name: &str| [b"name\0string\0".as_slice(), &text(name)].concat();
    let typed = |kind: &str| [b"type\0string\0".as_slice(), &text(kind)].concat();
    // Attributes are in no order: find the header by its name, and its type after or before.
    let (bytes, at) = replace(bytes, 0, &named(name), &named(&format!("{name}+")));
    let kind = typed("scanlineimage");
    let places: Vec<usize> = (0..bytes.len() - kind.len())
        .filter(|at| bytes[*at..].starts_with(&kind))
        .collect();
    let nearest = (places.iter()).min_by_key(|place| place.abs_diff(at));
    let (mut bytes, _) = replace(
        &bytes,
        *nearest.expect("types"),
        &kind,
        &typed("deepscanline"),
    );
    bytes[5] |= 8;
    bytes
}

#[test]
fn deep_parts_are_refused_by_name_and_others_beside_them_read() {
    let sphere = bounds(0, 0, 96, 48);
    let layer = |name: &str| windowed_layer(name, &RGB, ZIP, sphere);
    let bytes = parts(sphere, vec![layer("smoke"), layer("sky")]);
    let bytes = with_deep_part(&bytes, "smoke");
    let map = Map::decode(&bytes).expect("the flat part");
    let image = map.source().image.clone().expect("a choice");
    assert_eq!(image.part_name.as_deref(), Some("sky"));
    assert!(image.choices.contains("deep"), "{}", image.choices);
    assert_eq!(map.pixels()[97][2], plane_value(1, 1, 2));
    let error = Map::decode_selected(&bytes, &selection(Some("smoke+"), None))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("part 0 \"smoke+\" is deep data") && error.contains("\"sky\""),
        "{error}"
    );
    let both = with_deep_part(&bytes, "sky");
    let error = Map::decode(&both).unwrap_err().to_string();
    assert!(error.contains("part 0 \"smoke+\" is deep data"), "{error}");
}
