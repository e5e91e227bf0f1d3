use glam::Vec3;
use strandlight_scene::camera::{Camera, view_uniform};

use super::super::project::project;
use super::super::screen_point::SAMPLED_WIDTH_PX;
use super::*;

/// Thick and thin strands across each other, some of them equally deep.
fn strands(n: usize, diameter: f32) -> Strands {
    let mut points = Vec::new();
    for ix in 0..n {
        let turn = 2.4 * ix as f32;
        let z = (ix % 7) as f32 * 0.1;
        let along = Vec3::new(turn.cos(), turn.sin(), 0.3 * (ix % 3) as f32);
        let middle = Vec3::new(0.3 * (1.7 * turn).sin(), 0.3 * (0.9 * turn).cos(), z);
        points.extend([-0.6, -0.1, 0.5].map(|t| (middle + along * t).to_array()));
    }
    let offsets: Vec<u32> = (0..=n).map(|ix| 3 * ix as u32).collect();
    let width = |strand: usize, _: usize| match strand % 3 {
        0 => 0.002,
        1 => diameter,
        _ => 0.1 * diameter,
    };
    Strands::new(&points, &offsets, width, true).expect("valid")
}

/// The picture in parts of `sides`, and by drawing every segment over all of it in another
/// order.
fn drawn(
    strands: &Strands,
    camera: &Camera,
    size: [u32; 2],
    sides: [i32; 2],
    is_close_up: bool,
) -> [Drawn; 2] {
    let view = view_uniform(camera, strands, size, 1.0);
    let projected = project(&view, strands, SAMPLED_WIDTH_PX);
    let at: Vec<[f32; 4]> = (0..strands.points.len())
        .map(|ix| [0.1, 0.2, 0.3].map(|x| x + (x * ix as f32).sin().abs()))
        .map(|[r, g, b]| [r, g, b, 0.0])
        .collect();
    let radiance = Radiance {
        at,
        along: Vec::new(),
    };
    let ribbons = ribbons(&view, strands, &projected, is_close_up);
    let proxies = Proxies::none();
    let hair = Hair {
        view: &view,
        strands,
        projected: &projected,
        radiance: &radiance,
        even: None,
        proxies: &proxies,
        ribbons: &ribbons,
        samples: 10,
    };
    let mut all = Tile::new(Rect {
        origin: [0, 0],
        size: size.map(|n| n as i32),
    });
    for pass in 0..3 {
        all.clear();
        for ix in (0..ribbons.len() as u32).rev() {
            all.pass(pass, &[ix], &hair);
        }
        all.add(if pass < 2 { 4 } else { 2 });
    }
    let whole = Drawn {
        sums: all.sums,
        visited: all.visited,
    };
    [hair.draw(sides, &|_| ()), whole]
}

#[test]
fn parts_and_order_change_no_bit() {
    let size = [75, 50];
    for diameter in [0.01, 0.3, 2.0] {
        let strands = strands(150, diameter);
        let framing = Camera::framing(strands.centre, strands.radius, 0.5);
        // Between the strands, where some pass by the eye.
        let inside = Camera {
            eye: Vec3::new(0.05, 0.02, 0.9),
            target: Vec3::new(0.0, 0.1, -1.0),
            ..framing
        };
        for camera in [framing, inside] {
            for sides in [[TILE, LEAST_TILE], [9, 5], [1, 1], [4096, 1]] {
                for is_close_up in [false, true] {
                    let [parts, whole] = drawn(&strands, &camera, size, sides, is_close_up);
                    let covered = whole.sums.iter().filter(|sum| sum[3] > 0.0).count();
                    assert!(covered > 300, "{covered}");
                    assert_eq!(parts.sums, whole.sums, "{diameter} {sides:?} {is_close_up}");
                }
            }
        }
    }
}

#[test]
fn what_is_hidden_is_not_drawn() {
    let strands = strands(3000, 2.0);
    let camera = Camera::framing(strands.centre, strands.radius, 0.5);
    let [parts, whole] = drawn(&strands, &camera, [64, 64], [TILE, LEAST_TILE], false);
    assert!(parts.sums == whole.sums);
    let opaque = parts.sums.iter().filter(|sum| sum[3] == 10.0).count();
    println!("{opaque} of {} pixels are opaque", parts.sums.len());
    assert!(opaque > 2000);
    println!("{} pixels visited of {}", parts.visited, whole.visited);
    assert!(4 * parts.visited < whole.visited);
}
