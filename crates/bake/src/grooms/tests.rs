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
        if style == Style::Layered {
            for (ix, &point) in groom.points.iter().enumerate() {
                let distance = super::bust::distance(point.into());
                assert!(distance > -0.15, "point {ix}: {distance} cm");
                assert!(ix % 24 != 0 || distance < 0.15, "strand {} floats", ix / 24);
            }
            continue;
        }
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
fn the_bust_is_a_closed_surface_around_the_head() {
    let mesh = bust();
    mesh.validate().expect("a mesh");
    // Every edge belongs to two triangles, once in each direction.
    let mut edges = std::collections::HashSet::new();
    for [a, b, c] in &mesh.triangles {
        for edge in [[a, b], [b, c], [c, a]] {
            assert!(edges.insert(edge), "{edge:?} twice");
        }
    }
    assert!(edges.iter().all(|[a, b]| edges.contains(&[*b, *a])));
    // Outwards: the volume is that of head, neck and shoulders, litres.
    let volume = mesh.triangles.iter().map(|triangle| {
        let [a, b, c] = triangle.map(|ix| Vec3::from(mesh.positions[ix as usize]));
        f64::from(a.dot(b.cross(c))) / 6.0
    });
    let litres = volume.sum::<f64>() / 1000.0;
    assert!((8.0..20.0).contains(&litres), "{litres}");
    // On the surface, but for the base, whose edge the grid rounds off.
    for &position in &mesh.positions {
        let distance = super::bust::distance(position.into());
        assert!(
            distance.abs() < 0.1 || position[1] < -33.0,
            "{position:?}: {distance}"
        );
    }
    for (&position, &normal) in mesh.positions.iter().zip(&mesh.normals) {
        let out = Vec3::from(position) + 0.1 * Vec3::from(normal);
        assert!(super::bust::distance(out) > 0.0, "{position:?}");
    }
}

#[test]
fn layered_strands_taper_and_other_styles_have_one_thickness() {
    for style in Style::ALL {
        let groom = grown(&spec(style));
        let diameter = groom.attribute("diameter").expect("all have one");
        if style != Style::Layered {
            assert_eq!(diameter.data.len(), 1);
            continue;
        }
        for strand in diameter.data.chunks(24) {
            assert!(strand.windows(2).all(|pair| pair[1] < pair[0]));
            assert!((strand[23] / strand[0] - 0.3).abs() < 1e-5);
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
