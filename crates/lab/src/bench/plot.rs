//! Plots of a few curves as SVG: axes, ticks, lines, markers, labelled points, legends.
//!
//! A [`Figure`] is a grid of [`Panel`]s; [`Figure::to_svg`] gives the same text for the same
//! numbers. Every name in a figure has one colour, whichever panel it appears in. What is not
//! finite, or not positive on a logarithmic axis, is left out and breaks a line.

use std::fmt::Write;

/// Size of a panel's plot area and of the strips around it, px.
const WIDTH: f64 = 340.0;
const HEIGHT: f64 = 260.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 22.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 54.0;
/// Height of a line of the legend, and of the figure's title.
const LEGEND_LINE: f64 = 18.0;
const TITLE: f64 = 34.0;
/// Font size of tick and point labels; the rest is 12.
const SMALL: f64 = 10.0;

/// Okabe and Ito's palette, which colour-blind readers can tell apart; black comes first.
const COLOURS: [&str; 8] = [
    "#000000", "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#b0a000",
];

/// A grid of panels.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Heading.
    pub title: String,
    /// Panels, row by row.
    pub panels: Vec<Panel>,
    /// Panels a row.
    pub columns: usize,
    /// Names of series that have the first colours, black first, whether they appear or not.
    pub colours: Vec<&'static str>,
}

/// One coordinate system.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Heading.
    pub title: String,
    /// The horizontal axis.
    pub x: AxisStyle,
    /// The vertical axis.
    pub y: AxisStyle,
    /// What is drawn, first below.
    pub series: Vec<Series>,
}

/// What an axis says and how it runs.
#[derive(Clone, Debug, Default)]
pub struct AxisStyle {
    /// Name and unit.
    pub label: String,
    /// Logarithmic.
    pub log: bool,
    /// Ends that do not depend on the data.
    pub range: Option<(f64, f64)>,
    /// Distance of the ticks of a linear axis.
    pub step: Option<f64>,
}

impl AxisStyle {
    /// A linear axis that fits the data.
    pub fn linear(label: &str) -> AxisStyle {
        AxisStyle {
            label: label.to_owned(),
            ..AxisStyle::default()
        }
    }

    /// A logarithmic axis that fits the data.
    pub fn log(label: &str) -> AxisStyle {
        AxisStyle {
            log: true,
            ..AxisStyle::linear(label)
        }
    }

    /// The axis with a tick every `step`.
    pub fn every(self, step: f64) -> AxisStyle {
        AxisStyle {
            step: Some(step),
            ..self
        }
    }

    /// The axis from `low` to `high`.
    pub fn within(self, low: f64, high: f64) -> AxisStyle {
        AxisStyle {
            range: Some((low, high)),
            ..self
        }
    }
}

/// How the points of a series are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// A line.
    #[default]
    Line,
    /// A dashed line.
    Dashed,
    /// Markers alone.
    Points,
    /// A line with markers.
    LinePoints,
}

/// A named curve or point set.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Name in the legend; the same name has the same colour everywhere.
    pub name: String,
    /// How it is drawn.
    pub mark: Mark,
    /// The points.
    pub points: Vec<(f64, f64)>,
    /// Texts beside the points: none, or one for each.
    pub labels: Vec<String>,
}

/// A rectangle that texts must not cover.
#[derive(Clone, Copy)]
struct Rect([f64; 4]);

