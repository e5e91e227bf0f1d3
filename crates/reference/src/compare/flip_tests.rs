use super::*;

const WIDTH: usize = 48;
const HEIGHT: usize = 32;

/// Blocks of a hash-like pattern beside blocks of ramps, moved and tinted by `k`.
fn pattern(k: u32) -> Vec<[f32; 3]> {
    let mut picture = Vec::with_capacity(WIDTH * HEIGHT);
    for y in 0..HEIGHT as u32 {
        for x in 0..WIDTH as u32 {
            picture.push([0, 1, 2].map(|c| {
                let value = if (x / 8 + y / 8).is_multiple_of(2) {
                    f64::from(((x + k) * (c + 2) + y * (5 - c)) % 17) / 16.0
                } else {
                    f64::from(x + y * 2 + c * 7) / 160.0
                };
                let tint = if c == 1 { 0.125 * f64::from(k) } else { 0.0 };
                (value * (1.0 - tint)) as f32
            }));
        }
    }
    picture
}

/// What the authors' program (flip-evaluator 1.7, linear input) says of the two patterns.
#[test]
fn the_authors_program_agrees() {
    struct Known {
        pixels_per_degree: f64,
        mean: f64,
        max: f64,
        quartiles: [f64; 3],
        /// At (0, 0), (24, 16), (47, 31), (20, 9).
        pixels: [f64; 4],
    }
    let known = [
        Known {
            pixels_per_degree: PIXELS_PER_DEGREE,
            mean: 0.290_500,
            max: 0.683_194,
            quartiles: [0.248_930, 0.296_504, 0.375_134],
            pixels: [0.647_228, 0.522_112, 0.490_762, 0.219_885],
        },
        Known {
            pixels_per_degree: 20.0,
            mean: 0.480_082,
            max: 0.984_861,
            quartiles: [0.373_369, 0.568_102, 0.905_648],
            pixels: [0.941_631, 0.543_333, 0.447_632, 0.233_080],
        },
    ];
    for known in known {
        let map = flip(&pattern(0), &pattern(1), WIDTH, known.pixels_per_degree).expect("one size");
        let at = |x: usize, y: usize| f64::from(map.errors[y * WIDTH + x]);
        let max = map.errors.iter().fold(0.0_f32, |max, x| max.max(*x));
        let mut pairs = vec![(map.mean(), known.mean), (f64::from(max), known.max)];
        let quartiles = [0.25, 0.5, 0.75].map(|q| map.weighted_percentile(q));
        pairs.extend(quartiles.into_iter().zip(known.quartiles));
        let pixels = [at(0, 0), at(24, 16), at(47, 31), at(20, 9)];
        pairs.extend(pixels.into_iter().zip(known.pixels));
        for (found, known) in &pairs {
            assert!((found - known).abs() < 1e-4, "{pairs:?}");
        }
    }
}

#[test]
fn equal_is_zero_and_black_against_white_is_large() {
    let picture = pattern(0);
    let map = flip(&picture, &picture, WIDTH, PIXELS_PER_DEGREE).expect("one size");
    assert_eq!(map.mean(), 0.0);
    assert_eq!(map.weighted_percentile(0.5), 0.0);
    let [black, white] = [0.0, 1.0].map(|value| vec![[value; 3]; 64]);
    let map = flip(&black, &white, 8, PIXELS_PER_DEGREE).expect("one size");
    assert!(map.errors.iter().all(|x| *x > 0.9), "{:?}", map.errors[0]);
    assert!(flip(&picture, &black, WIDTH, PIXELS_PER_DEGREE).is_err());
    assert!(flip(&[], &[], 0, PIXELS_PER_DEGREE).is_err());
}
