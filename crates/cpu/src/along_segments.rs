//! Shadows of narrow lights along segments.
//!
//! A strand's shadow in the light of a sun has sharp edges. A share at every point, the mean over half of
//! the segments beside it, blurs them over many pixels; and over a segment that bends, the highlight of such a
//! light is no straight line. So what single scattering sends to the eye of narrow lights is kept at
//! eight places about every point: each is as lit as the shadow maps say there, and what it
//! scatters lies between what the point does and what the middle of the segment does.
//! Twin of `shaders/lib/along_segments.wgsl`.

use glam::Vec3;
use strandlight_scattering::closed_form::DirectionInFrame;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::shadow_maps::N_PLACES;
use strandlight_scene::strands::Strands;

use super::shadow_map::Visibility;
use super::unblocked::{Unblocked, VisiblePoint};

/// Places about a point: the first half of them on the half of the segment before it, the others on that after
/// it, evenly, from the root on.
pub(super) const PLACES: usize = N_PLACES as usize;

const HALF: usize = PLACES / 2;

/// Square of the length below which the sum of two tangents, or of two normals across that, has no direction.
const LEAST_NORMAL: f32 = 1e-6;

/// Numbers at the middle of the segment before a point, at the point, and at the middle of that after it.
pub(super) type Nodes<T> = [T; 3];

/// Radiance of narrow lights at the places about a point, rgb.
pub(super) type Along = [[f32; 3]; PLACES];

/// Radiance of narrow lights at share `t` of the way from a point to the next.
#[inline(always)]
pub(super) fn along_segment(first: &Along, second: &Along, t: f32) -> [f32; 3] {
    let place = ((t * PLACES as f32) as i32 as usize).min(PLACES - 1);
    if place < HALF {
        first[HALF + place]
    } else {
        second[place - HALF]
    }
}

/// Adds what a light comes to by the shares that reach the places and what it would come to, unblocked, at the
/// nodes.
#[inline(always)]
pub(super) fn add_along(along: &mut Along, shares: &[f32; PLACES], nodes: &Nodes<[f32; 3]>) {
    for (place, (along, share)) in along.iter_mut().zip(shares).enumerate() {
        let [from, to] = [nodes[place / HALF], nodes[place / HALF + 1]];
        let t = ((place % HALF) as f32 + 0.5) / HALF as f32;
        for (channel, along) in along.iter_mut().enumerate() {
            *along += share * (from[channel] + (to[channel] - from[channel]) * t);
        }
    }
}

/// Axes of the fibre about a point of `strands`, and the direction from there to `eye` in them.
pub(super) fn frames_about(
    strands: &Strands,
    point: usize,
    eye: Vec3,
) -> Nodes<([Vec3; 3], DirectionInFrame)> {
    let [before, after] = lengths(strands, point);
    let others = [
        if before > 0.0 { point - 1 } else { point },
        point,
        if after > 0.0 { point + 1 } else { point },
    ];
    others.map(|other| {
        let of_both =
            |list: &[[f32; 4]]| Vec3::from_slice(&list[point]) + Vec3::from_slice(&list[other]);
        let along_both = of_both(&strands.tangents);
        let mut u = along_both.normalize_or_zero();
        let v = of_both(&strands.normals);
        let mut v = v - u * u.dot(v);
        // Where a strand turns straight back there is none between.
        if along_both.length_squared() < LEAST_NORMAL || v.length_squared() < LEAST_NORMAL {
            u = Vec3::from_slice(&strands.tangents[point]);
            v = Vec3::from_slice(&strands.normals[point]);
        }
        let v = v.normalize();
        let frame = [u, v, u.cross(v)];
        let towards = eye - 0.5 * of_both(&strands.points);
        let towards = frame.map(|axis: Vec3| axis.dot(towards));
        (frame, DirectionInFrame::from_vector(towards))
    })
}

/// What maps say about points.
pub(super) trait Answers {
    /// Which of [`N_PLACES`] places about a point a map has lit, a bit each from the root on.
    fn answer(&self, map: u32, at: VisiblePoint) -> u8;
}

impl Answers for Unblocked {
    #[inline(always)]
    fn answer(&self, map: u32, at: VisiblePoint) -> u8 {
        Unblocked::answer(self, map, at)
    }
}

/// Of all points, and their number.
impl Answers for (&Visibility, usize) {
    fn answer(&self, map: u32, at: VisiblePoint) -> u8 {
        let (visibility, n_points) = *self;
        visibility.answer(n_points, map, at.point)
    }
}

