use super::*;

fn prepare(points: &[[f32; 3]], offsets: &[u32], refine: bool) -> Result<Strands, SceneError> {
    Strands::new(points, offsets, |_, _| 0.008, refine)
}

#[test]
fn frames_are_orthonormal_and_finite_on_degenerate_strands() {
    let points = [
        // Repeated points, a reversal, a two-point strand, a strand that is one point.
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.5, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, -2.0, 0.3],
        [2.0, 2.0, 2.0],
        [2.0, 2.0, 2.0],
    ];
    for refine in [false, true] {
        let strands = prepare(&points, &[0, 5, 7, 9], refine).unwrap();
        assert_eq!((strands.n_strands, strands.n_degenerate), (2, 1));
        assert_eq!(strands.ids(), [0, 1]);
        assert!(!strands.segments.is_empty());
        for ((p, t), n) in strands
            .points
            .iter()
            .zip(&strands.tangents)
            .zip(&strands.normals)
        {
            let (t, n) = (Vec3::from_slice(t), Vec3::from_slice(n));
            assert!(p.iter().all(|x| x.is_finite()));
            assert!((t.length() - 1.0).abs() < 1e-5 && (n.length() - 1.0).abs() < 1e-5);
            assert!(t.dot(n).abs() < 1e-5);
        }
    }
}

#[test]
fn refinement_passes_through_the_points_and_stays_on_a_circle() {
    let points: Vec<[f32; 3]> = (0..9)
        .map(|ix| {
            let angle = ix as f32 * 0.4;
            [10.0 * angle.cos(), 10.0 * angle.sin(), 0.0]
        })
        .collect();
    let strands = prepare(&points, &[0, 9], true).unwrap();
    assert!(
        strands.points.len() > 3 * points.len(),
        "{}",
        strands.points.len()
    );
    for p in &points {
        assert!(strands.points.iter().any(|q| q[..3] == p[..]));
    }
    for p in &strands.points {
        let r = (p[0] * p[0] + p[1] * p[1]).sqrt();
        assert!((r - 10.0).abs() < 0.03, "{r}");
    }
}

#[test]
fn wrong_input_is_named() {
    assert!(matches!(
        prepare(&[], &[0], true),
        Err(SceneError::EmptyGroom)
    ));
    let p = [[0.0; 3], [0.0, 1.0, 0.0]];
    assert!(matches!(
        prepare(&p, &[0, 3], true),
        Err(SceneError::Offsets)
    ));
    assert!(matches!(
        prepare(&p, &[0, 2, 1, 2], true),
        Err(SceneError::Offsets)
    ));
    let none = prepare(&[p[0], p[0]], &[0, 2], true);
    assert!(matches!(none, Err(SceneError::EmptyGroom)));
    let nan = [[0.0; 3], [0.0, f32::NAN, 0.0]];
    let far = prepare(&nan, &[0, 2], true);
    assert!(matches!(far, Err(SceneError::Point { point: 1 })));
    let zero = Strands::new(&p, &[0, 2], |_, _| 0.0, true);
    assert!(matches!(zero, Err(SceneError::Diameter { strand: 0, .. })));
}

#[test]
fn the_normal_does_not_twist_about_a_planar_curve() {
    let points: Vec<[f32; 3]> = (0..50)
        .map(|ix| {
            let x = ix as f32 * 0.1;
            [x, x.sin(), 0.0]
        })
        .collect();
    let strands = prepare(&points, &[0, 50], false).unwrap();
    for n in &strands.normals {
        assert!((n[2].abs() - strands.normals[0][2].abs()).abs() < 1e-4);
    }
}

