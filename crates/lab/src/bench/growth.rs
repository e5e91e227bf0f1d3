//! How the time of a frame grows with the size of the scene and of the picture.

use serde_json::{Value, json};

use super::cpu_frames::PictureCost;
use super::peers::log_slope;
use super::plot::{AxisStyle, Figure, Mark, Panel, Series};

/// The edits that frames are measured after, of the names in [`cpu_frames`](super::cpu_frames).
pub const FRAMES: [&str; 2] = ["colour of the hair", "view"];

/// All curves.
#[derive(Clone, Debug, PartialEq)]
pub struct Growth {
    /// One for each number that varied.
    pub sweeps: Vec<Sweep>,
}

/// Frames while one number varied and the others stayed.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// What varied.
    pub name: &'static str,
    /// By its value, rising.
    pub rows: Vec<Row>,
}

/// Frames at one value.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The value.
    pub x: u64,
    /// In the order of [`FRAMES`].
    pub frames: Vec<PictureCost>,
}

/// Exponents of growth, by least squares in log-log; none of fewer than two values, or of times
/// that the clock did not see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slopes {
    /// Of the time by the clock.
    pub milliseconds: Option<f64>,
    /// Of the time of all cores together.
    pub core_seconds: Option<f64>,
}

impl Sweep {
    /// The curves of `rows`, in any order.
    pub fn new(name: &'static str, mut rows: Vec<Row>) -> Sweep {
        rows.sort_by_key(|row| row.x);
        Sweep { name, rows }
    }

    /// How [`FRAMES`]`[frame]` grows.
    pub fn slopes(&self, frame: usize) -> Slopes {
        let slope = |of: fn(&PictureCost) -> Option<f64>| {
            let points: Option<Vec<(f64, f64)>> = self
                .rows
                .iter()
                .map(|row| Some((row.x as f64, of(&row.frames[frame])?)))
                .collect();
            let points = points?.into_iter();
            log_slope(points).filter(|slope| slope.is_finite())
        };
        Slopes {
            milliseconds: slope(|cost| Some(cost.milliseconds)),
            core_seconds: slope(|cost| cost.core_seconds),
        }
    }

    fn to_json(&self) -> Value {
        let row = |row: &Row| {
            let frames: Vec<Value> = row.frames.iter().map(PictureCost::to_json).collect();
            json!({ "value": row.x, "frames": frames })
        };
        let slopes = FRAMES.iter().enumerate().map(|(ix, name)| {
            let slopes = self.slopes(ix);
            json!({
                "name": name,
                "milliseconds": slopes.milliseconds,
                "core_seconds": slopes.core_seconds,
            })
        });
        json!({
            "name": self.name,
            "rows": self.rows.iter().map(row).collect::<Vec<_>>(),
            "slopes": slopes.collect::<Vec<_>>(),
        })
    }

    /// Core-seconds over the values, or seconds by the clock where the system tells no others, and a
    /// line of slope 1.
    fn panel(&self) -> Panel {
        let mut frames = self.rows.iter().flat_map(|row| &row.frames);
        let has_cores = frames.all(|frame| frame.core_seconds.is_some());
        let seconds = |frame: &PictureCost| match frame.core_seconds.filter(|_| has_cores) {
            Some(seconds) => seconds,
            None => 1e-3 * frame.milliseconds,
        };
        let curve = |ix: usize| -> Vec<(f64, f64)> {
            let rows = self.rows.iter();
            rows.map(|row| (row.x as f64, seconds(&row.frames[ix])))
                .collect()
        };
        let mut series: Vec<Series> = FRAMES
            .iter()
            .enumerate()
            .map(|(ix, name)| Series {
                name: (*name).to_owned(),
                mark: Mark::LinePoints,
                points: curve(ix),
                ..Series::default()
            })
            .collect();
        let first = series.iter().filter_map(|series| series.points.first());
        let lowest = first.copied().reduce(|a, b| if b.1 < a.1 { b } else { a });
        if let (Some((x, y)), Some(last)) = (lowest, self.rows.last()) {
            let end = last.x as f64;
            series.push(Series {
                name: "linear".to_owned(),
                mark: Mark::Dashed,
                points: vec![(x, y), (end, y * end / x)],
                ..Series::default()
            });
        }
        Panel {
            title: format!("over {}", self.name),
            x: AxisStyle::log(self.name),
            y: AxisStyle::log(match has_cores {
                true => "core-seconds of a frame",
                false => "seconds of a frame",
            }),
            series,
        }
    }
}

impl Growth {
    /// As JSON.
    pub fn to_json(&self) -> Value {
        let sweeps: Vec<Value> = self.sweeps.iter().map(Sweep::to_json).collect();
        json!({ "sweeps": sweeps })
    }

    /// The curves.
    pub fn figure(&self) -> Figure {
        Figure {
            title: "Growth of a frame on the CPU".to_owned(),
            panels: self.sweeps.iter().map(Sweep::panel).collect(),
            columns: 3,
            colours: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use strandlight_scene::Stats;

    use super::*;

    fn row(x: u64, seconds: [f64; 2], core_seconds: Option<f64>) -> Row {
        let cost = |ix: usize| PictureCost {
            name: FRAMES[ix],
            milliseconds: 1e3 * seconds[ix],
            core_seconds,
            stages: Vec::new(),
            stats: Stats::default(),
        };
        Row {
            x,
            frames: vec![cost(0), cost(1)],
        }
    }

    #[test]
    fn slopes_are_exponents() {
        let rows = vec![
            row(400, [4.0, 2.0], Some(0.3)),
            row(100, [1.0, 1.0], Some(0.3)),
            row(1600, [16.0, 4.0], Some(0.3)),
        ];
        let sweep = Sweep::new("points", rows);
        let close = |found: Option<f64>, expected: f64| {
            assert!((found.expect("three values") - expected).abs() < 1e-9);
        };
        close(sweep.slopes(0).milliseconds, 1.0);
        close(sweep.slopes(1).milliseconds, 0.5);
        close(sweep.slopes(0).core_seconds, 0.0);
        // Too short for the clock of the cores; too few.
        let short = vec![row(1, [1.0; 2], Some(0.0)), row(2, [1.0; 2], Some(0.1))];
        assert_eq!(Sweep::new("points", short).slopes(0).core_seconds, None);
        let single = Sweep::new("points", vec![row(1, [1.0; 2], None)]);
        assert_eq!(single.slopes(0).milliseconds, None);

        let growth = Growth {
            sweeps: vec![sweep, single],
        };
        let svg = growth.figure().to_svg();
        for text in [
            "over points",
            "core-seconds of a frame",
            "seconds of a frame",
            "linear",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(growth.to_json()["sweeps"][0]["rows"][0]["value"], 100);
    }
}
