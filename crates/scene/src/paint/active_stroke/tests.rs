//! Tests of strokes.

use super::super::{BrushEffect, BrushMask};
use super::*;
use crate::strands::Strands;

/// A curtain of 41 strands from y = 0 down to -10 at x = -10..=10, 11 points each, and one
/// more in front of its middle.
fn curtain() -> Strands {
    let (mut points, mut offsets) = (Vec::new(), vec![0]);
    for strand in 0..42 {
        let (x, z) = match strand {
            41 => (0.0, 3.0),
            _ => (0.5 * strand as f32 - 10.0, 0.0),
        };
        points.extend((0..11).map(|ix| [x, -(ix as f32), z]));
        offsets.push(points.len() as u32);
    }
    Strands::new(&points, &offsets, |_, _| 0.01, true).unwrap()
}

fn camera() -> Camera {
    Camera {
        eye: Vec3::new(0.0, -5.0, 60.0),
        target: Vec3::new(0.0, -5.0, 0.0),
        up: Vec3::Y,
        fov_y: 0.5,
    }
}

const SIZE: [u32; 2] = [400, 300];

#[test]
fn the_strand_in_front_is_picked() {
    let picker = Picker::new(&curtain());
    let hit = picker.pick(&camera(), SIZE, [200.0, 150.0]).unwrap();
    assert!(hit.distance(Vec3::new(0.0, -5.0, 3.0)) < 1e-3, "{hit}");
    let px_per_cm = 150.0 / (60.0 * 0.25f32.tan());
    let cursor = [200.0 + 5.0 * px_per_cm + 1.0, 150.0 + 2.25 * px_per_cm];
    let hit = picker.pick(&camera(), SIZE, cursor).unwrap();
    assert!(hit.distance(Vec3::new(5.0, -7.25, 0.0)) < 1e-2, "{hit}");
    assert_eq!(picker.pick(&camera(), SIZE, [5.0, 5.0]), None);
    assert_eq!(picker.pick(&camera(), SIZE, [f32::NAN, 5.0]), None);
    // From behind, the curtain is in front.
    let behind = Camera {
        eye: Vec3::new(0.0, -5.0, -60.0),
        ..camera()
    };
    let hit = picker.pick(&behind, SIZE, [200.0, 150.0]).unwrap();
    assert!(hit.z.abs() < 1e-3, "{hit}");
}

fn stroke(brush: Brush, path: StrokePath) -> (Stroke, Paint) {
    let strands = curtain();
    let picker = Picker::new(&strands);
    let mut paint = Paint::unpainted(strands.n_groom_points());
    let stroke = BrushStroke { brush, path };
    let stroke = picker.stroke(&mut paint, &camera(), SIZE, &stroke).unwrap();
    (stroke, paint)
}

/// The left half of the curtain is dyed.
fn half_dyed(strands: &Strands) -> Paint {
    let mut paint = Paint::unpainted(strands.n_groom_points());
    for (point, origin) in strands.points.iter().zip(strands.origins()) {
        if origin.fraction == 0.0 && point[0] < 0.0 {
            paint.points[origin.point as usize] = PaintedPoint {
                sigma_a: [0.1, 2.0, 3.0],
                weight: 1.0,
                width_scale: 2.0,
                ..PaintedPoint::NONE
            };
        }
    }
    paint
}

/// Paint of the groom's point of the curtain at x and 5 cm below the root, after a stroke over it.
fn after(brush: Brush, path: [[f32; 3]; 2]) -> impl Fn(f32) -> PaintedPoint {
    let strands = curtain();
    let mut paint = half_dyed(&strands);
    let stroke = BrushStroke {
        brush,
        path: StrokePath::World(path.to_vec()),
    };
    let picker = Picker::new(&strands);
    let before = paint.clone();
    let stroke = picker.stroke(&mut paint, &camera(), SIZE, &stroke).unwrap();
    let mut undone = paint.clone();
    undone.revert(&stroke);
    assert_eq!(undone, before);
    move |x| paint.points[(11.0 * (2.0 * (x + 10.0))) as usize + 5]
}

