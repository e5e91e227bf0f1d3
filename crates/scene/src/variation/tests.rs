//! Fibres by strand and by lock, and shapes.

use std::borrow::Cow;

use glam::Vec3;
use strandlight_formats::{Groom, VariationSection};
use strandlight_scattering::HairParams;

use super::{FibreVariation, ShapeVariation};
use crate::paint::{Paint, PaintedPoint};

const SIGMA_A: [f64; 3] = [0.5, 0.9, 1.8];
const N_POINTS: usize = 12;

/// Strands of 11 cm that hang from a square of 10 cm, each of its own direction.
fn groom(side: usize) -> Groom {
    let mut groom = Groom::default();
    groom.strand_offsets.push(0);
    for ix in 0..side * side {
        let [x, z] = [ix % side, ix / side].map(|at| 10.0 * at as f32 / side as f32);
        let tilt = [0.1 * (ix as f32).sin(), 0.1 * (1.7 * ix as f32).cos()];
        for point in 0..N_POINTS {
            let along = point as f32;
            groom
                .points
                .push([x + tilt[0] * along, -along, z + tilt[1] * along]);
        }
        groom.strand_offsets.push(groom.points.len() as u32);
    }
    groom
}

fn section(change: impl FnOnce(&mut VariationSection)) -> VariationSection {
    let mut section = VariationSection {
        seed: 4,
        ..VariationSection::default()
    };
    change(&mut section);
    section
}

/// The paint of each strand, of which all points have the same.
fn by_strand(section: &VariationSection, groom: &Groom) -> Vec<PaintedPoint> {
    let fibres = FibreVariation::new(section, groom).expect("varied");
    let paint = fibres.under(SIGMA_A, None).expect("of the groom");
    let strands = paint.points.chunks(N_POINTS).map(|points| {
        assert!(points.iter().all(|point| *point == points[0]));
        points[0]
    });
    strands.collect()
}

/// Mean and standard deviation.
fn moments(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    [mean, square.sqrt()]
}

/// Logarithms of the factors on absorption.
fn factors(strands: &[PaintedPoint], channel: usize) -> Vec<f64> {
    let of = |point: &PaintedPoint| (f64::from(point.sigma_a[channel]) / SIGMA_A[channel]).ln();
    strands.iter().map(of).collect()
}

#[test]
fn amounts_are_standard_deviations() {
    let groom = groom(100);
    let melanin = by_strand(&section(|it| it.melanin_strand = 0.3), &groom);
    for channel in 0..3 {
        let [mean, deviation] = moments(&factors(&melanin, channel));
        // Standard errors: 0.003 and 0.002.
        assert!(
            mean.abs() < 0.012 && (deviation - 0.3).abs() < 0.01,
            "{mean} {deviation}"
        );
    }
    assert!(
        melanin
            .iter()
            .all(|point| point.width_scale == 1.0 && point.weight == 1.0)
    );
    // Redness leaves the geometric mean of the channels.
    let redness = by_strand(&section(|it| it.redness_strand = 0.5), &groom);
    let all = [0, 1, 2].map(|channel| factors(&redness, channel));
    let of_one = strandlight_scattering::color::redness_factors(1.0);
    for (channel, logarithms) in all.iter().enumerate() {
        let [mean, deviation] = moments(logarithms);
        let expected = 0.5 * of_one[channel].ln().abs();
        assert!(
            mean.abs() < 0.01 && (deviation / expected - 1.0).abs() < 0.03,
            "{deviation}"
        );
    }
    for strand in 0..redness.len() {
        let sum: f64 = all.iter().map(|logarithms| logarithms[strand]).sum();
        assert!(sum.abs() < 1e-5, "{sum}");
    }
    let roughness = by_strand(&section(|it| it.roughness_strand = 0.2), &groom);
    let logarithms: Vec<f64> = roughness
        .iter()
        .map(|it| f64::from(it.width_scale).ln())
        .collect();
    let [mean, deviation] = moments(&logarithms);
    assert!(mean.abs() < 0.01 && (deviation - 0.2).abs() < 0.01);
    // What is not varied stays the hair's own.
    assert!(roughness.iter().all(|point| point.weight == 0.0));
    let grey = by_strand(&section(|it| it.grey = 0.25), &groom);
    let is_grey = |it: &PaintedPoint| it.weight == 1.0 && it.sigma_a == [0.0; 3];
    let n_grey = grey.iter().filter(|it| is_grey(it)).count() as f64;
    assert!((n_grey / 1e4 - 0.25).abs() < 0.02, "{n_grey}");
    let all_grey = by_strand(&section(|it| it.grey = 1.0), &groom);
    assert!(
        all_grey
            .iter()
            .all(|it| it.sigma_a == [0.0; 3] && it.weight == 1.0)
    );
}

