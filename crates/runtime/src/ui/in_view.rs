//! How much of the hair a view shows.

use glam::{Vec2, Vec3};
use strandlight_scene::Camera;
use strandlight_scene::strands::Strands;

use super::orbit::Bounds;

/// Hair that is lower in the picture than this share of it is a speck.
const SPECK: f32 = 0.02;

/// What there is of the hair in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InView {
    /// No strand.
    Nothing,
    /// All of it, so small that it is hardly seen.
    Speck,
    /// Strands.
    Hair,
}

/// What a picture of `aspect` shows of `strands`. Moved hair counts where it was at rest, and what hides it is not asked.
pub fn in_view(camera: &Camera, strands: &Strands, aspect: f32) -> InView {
    let bounds = Bounds::of(strands);
    let view = Frustum::new(camera, aspect);
    if !view.meets(bounds) {
        return InView::Nothing;
    }
    let distance = bounds.centre.distance(camera.eye);
    if bounds.radius < SPECK * distance * view.tangents.y {
        return InView::Speck;
    }
    // Where hair is in view, it is mostly found at once.
    let at = |point: u32| {
        let &[x, y, z, _] = strands.points.get(point as usize)?;
        Some(Vec3::new(x, y, z))
    };
    let is_seen = |&first: &u32| match (at(first), at(first + 1)) {
        (Some(from), Some(to)) => view.has_part_of(from, to),
        _ => false,
    };
    match strands.segments.iter().any(is_seen) {
        true => InView::Hair,
        false => InView::Nothing,
    }
}

/// Is the eye among the strands?
pub fn is_amid(camera: &Camera, bounds: Bounds) -> bool {
    camera.eye.distance(bounds.centre) < bounds.radius
}

/// What is in front of the eye and between the edges of the picture.
struct Frustum {
    eye: Vec3,
    axes: (Vec3, Vec3, Vec3),
    /// Of half the horizontal and half the vertical angle of view.
    tangents: Vec2,
}

impl Frustum {
    fn new(camera: &Camera, aspect: f32) -> Frustum {
        let up = (0.5 * camera.fov_y).tan();
        Frustum {
            eye: camera.eye,
            axes: camera.axes(),
            tangents: Vec2::new(up * aspect.max(1e-3), up),
        }
    }

    /// Is a part of the sphere in it?
    fn meets(&self, bounds: Bounds) -> bool {
        let (right, up, forward) = self.axes;
        let to_centre = bounds.centre - self.eye;
        let depth = to_centre.dot(forward);
        // How far the centre is outside the nearer edge of the picture.
        let outside = |axis: Vec3, tangent: f32| {
            let half = tangent.atan();
            to_centre.dot(axis).abs() * half.cos() - depth * half.sin()
        };
        let radius = bounds.radius;
        depth > -radius
            && outside(right, self.tangents.x) < radius
            && outside(up, self.tangents.y) < radius
    }

    /// Is a part of the line from one point to another in it?
    fn has_part_of(&self, from: Vec3, to: Vec3) -> bool {
        let [from, to] = [from, to].map(|point| self.inside(point));
        // The share of the way where it comes in last, and where it first goes out again.
        let (mut enters, mut leaves) = (0.0f32, 1.0f32);
        for (from, to) in from.into_iter().zip(to) {
            match (from > 0.0, to > 0.0) {
                (true, true) => {}
                (false, false) => return false,
                (false, true) => enters = enters.max(from / (from - to)),
                (true, false) => leaves = leaves.min(from / (from - to)),
            }
        }
        enters < leaves
    }

    /// How far a point is in front of the eye and inside of each edge, in whatever unit.
    fn inside(&self, point: Vec3) -> [f32; 5] {
        let (right, up, forward) = self.axes;
        let from_eye = point - self.eye;
        let depth = from_eye.dot(forward);
        let [x, y] = [from_eye.dot(right), from_eye.dot(up)];
        let edge = self.tangents * depth;
        [depth, edge.x - x, edge.x + x, edge.y - y, edge.y + y]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ui::orbit::{frame, pan};

    fn camera() -> Camera {
        Camera::framing(Vec3::new(1.0, 2.0, 3.0), 10.0, 0.5)
    }

    /// One strand along +Y of a length, cm, around a point.
    fn strand(centre: Vec3, length: f32) -> Strands {
        let half = Vec3::new(0.0, 0.5 * length, 0.0);
        let points = [(centre - half).to_array(), (centre + half).to_array()];
        Strands::new(&points, &[0, 2], |_, _| 0.01, false).expect("a strand")
    }

    #[test]
    fn hair_that_is_aside_or_behind_is_out_of_view() {
        let start = camera();
        let strands = strand(start.target, 2.0);
        let is_seen = |camera: &Camera| in_view(camera, &strands, 1.5) == InView::Hair;
        assert!(is_seen(&start));
        // In heights of the picture: half of one to its upper edge, three quarters to its right one.
        for (right, up) in [(0.7, 0.0), (0.0, 0.45), (-0.7, -0.45)] {
            assert!(is_seen(&pan(&start, right, up)), "{right} {up}");
        }
        for (right, up) in [(1.1, 0.0), (-1.1, 0.0), (0.0, 0.8), (0.0, -0.8)] {
            assert!(!is_seen(&pan(&start, right, up)), "{right} {up}");
        }
        // The strand is just outside of the right edge, the sphere around it is not.
        assert!(!is_seen(&pan(&start, 0.76, 0.0)));
        let away = Camera {
            target: 2.0 * start.eye - start.target,
            ..start
        };
        assert!(!is_seen(&away));
        assert!(is_seen(&frame(&away, strands.centre, strands.radius, 1.5)));
    }

    #[test]
    fn hair_that_passes_through_the_view_is_seen_and_hair_around_the_eye_may_not_be() {
        let start = camera();
        // Both ends are far outside.
        let long = strand(start.target, 1e4);
        assert_eq!(in_view(&start, &long, 1.5), InView::Hair);
        assert!(is_amid(&start, Bounds::of(&long)));
        // The eye is in the middle of it, and looks past it.
        let beside = strand(start.eye + Vec3::new(50.0, 0.0, 0.0), 1e4);
        assert!(is_amid(&start, Bounds::of(&beside)));
        assert_eq!(in_view(&start, &beside, 1.5), InView::Nothing);
    }

    #[test]
    fn hair_that_is_lower_than_a_fiftieth_of_the_picture_is_a_speck() {
        let start = camera();
        let height = 2.0 * start.eye.distance(start.target) * (0.5 * start.fov_y).tan();
        let seen = |share: f32| in_view(&start, &strand(start.target, share * height), 1.5);
        assert_eq!(seen(0.03), InView::Hair);
        assert_eq!(seen(0.015), InView::Speck);
    }
}
