//! The visibility list against samples.

use glam::Vec3;
use strandlight_scene::camera::{Camera, view_uniform};
use strandlight_scene::proxy::{GROUND, Proxy};

use super::super::project::project;
use super::super::proxies::Proxies;
use super::super::radiance::Radiance;
use super::super::raster;
use super::*;

/// Curls of a ball of hair; every third one is wide.
fn strands(n: usize, diameter: f32) -> Strands {
    let mut points = Vec::new();
    for ix in 0..n {
        let turn = 2.4 * ix as f32;
        let height = 1.0 - 2.0 * (ix as f32 + 0.5) / n as f32;
        let out = Vec3::new(turn.cos(), 0.0, turn.sin()) * (1.0 - height * height).sqrt()
            + Vec3::Y * height;
        let across = out.cross(Vec3::Y).normalize_or(Vec3::X);
        points.extend((0..6).map(|k| {
            let along = k as f32 / 5.0;
            let curl = 0.1 * (4.0 * along + turn).sin();
            (out * (0.7 + 0.4 * along) + across * (0.6 * along + curl)).to_array()
        }));
    }
    let offsets: Vec<u32> = (0..=n).map(|ix| 6 * ix as u32).collect();
    let width = |strand: usize, _: usize| match strand % 3 {
        0 => diameter,
        _ => 0.2 * diameter,
    };
    Strands::new(&points, &offsets, width, true).expect("valid")
}

fn no_proxies() -> Beside {
    Beside::none()
}

/// Radiance and coverage by the list.
fn resolved(list: &VisibilityList, radiance: &[[f32; 4]], size: [u32; 2]) -> Vec<[f64; 4]> {
    let mut picture = vec![[0.0; 4]; (size[0] * size[1]) as usize];
    for tile in &list.tiles {
        for (pixel, range) in tile.starts.windows(2).enumerate() {
            let x = tile.origin[0] + pixel as u32 % tile.size[0];
            let y = tile.origin[1] + pixel as u32 / tile.size[0];
            let sum = &mut picture[(x + size[0] * y) as usize];
            for entry in &tile.entries[range[0] as usize..range[1] as usize] {
                let ends = [0, 1].map(|ix| &radiance[entry.first as usize + ix]);
                for (channel, sum) in sum.iter_mut().enumerate().take(3) {
                    let value = ends[0][channel] * (1.0 - entry.t()) + ends[1][channel] * entry.t();
                    *sum += f64::from(entry.weight * value);
                }
                sum[3] += f64::from(entry.weight);
            }
        }
    }
    picture
}

/// Relative difference of the means over blocks of 4 x 4 pixels, and the ratio of the means over
/// all.
fn compare(a: &[[f64; 4]], b: &[[f64; 4]], size: [u32; 2]) -> (f64, f64) {
    let (mut difference, mut square, mut sums) = (0.0, 0.0, [0.0; 2]);
    let [width, height] = size.map(|n| n as usize);
    for y in (0..height).step_by(4) {
        for x in (0..width).step_by(4) {
            for channel in 0..4 {
                let mean = |picture: &[[f64; 4]]| {
                    let places = (0..16).map(|ix| x + ix % 4 + width * (y + ix / 4));
                    places.map(|place| picture[place][channel]).sum::<f64>()
                };
                let (a, b) = (mean(a), mean(b));
                difference += (a - b).powi(2);
                square += b * b;
                sums = [sums[0] + a, sums[1] + b];
            }
        }
    }
    ((difference / square).sqrt(), sums[0] / sums[1])
}

/// Smooth over the hair, as radiance is, with a strong gradient.
fn radiance_of(strands: &Strands) -> Vec<[f32; 4]> {
    let of = |point: &[f32; 4]| {
        let at = Vec3::from_slice(point);
        [
            1.0 + 0.9 * (3.0 * at.x).sin(),
            1.0 + 0.9 * (5.0 * at.y).cos(),
            0.2 + at.length(),
            0.0,
        ]
    };
    strands.points.iter().map(of).collect()
}

/// Difference of the list from samples, as [`compare`] has it, of strands from a tenth of a pixel
/// to several pixels wide, with these numbers of samples. Samples reach an eighth of a pixel beyond
/// their pixel, which shows at the outlines of wide strands: those are drawn in four times as many
/// pixels across, and four down. Narrow ones would be other ribbons there.
fn differences(samples: [u32; 3]) -> [(f64, f64); 3] {
    let size = [48, 32];
    let cases = [(0.005, 6000, 1), (0.03, 3000, 1), (0.3, 300, 4)];
    std::array::from_fn(|case| {
        let (diameter, n_strands, finer) = cases[case];
        let n = samples[case].div_ceil(finer * finer);
        let strands = strands(n_strands, diameter);
        let camera = Camera::framing(strands.centre, strands.radius, 0.5);
        let view = view_uniform(&camera, &strands, size, 1.0);
        let radiance = Radiance {
            at: radiance_of(&strands),
            along: Vec::new(),
        };
        let list = VisibilityList::new(&view, &strands, &no_proxies());
        let view = view_uniform(&camera, &strands, size.map(|side| side * finer), 1.0);
        let projected = project(&view, &strands, LISTED_WIDTH_PX);
        let none = Proxies::none();
        let ribbons = raster::ribbons(&view, &strands, &projected, true);
        let of_view = (&view, &strands, &projected[..], &ribbons[..]);
        let drawn = raster::draw(of_view, (&radiance, None), &none, n, &|_| ());
        let mut samples = vec![[0.0; 4]; (size[0] * size[1]) as usize];
        for (ix, sums) in (0..).zip(&drawn.sums) {
            let [x, y] = [ix % view.size[0], ix / view.size[0]].map(|at| at / finer);
            for (mean, sum) in samples[(x + size[0] * y) as usize].iter_mut().zip(sums) {
                *mean += f64::from(*sum) / f64::from(n * finer * finer);
            }
        }
        let (error, ratio) = compare(&resolved(&list, &radiance.at, size), &samples, size);
        println!(
            "{diameter}, {n} samples: {:.3} %, {ratio:.5}",
            100.0 * error
        );
        (error, ratio)
    })
}