impl Rect {
    /// Does the straight line from `a` to `b` pass through? Looked at every two pixels.
    fn is_crossed(&self, a: (f64, f64), b: (f64, f64)) -> bool {
        let steps = (0.5 * (b.0 - a.0).hypot(b.1 - a.1)).ceil().max(1.0);
        let Rect([left, top, right, bottom]) = *self;
        (0..=steps as u32).any(|i| {
            let t = f64::from(i) / steps;
            let (x, y) = (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
            (left..=right).contains(&x) && (top..=bottom).contains(&y)
        })
    }

    fn meets(&self, other: &Rect) -> bool {
        let (Rect([a, b, c, d]), Rect([e, f, g, h])) = (self, other);
        a < g && e < c && b < h && f < d
    }
}

/// An axis with its ends known.
struct Scale {
    log: bool,
    step: Option<f64>,
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Scale {
    fn new(style: &AxisStyle, values: impl Iterator<Item = f64>, from: f64, to: f64) -> Scale {
        let warp = |x: f64| if style.log { x.log10() } else { x };
        let (mut low, mut high) = values
            .map(warp)
            .filter(|x| x.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                (low.min(x), high.max(x))
            });
        if let Some(range) = style.range {
            (low, high) = (warp(range.0), warp(range.1));
        } else if low > high {
            (low, high) = (0.0, 1.0);
        } else {
            let margin = 0.05 * (high - low).max(if style.log { 0.3 } else { 1e-9 });
            // A curve that starts at 0 has its axis at 0.
            let at_zero = !style.log && low == 0.0;
            (low, high) = (if at_zero { 0.0 } else { low - margin }, high + margin);
        }
        Scale {
            log: style.log,
            step: style.step,
            low,
            high,
            from,
            to,
        }
    }

    /// Where `x` lies, or `None` outside the axis.
    fn place(&self, x: f64) -> Option<f64> {
        let warped = if self.log { x.log10() } else { x };
        let unit = (warped - self.low) / (self.high - self.low);
        (-1e-6..=1.0 + 1e-6)
            .contains(&unit)
            .then_some(self.from + unit * (self.to - self.from))
    }

    /// Values with a tick; those with a text say it.
    fn ticks(&self) -> Vec<(f64, Option<String>)> {
        if !self.log {
            let nice = nice_step((self.high - self.low) / 5.0);
            let step = self.step.unwrap_or(nice);
            let digits = (-step.log10()).ceil().max(0.0) as usize;
            let first = (self.low / step - 1e-6).ceil() as i64;
            let last = (self.high / step + 1e-6).floor() as i64;
            return (first..=last.min(first + 20))
                .map(|i| {
                    let value = i as f64 * step;
                    (value, Some(format!("{value:.digits$}")))
                })
                .collect();
        }
        let mut ticks = Vec::new();
        let decades = self.high - self.low;
        for power in self.low.floor() as i32..=self.high.ceil() as i32 {
            for digit in 1..10 {
                let named = digit == 1
                    || decades < 3.0 && (digit == 2 || digit == 5)
                    || decades < 0.8 && digit < 9;
                let value = f64::from(digit) * 10f64.powi(power);
                ticks.push((value, named.then(|| number(value))));
            }
        }
        ticks
    }
}

/// 1, 2 or 5 times a power of ten, at least `least`.
fn nice_step(least: f64) -> f64 {
    let decade = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|n| n * decade)
        .into_iter()
        .find(|step| *step >= 0.999 * least)
        .unwrap_or(decade)
}

/// A tick's value without needless digits.
fn number(value: f64) -> String {
    if (1e-3..1e6).contains(&value) {
        let text = format!("{value:.3}");
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    format!("{value:e}")
}

/// Five digits of `value`.
fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// Estimated width of `text` in a sans-serif font.
fn text_width(text: &str, size: f64) -> f64 {
    0.68 * size * text.chars().count() as f64
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

impl Figure {
    /// The picture.
    pub fn to_svg(&self) -> String {
        let columns = self.columns.max(1);
        let names = self.names();
        let rows: Vec<&[Panel]> = self.panels.chunks(columns).collect();
        let width = columns as f64 * (LEFT + WIDTH + RIGHT);
        let legends = |row: &[Panel]| {
            let lines = row.iter().map(|panel| panel.legend_lines().len());
            lines.max().unwrap_or(0) as f64 * LEGEND_LINE
        };
        let heights: Vec<f64> = rows
            .iter()
            .map(|row| TOP + HEIGHT + BOTTOM + legends(row) + 8.0)
            .collect();
        let height = TITLE + heights.iter().sum::<f64>();
        let mut svg = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"Helvetica, Arial, sans-serif\" \
             font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
             <text x=\"{:.1}\" y=\"22\" font-size=\"15\" text-anchor=\"middle\">{}</text>",
            0.5 * width,
            escaped(&self.title)
        );
        let mut y = TITLE;
        for (row, height) in rows.iter().zip(heights) {
            for (ix, panel) in row.iter().enumerate() {
                panel.draw(&mut svg, ix as f64 * (LEFT + WIDTH + RIGHT), y, &names);
            }
            y += height;
        }
        svg.push_str("</svg>\n");
        svg
    }

    /// The points as `panel,series,x,y`, commas in titles and names as semicolons.
    pub fn to_csv(&self) -> String {
        let mut csv = "panel,series,x,y\n".to_owned();
        for panel in &self.panels {
            for series in &panel.series {
                let [panel, name] = [&panel.title, &series.name].map(|text| text.replace(',', ";"));
                for (x, y) in &series.points {
                    // Writing to a string cannot fail.
                    let _ = writeln!(csv, "{panel},{name},{},{}", rounded(*x), rounded(*y));
                }
            }
        }
        csv
    }

    /// The names in `colours`, then all others in the order of their first appearance: the index
    /// is the colour.
    fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.colours.clone();
        for series in self.panels.iter().flat_map(|panel| &panel.series) {
            if !names.contains(&series.name.as_str()) {
                names.push(&series.name);
            }
        }
        names
    }
}

