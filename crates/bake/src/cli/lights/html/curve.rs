//! The error against the number of lights, both axes logarithmic.

use std::fmt::Write as _;
use strandlight_formats::counted;

use strandlight_bake::lights::{CountError, Metric};

use super::text::{self, percent};

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 320.0;
/// Left, top, right, bottom.
const MARGINS: [f64; 4] = [64.0, 16.0, 120.0, 44.0];
/// What an error of 0 is drawn as.
const LEAST: f64 = 1e-6;

/// The picture; `chosen` is the number of lights to be marked, `limit` an error and its name.
pub fn svg(points: &[CountError], chosen: usize, limit: Option<(f64, &str)>) -> String {
    let errors = points
        .iter()
        .flat_map(|point| Metric::ALL.map(|metric| metric.of(point).max(LEAST)));
    let errors: Vec<f64> = errors
        .chain(limit.map(|(error, _)| error.max(LEAST)))
        .collect();
    let counts = || points.iter().map(|point| point.count as f64);
    let plot = Plot {
        x: spread(
            counts().fold(f64::MAX, f64::min),
            counts().fold(1.0, f64::max),
        ),
        y: spread(
            0.8 * errors.iter().copied().fold(f64::MAX, f64::min),
            1.25 * errors.iter().copied().fold(LEAST, f64::max),
        ),
    };
    let mut out = format!(
        "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"Error against number of lights\">"
    );
    plot.frame(&mut out);
    let mut last_label = f64::NEG_INFINITY;
    let mut by_end: Vec<Metric> = Metric::ALL.to_vec();
    let end = |metric: &Metric| {
        points
            .last()
            .map_or(0.0, |point| plot.at_y(metric.of(point)))
    };
    by_end.sort_by(|a, b| end(a).total_cmp(&end(b)));
    for metric in by_end {
        let name = metric.name();
        let at = |point: &CountError| (plot.at_x(point.count as f64), plot.at_y(metric.of(point)));
        let line: Vec<String> = points
            .iter()
            .map(at)
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        let _ = write!(
            out,
            "<g class=\"{name}\"><polyline points=\"{}\" />",
            line.join(" ")
        );
        for point in points {
            let (x, y) = at(point);
            let ring = if point.count == chosen {
                " class=\"ring\""
            } else {
                ""
            };
            let radius = if point.count == chosen { 6 } else { 3 };
            let _ = write!(
                out,
                "<circle{ring} cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"><title>{}: {name} error {}</title></circle>",
                counted(point.count, "light", "lights"),
                percent(metric.of(point))
            );
        }
        // Labels one below the other where the lines meet.
        last_label = end(&metric).max(last_label + 16.0);
        let _ = write!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\">{name}</text></g>",
            WIDTH - MARGINS[2] + 12.0,
            last_label + 4.0
        );
    }
    if let Some((error, name)) = limit {
        let y = plot.at_y(error);
        let _ = write!(
            out,
            "<g class=\"limit\"><path d=\"M{} {y:.1}H{}\" /><text x=\"{}\" y=\"{:.1}\">at most {} ({name})</text></g>",
            MARGINS[0],
            WIDTH - MARGINS[2],
            MARGINS[0] + 6.0,
            y - 5.0,
            text::limit(error)
        );
    }
    out + "</svg>"
}

/// Ends of an axis, apart.
fn spread(low: f64, high: f64) -> [f64; 2] {
    if high > 1.2 * low {
        [low, high]
    } else {
        [low / 1.5, low * 1.5]
    }
}

struct Plot {
    x: [f64; 2],
    y: [f64; 2],
}

impl Plot {
    fn at_x(&self, count: f64) -> f64 {
        let share = (count / self.x[0]).ln() / (self.x[1] / self.x[0]).ln();
        MARGINS[0] + share * (WIDTH - MARGINS[0] - MARGINS[2])
    }

    fn at_y(&self, error: f64) -> f64 {
        let share = (error.max(LEAST) / self.y[0]).ln() / (self.y[1] / self.y[0]).ln();
        HEIGHT - MARGINS[3] - share * (HEIGHT - MARGINS[1] - MARGINS[3])
    }

    /// Lines and numbers of both axes.
    fn frame(&self, out: &mut String) {
        let [left, top, right, bottom] = MARGINS;
        let (right, bottom) = (WIDTH - right, HEIGHT - bottom);
        *out += "<g class=\"frame\">";
        for tick in ticks(self.x).into_iter().filter(|tick| tick.fract() == 0.0) {
            let x = self.at_x(tick);
            let _ = write!(
                out,
                "<path d=\"M{x:.1} {top}V{bottom}\" /><text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{tick}</text>",
                bottom + 16.0
            );
        }
        for tick in ticks(self.y) {
            let y = self.at_y(tick);
            // Rounded: 0.05 * 100 has a tail of digits.
            let tick = (1e9 * tick).round() / 1e7;
            let _ = write!(
                out,
                "<path d=\"M{left} {y:.1}H{right}\" /><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{tick} %</text>",
                left - 6.0,
                y + 4.0
            );
        }
        let _ = write!(
            out,
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">number of lights</text></g>",
            0.5 * (left + right),
            bottom + 36.0
        );
    }
}

/// 1, 2 and 5 times powers of ten within a range.
fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let decades = (low.log10().floor() as i32)..=(high.log10().ceil() as i32);
    let steps = decades.flat_map(|decade| [1.0, 2.0, 5.0].map(|step| step * 10f64.powi(decade)));
    steps.filter(|x| (low..=high).contains(x)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(count: usize, error: f64) -> CountError {
        CountError {
            count,
            lights: count,
            compact_lights: 0,
            fibre_error: error,
            irradiance_error: 0.5 * error,
        }
    }

    #[test]
    fn every_curve_stays_in_its_picture() {
        for points in [
            vec![point(1, 0.3), point(2, 0.2), point(40, 0.005)],
            vec![point(7, 0.01)],
            vec![point(1, 0.0), point(2, 0.0)],
            vec![point(1, 1e9), point(1024, 1e-12)],
        ] {
            for limit in [None, Some((0.01, "fibre")), Some((0.0, "irradiance"))] {
                let svg = svg(&points, 2, limit);
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
                for pair in svg.split("points=\"").skip(1) {
                    for point in pair.split('"').next().unwrap_or_default().split(' ') {
                        let (x, y) = point.split_once(',').expect("a point");
                        let (x, y): (f64, f64) = (x.parse().expect("x"), y.parse().expect("y"));
                        assert!(
                            (0.0..=WIDTH).contains(&x) && (0.0..=HEIGHT).contains(&y),
                            "{point}"
                        );
                    }
                }
            }
        }
        assert_eq!(ticks([0.9, 11.0]), [1.0, 2.0, 5.0, 10.0]);
    }
}
