//! Data layers: what compositors need to know of the strand that is seen in each pixel, such as its
//! depth and direction.
//!
//! Values are those of the nearest strand at the centre of the pixel, where the picture of the strands
//! without jitter has them. They are not filtered: a mean of two depths or two numbers is neither. A
//! strand thinner than a pixel counts as one pixel wide, as samples draw it. Proxies hide strands and have
//! no data of their own.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scene::background::ray_direction;
use strandlight_scene::beside::Beside;
use strandlight_scene::budget::check_frame;
use strandlight_scene::camera::{Camera, ViewUniform, screen_position, view_uniform};
use strandlight_scene::layers::{Content, Data, Layer};
use strandlight_scene::proxy::entry_distance;
use strandlight_scene::strands::Strands;
use strandlight_scene::{PreparedScene, RenderError};

use super::list::VisibilityList;
use super::project::project;
use super::raster::ribbons;
use super::screen_point::SAMPLED_WIDTH_PX;
use super::transmittance::mix;
use super::triangles::Triangles;

/// What is seen at the centre of a pixel.
struct Seen {
    /// Along the optical axis, cm.
    depth: f32,
    /// World space, cm.
    position: Vec3,
    /// Unit, root to tip.
    tangent: Vec3,
    /// Index in the groom.
    strand_id: u32,
    /// 0 at the root, 1 at the tip.
    root_distance: f32,
    /// Of the fibre, cm.
    diameter: f32,
}

impl Seen {
    /// The channels of `data`; none of coverage, which is filtered.
    fn value(&self, data: Data) -> Option<[f32; 3]> {
        Some(match data {
            Data::Coverage => return None,
            Data::Depth => [self.depth, 0.0, 0.0],
            Data::Tangent => self.tangent.to_array(),
            Data::StrandId => [self.strand_id as f32, 0.0, 0.0],
            Data::RootDistance => [self.root_distance, 0.0, 0.0],
            Data::Position => self.position.to_array(),
            Data::Diameter => [self.diameter, 0.0, 0.0],
        })
    }
}

/// The channels of those `layers` that are data, for `scene` as `camera` sees it: names, and values in
/// rows, top first. None of coverage: see [`coverage`].
///
/// # Errors
/// A size out of range.
pub fn data_layers(
    scene: &PreparedScene,
    camera: &Camera,
    size: [u32; 2],
    layers: &[&Layer],
) -> Result<Vec<(&'static str, Vec<f32>)>, RenderError> {
    check_frame(size, 1)?;
    let strands = &scene.strands;
    let view = view_uniform(camera, strands, size, 1.0);
    Ok(channels(strands, &scene.beside(), &view, layers))
}

/// Shares of each pixel that hair and that proxies cover, for `scene` as `camera` sees it, in rows, top
/// first.
///
/// # Errors
/// A size out of range.
pub fn coverage(
    scene: &PreparedScene,
    camera: &Camera,
    size: [u32; 2],
) -> Result<[Vec<f32>; 2], RenderError> {
    check_frame(size, 1)?;
    let strands = &scene.strands;
    let view = view_uniform(camera, strands, size, 1.0);
    let list = VisibilityList::new(&view, strands, &scene.beside());
    let mut shares = [0, 1].map(|_| vec![0.0; (size[0] * size[1]) as usize]);
    for tile in &list.tiles {
        let place = |pixel: usize| {
            let [x, y] = [pixel as u32 % tile.size[0], pixel as u32 / tile.size[0]];
            (tile.origin[0] + x + size[0] * (tile.origin[1] + y)) as usize
        };
        for (pixel, range) in tile.starts.windows(2).enumerate() {
            let entries = &tile.entries[range[0] as usize..range[1] as usize];
            shares[0][place(pixel)] = entries.iter().map(|entry| entry.weight).sum();
        }
        for entry in &tile.proxies {
            shares[1][place(entry.pixel as usize)] += entry.weight;
        }
    }
    Ok(shares)
}

/// `values` of the points, between them along the strand that is seen at the centre of each pixel of `view`, in
/// rows, top first; none where no strand is.
pub(super) fn seen_of_points(
    strands: &Strands,
    beside: &Beside,
    view: &ViewUniform,
    values: &[f32],
) -> Vec<Option<f32>> {
    let nearest = nearest(strands, beside, view);
    let pixels = nearest.into_par_iter().enumerate();
    pixels
        .map(|(pixel, nearest)| {
            let segment = nearest as u32;
            (segment != NO_SEGMENT).then(|| {
                let first = strands.segments[segment as usize] as usize;
                let share = Spine::new(view, strands, segment).share(centre(view, pixel));
                mix(values[first], values[first + 1], share)
            })
        })
        .collect()
}

