//! Which of the lists of strands without a signature a file is: [`crate::usc`] or
//! [`crate::ct2hair`]. Both are a number of strands, and for each a number of points and the points;
//! they differ in what they have for a point.

use crate::bytes::{f32_at, u32_at};
use crate::groom::MAX_COORDINATE_CM;

/// Most strands, and points of a strand, of a file that is taken for a list by its start. Larger
/// numbers are far from any hair style, and first bytes of many other files.
const LIKELY_COUNT: std::ops::RangeInclusive<u32> = 1..=4_000_000;
/// Smallest coordinate but zero of most points: random bits make smaller ones, as do sines of half turns,
/// but rarely in all three coordinates.
const LIKELY_LEAST: f32 = 1e-12;
/// Largest label of a point.
const LIKELY_LABEL: f32 = 65536.0;

/// What a list has for a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PointKind {
    /// Three floats.
    Position,
    /// Seven: position, direction or colour, and a label, which is 0 or another integer.
    Labelled,
}

/// How far a file makes sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fit {
    No,
    /// As far as it goes; some point at least.
    Start,
    /// To its end, which is where the file ends.
    Whole,
}

impl PointKind {
    fn n_bytes(self) -> usize {
        match self {
            PointKind::Position => 12,
            PointKind::Labelled => 28,
        }
    }

    fn is_likely(self, point: &[u8]) -> bool {
        let likely = |at: usize| {
            let x = f32_at(point, at);
            x == 0.0 || (x.is_finite() && (LIKELY_LEAST..=MAX_COORDINATE_CM).contains(&x.abs()))
        };
        let is_nan = |at: usize| f32_at(point, at).is_nan();
        match self {
            PointKind::Position => {
                let in_range = |at: usize| f32_at(point, at).abs() <= MAX_COORDINATE_CM;
                [0, 4, 8].into_iter().all(in_range) && [0, 4, 8].into_iter().any(likely)
            }
            PointKind::Labelled => {
                let label = f32_at(point, 24);
                // Some files have strands whose points are no numbers.
                (0..6).all(|ix| likely(4 * ix) || is_nan(4 * ix))
                    && [12, 16, 20]
                        .into_iter()
                        .all(|at| f32_at(point, at).abs() < 1.01 || is_nan(at))
                    && (0.0..LIKELY_LABEL).contains(&label)
                    && label.fract() == 0.0
            }
        }
    }

    /// Do the strands of `start` make sense? `is_whole`: it is the whole file.
    fn fit(self, start: &[u8], is_whole: bool) -> Fit {
        let mut rest = start;
        let mut n_seen = 0;
        let end = |n_seen: usize| match n_seen {
            0 => Fit::No,
            // What ends here is the start of a longer file, or cut, which its reader says.
            _ => Fit::Start,
        };
        let Some(n_strands) = count(&mut rest) else {
            return Fit::No;
        };
        if !LIKELY_COUNT.contains(&n_strands) {
            return Fit::No;
        }
        for _ in 0..n_strands {
            let Some(n_points) = count(&mut rest) else {
                return end(n_seen);
            };
            if n_points > *LIKELY_COUNT.end() {
                return Fit::No;
            }
            for _ in 0..n_points {
                let Some((point, after)) = rest.split_at_checked(self.n_bytes()) else {
                    return end(n_seen);
                };
                if !self.is_likely(point) {
                    return Fit::No;
                }
                rest = after;
                n_seen += 1;
            }
        }
        match n_seen {
            0 => Fit::No,
            _ if is_whole && rest.is_empty() => Fit::Whole,
            _ => Fit::Start,
        }
    }
}

fn count(rest: &mut &[u8]) -> Option<u32> {
    let (count, after) = rest.split_at_checked(4)?;
    *rest = after;
    Some(u32_at(count, 0))
}

/// The list that a file is which starts with `start`; all of it where that is shorter than
/// `sniff_bytes`.
pub(crate) fn kind(start: &[u8], sniff_bytes: usize) -> Option<PointKind> {
    let is_whole = start.len() < sniff_bytes;
    let [plain, labelled] =
        [PointKind::Position, PointKind::Labelled].map(|kind| kind.fit(start, is_whole));
    // Where both make sense so far the rarer pattern is right: coordinates are no small integers
    // at every seventh place.
    match () {
        () if labelled > Fit::No && labelled >= plain => Some(PointKind::Labelled),
        () if plain > Fit::No => Some(PointKind::Position),
        () => None,
    }
}