/// The unblocked shares of a narrow light at the places about a point, times `scale`; nothing where its maps
/// lit none.
#[inline(always)]
pub(super) fn shares_along(
    strands: &Strands,
    answers: &impl Answers,
    light: &LightRecord,
    at: VisiblePoint,
    scale: f32,
) -> Option<[f32; PLACES]> {
    let lengths = lengths(strands, at.point);
    let mut n_lit = [0_u32; PLACES];
    let mut any = 0;
    for map in light.first_map..light.first_map + light.n_maps {
        let answer = answers.answer(map, at);
        any |= answer;
        let lit = even_halves(answer, lengths);
        for (place, n_lit) in n_lit.iter_mut().enumerate() {
            *n_lit += u32::from(lit >> place & 1);
        }
    }
    let of_map = scale / light.n_maps as f32;
    (any != 0).then(|| n_lit.map(|n_lit| n_lit as f32 * of_map))
}

/// Half the way to the points before and after one, cm; 0 where there is none.
#[inline(always)]
fn lengths(strands: &Strands, point: usize) -> [f32; 2] {
    [strands.tangents[point][3], strands.normals[point][3]]
}

/// An answer, whose places lie evenly over both halves of the given lengths together, at [`PLACES`] places.
#[inline(always)]
fn even_halves(answer: u8, [before, after]: [f32; 2]) -> u8 {
    if before == after {
        return answer;
    }
    let middle = N_PLACES as f32 * before / (before + after);
    let mut lit = 0;
    for place in 0..PLACES {
        let (start, length) = match place / HALF {
            0 => (0.0, middle),
            _ => (middle, N_PLACES as f32 - middle),
        };
        let share = ((place % HALF) as f32 + 0.5) / HALF as f32;
        let from = (start + length * share) as i32;
        lit |= (answer >> from.min(7) & 1) << place;
    }
    lit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_one_length_are_those_of_the_answer() {
        assert_eq!(even_halves(0b1010_0110, [0.3, 0.3]), 0b1010_0110);
        // Nearly one length hardly matters.
        assert_eq!(even_halves(0b1010_0110, [0.3001, 0.3]), 0b1010_0110);
        // At ends all places of the answer lie in one half.
        assert_eq!(even_halves(0b1100_1111, [0.0, 0.5]) >> 4, 0b1011);
        assert_eq!(even_halves(0b1100_1111, [0.5, 0.0]) & 15, 0b1011);
    }

    #[test]
    fn frames_about_points_are_right_angled_even_where_a_strand_turns_back() {
        // There and back again, and a bend.
        let back = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
        ];
        let bend = [
            [0.0, 2.0, 0.0],
            [1.0, 2.0, 0.0],
            [1.5, 3.0, 0.2],
            [1.0, 4.0, 1.0],
        ];
        let points: Vec<[f32; 3]> = back.into_iter().chain(bend).collect();
        let strands = Strands::new(&points, &[0, 4, 8], |_, _| 0.01, false).expect("valid");
        for point in 0..strands.points.len() {
            for (frame, eye) in frames_about(&strands, point, Vec3::new(0.3, 5.0, 9.0)) {
                let [u, v, w] = frame;
                assert!(frame.iter().all(|axis| (axis.length() - 1.0).abs() < 1e-5));
                assert!(u.dot(v).abs() < 1e-5 && w.dot(u).abs() < 1e-5 && w.dot(v).abs() < 1e-5);
                assert!(eye.theta.is_finite());
            }
        }
    }

    #[test]
    fn light_along_a_segment_is_that_of_the_nearest_place() {
        // Of two points, lit all over: 0, 1, 2 and 2, 4, 6 at the nodes; what is shared is the same.
        let mut along = [Along::default(); 2];
        for (along, by) in along.iter_mut().zip([1.0, 2.0]) {
            let nodes = [0.0, 1.0, 2.0].map(|at| [by * (at + by - 1.0); 3]);
            add_along(along, &[1.0; PLACES], &nodes);
        }
        let [first, second] = &along;
        for place in 0..PLACES {
            let t = (place as f32 + 0.5) / PLACES as f32;
            let half = 2.0 * t;
            let exact = if half < 1.0 {
                1.0 + half
            } else {
                2.0 + 2.0 * (half - 1.0)
            };
            assert!(
                (along_segment(first, second, t)[1] - exact).abs() < 1e-5,
                "{place}"
            );
        }
        assert_eq!(along_segment(first, second, 0.0), first[4]);
        assert_eq!(along_segment(first, second, 1.0), second[3]);
        let mut dark = Along::default();
        let shares = [0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0];
        add_along(&mut dark, &shares, &[[0.0; 3], [4.0; 3], [0.0; 3]]);
        assert_eq!(dark[3], [1.75; 3]);
        assert!(
            dark.iter()
                .enumerate()
                .all(|(place, rgb)| place == 3 || *rgb == [0.0; 3])
        );
    }
}
