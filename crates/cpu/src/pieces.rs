//! Segments of close-ups: the pieces that follow a bent strand, and round tips. Twin:
//! `shaders/lib/pieces.wgsl`.

use strandlight_scene::camera::WIDE_PX;

use super::screen_point::ScreenPoint;

/// A segment that leaves the line between its ends by more than this, px, is drawn in pieces.
const FLAT: f32 = 0.15;

/// Most pieces of a segment before its tip.
const MAX_PIECES: u32 = 12;

/// Pieces of a round tip.
const TIP_PIECES: u32 = 6;

/// How far a round tip reaches beyond the last point, as a share of its length: it covers as much as a square one.
pub(super) const BEYOND_TIP: f32 = 0.214_601_84;

/// Segments shorter than this on the screen, px, are seen end on.
pub(super) const LEAST_LENGTH: f32 = 1e-3;

/// What a segment is drawn in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pieces {
    /// Before the tip.
    n_body: u32,
    /// Of the tip; none where the strand goes on, or is narrow.
    n_tip: u32,
}

impl Pieces {
    /// Those of the segment between two neighbouring points, the second of which may be the last of its strand;
    /// [`None`] if it is drawn as a whole.
    pub fn new(a: &ScreenPoint, b: &ScreenPoint, is_tip: bool) -> Option<Pieces> {
        let d = [b.at[0] - a.at[0], b.at[1] - a.at[1]];
        let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
        if a.coverage < 0.0 || b.coverage < 0.0 || !(length > LEAST_LENGTH && length < 1e9) {
            return None;
        }
        let along = [d[0] / length, d[1] / length];
        let is_round = is_tip && b.half_width > 0.5 * WIDE_PX && is_smooth(a, b, along);
        let pieces = Pieces {
            n_body: n_pieces(bend(a, b, along, length)),
            n_tip: if is_round { TIP_PIECES } else { 0 },
        };
        (pieces.n() > 1).then_some(pieces)
    }

    /// How many there are.
    pub fn n(&self) -> u32 {
        self.n_body + self.n_tip
    }

    /// The strand where piece `ix` begins, or where the last one ends, and the share of the segment's way up to there.
    pub fn cut(&self, a: &ScreenPoint, b: &ScreenPoint, ix: u32) -> (ScreenPoint, f32) {
        let d = [b.at[0] - a.at[0], b.at[1] - a.at[1]];
        let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
        let reach = b.half_width.min(length);
        let body = match self.n_tip {
            0 => 1.0,
            _ => 1.0 - (1.0 - BEYOND_TIP) * reach / length,
        };
        if ix <= self.n_body {
            let t = body * (ix as f32 / self.n_body as f32);
            return (between(a, b, t), t);
        }
        // Cuts are closer where the outline turns to the side.
        let from_end = 1.0 - (ix - self.n_body) as f32 / TIP_PIECES as f32;
        let from_end = from_end * from_end;
        let way = body + (1.0 - from_end) * reach / length;
        let beyond = (way - 1.0).max(0.0) * length;
        let mut cut = between(a, b, way);
        cut.at = [0, 1].map(|axis: usize| cut.at[axis] + beyond * cut.along[axis]);
        cut.half_width *= round_tip(from_end);
        (cut, way.min(1.0))
    }
}

/// How many pieces follow a strand that leaves the line between its ends by `bend`, px.
#[inline(always)]
pub(super) fn n_pieces(bend: f32) -> u32 {
    match bend > 0.0 {
        // A piece of a parabola leaves its line by the square of its share.
        true => ((bend / FLAT).sqrt().ceil() as u32).clamp(2, MAX_PIECES),
        false => 1,
    }
}

/// A point on the cubic that leaves both ends of a segment along the strand.
#[inline(always)]
pub(super) fn between(a: &ScreenPoint, b: &ScreenPoint, t: f32) -> ScreenPoint {
    if t <= 0.0 || t >= 1.0 {
        return if t <= 0.0 { *a } else { *b };
    }
    let d = [b.at[0] - a.at[0], b.at[1] - a.at[1]];
    let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
    let rest = 1.0 - t;
    let of_b = t * t * (3.0 - 2.0 * t);
    let (from_a, from_b) = (length * t * rest * rest, -length * t * t * rest);
    let (slope_a, slope_b) = (
        length * rest * (1.0 - 3.0 * t),
        length * t * (3.0 * t - 2.0),
    );
    let slope = 6.0 * t * rest;
    let axis = |ix: usize| {
        let at = a.at[ix] + of_b * d[ix] + from_a * a.along[ix] + from_b * b.along[ix];
        (
            at,
            slope * d[ix] + slope_a * a.along[ix] + slope_b * b.along[ix],
        )
    };
    let ((x, dx), (y, dy)) = (axis(0), axis(1));
    let speed = (dx * dx + dy * dy).sqrt().max(1e-12);
    let mix = |a: f32, b: f32| a + (b - a) * t;
    ScreenPoint {
        at: [x, y],
        along: [dx / speed, dy / speed],
        half_width: mix(a.half_width, b.half_width),
        depth: mix(a.depth, b.depth),
        coverage: mix(a.coverage, b.coverage),
        is_tip: false,
    }
}

/// Does the strand run ahead at both points? What turns back on the screen has no smooth curve there.
#[inline(always)]
fn is_smooth(a: &ScreenPoint, b: &ScreenPoint, along: [f32; 2]) -> bool {
    let ahead = |of: &ScreenPoint| along[0] * of.along[0] + along[1] * of.along[1];
    ahead(a) > 0.5 && ahead(b) > 0.5
}

/// How far the strand between two points leaves the line between them, px, where that is more than [`FLAT`], or else
/// zero. The unit vector from end to end is `along`.
#[inline(always)]
pub(super) fn bend(a: &ScreenPoint, b: &ScreenPoint, along: [f32; 2], length: f32) -> f32 {
    let off = |of: &ScreenPoint| along[0] * of.along[1] - along[1] * of.along[0];
    // Of the cubic's inner control points, a third of the way along the strand, three quarters.
    let bend = 0.25 * length * off(a).abs().max(off(b).abs());
    match bend > FLAT && is_smooth(a, b, along) {
        true => bend,
        false => 0.0,
    }
}

/// Width of a round tip at a share of its length from its end, 0..=1 of the whole.
#[inline(always)]
pub(super) fn round_tip(from_end: f32) -> f32 {
    let from_middle = 1.0 - from_end.clamp(0.0, 1.0);
    (1.0 - from_middle * from_middle).sqrt()
}