#[test]
fn locks_vary_as_one_and_add_up_with_strands() {
    let groom = groom(100);
    let of_locks = by_strand(
        &section(|it| (it.melanin_lock, it.lock_size_cm) = (0.3, 1.0)),
        &groom,
    );
    let mut distinct: Vec<u32> = of_locks.iter().map(|it| it.sigma_a[0].to_bits()).collect();
    distinct.sort_unstable();
    distinct.dedup();
    assert!((80..200).contains(&distinct.len()), "{}", distinct.len());
    // Neighbours mostly have the same one.
    let n_alike = of_locks
        .windows(2)
        .filter(|pair| pair[0] == pair[1])
        .count();
    assert!((7_500..9_800).contains(&n_alike), "{n_alike}");
    let [_, deviation] = moments(&factors(&of_locks, 0));
    assert!((deviation - 0.3).abs() < 0.06, "{deviation}");
    let both = section(|it| {
        (it.melanin_lock, it.melanin_strand, it.lock_size_cm) = (0.3, 0.2, 1.0);
    });
    let both = factors(&by_strand(&both, &groom), 0);
    let of_strands = by_strand(&section(|it| it.melanin_strand = 0.2), &groom);
    let [of_locks, of_strands] = [&of_locks, &of_strands].map(|it| factors(it, 0));
    for ((sum, a), b) in both.iter().zip(&of_locks).zip(&of_strands) {
        assert!((sum - a - b).abs() < 1e-5);
    }
}

#[test]
fn numbers_belong_to_roots_and_seeds() {
    let groom = groom(30);
    let all = section(|it| {
        (it.melanin_strand, it.melanin_lock, it.roughness_strand) = (0.3, 0.2, 0.2);
        (it.redness_strand, it.grey) = (0.4, 0.1);
    });
    let strands = by_strand(&all, &groom);
    assert_eq!(strands, by_strand(&all, &groom));
    // Sorted otherwise and cut short.
    let mut other = Groom::default();
    other.strand_offsets.push(0);
    for strand in (0..groom.n_strands()).rev() {
        other.points.extend(&groom.points[groom.strand(strand)]);
        other.points.last_mut().expect("points")[1] += 0.5;
        other.strand_offsets.push(other.points.len() as u32);
    }
    let mut reversed = by_strand(&all, &other);
    reversed.reverse();
    assert_eq!(reversed, strands);
    let reseeded = VariationSection {
        seed: 5,
        ..all.clone()
    };
    let other = by_strand(&reseeded, &groom);
    let n_same = other.iter().zip(&strands).filter(|(a, b)| a == b).count();
    assert!(n_same < 30, "{n_same}");
    // Strands of one root differ all the same.
    let mut one_root = groom.clone();
    for strand in 0..30 {
        one_root.points[N_POINTS * strand] = [0.0, 1.0, 0.0];
    }
    let mut distinct: Vec<u32> = by_strand(&section(|it| it.melanin_strand = 0.3), &one_root)[..30]
        .iter()
        .map(|point| point.sigma_a[0].to_bits())
        .collect();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), 30);
}

#[test]
fn paint_lies_over_the_variation() {
    let groom = groom(10);
    let varied = section(|it| (it.melanin_strand, it.roughness_strand) = (0.3, 0.2));
    let fibres = FibreVariation::new(&varied, &groom).expect("varied");
    let bare = fibres.under(SIGMA_A, None).expect("of the groom");
    let mut paint = Paint::unpainted(groom.points.len());
    let dye = PaintedPoint {
        sigma_a: [3.0, 0.2, 0.1],
        weight: 0.25,
        width_scale: 2.0,
        shift_scale: 1.5,
        ..PaintedPoint::NONE
    };
    paint.points[100..200].fill(dye);
    paint.points[150].weight = 1.0;
    let over = fibres.under(SIGMA_A, Some(&paint)).expect("of the groom");
    let hair = HairParams {
        sigma_a: SIGMA_A,
        ..HairParams::default()
    };
    for (ix, (found, under)) in over.points.iter().zip(&bare.points).enumerate() {
        let point = &paint.points[ix];
        // As if the hair had the strand's fibre from the beginning.
        let expected = point.on(&under.on(&hair));
        let found = found.on(&hair);
        for c in 0..3 {
            assert!((found.sigma_a[c] - expected.sigma_a[c]).abs() < 1e-5);
        }
        assert!((found.width.tt / expected.width.tt - 1.0).abs() < 1e-6);
        assert!((found.shift.tt - expected.shift.tt).abs() < 1e-6);
    }
    assert_eq!(over.points[150].sigma_a, dye.sigma_a, "wholly covered");
    assert_eq!(
        over.points[150].around,
        Some(dye.sigma_a),
        "as wholly as its neighbours"
    );
    assert_eq!(over.points[..100], bare.points[..100]);
    // Piece by piece it comes to the same; what is outside of the range stays.
    let absorption = (SIGMA_A, fibres.around(SIGMA_A));
    for range in [0..1200, 100..101, 95..161, 1199..5000, 7..7] {
        let mut pieces = bare.clone();
        fibres
            .lay_under(absorption, Some(&paint), range.clone(), &mut pieces)
            .expect("of the groom");
        for (ix, point) in pieces.points.iter().enumerate() {
            let expected = if range.contains(&ix) { &over } else { &bare };
            assert_eq!(*point, expected.points[ix], "{ix} {range:?}");
        }
    }
    assert!(fibres.under(SIGMA_A, Some(&Paint::unpainted(3))).is_err());
}

