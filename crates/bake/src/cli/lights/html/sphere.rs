//! What is drawn over a map of the sphere: axes and lights.

use std::fmt::Write as _;

use strandlight_formats::SrbfLight;
use strandlight_images::LatLong;

use super::text::{degrees, number, percent};

/// Most lights whose share is written beside them.
const LABELS: usize = 12;

/// Points of a circle.
const STEPS: usize = 96;

/// The ends of the axes, and their names.
pub fn axes(grid: LatLong) -> String {
    let (width, height) = (grid.width as f64, grid.height as f64);
    let mut out = "<g class=\"axes\">".to_owned();
    for (name, direction) in [
        ("+X", [1.0, 0.0, 0.0]),
        ("-X", [-1.0, 0.0, 0.0]),
        ("+Z", [0.0, 0.0, 1.0]),
    ] {
        let [x, y] = grid.position(direction);
        mark(&mut out, name, [x, y], [x, y - 8.0], "middle");
    }
    // On the edges: above and below everywhere, -Z on both sides.
    mark(
        &mut out,
        "+Y",
        [width / 2.0, 0.0],
        [width / 2.0, 16.0],
        "middle",
    );
    mark(
        &mut out,
        "-Y",
        [width / 2.0, height],
        [width / 2.0, height - 8.0],
        "middle",
    );
    mark(
        &mut out,
        "-Z",
        [0.0, height / 2.0],
        [6.0, height / 2.0 - 8.0],
        "start",
    );
    mark(
        &mut out,
        "-Z",
        [width, height / 2.0],
        [width - 6.0, height / 2.0 - 8.0],
        "end",
    );
    out + "</g>"
}

fn mark(out: &mut String, name: &str, [x, y]: [f64; 2], [at, baseline]: [f64; 2], anchor: &str) {
    let _ = write!(
        out,
        "<path d=\"M{:.1} {y:.1}h8M{x:.1} {:.1}v8\" /><text x=\"{at:.1}\" y=\"{baseline:.1}\" text-anchor=\"{anchor}\">{name}</text>",
        x - 4.0,
        y - 4.0
    );
}

/// The angle at which the radiance of a light has fallen to 1/e; none if it nowhere has.
pub fn radius(lambda: f32) -> Option<f64> {
    // 2 (1 - cos) / lambda^2 = 1
    let half = 0.5 * f64::from(lambda);
    (half < 1.0).then(|| 2.0 * half.asin())
}

/// A dot for each light, its area the share, and its circle.
pub fn discs(lights: &[SrbfLight], shares: &[f64], grid: LatLong) -> String {
    let mut out = "<g class=\"discs\">".to_owned();
    // Faint lights first, so that strong ones stay on top.
    let numbered = lights.iter().zip(shares).enumerate();
    for (ix, (light, &share)) in numbered.rev() {
        let axis = light.direction.map(f64::from);
        let [x, y] = grid.position(axis);
        let color = color(light.rgb);
        if let Some(radius) = radius(light.lambda) {
            let path = circle(axis, radius, grid);
            let _ = write!(out, "<path d=\"{path}\" stroke=\"{color}\" />");
        }
        // A light of all energy has a fortieth of the picture.
        let dot = (share * (grid.width * grid.height) as f64 / 40.0 / std::f64::consts::PI).sqrt();
        let width = radius(light.lambda).map_or("none".to_owned(), degrees);
        let [r, g, b] = light.rgb.map(|x| number(f64::from(x)));
        let _ = write!(
            out,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\" fill=\"{color}\"><title>light {}: {} of the energy, \
             elevation {}, radius at 1/e {width}, radiance {r} {g} {b}</title></circle>",
            dot.max(1.2),
            ix + 1,
            percent(share),
            degrees(axis[1].clamp(-1.0, 1.0).asin()),
        );
    }
    labels(&mut out, lights, shares, grid);
    out + "</g>"
}