#[test]
fn slow_the_list_is_the_picture_of_many_samples() {
    // Most of the difference of thin strands is noise of the samples.
    let limits = [0.015, 0.015, 0.01];
    for ((error, ratio), limit) in differences([512, 512, 256]).into_iter().zip(limits) {
        assert!(error < limit, "{error}");
        assert!((ratio - 1.0).abs() < 0.004, "{ratio}");
    }
}

/// In the tier `truth` of `tests/run`; alone `cargo test -p strandlight-cpu --lib very_many -- --ignored --nocapture`.
#[test]
#[ignore = "takes minutes, so it is in the tier truth"]
fn the_list_is_the_picture_of_very_many_samples() {
    let [thin, middle, wide] = differences([16_384; 3]);
    for ((error, ratio), limit) in [(thin, 0.005), (middle, 0.005), (wide, 0.01)] {
        assert!(error < limit, "{error}");
        assert!((ratio - 1.0).abs() < 0.001, "{ratio}");
    }
}

#[test]
fn weights_are_shares_and_bytes_do_not_depend_on_threads() {
    let size = [75, 50];
    let strands = strands(900, 0.3);
    let camera = Camera::framing(strands.centre, strands.radius, 0.5);
    let view = view_uniform(&camera, &strands, size, 1.0);
    let list = VisibilityList::new(&view, &strands, &no_proxies());
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool");
    let alone = one.install(|| VisibilityList::new(&view, &strands, &no_proxies()));
    let mut opaque = 0;
    for (tile, other) in list.tiles.iter().zip(&alone.tiles) {
        assert_eq!(tile.entries, other.entries);
        for range in tile.starts.windows(2) {
            let entries = &tile.entries[range[0] as usize..range[1] as usize];
            let sum: f32 = entries.iter().map(|entry| entry.weight).sum();
            assert!((0.0..=1.0 + 1e-5).contains(&sum), "{sum}");
            opaque += u32::from(sum > 1.0 - 1e-5);
        }
    }
    // In the middle everything is hidden.
    assert!(opaque > 500, "{opaque}");
}

#[test]
fn a_proxy_hides_what_is_behind_it() {
    let size = [64, 64];
    let strands = strands(300, 0.02);
    let camera = Camera::framing(strands.centre, strands.radius, 0.5);
    let view = view_uniform(&camera, &strands, size, 1.0);
    let head = Proxy::Ellipsoid {
        centre: Vec3::ZERO,
        radii: Vec3::splat(0.6),
        turn: glam::Quat::IDENTITY,
        albedo: [0.5; 3],
    };
    let proxies = Beside::new(&[head], &strands);
    assert_ne!(proxies.records().list[0].kind, GROUND);
    let open = VisibilityList::new(&view, &strands, &no_proxies());
    let list = VisibilityList::new(&view, &strands, &proxies);
    assert!(list.n_entries() < open.n_entries());
    let middle = |list: &VisibilityList| {
        let tile = list.tiles.iter().find(|tile| tile.origin == [32, 32]);
        let tile = tile.expect("the picture has four by four tiles");
        let range = tile.starts[0] as usize..tile.starts[1] as usize;
        let hair: f32 = tile.entries[range].iter().map(|entry| entry.weight).sum();
        let proxies = tile.proxies.iter().filter(|entry| entry.pixel == 0);
        (hair, proxies.map(|entry| entry.weight).sum::<f32>())
    };
    let (hair, head) = middle(&list);
    assert!(head > 0.05, "{head}");
    // Nothing shows through the head.
    assert!((hair + head - 1.0).abs() < 1e-4, "{hair} {head}");
}

/// Half a circle of radius 1 in `n` segments, 0.1 wide, flat before the camera.
fn arc_strands(n: u32) -> (Strands, ViewUniform) {
    let points: Vec<[f32; 3]> = (0..=n)
        .map(|ix| {
            let (sin, cos) = (std::f32::consts::PI * ix as f32 / n as f32).sin_cos();
            [cos, sin - 0.5, 0.0]
        })
        .collect();
    let strands = Strands::new(&points, &[0, n + 1], |_, _| 0.1, false).expect("valid");
    let camera = Camera {
        eye: Vec3::new(0.0, 0.0, 10.0),
        target: Vec3::ZERO,
        up: Vec3::Y,
        fov_y: 0.25,
    };
    let view = view_uniform(&camera, &strands, [320, 320], 1.0);
    (strands, view)
}

