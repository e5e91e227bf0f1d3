// Segments of close-ups: the pieces that follow a bent strand, and round tips. Twin: crates/cpu/src/pieces.rs.
// #import lib/view
// #import lib/screen_point

// A segment that leaves the line between its ends by more than this, px, is drawn in pieces.
const FLAT: f32 = 0.15;

// Most pieces of a segment before its tip.
const MAX_PIECES: u32 = 12;

// Pieces of a round tip.
const TIP_PIECES: u32 = 6;

// How far a round tip reaches beyond the last point, as a share of its length: it covers as much as a square one.
const BEYOND_TIP: f32 = 0.21460184;

// Segments shorter than this on the screen, px, are seen end on.
const LEAST_LENGTH: f32 = 1e-3;

// What a segment is drawn in; 0 and 0 if as a whole.
struct Pieces {
    // Before the tip.
    n_body: u32,
    // Of the tip; none where the strand goes on, or is narrow.
    n_tip: u32,
}

// Those of the segment between two neighbouring points, the second of which may be the last of its strand.
fn pieces_of(a: ScreenPoint, b: ScreenPoint, is_tip: bool) -> Pieces {
    let length = distance(a.at, b.at);
    if a.coverage < 0.0 || b.coverage < 0.0 || !(length > LEAST_LENGTH && length < 1e9) {
        return Pieces(0u, 0u);
    }
    let along = (b.at - a.at) / length;
    let is_round = is_tip && b.half_width > 0.5 * WIDE_PX && is_smooth(a, b, along);
    let pieces = Pieces(n_pieces(bend(a, b, along, length)), select(0u, TIP_PIECES, is_round));
    if pieces.n_body + pieces.n_tip > 1u {
        return pieces;
    }
    return Pieces(0u, 0u);
}

struct Cut {
    at: ScreenPoint,
    // Share of the segment's way up to there.
    t: f32,
}

// The strand where piece `ix` begins, or where the last one ends.
fn cut(pieces: Pieces, a: ScreenPoint, b: ScreenPoint, ix: u32) -> Cut {
    let length = distance(a.at, b.at);
    let reach = min(b.half_width, length);
    let body = select(1.0 - (1.0 - BEYOND_TIP) * reach / length, 1.0, pieces.n_tip == 0u);
    if ix <= pieces.n_body {
        let t = body * (f32(ix) / f32(pieces.n_body));
        return Cut(between(a, b, t), t);
    }
    // Cuts are closer where the outline turns to the side.
    let left = 1.0 - f32(ix - pieces.n_body) / f32(TIP_PIECES);
    let from_end = left * left;
    let way = body + (1.0 - from_end) * reach / length;
    var at = between(a, b, way);
    at.at += max(way - 1.0, 0.0) * length * at.along;
    at.half_width *= round_tip(from_end);
    return Cut(at, min(way, 1.0));
}

// How many pieces follow a strand that leaves the line between its ends by `bend`, px.
fn n_pieces(bend: f32) -> u32 {
    if bend > 0.0 {
        // A piece of a parabola leaves its line by the square of its share.
        return clamp(u32(ceil(sqrt(bend / FLAT))), 2u, MAX_PIECES);
    }
    return 1u;
}

// A point on the cubic that leaves both ends of a segment along the strand.
fn between(a: ScreenPoint, b: ScreenPoint, t: f32) -> ScreenPoint {
    if t <= 0.0 {
        return a;
    }
    if t >= 1.0 {
        return b;
    }
    let d = b.at - a.at;
    let chord = length(d);
    let rest = 1.0 - t;
    let at = a.at + t * t * (3.0 - 2.0 * t) * d + chord * t * rest * rest * a.along - chord * t * t * rest * b.along;
    let slope = 6.0 * t * rest * d + chord * rest * (1.0 - 3.0 * t) * a.along + chord * t * (3.0 * t - 2.0) * b.along;
    return ScreenPoint(
        at,
        slope / max(length(slope), 1e-12),
        mix(a.half_width, b.half_width, t),
        mix(a.depth, b.depth, t),
        mix(a.coverage, b.coverage, t),
    );
}

// Does the strand run ahead at both points? What turns back on the screen has no smooth curve there.
fn is_smooth(a: ScreenPoint, b: ScreenPoint, along: vec2f) -> bool {
    return dot(along, a.along) > 0.5 && dot(along, b.along) > 0.5;
}

// How far the strand between two points leaves the line between them, px, where that is more than FLAT, or else zero.
// The unit vector from end to end is `along`.
fn bend(a: ScreenPoint, b: ScreenPoint, along: vec2f, length: f32) -> f32 {
    let off_a = along.x * a.along.y - along.y * a.along.x;
    let off_b = along.x * b.along.y - along.y * b.along.x;
    // Of the cubic's inner control points, a third of the way along the strand, three quarters.
    let bend = 0.25 * length * max(abs(off_a), abs(off_b));
    return select(0.0, bend, bend > FLAT && is_smooth(a, b, along));
}

// Width of a round tip at a share of its length from its end, 0..=1 of the whole.
fn round_tip(from_end: f32) -> f32 {
    let from_middle = 1.0 - clamp(from_end, 0.0, 1.0);
    return sqrt(1.0 - from_middle * from_middle);
}