#[test]
fn blur_softens_an_edge_and_leaves_what_is_even() {
    let brush = Brush {
        radius_cm: 2.0,
        effect: BrushEffect::Blur,
        ..Brush::default()
    };
    let at = after(brush, [[-6.0, -5.0, 0.0], [6.0, -5.0, 0.0]]);
    let weights: Vec<f32> = (-5..=5).map(|x| at(x as f32).weight).collect();
    assert!(
        weights.windows(2).all(|pair| pair[0] >= pair[1]),
        "{weights:?}"
    );
    assert!((0.3..0.7).contains(&at(0.0).weight), "{weights:?}");
    let soft = weights
        .iter()
        .filter(|weight| (0.01..0.99).contains(*weight));
    assert!(soft.count() >= 3, "{weights:?}");
    let width = at(0.0).width_scale;
    assert!((1.1..1.9).contains(&width), "{width}");
    // Away from the edge there is nothing to soften.
    assert_eq!((weights[0], weights[10]), (1.0, 0.0));
    assert_eq!(at(-4.5).sigma_a, [0.1, 2.0, 3.0]);
}

#[test]
fn smear_drags_paint_the_way_that_it_goes() {
    let brush = Brush {
        radius_cm: 1.0,
        effect: BrushEffect::Smear,
        softness: 0.0,
        ..Brush::default()
    };
    let path = [[-4.0, -5.0, 0.0], [4.0, -5.0, 0.0]];
    let right = after(brush, path);
    let left = after(brush, [path[1], path[0]]);
    // Dye comes into the bare half, or bareness into the dyed one; less and less.
    let [near, far] = [right(1.0).weight, right(3.0).weight];
    assert!(near > 0.3 && far < near && far > 0.0, "{near} {far}");
    assert_eq!(right(-3.0).weight, 1.0);
    let [near, far] = [left(-1.0).weight, left(-3.0).weight];
    assert!(near < 0.7 && far > near, "{near} {far}");
    assert_eq!(left(3.0).weight, 0.0);
    assert!((1.0..2.0).contains(&left(-2.0).width_scale));
}

#[test]
fn pressure_is_a_share_of_the_strength() {
    let strands = curtain();
    let picker = Picker::new(&strands);
    let weight = |pressure: f32| {
        let mut paint = Paint::unpainted(strands.n_groom_points());
        let mut stroke = ActiveStroke::new(Brush::default()).unwrap();
        stroke.set_pressure(pressure);
        stroke.dab(&picker, &mut paint, Vec3::new(2.0, -5.0, 0.0));
        paint
            .points
            .iter()
            .map(|point| point.weight)
            .fold(0.0, f32::max)
    };
    assert_eq!(
        [0.0, 0.25, 1.0, 3.0, f32::NAN].map(weight),
        [0.0, 0.25, 1.0, 1.0, 1.0]
    );
}

#[test]
fn floods_cover_all_hair_within_the_mask() {
    let strands = curtain();
    let picker = Picker::new(&strands);
    let mut paint = half_dyed(&strands);
    let mut brush = Brush {
        strength: 0.5,
        effect: BrushEffect::Erase,
        mask: BrushMask {
            from: 0.5,
            to: 1.0,
            soft: 0.0,
        },
        ..Brush::default()
    };
    let stroke = picker.flood(&mut paint, &brush).unwrap();
    // Twenty strands are dyed, six of eleven points of each lie in the mask.
    assert_eq!(stroke.changed.len(), 20 * 6);
    assert!(stroke.changed.iter().all(|(.., after)| after.weight == 0.5));
    brush.effect = BrushEffect::Dye([1.0; 3]);
    let stroke = picker.flood(&mut paint, &brush).unwrap();
    assert_eq!(stroke.changed.len(), 42 * 6);
    brush.effect = BrushEffect::Smear;
    assert!(picker.flood(&mut paint, &brush).unwrap().is_empty());
    // Strands that are even stay as they are; a tip that is dyed fades into the rest.
    brush = Brush {
        radius_cm: 3.0,
        effect: BrushEffect::Blur,
        ..Brush::default()
    };
    let mut paint = Paint::unpainted(strands.n_groom_points());
    paint.points[10].weight = 1.0;
    let mut after = paint.clone();
    after.apply(&picker.flood(&mut paint, &brush).unwrap());
    let weights: Vec<f32> = after.points[6..11].iter().map(|it| it.weight).collect();
    assert!(weights.windows(2).all(|pair| pair[0] < pair[1]) || weights[0] == 0.0);
    assert!(weights[4] < 0.8 && weights[3] > 0.1, "{weights:?}");
    assert!(after.points[11..].iter().all(|it| it.weight == 0.0));
    brush.radius_cm = f32::NAN;
    assert!(picker.flood(&mut paint, &brush).is_err());
}