fn channels(
    strands: &Strands,
    beside: &Beside,
    view: &ViewUniform,
    layers: &[&Layer],
) -> Vec<(&'static str, Vec<f32>)> {
    let wanted = layers.iter().filter_map(|layer| match layer.content {
        Content::Data(data) if data != Data::Coverage => Some((*layer, data)),
        _ => None,
    });
    let wanted: Vec<_> = wanted.collect();
    if wanted.is_empty() {
        return Vec::new();
    }
    let nearest = nearest(strands, beside, view);
    let ways = Ways::new(strands);
    let seen = |pixel: usize| {
        let segment = nearest[pixel] as u32;
        (segment != NO_SEGMENT).then(|| ways.seen(view, segment, pixel))
    };
    let mut channels = Vec::new();
    for (layer, data) in wanted {
        let background = [layer.background.unwrap_or(0.0); 3];
        let pixels = (0..nearest.len()).into_par_iter();
        let values: Vec<[f32; 3]> = pixels
            .map(|pixel| seen(pixel).and_then(|seen| seen.value(data)))
            .map(|value| value.unwrap_or(background))
            .collect();
        for (ix, name) in layer.channels.iter().enumerate() {
            channels.push((*name, values.iter().map(|value| value[ix]).collect()));
        }
    }
    channels
}

/// In place of a segment: a proxy, or nothing.
const NO_SEGMENT: u32 = u32::MAX;

/// By pixel, the depth of what is nearest at its centre in the upper 32 bits and its segment in the
/// lower: depths are positive, so that the nearest is the least of these numbers, and of equally
/// deep segments the first.
fn nearest(strands: &Strands, beside: &Beside, view: &ViewUniform) -> Vec<u64> {
    let packed = |depth: f32, segment: u32| u64::from(depth.to_bits()) << 32 | u64::from(segment);
    let [width, height] = view.size.map(|n| n as usize);
    let triangles = Triangles::new(view, beside);
    let pixels = (0..width * height).into_par_iter();
    let nearest: Vec<AtomicU64> = pixels
        .map(|pixel| {
            let direction = ray(view, pixel);
            let distances = beside.records().list().iter().filter_map(|proxy| {
                let distance = entry_distance(proxy, Vec3::from(view.eye), direction);
                (distance > 0.0).then_some(distance)
            });
            let distance = distances.fold(f32::INFINITY, f32::min);
            let depth = distance * direction.dot(Vec3::from(view.forward));
            let of_pixel = [pixel % width, pixel / width].map(|n| n as u32);
            let hit = triangles.nearest(of_pixel, centre(view, pixel));
            let depth = hit.map_or(depth, |hit| depth.min(hit.depth));
            AtomicU64::new(packed(depth, NO_SEGMENT))
        })
        .collect();
    let projected = project(view, strands, SAMPLED_WIDTH_PX);
    let ribbons = ribbons(view, strands, &projected, false);
    ribbons.par_iter().for_each(|ribbon| {
        let spine = Spine::new(view, strands, ribbon.segment);
        ribbon.for_each_centre([width as i32, height as i32], |[x, y]| {
            let pixel = y as usize * width + x as usize;
            let depth = spine.depth(spine.share(centre(view, pixel)));
            nearest[pixel].fetch_min(packed(depth, ribbon.segment), Ordering::Relaxed);
        });
    });
    nearest.into_iter().map(AtomicU64::into_inner).collect()
}

/// The centre of a pixel, px.
fn centre(view: &ViewUniform, pixel: usize) -> [f32; 2] {
    let width = view.size[0] as usize;
    [(pixel % width) as f32 + 0.5, (pixel / width) as f32 + 0.5]
}

/// Unit vector from the eye through the centre of a pixel.
fn ray(view: &ViewUniform, pixel: usize) -> Vec3 {
    let [x, y] = centre(view, pixel);
    ray_direction(view, x, y)
}

/// The middle of a segment on the screen: x, y in pixels and depth in cm of both ends.
struct Spine([[f32; 3]; 2]);

impl Spine {
    fn new(view: &ViewUniform, strands: &Strands, segment: u32) -> Spine {
        let first = strands.segments[segment as usize] as usize;
        let ends = [first, first + 1].map(|ix| Vec3::from_slice(&strands.points[ix]));
        Spine(ends.map(|end| screen_position(view, end)))
    }