impl Panel {
    /// Series with a name, each once, broken into lines that fit the panel.
    fn legend_lines(&self) -> Vec<Vec<&Series>> {
        let mut lines: Vec<Vec<&Series>> = Vec::new();
        let mut used = f64::INFINITY;
        let mut seen: Vec<&str> = Vec::new();
        for series in &self.series {
            if series.name.is_empty() || seen.contains(&series.name.as_str()) {
                continue;
            }
            seen.push(&series.name);
            let width = legend_width(&series.name);
            if used + width > WIDTH + RIGHT {
                lines.push(Vec::new());
                used = 0.0;
            }
            used += width;
            if let Some(line) = lines.last_mut() {
                line.push(series);
            }
        }
        lines
    }

    /// Draws the panel with its corner at (`x`, `y`).
    fn draw(&self, svg: &mut String, x: f64, y: f64, names: &[&str]) {
        let (left, top) = (x + LEFT, y + TOP);
        let (right, bottom) = (left + WIDTH, top + HEIGHT);
        let all = || self.series.iter().flat_map(|series| &series.points);
        let horizontal = Scale::new(&self.x, all().map(|p| p.0), left, right);
        let vertical = Scale::new(&self.y, all().map(|p| p.1), bottom, top);
        self.draw_frame(svg, &horizontal, &vertical);
        let colour = |name: &str| {
            let ix = names.iter().position(|other| *other == name).unwrap_or(0);
            COLOURS[ix % COLOURS.len()]
        };

        // Markers and lines first take their place, then labels look for theirs.
        let mut taken: Vec<Rect> = Vec::new();
        let mut lines: Vec<[(f64, f64); 2]> = Vec::new();
        let mut labels: Vec<(f64, f64, &str, &str)> = Vec::new();
        for series in &self.series {
            let colour = colour(&series.name);
            let places: Vec<Option<(f64, f64)>> = series
                .points
                .iter()
                .map(|&(x, y)| Some((horizontal.place(x)?, vertical.place(y)?)))
                .collect();
            if series.mark != Mark::Points {
                let dash = if series.mark == Mark::Dashed {
                    " stroke-dasharray=\"5 3\""
                } else {
                    ""
                };
                for run in places.split(Option::is_none).filter(|run| run.len() > 1) {
                    let ends = run.windows(2).flat_map(|pair| Some([pair[0]?, pair[1]?]));
                    lines.extend(ends);
                    let path: Vec<String> = run
                        .iter()
                        .flatten()
                        .map(|(x, y)| format!("{x:.1},{y:.1}"))
                        .collect();
                    let _ = writeln!(
                        svg,
                        "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" \
                         stroke-width=\"1.5\"{dash}/>",
                        path.join(" ")
                    );
                }
            }
            if matches!(series.mark, Mark::Points | Mark::LinePoints) {
                for (ix, &(x, y)) in places
                    .iter()
                    .enumerate()
                    .filter_map(|(ix, p)| Some((ix, p.as_ref()?)))
                {
                    let _ = writeln!(
                        svg,
                        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.2\" fill=\"{colour}\"/>"
                    );
                    taken.push(Rect([x - 4.0, y - 4.0, x + 4.0, y + 4.0]));
                    if let Some(text) = series.labels.get(ix) {
                        labels.push((x, y, text, colour));
                    }
                }
            }
        }
        for (x, y, text, colour) in labels {
            let width = text_width(text, SMALL);
            // Above, below, right, left, the corners, then further off; the first place that is
            // free, of lines if there is one.
            let offsets = [
                (-0.5 * width, -7.0),
                (-0.5 * width, 15.0),
                (7.0, 3.5),
                (-width - 7.0, 3.5),
                (5.0, -6.0),
                (5.0, 14.0),
                (-width - 5.0, -6.0),
                (-width - 5.0, 14.0),
                (-0.5 * width, -19.0),
                (-0.5 * width, 27.0),
            ];
            let free: Vec<(f64, f64, Rect)> = offsets
                .iter()
                .filter_map(|(dx, dy)| {
                    let (a, b) = (x + dx, y + dy);
                    let rect = Rect([a - 1.0, b - SMALL, a + width + 1.0, b + 2.0]);
                    let inside = a >= left + 1.0
                        && a + width <= right - 1.0
                        && b - SMALL >= top
                        && b + 2.0 <= bottom;
                    let free = inside && !taken.iter().any(|other| other.meets(&rect));
                    free.then_some((a, b, rect))
                })
                .collect();
            let uncrossed = free
                .iter()
                .find(|(_, _, rect)| !lines.iter().any(|[a, b]| rect.is_crossed(*a, *b)));
            // A crowded point goes unnamed; the table beside the plot has it.
            if let Some(&(a, b, rect)) = uncrossed.or(free.first()) {
                taken.push(rect);
                let _ = writeln!(
                    svg,
                    "<text x=\"{a:.1}\" y=\"{b:.1}\" font-size=\"{SMALL}\" fill=\"{colour}\">{}</text>",
                    escaped(text)
                );
            }
        }

        let mut line_y = bottom + BOTTOM + 2.0;
        for line in self.legend_lines() {
            let mut at = left - 30.0;
            for series in line {
                draw_key(svg, series, colour(&series.name), at, line_y);
                at += legend_width(&series.name);
            }
            line_y += LEGEND_LINE;
        }
    }

