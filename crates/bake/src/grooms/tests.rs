use glam::Vec3;

use super::scalp::HEAD_RADII;
use super::*;

fn spec(style: Style) -> GrowSpec {
    GrowSpec {
        style,
        strands: 600,
        points_per_strand: 24,
        seed: 7,
    }
}

fn grown(spec: &GrowSpec) -> Groom {
    generate(spec, &Progress::silent()).expect("the counts are in range")
}

#[test]
fn grooms_are_valid_and_have_the_asked_size() {
    for style in Style::ALL {
        let groom = grown(&spec(style));
        groom
            .validate()
            .unwrap_or_else(|error| panic!("{}: {error}", style.name()));
        assert_eq!(groom.points.len(), 600 * 24);
        assert_eq!(groom.strand_offsets.len(), 601);
    }
}

#[test]
fn equal_seeds_give_equal_hair_on_any_number_of_threads() {
    let spec = spec(Style::Curly);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| grown(&spec))
    };
    let one = on(1);
    assert_eq!(one, on(3));
    let other = grown(&GrowSpec { seed: 8, ..spec });
    assert_ne!(one.points, other.points);
}

#[test]
fn hair_stays_outside_the_head_and_starts_on_it() {
    for style in Style::ALL {
        let groom = grown(&spec(style));
        let scaled = |point: [f32; 3]| (Vec3::from(point) / HEAD_RADII).length();
        for (ix, &point) in groom.points.iter().enumerate() {
            assert!(
                scaled(point) > 0.999,
                "{} point {ix} is inside",
                style.name()
            );
            if ix % 24 == 0 {
                assert!(
                    scaled(point) < 1.001,
                    "{} strand {} floats",
                    style.name(),
                    ix / 24
                );
            }
        }
    }
}

#[test]
fn strands_are_smooth_and_of_believable_length() {
    for style in Style::ALL {
        let groom = grown(&spec(style));
        for strand in groom.points.chunks(24) {
            let lengths: Vec<f32> = strand
                .windows(2)
                .map(|pair| Vec3::from(pair[0]).distance(Vec3::from(pair[1])))
                .collect();
            let total: f32 = lengths.iter().sum();
            assert!((2.0..80.0).contains(&total), "{}: {total} cm", style.name());
            let longest = lengths.iter().fold(0.0_f32, |a, &b| a.max(b));
            assert!(
                longest < 4.0 * total / 23.0,
                "{}: a jump of {longest} cm",
                style.name()
            );
        }
    }
}

#[test]
fn sizes_out_of_range_are_refused() {
    let good = spec(Style::Bob);
    for bad in [
        GrowSpec { strands: 0, ..good },
        GrowSpec {
            strands: MAX_STRANDS + 1,
            ..good
        },
        GrowSpec {
            points_per_strand: 1,
            ..good
        },
        GrowSpec {
            points_per_strand: MAX_POINTS_PER_STRAND + 1,
            ..good
        },
        GrowSpec {
            strands: MAX_STRANDS,
            points_per_strand: 1000,
            ..good
        },
    ] {
        assert!(generate(&bad, &Progress::silent()).is_err(), "{bad:?}");
    }
    assert!(
        generate(
            &GrowSpec {
                strands: 1,
                points_per_strand: 2,
                ..good
            },
            &Progress::silent()
        )
        .is_ok()
    );
}