#[test]
fn hair_around_leaves_what_strands_leave_on_the_mean() {
    let groom = groom(2000);
    let grey = FibreVariation::new(&section(|it| it.grey = 0.25), &groom).expect("a variation");
    let points = grey.under(SIGMA_A, None).expect("of the groom").points;
    let hair = HairParams {
        sigma_a: SIGMA_A,
        ..HairParams::default()
    };
    let left = |sigma_a: f64| (-std::f64::consts::FRAC_PI_2 * sigma_a).exp();
    for (c, sigma_a) in SIGMA_A.into_iter().enumerate() {
        let mean = points.iter().map(|point| left(point.on(&hair).sigma_a[c]));
        let mean = mean.sum::<f64>() / points.len() as f64;
        for point in &points {
            let around = f64::from(point.around.expect("strands differ")[c]);
            assert!((left(around) / mean - 1.0).abs() < 1e-5, "{around} {mean}");
        }
        assert!(mean > left(sigma_a) && mean < 1.0, "{mean}");
    }
    // Strands that differ in their widths alone are as those around them.
    let rough = FibreVariation::new(&section(|it| it.roughness_strand = 0.5), &groom);
    let points = rough
        .expect("a variation")
        .under(SIGMA_A, None)
        .unwrap()
        .points;
    assert!(points.iter().all(|point| point.around.is_none()));
}

#[test]
fn nothing_varies_by_default_nor_by_a_seed() {
    let groom = groom(4);
    let plain = section(|it| (it.lock_size_cm, it.frizz_length_cm) = (1.0, 3.0));
    assert!(FibreVariation::new(&plain, &groom).is_none());
    assert!(ShapeVariation::new(&plain, &groom).is_none());
    assert!(matches!(
        ShapeVariation::points(&plain, &groom),
        Cow::Borrowed(_)
    ));
    // Fibres and shapes have nothing to do with each other.
    let shape = section(|it| (it.clump, it.frizz) = (0.5, 0.5));
    assert!(FibreVariation::new(&shape, &groom).is_none());
    assert!(ShapeVariation::new(&section(|it| it.grey = 0.5), &groom).is_none());
}

/// Largest relative change of the length of a piece, and mean distance that tips moved.
fn changes(before: &[[f32; 3]], after: &[[f32; 3]]) -> [f32; 2] {
    let vector = |p: &[f32; 3]| Vec3::from(*p);
    let (mut worst, mut moved) = (0.0, 0.0);
    for (a, b) in before.chunks(N_POINTS).zip(after.chunks(N_POINTS)) {
        assert_eq!(a[0], b[0], "roots stay");
        for (a, b) in a.windows(2).zip(b.windows(2)) {
            let length = |pair: &[[f32; 3]]| vector(&pair[0]).distance(vector(&pair[1]));
            worst = f32::max(worst, (length(b) / length(a) - 1.0).abs());
        }
        let last = N_POINTS - 1;
        moved += vector(&a[last]).distance(vector(&b[last]));
    }
    [worst, moved / (before.len() / N_POINTS) as f32]
}