    /// Title, frame, grid, ticks and axis labels.
    fn draw_frame(&self, svg: &mut String, horizontal: &Scale, vertical: &Scale) {
        let (left, right) = (horizontal.from, horizontal.to);
        let (bottom, top) = (vertical.from, vertical.to);
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            0.5 * (left + right),
            top - 10.0,
            escaped(&self.title)
        );
        for (value, text) in horizontal.ticks() {
            let Some(x) = horizontal.place(value) else {
                continue;
            };
            let (length, grid) = if text.is_some() {
                (5.0, true)
            } else {
                (3.0, false)
            };
            if grid {
                let _ = writeln!(
                    svg,
                    "<path d=\"M{x:.1} {bottom:.1}V{top:.1}\" stroke=\"#e4e4e4\"/>"
                );
            }
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.1} {bottom:.1}v{length}\" stroke=\"#444444\"/>"
            );
            if let Some(text) = text {
                let _ = writeln!(
                    svg,
                    "<text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"{SMALL}\" \
                     text-anchor=\"middle\">{text}</text>",
                    bottom + 17.0
                );
            }
        }
        for (value, text) in vertical.ticks() {
            let Some(y) = vertical.place(value) else {
                continue;
            };
            let (length, grid) = if text.is_some() {
                (5.0, true)
            } else {
                (3.0, false)
            };
            if grid {
                let _ = writeln!(
                    svg,
                    "<path d=\"M{left:.1} {y:.1}H{right:.1}\" stroke=\"#e4e4e4\"/>"
                );
            }
            let _ = writeln!(
                svg,
                "<path d=\"M{left:.1} {y:.1}h-{length}\" stroke=\"#444444\"/>"
            );
            if let Some(text) = text {
                let _ = writeln!(
                    svg,
                    "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"{SMALL}\" \
                     text-anchor=\"end\">{text}</text>",
                    left - 8.0,
                    y + 3.5
                );
            }
        }
        let (middle, label_x) = (0.5 * (top + bottom), left - 50.0);
        let _ = writeln!(
            svg,
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
             fill=\"none\" stroke=\"#444444\"/>\n\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\n\
             <text x=\"{label_x:.1}\" y=\"{middle:.1}\" text-anchor=\"middle\" \
             transform=\"rotate(-90 {label_x:.1} {middle:.1})\">{}</text>",
            0.5 * (left + right),
            bottom + 35.0,
            escaped(&self.x.label),
            escaped(&self.y.label)
        );
    }
}