/// The shares of the strongest lights beside them, where there is room.
fn labels(out: &mut String, lights: &[SrbfLight], shares: &[f64], grid: LatLong) {
    let mut taken: Vec<[f64; 2]> = Vec::new();
    let strong = lights
        .iter()
        .zip(shares)
        .filter(|(_, share)| **share >= 0.01);
    for (light, share) in strong {
        let [x, y] = grid.position(light.direction.map(f64::from));
        let x = x.clamp(14.0, grid.width as f64 - 14.0);
        let y = y.clamp(8.0, grid.height as f64 - 6.0) + 4.0;
        let is_free = |[a, b]: &[f64; 2]| (a - x).abs() > 28.0 || (b - y).abs() > 12.0;
        if taken.len() == LABELS || !taken.iter().all(is_free) {
            continue;
        }
        taken.push([x, y]);
        let share = 100.0 * share;
        let _ = write!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\">{share:.0} %</text>");
    }
}

/// A circle on the sphere as lines on the map, cut where it leaves at one side and enters at the other.
fn circle(axis: [f64; 3], radius: f64, grid: LatLong) -> String {
    let [a, b] = frame(axis);
    let (sin, cos) = radius.sin_cos();
    let mut path = String::new();
    let mut last: Option<f64> = None;
    for step in 0..=STEPS {
        let turn = std::f64::consts::TAU * step as f64 / STEPS as f64;
        let (s, c) = turn.sin_cos();
        let point = [0, 1, 2].map(|k| cos * axis[k] + sin * (c * a[k] + s * b[k]));
        let [x, y] = grid.position(point);
        let is_cut = last.is_none_or(|last| (last - x).abs() > 0.5 * grid.width as f64);
        let _ = write!(path, "{}{x:.1} {y:.1}", if is_cut { 'M' } else { 'L' });
        last = Some(x);
    }
    path
}

/// Two unit vectors normal to a unit vector and to each other.
fn frame([x, y, z]: [f64; 3]) -> [[f64; 3]; 2] {
    let across = if y.abs() < 0.9 {
        [z, 0.0, -x]
    } else {
        [0.0, -z, y]
    };
    let length = across.iter().map(|v| v * v).sum::<f64>().sqrt();
    let a = across.map(|v| v / length);
    let b = [
        y * a[2] - z * a[1],
        z * a[0] - x * a[2],
        x * a[1] - y * a[0],
    ];
    [a, b]
}

/// The hue of a light, at full brightness, sRGB.
fn color(rgb: [f32; 3]) -> String {
    let strongest = rgb.iter().fold(f32::MIN_POSITIVE, |m, x| m.max(*x));
    let [r, g, b] = rgb.map(|x| {
        let value = 0.08 + 0.92 * f64::from(x / strongest);
        (255.0 * value.powf(1.0 / 2.2)).round() as u8
    });
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_lie_about_their_axis() {
        let grid = LatLong {
            width: 512,
            height: 256,
        };
        for axis in [
            [0.0, 0.0, 1.0],
            [0.6, 0.8, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, -1.0],
        ] {
            let path = circle(axis, 0.3, grid);
            let points = path.split(['M', 'L']).filter(|point| !point.is_empty());
            let mut n = 0;
            for point in points {
                let (x, y) = point.split_once(' ').expect("two numbers");
                let at = grid.direction(x.parse().expect("x"), y.parse().expect("y"));
                let cos: f64 = (0..3).map(|k| at[k] * axis[k]).sum();
                assert!((cos - 0.3f64.cos()).abs() < 2e-3, "{axis:?}: {point}");
                n += 1;
            }
            assert_eq!(n, STEPS + 1);
        }
        // Across the seam: cut, and not drawn over the whole map.
        assert!(circle([0.0, 0.0, -1.0], 0.3, grid).matches('M').count() > 1);
        assert_eq!(circle([0.0, 0.0, 1.0], 0.3, grid).matches('M').count(), 1);
    }

    #[test]
    fn radii_are_where_the_light_has_fallen() {
        for lambda in [0.005f32, 0.3, 1.5] {
            let angle = radius(lambda).expect("narrow");
            let value = (2.0 * (angle.cos() - 1.0) / f64::from(lambda).powi(2)).exp();
            assert!((value * std::f64::consts::E - 1.0).abs() < 1e-6);
        }
        assert_eq!(radius(2.5), None);
    }
}