/// The list of an [`arc_strands`].
fn arc(n: u32) -> VisibilityList {
    let (strands, view) = arc_strands(n);
    VisibilityList::new(&view, &strands, &no_proxies())
}

#[test]
fn bent_segments_follow_the_curve_and_tips_are_round() {
    let by_list = |n: u32| {
        let radiance = [[0.0; 4]; 300];
        let picture = resolved(&arc(n), &radiance, [320, 320]);
        picture.iter().map(|pixel| pixel[3]).collect::<Vec<f64>>()
    };
    let fine = follow_the_curve_and_are_round(by_list);
    let by_samples = |n: u32| {
        let (strands, view) = arc_strands(n);
        let projected = project(&view, &strands, LISTED_WIDTH_PX);
        let radiance = Radiance {
            at: vec![[0.0; 4]; strands.points.len()],
            along: Vec::new(),
        };
        let ribbons = raster::ribbons(&view, &strands, &projected, true);
        let of_view = (&view, &strands, &projected[..], &ribbons[..]);
        let lit = (&radiance, None);
        let drawn = raster::draw(of_view, lit, &Proxies::none(), 64, &|_| ());
        drawn
            .sums
            .iter()
            .map(|sum| f64::from(sum[3]) / 64.0)
            .collect::<Vec<f64>>()
    };
    let of_samples = follow_the_curve_and_are_round(by_samples);
    let off = fine.iter().zip(&of_samples).map(|(a, b)| (a - b).abs());
    let off = off.sum::<f64>() / fine.iter().sum::<f64>();
    println!("list and samples: {off:.4}");
    assert!(off < 0.01, "{off}");
}

/// Checks `coverage` of pictures of arcs in few segments and in many, which is the answer.
fn follow_the_curve_and_are_round(coverage: impl Fn(u32) -> Vec<f64>) -> Vec<f64> {
    // 22 degrees a segment: straight ones leave the curve by 2.4 px, of 13 that it is wide.
    let (coarse, fine) = (coverage(8), coverage(180));
    let sum = |picture: &[f64]| picture.iter().sum::<f64>();
    // The first and the last know their direction from one side alone.
    let middle = |picture: &[f64]| {
        let columns = picture.chunks(320).flat_map(|row| &row[80..240]);
        columns.copied().collect::<Vec<f64>>()
    };
    let off = middle(&coarse)
        .into_iter()
        .zip(middle(&fine))
        .map(|(a, b)| (a - b).abs());
    let off = off.sum::<f64>() / sum(&middle(&fine));
    println!("{off:.4} of {:.1} px", sum(&fine));
    assert!(off < 0.02, "{off}");
    assert!((sum(&coarse) / sum(&fine) - 1.0).abs() < 0.003);
    // The tip, on the left, has no corners: its last row is narrower than the strand.
    let width_of = |row: usize| fine[320 * row..][..160].iter().sum::<f64>();
    let last = (0..320)
        .rposition(|row| width_of(row) > 0.5)
        .expect("there");
    let above = width_of(last - 20);
    assert!(width_of(last) < 0.7 * above, "{} {above}", width_of(last));
    fine
}

#[test]
fn entries_of_a_wide_strand_show_all_of_its_width() {
    let list = arc(180);
    assert!(list.has_wide);
    let (mut weights, mut sums) = (0.0, [0.0; 2]);
    let mut edges = [1.0_f32, -1.0];
    for entry in list.tiles.iter().flat_map(|tile| &tile.entries) {
        let [across, across_2] = entry.across();
        weights += f64::from(entry.weight);
        sums[0] += f64::from(entry.weight * across);
        sums[1] += f64::from(entry.weight * across_2);
        edges = [edges[0].min(across), edges[1].max(across)];
    }
    let [mean, mean_square] = sums.map(|sum| sum / weights);
    // The outer side of the arc is longer: a strand of radius r and half width h has the mean h / 3 r.
    assert!(
        (mean - 0.05 / 3.0).abs() < 0.01 || (mean + 0.05 / 3.0).abs() < 0.01,
        "{mean}"
    );
    assert!((mean_square - 1.0 / 3.0).abs() < 0.01, "{mean_square}");
    assert!(edges[0] < -0.9 && edges[1] > 0.9, "{edges:?}");
    // Thin strands have no sides.
    let strands = strands(300, 0.005);
    let camera = Camera::framing(strands.centre, strands.radius, 0.5);
    let view = view_uniform(&camera, &strands, [48, 32], 1.0);
    let thin = VisibilityList::new(&view, &strands, &no_proxies());
    assert!(!thin.has_wide && thin.n_entries() > 0);
    let entries = thin.tiles.iter().flat_map(|tile| &tile.entries);
    assert!(entries.into_iter().all(|entry| entry.across()[0] == 0.0));
}