/// Room that an entry of the legend takes.
fn legend_width(name: &str) -> f64 {
    text_width(name, 11.0) + 38.0
}

/// One entry of the legend.
fn draw_key(svg: &mut String, series: &Series, colour: &str, x: f64, y: f64) {
    let middle = y - 4.0;
    if series.mark != Mark::Points {
        let dash = if series.mark == Mark::Dashed {
            " stroke-dasharray=\"5 3\""
        } else {
            ""
        };
        let _ = writeln!(
            svg,
            "<path d=\"M{x:.1} {middle:.1}h20\" stroke=\"{colour}\" stroke-width=\"1.5\"{dash}/>"
        );
    }
    if matches!(series.mark, Mark::Points | Mark::LinePoints) {
        let _ = writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{middle:.1}\" r=\"3.2\" fill=\"{colour}\"/>",
            x + 10.0
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{y:.1}\" font-size=\"11\">{}</text>",
        x + 25.0,
        escaped(&series.name)
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(points: Vec<(f64, f64)>, log: bool) -> Figure {
        Figure {
            title: "a < b".to_owned(),
            columns: 1,
            colours: Vec::new(),
            panels: vec![Panel {
                title: "panel".to_owned(),
                x: AxisStyle::linear("x"),
                y: if log {
                    AxisStyle::log("y")
                } else {
                    AxisStyle::linear("y")
                },
                series: vec![Series {
                    name: "curve".to_owned(),
                    mark: Mark::LinePoints,
                    labels: vec!["point".to_owned(); points.len()],
                    points,
                }],
            }],
        }
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out() {
        let points = vec![
            (0.0, 1.0),
            (1.0, 10.0),
            (2.0, 0.0),
            (3.0, f64::NAN),
            (4.0, 1e3),
        ];
        let svg = figure(points, true).to_svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        // Three circles and the legend's.
        assert_eq!(svg.matches("<circle").count(), 4);
        assert_eq!(svg.matches("<polyline").count(), 1);
        assert!(svg.contains("a &lt; b"));
        let svg = figure(Vec::new(), false).to_svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn labels_do_not_cover_each_other() {
        let svg = figure(vec![(1.0, 1.0); 30], false).to_svg();
        // All at one place: as many names as there are free places around it.
        let n_labels = svg.matches(">point<").count();
        assert!((1..=10).contains(&n_labels), "{n_labels}");
        let spread = (0..8).map(|i| (f64::from(i), f64::from(i * i)));
        let svg = figure(spread.collect(), false).to_svg();
        assert_eq!(svg.matches(">point<").count(), 8);
    }

    #[test]
    fn ticks_are_round_numbers_inside_the_axis() {
        let axis = AxisStyle::linear("x").within(-0.3, 1.01);
        let scale = Scale::new(&axis, std::iter::empty(), 0.0, 1.0);
        let texts: Vec<_> = scale
            .ticks()
            .into_iter()
            .filter_map(|tick| tick.1)
            .collect();
        assert_eq!(texts, ["0.0", "0.5", "1.0"]);
        let axis = AxisStyle::log("x").within(0.001, 20.0);
        let scale = Scale::new(&axis, std::iter::empty(), 0.0, 1.0);
        let texts: Vec<_> = scale
            .ticks()
            .into_iter()
            .filter(|tick| scale.place(tick.0).is_some())
            .filter_map(|tick| tick.1)
            .collect();
        assert_eq!(texts, ["0.001", "0.01", "0.1", "1", "10"]);
    }
}