    /// Share of the way along the segment, 0..=1, of what is beside a place on the screen.
    fn share(&self, [x, y]: [f32; 2]) -> f32 {
        let Spine([a, b]) = self;
        let along = [b[0] - a[0], b[1] - a[1]];
        let squared = (along[0] * along[0] + along[1] * along[1]).max(1e-6);
        let product = (x - a[0]) * along[0] + (y - a[1]) * along[1];
        let on_screen = (product / squared).clamp(0.0, 1.0);
        // In perspective the farther half takes less of the screen.
        let near = on_screen * a[2];
        near / (near + (1.0 - on_screen) * b[2])
    }

    fn depth(&self, share: f32) -> f32 {
        let Spine([a, b]) = self;
        mix(a[2], b[2], share)
    }
}

/// Strands, and how far along them their points are.
struct Ways<'a> {
    strands: &'a Strands,
    /// First point of each strand.
    firsts: Vec<u32>,
    /// By point: its share of the strand's length.
    root_distances: Vec<f32>,
}

impl Ways<'_> {
    fn new(strands: &Strands) -> Ways<'_> {
        let mut firsts = Vec::with_capacity(strands.n_strands);
        let mut root_distances = Vec::with_capacity(strands.points.len());
        for [first, n] in strands.ranges() {
            firsts.push(first);
            let points = &strands.points[first as usize..][..n as usize];
            let position = |point: &[f32; 4]| Vec3::from_slice(point).as_dvec3();
            let mut way = 0.0;
            let mut ways = vec![0.0];
            for pair in points.windows(2) {
                way += position(&pair[0]).distance(position(&pair[1]));
                ways.push(way);
            }
            // Points that a motion brings together have no length between them.
            let length = way.max(f64::MIN_POSITIVE);
            root_distances.extend(ways.into_iter().map(|way| (way / length) as f32));
        }
        Ways {
            strands,
            firsts,
            root_distances,
        }
    }

    fn seen(&self, view: &ViewUniform, segment: u32, pixel: usize) -> Seen {
        let strands = self.strands;
        let first = strands.segments[segment as usize];
        let strand = self.firsts.partition_point(|&start| start <= first) - 1;
        let ends = [first as usize, first as usize + 1];
        let spine = Spine::new(view, strands, segment);
        let share = spine.share(centre(view, pixel));
        let depth = spine.depth(share);
        let direction = ray(view, pixel);
        let distance = depth / direction.dot(Vec3::from(view.forward));
        let [t_a, t_b] = ends.map(|ix| Vec3::from_slice(&strands.tangents[ix]));
        let tangent = t_a.lerp(t_b, share).try_normalize().unwrap_or(t_a);
        let [r_a, r_b] = ends.map(|ix| self.root_distances[ix]);
        Seen {
            depth,
            position: Vec3::from(view.eye) + direction * distance,
            tangent,
            strand_id: strands.ids()[strand],
            root_distance: mix(r_a, r_b, share),
            diameter: 2.0
                * mix(
                    strands.points[ends[0]][3],
                    strands.points[ends[1]][3],
                    share,
                ),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use glam::Quat;
    use strandlight_scene::layers::LAYERS;
    use strandlight_scene::proxy::Proxy;

    use super::*;

    const SIZE: [u32; 2] = [96, 64];

    /// Straight strands, each from a root along a way to its tip.
    fn straight(ends: &[(Vec3, Vec3)], n_points: usize, diameter: f32) -> Strands {
        let mut points = Vec::new();
        for (root, way) in ends {
            let at = |ix: usize| *root + *way * (ix as f32 / (n_points - 1) as f32);
            points.extend((0..n_points).map(|ix| at(ix).to_array()));
        }
        let offsets: Vec<u32> = (0..=ends.len()).map(|ix| (ix * n_points) as u32).collect();
        Strands::new(&points, &offsets, |_, _| diameter, true).expect("valid")
    }

    fn camera(eye: Vec3) -> Camera {
        Camera {
            eye,
            target: Vec3::ZERO,
            up: Vec3::Y,
            fov_y: 0.4,
        }
    }

    /// All channels by name.
    fn all(strands: &Strands, view: &ViewUniform) -> BTreeMap<&'static str, Vec<f32>> {
        let beside = Beside::none();
        let layers: Vec<&Layer> = LAYERS.iter().collect();
        let channels = channels(strands, &beside, view, &layers);
        channels.into_iter().collect()
    }

    fn vectors(channels: &BTreeMap<&'static str, Vec<f32>>, names: [&str; 3]) -> Vec<Vec3> {
        let [x, y, z] = names.map(|name| &channels[name]);
        let along = x.iter().zip(y).zip(z);
        along.map(|((&x, &y), &z)| Vec3::new(x, y, z)).collect()
    }

    #[test]
    fn depth_and_position_are_those_of_a_tilted_plane() {
        // The plane z = y / 2, seen from ahead; far more than fills the picture.
        let way = Vec3::new(0.0, -16.0, -8.0);
        let ends: Vec<_> = (-100..=100)
            .map(|ix| (Vec3::new(0.1 * ix as f32, 8.0, 4.0), way))
            .collect();
        // Few points: across a segment the depths differ by centimetres.
        let strands = straight(&ends, 4, 0.15);
        let view = view_uniform(&camera(Vec3::new(0.0, 0.0, 20.0)), &strands, SIZE, 1.0);
        let found = all(&strands, &view);
        let positions = vectors(&found, ["P.X", "P.Y", "P.Z"]);
        let tangents = vectors(&found, ["tangent.X", "tangent.Y", "tangent.Z"]);
        let mut worst = [0.0_f32; 2];
        for (pixel, &depth) in found["depth.Z"].iter().enumerate() {
            let ray = ray(&view, pixel);
            // 20 + t ray.z = t ray.y / 2, and the optical axis is -z.
            let expected = -ray.z * 20.0 / (0.5 * ray.y - ray.z);
            worst[0] = worst[0].max((depth - expected).abs());
            let on_ray = Vec3::new(0.0, 0.0, 20.0) + ray * (expected / -ray.z);
            worst[1] = worst[1].max(positions[pixel].distance(on_ray));
            assert!(tangents[pixel].distance(way.normalize()) < 1e-5);
        }
        println!("depth {} cm, position {} cm", worst[0], worst[1]);
        // A strand that leans on the screen has its ribbon's edge, half a diameter beside it, at
        // the depth of its middle.
        assert!(worst[0] < 0.02 && worst[1] < 0.02, "{worst:?}");
    }

    #[test]
    fn the_nearest_strand_of_a_cylinder_is_seen() {
        let radius = 3.0;
        let ends: Vec<_> = (0..2000)
            .map(|ix| {
                let angle = std::f32::consts::TAU * ix as f32 / 2000.0;
                let root = Vec3::new(radius * angle.sin(), 4.0, radius * angle.cos());
                (root, Vec3::new(0.0, -8.0, 0.0))
            })
            .collect();
        let strands = straight(&ends, 9, 0.02);
        let eye = Vec3::new(0.0, 0.0, 30.0);
        let view = view_uniform(&camera(eye), &strands, SIZE, 1.0);
        let found = all(&strands, &view);
        let mut n_compared = 0;
        for (pixel, &depth) in found["depth.Z"].iter().enumerate() {
            let ray = ray(&view, pixel);
            // First crossing of x^2 + z^2 = radius^2.
            let across = ray.x * ray.x + ray.z * ray.z;
            let half = -eye.z * ray.z / across;
            let left = half * half - (eye.z * eye.z - radius * radius) / across;
            let outside = eye.z * (ray.x * ray.x / across).sqrt();
            if outside > radius + 0.1 {
                assert_eq!(depth, 0.0);
                assert_eq!(found["strand_id.Y"][pixel], -1.0);
                assert_eq!(found["P.X"][pixel], 0.0);
                continue;
            }
            let hit = eye + ray * (half - left.max(0.0).sqrt());
            // Not at the rim, where a pixel spans much of the depth, nor at the ends.
            if outside > 0.8 * radius || hit.y.abs() > 3.9 {
                continue;
            }
            n_compared += 1;
            let expected = (hit - eye).dot(Vec3::NEG_Z);
            // Half a pixel, 0.1 cm, to the side: up to 0.13 cm of depth at 0.8 of the radius.
            assert!((depth - expected).abs() < 0.14, "{depth} {expected}");
            let (angle, n) = (hit.x.atan2(hit.z), ends.len() as f32);
            let expected = (angle / std::f32::consts::TAU).rem_euclid(1.0) * n;
            let apart = (found["strand_id.Y"][pixel] - expected).abs();
            // As far in angle, in strands.
            assert!(apart.min(n - apart) < 20.0, "{apart}");
            assert!((found["diameter.Y"][pixel] - 0.02).abs() < 1e-6);
            let expected = (4.0 - hit.y) / 8.0;
            let root_distance = found["root_distance.Y"][pixel];
            assert!(
                (root_distance - expected).abs() < 0.005,
                "{root_distance} {expected}"
            );
        }
        assert!(n_compared > 500, "{n_compared}");
    }

    #[test]
    fn ids_count_strands_without_extent_and_root_distance_grows_by_length() {
        // The first strand has no extent; the second has its points at 0, 1 and 4 cm.
        let points = [
            [9.0, 9.0, 0.0],
            [9.0, 9.0, 0.0],
            [0.0, 2.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -2.0, 0.0],
        ];
        let strands = Strands::new(&points, &[0, 2, 5], |_, _| 0.5, false).expect("valid");
        let view = view_uniform(&camera(Vec3::new(0.0, 0.0, 20.0)), &strands, SIZE, 1.0);
        let found = all(&strands, &view);
        let rows = SIZE[1] as usize;
        let column: Vec<usize> = (0..rows).map(|y| y * SIZE[0] as usize + 48).collect();
        let ids = column.iter().map(|&pixel| found["strand_id.Y"][pixel]);
        assert!(ids.clone().all(|id| id == 1.0 || id == -1.0));
        assert!(ids.filter(|&id| id == 1.0).count() > 20);
        let seen = |pixel: &&usize| found["depth.Z"][**pixel] > 0.0;
        let mut before = 0.0;
        for &pixel in column.iter().filter(seen) {
            let (way, y) = (found["root_distance.Y"][pixel], found["P.Y"][pixel]);
            assert!(way >= before, "{way} after {before}");
            assert!((way - (2.0 - y) / 4.0).abs() < 1e-3, "{way} at {y}");
            before = way;
        }
        assert!(before > 0.95, "{before}");
    }

    #[test]
    fn proxies_hide_strands_behind_them_only() {
        // A curtain at z = 0, fuller than the picture.
        let ends: Vec<_> = (-100..=100)
            .map(|ix| (Vec3::new(0.1 * ix as f32, 8.0, 0.0), Vec3::Y * -16.0))
            .collect();
        let strands = straight(&ends, 9, 0.15);
        let view = view_uniform(&camera(Vec3::new(0.0, 0.0, 20.0)), &strands, SIZE, 1.0);
        let layers: Vec<&Layer> = LAYERS.iter().collect();
        let hidden = |z: f32| {
            let proxy = Proxy::Ellipsoid {
                centre: Vec3::new(0.0, 0.0, z),
                radii: Vec3::ONE,
                turn: Quat::IDENTITY,
                albedo: [0.5; 3],
            };
            let beside = Beside::new(&[proxy], &strands);
            let channels = channels(&strands, &beside, &view, &layers);
            let found: BTreeMap<_, _> = channels.into_iter().collect();
            let middle = 32 * SIZE[0] as usize + 48;
            assert_eq!(found["depth.Z"][middle] == 0.0, z > 0.0, "{z}");
            let free = found["depth.Z"].iter().filter(|&&depth| depth == 0.0);
            assert_eq!(
                free.clone().count(),
                found["strand_id.Y"]
                    .iter()
                    .filter(|&&id| id == -1.0)
                    .count()
            );
            free.count()
        };
        // A disc of radius 1 cm 17 cm away, at 158 pixels a unit of tangent.
        let expected = std::f32::consts::PI * (157.9_f32 / 17.0).powi(2);
        let count = hidden(3.0) as f32;
        assert!((count / expected - 1.0).abs() < 0.1, "{count} {expected}");
        assert_eq!(hidden(-3.0), 0);
    }

    #[test]
    fn every_layer_of_data_but_coverage_has_its_channels() {
        let strands = straight(&[(Vec3::Y, Vec3::Y * -2.0)], 2, 0.1);
        let view = view_uniform(&camera(Vec3::new(0.0, 0.0, 20.0)), &strands, SIZE, 1.0);
        let found = all(&strands, &view);
        let mut n_channels = 0;
        for (layer, data) in strandlight_scene::layers::data_layers() {
            for channel in layer.channels {
                assert_eq!(found.contains_key(channel), data != Data::Coverage);
                n_channels += usize::from(data != Data::Coverage);
            }
        }
        assert_eq!(n_channels, found.len());
    }
}
