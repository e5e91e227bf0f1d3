//! What is under the mouse: the strand point there, and the light that adds most to it.

use glam::Vec3;
use strandlight_formats::SrbfLight;
use strandlight_scattering::closed_form::{DirectionInFrame, LightInFrame, single_scattering};

use crate::camera::{Camera, view_uniform};
use crate::scene::PreparedScene;
use crate::strands::Strands;

/// A point this near to the mouse, in pixels, is under it.
const REACH_PX: f32 = 5.0;

/// Hair in the way of a light is counted in a tube of this share of the hair's radius.
const TUBE: f32 = 0.03;

/// The light that adds most at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brightest {
    /// Its place among the lights that were asked about.
    pub light: usize,
    /// Its share of what all add, 0..=1.
    pub share: f32,
}

/// The strand point under `place` (pixels from the upper left of a picture of `size`) that is
/// nearest to the eye, or `None` where there is no hair.
pub fn point(strands: &Strands, camera: &Camera, size: [u32; 2], place: [f32; 2]) -> Option<usize> {
    let view = view_uniform(camera, strands, size, 1.0);
    let (right, up) = (Vec3::from(view.right), Vec3::from(view.up));
    let (forward, eye) = (Vec3::from(view.forward), Vec3::from(view.eye));
    let centre = size.map(|side| 0.5 * side as f32);
    let under = |&(_, &[x, y, z, _]): &(usize, &[f32; 4])| {
        let from_eye = Vec3::new(x, y, z) - eye;
        let depth = from_eye.dot(forward);
        let scale = view.focal_px / depth;
        let x = centre[0] + from_eye.dot(right) * scale - place[0];
        let y = centre[1] - from_eye.dot(up) * scale - place[1];
        depth > view.near && x * x + y * y < REACH_PX * REACH_PX
    };
    let depth = |&[x, y, z, _]: &[f32; 4]| (Vec3::new(x, y, z) - eye).dot(forward);
    (strands.points.iter().enumerate())
        .filter(under)
        .min_by(|(_, a), (_, b)| depth(a).total_cmp(&depth(b)))
        .map(|(point, _)| point)
}

/// The one of `lights` (turned and scaled) that adds most to what the eye sees of `point`: single
/// scattering by the closed form, dimmed by an estimate of the hair in the way. Light that other
/// hair scatters on is not counted. `None` where no light adds anything.
pub fn brightest(
    scene: &PreparedScene,
    lights: &[SrbfLight],
    eye: Vec3,
    point: usize,
) -> Option<Brightest> {
    let strands = &scene.strands;
    let [x, y, z, _] = strands.points[point];
    let position = Vec3::new(x, y, z);
    let u = Vec3::from_slice(&strands.tangents[point]);
    let v = Vec3::from_slice(&strands.normals[point]);
    let w = u.cross(v);
    let in_frame = |d: Vec3| [u.dot(d), v.dot(d), w.dot(d)];
    let view = DirectionInFrame::from_vector(in_frame(eye - position));
    let shading = scene.hair.optics().shading(scene.tables.view());
    let added: Vec<f32> = lights
        .iter()
        .map(|light| {
            if light.rgb.iter().all(|&x| x == 0.0) {
                return 0.0;
            }
            let towards = Vec3::from(light.direction);
            let source = LightInFrame::from_vector(in_frame(towards), light.lambda);
            let scattered = single_scattering(&source, &view, &shading);
            let sum: f32 = (0..3).map(|ix| light.rgb[ix] * scattered[ix]).sum();
            sum * unblocked(strands, position, towards)
        })
        .collect();
    let all: f32 = added.iter().sum();
    let (light, &most) = (added.iter().enumerate()).max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (most > 0.0 && all.is_finite()).then(|| Brightest {
        light,
        share: most / all,
    })
}

/// Share of a light from `towards` that no hair blocks: `exp(-n)` with n fibres crossed, counted
/// in a tube around the ray.
fn unblocked(strands: &Strands, from: Vec3, towards: Vec3) -> f32 {
    let tube = TUBE * strands.radius;
    let area = std::f32::consts::PI * tube * tube;
    let mut crossed = 0.0;
    for (ix, &[x, y, z, radius]) in strands.points.iter().enumerate() {
        let offset = Vec3::new(x, y, z) - from;
        let along = offset.dot(towards);
        if along > tube && offset.length_squared() - along * along < tube * tube {
            let (tangent, normal) = (strands.tangents[ix], strands.normals[ix]);
            let length = tangent[3] + normal[3];
            let sine = Vec3::from_slice(&tangent).cross(towards).length();
            crossed += 2.0 * radius * length * sine / area;
        }
    }
    (-crossed).exp()
}
