//! JPEGs of every kind that is read, and of kinds that are not. The samples are 24 x 16 pixels: the upper left is red, the
//! lower left white, and the right half blue.

use strandlight_scattering::random::SplitMix64;

use super::*;
use crate::ui::photo::Photo;

const BASELINE: &[u8] = include_bytes!("../samples/baseline.jpg");
/// With colours at half the resolution.
const PROGRESSIVE: &[u8] = include_bytes!("../samples/progressive.jpg");
const GREY: &[u8] = include_bytes!("../samples/grey.jpg");
const CMYK: &[u8] = include_bytes!("../samples/cmyk.jpg");

fn read(bytes: &[u8]) -> Result<Photo, PhotoError> {
    Photo::decode("hair.jpg".to_owned(), bytes)
}

/// sRGB levels of the colour that is picked there.
fn level(photo: &Photo, at: [f32; 2]) -> [f64; 3] {
    photo.color_at(at).map(|x| match x <= 0.003_130_8 {
        true => 255.0 * 12.92 * x,
        false => 255.0 * (1.055 * x.powf(1.0 / 2.4) - 0.055),
    })
}

fn assert_near(found: [f64; 3], expected: [f64; 3], what: &str) {
    let is_near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 6.0);
    assert!(is_near, "{what}: {found:?}, not {expected:?}");
}

const RED: [f64; 3] = [200.0, 60.0, 40.0];
const WHITE: [f64; 3] = [240.0; 3];
const BLUE: [f64; 3] = [40.0, 120.0, 200.0];

#[test]
fn colours_are_picked_from_jpegs() {
    for (bytes, what) in [(BASELINE, "baseline"), (PROGRESSIVE, "progressive")] {
        let photo = read(bytes).expect(what);
        assert_eq!((photo.size, photo.pixels.len()), ([24, 16], 24 * 16));
        assert_near(level(&photo, [0.2, 0.2]), RED, what);
        assert_near(level(&photo, [0.2, 0.8]), WHITE, what);
        assert_near(level(&photo, [0.9, 0.5]), BLUE, what);
    }
    let grey = read(GREY).expect("grey");
    let [r, g, b] = level(&grey, [0.2, 0.8]);
    assert!(r == g && g == b && (r - 240.0).abs() < 6.0, "{r} {g} {b}");
    let error = read(CMYK).expect_err("CMYK").to_string();
    assert_eq!(
        error,
        "hair.jpg has CMYK colours: save it as RGB, or as PNG"
    );
}

/// The sample with an EXIF segment of that orientation.
fn turned(number: u16, is_little: bool) -> Vec<u8> {
    let short = |x: u16| match is_little {
        true => x.to_le_bytes(),
        false => x.to_be_bytes(),
    };
    let long = |x: u32| match is_little {
        true => x.to_le_bytes(),
        false => x.to_be_bytes(),
    };
    let mut exif = b"Exif\0\0".to_vec();
    exif.extend(if is_little { b"II*\0" } else { b"MM\0*" });
    exif.extend(long(8));
    exif.extend(short(2));
    // Another tag before it.
    for (tag, value) in [(0x0100, 24), (0x0112, number)] {
        exif.extend(short(tag));
        exif.extend(short(3));
        exif.extend(long(1));
        exif.extend(short(value));
        exif.extend(short(0));
    }
    exif.extend(long(0));
    let mut file = BASELINE[..2].to_vec();
    file.extend([0xff, 0xe1]);
    file.extend((exif.len() as u16 + 2).to_be_bytes());
    file.extend(exif);
    file.extend(&BASELINE[2..]);
    file
}

#[test]
fn photos_are_upright() {
    // Of what the file has at its upper left, lower left and right: where that is in the picture.
    let (tl, tr, bl, br) = ([0.1, 0.1], [0.9, 0.1], [0.1, 0.9], [0.9, 0.9]);
    for (number, size, [red, white, blue]) in [
        (1, [24, 16], [tl, bl, tr]),
        (2, [24, 16], [tr, br, tl]),
        (3, [24, 16], [br, tr, tl]),
        (4, [24, 16], [bl, tl, tr]),
        (5, [16, 24], [tl, tr, bl]),
        (6, [16, 24], [tr, tl, br]),
        (7, [16, 24], [br, bl, tr]),
        (8, [16, 24], [bl, br, tl]),
        // No orientation that there is.
        (0, [24, 16], [tl, bl, tr]),
        (9, [24, 16], [tl, bl, tr]),
    ] {
        for is_little in [true, false] {
            let what = format!("orientation {number}");
            let photo = read(&turned(number, is_little)).expect(&what);
            assert_eq!((photo.size, photo.pixels.len()), (size, 24 * 16), "{what}");
            for (at, color) in [(red, RED), (white, WHITE), (blue, BLUE)] {
                assert_near(level(&photo, at), color, &what);
            }
        }
    }
    // Lists of tags that lead nowhere.
    for exif in [
        &b""[..],
        b"II*\0",
        b"II*\0\xff\xff\xff\xff",
        b"II*\0\x08\0\0\0\xff\xff",
        b"MM\0*\0\0\0\x08\0\x01\x01\x12",
        b"hair",
    ] {
        assert_eq!(orientation(exif), None, "{exif:?}");
    }
}

#[test]
fn damaged_files_are_named_and_nothing_panics() {
    for (bytes, what) in [(BASELINE, "baseline"), (PROGRESSIVE, "progressive")] {
        // What lacks bytes of the last row of blocks is taken as it is; here that is one of two.
        let scan = bytes.windows(2).rposition(|it| it == [0xff, 0xda]);
        let scan = scan.expect("a scan");
        for end in 0..bytes.len() {
            let found = read(&bytes[..end]);
            let Err(error) = found else {
                assert!(end > scan + 12, "{what}: {end} of {}", bytes.len());
                continue;
            };
            let error = error.to_string();
            assert!(error.starts_with("hair.jpg: "), "{end}: {error}");
            assert!(!error.contains('\n'), "{error}");
        }
        let mut random = SplitMix64(7);
        let mut n_refused = 0;
        for _ in 0..3000 {
            let mut damaged = bytes.to_vec();
            for _ in 0..1 + random.next_u64() % 4 {
                let at = 2 + (random.next_u64() as usize) % (damaged.len() - 2);
                damaged[at] = random.next_u64() as u8;
            }
            n_refused += usize::from(read(&damaged).is_err());
        }
        assert!(n_refused > 100, "{what}: {n_refused}");
    }
    // A header of 65535 x 65535 pixels.
    let mut absurd = BASELINE.to_vec();
    let frame = absurd.windows(2).position(|it| it == [0xff, 0xc0]);
    let size = frame.expect("a header") + 5;
    absurd[size..size + 4].fill(0xff);
    let error = read(&absurd).expect_err("absurd").to_string();
    assert!(error.contains("4294836225 pixels"), "{error}");
    // Of no pixels.
    absurd[size..size + 4].fill(0);
    assert!(read(&absurd).is_err());
    let error = read(b"\xff\xd8\xffnothing").expect_err("garbage");
    assert!(error.to_string().starts_with("hair.jpg: "), "{error}");
    assert!(read(b"GIF89a").is_err());
}