#[test]
fn roots_and_lengths_stay_and_frizz_grows_towards_the_tip() {
    let groom = groom(30);
    let mut last = 0.0;
    for frizz in [0.1, 0.3, 1.0, 4.0] {
        let bent = section(|it| it.frizz = frizz);
        let points = ShapeVariation::points(&bent, &groom);
        let [worst, moved] = changes(&groom.points, &points);
        println!("frizz {frizz}: lengths within {worst:.1e}, tips move {moved:.2} cm");
        assert!(worst < 1e-4 && moved > 1.5 * last, "{worst} {moved}");
        last = moved;
        // The angle between pieces and where they were, by their place along the strand.
        let mut turned = [0.0; N_POINTS - 1];
        for (a, b) in groom.points.chunks(N_POINTS).zip(points.chunks(N_POINTS)) {
            for (ix, sum) in turned.iter_mut().enumerate() {
                let piece = |p: &[[f32; 3]]| Vec3::from(p[ix + 1]) - Vec3::from(p[ix]);
                *sum += piece(a).angle_between(piece(b)) / groom.n_strands() as f32;
            }
        }
        assert!(turned[10] > 3.0 * turned[1], "{turned:?}");
        if frizz == 1.0 {
            // As its help says: about 30 degrees.
            println!("{:.1} degrees at the tip", turned[10].to_degrees());
            assert!(
                (25.0..40.0).contains(&turned[10].to_degrees()),
                "{turned:?}"
            );
        }
    }
    let [a, b] = [4, 5].map(|seed| {
        let bent = section(|it| (it.frizz, it.seed) = (0.5, seed));
        ShapeVariation::points(&bent, &groom).into_owned()
    });
    assert_ne!(a, b);
}

#[test]
fn clumps_draw_tips_together() {
    let groom = groom(30);
    // Mean distance of tips from the nearest other strand's tip.
    let gap = |points: &[[f32; 3]]| {
        let tips: Vec<Vec3> = points
            .chunks(N_POINTS)
            .map(|it| it[N_POINTS - 1].into())
            .collect();
        let nearest = tips.iter().enumerate().map(|(ix, tip)| {
            let others = tips.iter().enumerate().filter(|(other, _)| *other != ix);
            others
                .map(|(_, other)| tip.distance(*other))
                .fold(f32::INFINITY, f32::min)
        });
        nearest.sum::<f32>() / tips.len() as f32
    };
    let mut last = gap(&groom.points);
    for clump in [0.3, 0.6, 1.0] {
        let drawn = section(|it| it.clump = clump);
        let points = ShapeVariation::points(&drawn, &groom);
        let [worst, moved] = changes(&groom.points, &points);
        let now = gap(&points);
        println!("clump {clump}: {now:.3} cm between tips, tips move {moved:.2} cm");
        assert!(worst < 1e-4, "{worst}");
        assert!(now < last, "{now} {last}");
        last = now;
    }
    assert!(last < 0.03, "tips meet: {last}");
}

#[test]
fn another_pose_is_bent_likewise() {
    let groom = groom(10);
    let both = section(|it| (it.clump, it.frizz) = (0.4, 0.3));
    let shape = ShapeVariation::new(&both, &groom).expect("bent");
    let bent = shape.bend(&groom.points).expect("of the groom");
    assert_eq!(bent, ShapeVariation::points(&both, &groom).into_owned());
    let shift = |points: &[[f32; 3]]| -> Vec<[f32; 3]> {
        points.iter().map(|&[x, y, z]| [x + 64.0, y, z]).collect()
    };
    let moved = shape.bend(&shift(&groom.points)).expect("of the groom");
    for (a, b) in moved.iter().zip(shift(&bent)) {
        assert!(Vec3::from(*a).distance(b.into()) < 1e-3);
    }
    assert!(shape.bend(&groom.points[1..]).is_err());
}

/// Strands without extent, points or sense give an answer of the right length.
#[test]
fn odd_strands_are_bent_without_a_fault() {
    let groom = Groom {
        points: vec![
            [1.0; 3],
            [1.0; 3],
            [2.0; 3],
            [f32::NAN; 3],
            [0.0; 3],
            [1e30; 3],
            [f32::INFINITY; 3],
            [0.0, 1.0, 0.0],
        ],
        strand_offsets: vec![0, 2, 2, 3, 5, 7, 8],
        ..Groom::default()
    };
    let all = section(|it| {
        (it.clump, it.frizz, it.lock_size_cm, it.frizz_length_cm) = (1.0, 4.0, 0.05, 0.05);
        (it.melanin_strand, it.melanin_lock) = (1.0, 1.0);
    });
    let shape = ShapeVariation::new(&all, &groom).expect("bent");
    assert_eq!(shape.bend(&groom.points).expect("of the groom").len(), 8);
    let fibres = FibreVariation::new(&all, &groom).expect("varied");
    let paint = fibres.under([50.0; 3], None).expect("of the groom");
    assert!(paint.points.iter().all(|point| point.clamped() == *point));
}