#[test]
fn a_dab_touches_the_ball_and_can_be_undone() {
    let brush = Brush {
        radius_cm: 1.2,
        softness: 0.0,
        ..Brush::default()
    };
    let centre = [2.0, -5.0, 0.0];
    let (stroke, mut paint) = stroke(brush, StrokePath::World(vec![centre]));
    let strands = curtain();
    let mut inside = 0;
    for (point, origin) in strands.points.iter().zip(strands.origins()) {
        if origin.fraction != 0.0 {
            continue;
        }
        let distance = Vec3::from_slice(point).distance(Vec3::from(centre));
        let painted = paint.points[origin.point as usize];
        if distance < 1.19 {
            assert_eq!(painted.weight, 1.0, "{point:?}");
            inside += 1;
        }
        // Hair between points counts for the points at its ends.
        assert!(distance < 2.21 || !painted.is_painted(), "{point:?}");
    }
    assert!(inside >= 9, "{inside}");
    assert!(stroke.changed.is_sorted_by_key(|&(ix, ..)| ix));
    paint.revert(&stroke);
    assert!(!paint.is_painted());
}

#[test]
fn what_a_point_gets_does_not_depend_on_how_the_cursor_was_seen() {
    let brush = Brush {
        radius_cm: 1.5,
        along_cm: 2.0,
        strength: 0.7,
        ..Brush::default()
    };
    let ends = vec![[140.0, 120.0], [260.0, 130.0]];
    let between = |t: f32| [140.0 + 120.0 * t, 120.0 + 10.0 * t];
    let finely = (0..=200).map(|ix| between(ix as f32 / 200.0)).collect();
    let (a, _) = stroke(brush, StrokePath::Pixels(ends.clone()));
    let (b, _) = stroke(brush, StrokePath::Pixels(finely));
    let (again, _) = stroke(brush, StrokePath::Pixels(ends));
    assert_eq!(a, again);
    let heaviest = |stroke: &Stroke| {
        let weights = stroke.changed.iter().map(|(_, _, after)| after.weight);
        weights.fold(0.0, f32::max)
    };
    assert!(
        heaviest(&a) <= 0.7 && heaviest(&a) > 0.3,
        "{}",
        heaviest(&a)
    );
    let mut apart = 0.0f32;
    for (ix, _, after) in &b.changed {
        let other = a.changed.iter().find(|(at, ..)| at == ix);
        apart = apart.max((other.map_or(0.0, |(_, _, p)| p.weight) - after.weight).abs());
    }
    assert!(apart < 0.1, "{apart}");
}

#[test]
fn paint_carries_along_strands_within_the_mask_and_to_the_other_side() {
    let brush = Brush {
        radius_cm: 0.3,
        along_cm: 4.0,
        softness: 0.0,
        is_symmetric: true,
        mask: BrushMask {
            from: 0.4,
            to: 1.0,
            soft: 0.0,
        },
        effect: BrushEffect::WidthScale(3.0),
        ..Brush::default()
    };
    let (_, paint) = stroke(brush, StrokePath::World(vec![[4.0, -5.0, 0.0]]));
    for (ix, point) in paint.points.iter().enumerate() {
        let (strand, place) = (ix / 11, ix % 11);
        // x = 4 and -4; from 0.4 on and within 4 cm of 5.
        let expected = match [28, 12].contains(&strand) && (4..9).contains(&place) {
            true => 3.0,
            false => 1.0,
        };
        assert!(
            (point.width_scale - expected).abs() < 1e-5,
            "{ix} {point:?}"
        );
    }
}

