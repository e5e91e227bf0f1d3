//! The light that adds most to a point of a strand.

use glam::Vec3;
use strandlight_formats::SrbfLight;
use strandlight_scattering::closed_form::{DirectionInFrame, LightInFrame, single_scattering};

use strandlight_scene::scene::PreparedScene;
use strandlight_scene::strands::Strands;

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

/// The point of the strands nearest to `position`, or `None` where there is none.
pub fn nearest(strands: &Strands, position: Vec3) -> Option<usize> {
    let distance = |point: &[f32; 4]| Vec3::from_slice(point).distance_squared(position);
    (strands.points.iter().enumerate())
        .min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)))
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
    let [u, v, w] = strands.frame(point);
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

/// Where a light comes from whose reflection R the eye sees brightest at a point, a unit vector: at the
/// inclination `2 alpha_R - theta_o`, at the azimuth of the eye.
pub fn highlight(scene: &PreparedScene, eye: Vec3, point: usize) -> Vec3 {
    let strands = &scene.strands;
    let position = Vec3::from_slice(&strands.points[point]);
    let u = Vec3::from_slice(&strands.tangents[point]);
    let wo = (eye - position).normalize_or(Vec3::Z);
    let sin_theta_o = u.dot(wo).clamp(-1.0, 1.0);
    let across = (wo - u * sin_theta_o).try_normalize();
    let across = across.unwrap_or_else(|| Vec3::from_slice(&strands.normals[point]));
    let shift = scene.hair.hair().shift.r as f32;
    let half_pi = std::f32::consts::FRAC_PI_2;
    let theta_i = (2.0 * shift - sin_theta_o.asin()).clamp(-half_pi, half_pi);
    u * theta_i.sin() + across * theta_i.cos()
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use strandlight_formats::{Background, TableFile, TableReader};
    use strandlight_scattering::fresnel::Fresnel;
    use strandlight_scattering::{HairParams, Lobe};

    use super::*;
    use strandlight_data::DEFAULT_TABLES;
    use strandlight_scene::Camera;
    use strandlight_scene::material::{HairMaterial, LobeTables};
    use strandlight_scene::tables::ShadingTables;

    /// One upright strand before the eye on +Z.
    fn scene(modes: &[Lobe]) -> PreparedScene {
        let points = [[0.0, -1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let strands = Strands::new(&points, &[0, 3], |_, _| 0.01, false).expect("a strand");
        let mut reader = TableReader::from_static(DEFAULT_TABLES).expect("bundled tables");
        let tables = vec![reader.read_table("C").expect("it is there")];
        let file = TableFile {
            tables,
            ..TableFile::default()
        };
        let hair = HairMaterial::new(
            Arc::new(LobeTables::default()),
            Fresnel::Dielectric,
            &HairParams::default(),
            modes,
            4,
        );
        PreparedScene::from_parts(
            strands,
            Vec::new(),
            hair.expect("of R alone"),
            ShadingTables::for_modes(&file, modes).expect("C is enough"),
            Camera::framing(Vec3::ZERO, 1.0, 0.5),
            Background::None,
        )
        .expect("a scene")
    }

    fn light(direction: [f32; 3], strength: f32) -> SrbfLight {
        SrbfLight {
            direction,
            lambda: 0.2,
            rgb: [strength; 3],
        }
    }

    /// The light that [`highlight`] places stands on the eye's side of the strand, and is reflected more than others
    /// above and below it.
    #[test]
    fn the_highlight_is_brightest_where_it_is_placed() {
        let scene = scene(&[Lobe::R]);
        let point = nearest(&scene.strands, Vec3::ZERO).expect("a point");
        for eye in [[0.0, 0.0, 10.0], [3.0, 6.0, 8.0], [0.0, -3.0, 5.0]].map(Vec3::from) {
            let placed = highlight(&scene, eye, point);
            assert!((placed.length() - 1.0).abs() < 1e-5);
            let [side, side_of_eye] =
                [placed, eye].map(|d| (d * Vec3::new(1.0, 0.0, 1.0)).normalize());
            assert!(side.dot(side_of_eye) > 0.9999, "{eye}: {side}");
            let across = placed.cross(Vec3::Y).normalize();
            let others = [0.1, -0.1, 0.3, -0.3]
                .map(|angle| glam::Quat::from_axis_angle(across, angle) * placed);
            let mut lights = vec![light(placed.to_array(), 1.0)];
            lights.extend(others.map(|other| light(other.to_array(), 1.0)));
            let found = brightest(&scene, &lights, eye, point).expect("a light");
            assert_eq!(found.light, 0, "{eye}");
        }
    }

    #[test]
    fn the_light_that_is_reflected_is_found() {
        let scene = scene(&[Lobe::R]);
        let point = nearest(&scene.strands, Vec3::new(0.1, 0.2, 0.0)).expect("a point");
        assert_eq!(scene.strands.points[point][1], 0.0);
        let eye = Vec3::new(0.0, 0.0, 10.0);
        // From the front it is reflected to the eye; from above it never gets there.
        let lights = [
            light([0.0, 1.0, 0.0], 5.0),
            light([0.0, 0.0, 1.0], 1.0),
            light([0.0, 0.0, 1.0], 0.0),
        ];
        let found = brightest(&scene, &lights, eye, point).expect("a light");
        assert_eq!(found.light, 1);
        assert!(found.share > 0.9, "{}", found.share);
        // Switched off, it is not named.
        let found = brightest(&scene, &lights[2..], eye, point);
        assert_eq!(found, None);
    }
}