/// Curls with repeated points, a degenerate strand among them, and strands of two points.
fn tangle() -> (Vec<[f32; 3]>, Vec<u32>) {
    let (mut points, mut offsets) = (Vec::new(), vec![0]);
    for strand in 0..9 {
        for ix in 0..[12, 2, 5][strand % 3] {
            let angle = 0.7 * ix as f32;
            let x = strand as f32 + angle.cos();
            let point = [x, -0.4 * ix as f32, angle.sin() * (1.0 + 0.1 * ix as f32)];
            let copies = 1 + usize::from(strand == 3 || ix == 3) + usize::from(ix == 11);
            points.extend(std::iter::repeat_n(point, copies));
        }
        if strand == 4 {
            offsets.push(points.len() as u32);
            points.extend([[9.0; 3]; 3]);
        }
        offsets.push(points.len() as u32);
    }
    (points, offsets)
}

#[test]
fn the_rest_pose_resampled_is_itself_bit_for_bit() {
    let (points, offsets) = tangle();
    for refine in [false, true] {
        let strands = prepare(&points, &offsets, refine).unwrap();
        assert_eq!(strands.n_degenerate, 1);
        assert!(!refine || strands.points.len() > 2 * points.len());
        assert_eq!(strands.origins().len(), strands.points.len());
        assert_eq!(strands.resampled(&points).unwrap(), strands.points);
    }
}

#[test]
fn a_turned_pose_resampled_turns_the_points_and_keeps_their_origins() {
    let (points, offsets) = tangle();
    let strands = prepare(&points, &offsets, true).unwrap();
    let turn = |p: Vec3| glam::Quat::from_rotation_y(1.0) * p + Vec3::new(1.0, 2.0, 3.0);
    let turned: Vec<[f32; 3]> = points.iter().map(|&p| turn(p.into()).to_array()).collect();
    let resampled = strands.resampled(&turned).unwrap();
    for (now, before) in resampled.iter().zip(&strands.points) {
        let expected = turn(Vec3::from_slice(before));
        assert!(Vec3::from_slice(now).distance(expected) < 2e-5);
        assert_eq!(now[3], before[3]);
    }
    let moved = strands.moved(&resampled).unwrap();
    assert_eq!(moved.origins(), strands.origins());
}

#[test]
fn poses_that_fold_strands_up_stay_finite() {
    let (points, offsets) = tangle();
    let strands = prepare(&points, &offsets, true).unwrap();
    let mut folded = points.clone();
    for (ix, point) in folded.iter_mut().enumerate() {
        if ix % 3 != 0 {
            *point = [1e3, 2.0, 3.0];
        }
    }
    let resampled = strands.resampled(&folded).unwrap();
    assert!(resampled.iter().flatten().all(|x| x.is_finite()));
}

#[test]
fn values_are_spread_linearly_between_the_points_of_the_groom() {
    let (points, offsets) = tangle();
    let strands = prepare(&points, &offsets, true).unwrap();
    let mix = |a: f32, b: f32, t: f32| a + t * (b - a);
    // Numbers of points, the same for those that coincide.
    let mut numbers: Vec<f32> = Vec::new();
    for ix in 0..points.len() {
        let is_repeated = ix > 0 && points[ix - 1] == points[ix];
        let before = numbers.last().copied();
        numbers.push(before.filter(|_| is_repeated).unwrap_or(ix as f32));
    }
    let spread = strands.spread(&numbers, mix).unwrap();
    let mut n_between = 0;
    for (value, (origin, point)) in spread
        .iter()
        .zip(strands.origins().iter().zip(&strands.points))
    {
        let ix = origin.point as usize;
        if origin.fraction == 0.0 {
            assert_eq!(*value, numbers[ix]);
            assert_eq!(points[ix], point[..3]);
        } else {
            n_between += 1;
            assert!(numbers[ix] < *value && *value < numbers[ix + 1]);
            // Pieces stay near the line between the points that they are said to lie between.
            let [a, b] = [ix, ix + 1].map(|ix| Vec3::from(points[ix]));
            let (here, line) = (Vec3::from_slice(point), a.lerp(b, origin.fraction));
            assert!(here.distance(line) < 0.3 * a.distance(b));
        }
    }
    assert!(n_between > points.len());
    assert!(matches!(
        strands.spread(&numbers[1..], mix),
        Err(SceneError::Offsets)
    ));
    assert!(matches!(
        strands.resampled(&points[1..]),
        Err(SceneError::Offsets)
    ));
}