#[test]
fn strands_apart_and_repeated_points_have_their_own_lengths() {
    let points = [
        // A strand that is one point, then one that repeats a point.
        [5.0, 0.0, 0.0],
        [5.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, -3.0, 0.0],
    ];
    let strands = Strands::new(&points, &[0, 2, 6], |_, _| 0.01, false).unwrap();
    let picker = Picker::new(&strands);
    assert_eq!(picker.strand_of(0), None);
    assert_eq!(picker.strand_of(4), Some(2..6));
    assert_eq!([2, 3, 4, 5].map(|ix| picker.arc(ix)), [0.0, 1.0, 1.0, 3.0]);
    let brush = Brush {
        radius_cm: 0.1,
        softness: 0.0,
        ..Brush::default()
    };
    let mut active_stroke = ActiveStroke::new(brush).unwrap();
    let mut paint = Paint::unpainted(6);
    active_stroke.dab(&picker, &mut paint, Vec3::new(0.0, -1.0, 0.0));
    // Both points that coincide, or there would be a seam between them.
    let weights: Vec<f32> = paint.points.iter().map(|point| point.weight).collect();
    assert_eq!(weights, [0.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
}

/// The picker of the curtain, its left half dyed, and a mask with the three strands of `from`.. protected by `mask`.
fn masked(from: usize, mask: f32) -> (Picker, Paint, PointMask) {
    let strands = curtain();
    let mut of_strands = PointMask::none(strands.n_groom_points());
    of_strands.points[11 * from..11 * (from + 3)].fill(mask);
    (Picker::new(&strands), half_dyed(&strands), of_strands)
}

/// Effects of every brush for paint.
const PAINTING: [BrushEffect; 6] = [
    BrushEffect::Dye([1.0, 0.5, 0.2]),
    BrushEffect::WidthScale(3.0),
    BrushEffect::ShiftScale(0.5),
    BrushEffect::Erase,
    BrushEffect::Blur,
    BrushEffect::Smear,
];

#[test]
fn masked_points_stay_as_they_are_to_the_bit() {
    // Beside the edge of the dye, so that each brush has something to do there.
    let (picker, before, mask) = masked(18, 1.0);
    let path = vec![[-4.0, -5.0, 0.0], [4.0, -5.0, 0.0]];
    for effect in PAINTING {
        let brush = Brush {
            effect,
            radius_cm: 2.0,
            softness: 0.0,
            ..Brush::default()
        };
        let stroke = BrushStroke {
            brush,
            path: StrokePath::World(path.clone()),
        };
        let mut paint = before.clone();
        let canvas = Canvas::Paint(&mut paint, Some(&mask));
        let stroke = picker.stroke(canvas, &camera(), SIZE, &stroke).unwrap();
        let mut flooded = before.clone();
        let flood = picker.flood(Canvas::Paint(&mut flooded, Some(&mask)), &brush);
        flooded.apply(&flood.unwrap());
        assert!(!stroke.is_empty(), "{effect:?}");
        let bits = |point: &PaintedPoint| bytes(point);
        for painted in [&paint, &flooded] {
            let points = painted.points.iter().zip(&before.points);
            for ((after, before), &mask) in points.zip(&mask.points) {
                assert!(
                    mask == 0.0 || bits(after) == bits(before),
                    "{effect:?} {after:?}"
                );
            }
        }
        // What is not protected is painted as without a mask, what lies under it included.
        let mut unmasked = before.clone();
        let free = BrushStroke {
            brush,
            path: StrokePath::World(path.clone()),
        };
        picker
            .stroke(&mut unmasked, &camera(), SIZE, &free)
            .unwrap();
        let points = paint.points.iter().zip(&unmasked.points);
        for ((with, without), &mask) in points.zip(&mask.points) {
            assert!(mask > 0.0 || with == without, "{effect:?}");
        }
    }
}

fn bytes(point: &PaintedPoint) -> [u32; 6] {
    let [r, g, b] = point.sigma_a;
    [r, g, b, point.weight, point.width_scale, point.shift_scale].map(f32::to_bits)
}

#[test]
fn half_a_mask_is_half_the_effect() {
    let (picker, _, mask) = masked(24, 0.5);
    let bare = Paint::unpainted(mask.points.len());
    let weights = |brush: &Brush, mask: Option<&PointMask>| {
        let mut paint = bare.clone();
        let mut stroke = ActiveStroke::new(*brush).unwrap();
        let centre = Vec3::new(2.5, -5.0, 0.0);
        stroke.dab(&picker, Canvas::Paint(&mut paint, mask), centre);
        paint
            .points
            .iter()
            .map(|point| point.weight)
            .collect::<Vec<f32>>()
    };
    let brush = Brush {
        strength: 0.8,
        ..Brush::default()
    };
    let (with, without) = (weights(&brush, Some(&mask)), weights(&brush, None));
    let mut n_halved = 0;
    for ((with, without), mask) in with.iter().zip(&without).zip(&mask.points) {
        assert!((with - (1.0 - mask) * without).abs() < 1e-6);
        n_halved += usize::from(*mask == 0.5 && *with > 0.0);
    }
    assert!(n_halved >= 9, "{n_halved}");
    // A factor goes half the way by its logarithm.
    let wide = Brush {
        effect: BrushEffect::WidthScale(4.0),
        ..Brush::default()
    };
    let mut paint = bare.clone();
    let stroke = picker.flood(Canvas::Paint(&mut paint, Some(&mask)), &wide);
    paint.apply(&stroke.unwrap());
    assert!((paint.points[24 * 11].width_scale - 2.0).abs() < 1e-5);
    assert_eq!(paint.points[0].width_scale, 4.0);
}

#[test]
fn brushes_protect_release_and_invert_and_can_be_undone() {
    let (picker, paint, _) = masked(0, 0.0);
    let mut mask = PointMask::none(paint.points.len());
    let with = |effect, strength| Brush {
        effect,
        strength,
        ..Brush::default()
    };
    let middle = StrokePath::World(vec![[2.0, -5.0, 0.0]]);
    let protect = BrushStroke {
        brush: with(BrushEffect::Protect(1.0), 1.0),
        path: middle.clone(),
    };
    let first = picker.stroke(&mut mask, &camera(), SIZE, &protect).unwrap();
    // x = 2, 5 cm from the root.
    let at = 24 * 11 + 5;
    assert!(first.changed.is_empty() && !first.is_empty());
    assert_eq!((mask.points[at], mask.points[0]), (1.0, 0.0));
    assert!(first.mask_range().unwrap().contains(&at));
    let protected = mask.clone();

    let release = picker.flood(&mut mask, &with(BrushEffect::Protect(0.0), 0.25));
    mask.apply(&release.unwrap());
    assert_eq!(mask.points[at], 0.75);
    let invert = picker.flood(&mut mask, &with(BrushEffect::InvertProtection, 1.0));
    let invert = invert.unwrap();
    mask.apply(&invert);
    assert_eq!((mask.points[at], mask.points[0]), (0.25, 1.0));
    mask.revert(&invert);
    assert_eq!(mask.points[at], 0.75);
    let clear = picker.flood(&mut mask, &with(BrushEffect::Protect(0.0), 1.0));
    mask.apply(&clear.unwrap());
    assert!(!mask.is_protecting());
    mask.apply(&first);
    assert_eq!(mask, protected);
    mask.revert(&first);
    assert!(!mask.is_protecting());

    // Brushes for the one do nothing to the other.
    let mut paint = paint;
    let before = paint.clone();
    for effect in [BrushEffect::Protect(1.0), BrushEffect::InvertProtection] {
        let flood = picker.flood(&mut paint, &with(effect, 1.0)).unwrap();
        let mut stroke = ActiveStroke::new(with(effect, 1.0)).unwrap();
        let touched = stroke.dab(&picker, &mut paint, Vec3::new(2.0, -5.0, 0.0));
        assert!(flood.is_empty() && touched.is_none() && paint == before);
    }
    for effect in PAINTING {
        let flood = picker.flood(&mut mask, &with(effect, 1.0)).unwrap();
        let mut stroke = ActiveStroke::new(with(effect, 1.0)).unwrap();
        let touched = stroke.dab(&picker, &mut mask, Vec3::new(2.0, -5.0, 0.0));
        assert!(flood.is_empty() && touched.is_none() && !mask.is_protecting());
    }
    // A mask of another groom is none here.
    let short = PointMask::none(3);
    let flood = picker.flood(
        Canvas::Paint(&mut paint, Some(&short)),
        &with(BrushEffect::Erase, 1.0),
    );
    assert_eq!(flood.unwrap().changed.len(), 20 * 11);
    let mut short = short;
    let flood = picker.flood(&mut short, &with(BrushEffect::Protect(1.0), 1.0));
    assert_eq!(flood.unwrap().masked.len(), 3);
}

#[test]
fn places_along_a_strand_are_found_by_their_share_of_its_length() {
    let points = [
        [5.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, -4.0, 0.0],
    ];
    let strands = Strands::new(&points, &[0, 1, 5], |_, _| 0.01, false).unwrap();
    let picker = Picker::new(&strands);
    assert_eq!(picker.at_share(0, 0.5), None);
    assert_eq!(picker.at_share(9, 0.5), None);
    assert_eq!(picker.at_share(1, 0.0), Some((1, 0.0)));
    assert_eq!(picker.at_share(3, 0.125), Some((1, 0.5)));
    assert_eq!(picker.at_share(1, 0.25), Some((3, 0.0)));
    assert_eq!(picker.at_share(1, 0.625), Some((3, 0.5)));
    for tip in [1.0, 7.0] {
        assert_eq!(picker.at_share(1, tip), Some((4, 0.0)));
    }
    assert!(picker.at_share(1, f32::NAN).is_some_and(|(at, _)| at < 5));
}
