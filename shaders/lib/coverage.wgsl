// How much of a pixel a strand covers: at a grid of places within it, filtered between them.
// Twins: crates/cpu/src/list/{bins,places,tile,pixel}.rs.
// #import lib/view
// #import lib/screen_point
// #import lib/pieces

// Places along a side of a pixel.
const PLACES_SIDE: u32 = 4u;

// Places of a pixel.
const PLACES: f32 = 16.0;

// How far along either axis the outermost places lie from the middle of their pixel, px.
const FARTHEST: f32 = 0.375;

// A pixel is closed once less than this share of what lies behind shows.
const CLOSED: f32 = 0.00390625;

// A segment on the screen, or a piece of one.
struct Ribbon {
    // Its ends, px.
    a: vec2f,
    b: vec2f,
    // Unit vector from end to end.
    along: vec2f,
    // Unit vectors across which the ribbon begins and ends: those of the strand at its points, so that the next one
    // begins where this one ends.
    begins: vec2f,
    ends: vec2f,
    // At the ends: half of the width, px; depth; coverage.
    half: vec2f,
    depth: vec2f,
    coverage: vec2f,
    // How far the strand between the ends leaves the line, px; below zero: the ribbon is not drawn.
    bend: f32,
    // Does the strand end with it?
    is_tip: bool,
}

fn towards(at: vec2f, along: vec2f) -> vec2f {
    return select(at, -at, dot(at, along) < 0.0);
}

// That of two neighbouring points; not drawn where it is behind the eye or seen end on.
fn ribbon_of(a: ScreenPoint, b: ScreenPoint, is_tip: bool) -> Ribbon {
    let length = distance(a.at, b.at);
    var ribbon: Ribbon;
    ribbon.bend = -1.0;
    if a.coverage < 0.0 || b.coverage < 0.0 || !(length > LEAST_LENGTH && length < 1e9) {
        return ribbon;
    }
    let along = (b.at - a.at) / length;
    return Ribbon(
        a.at,
        b.at,
        along,
        towards(a.along, along),
        towards(b.along, along),
        vec2f(a.half_width, b.half_width),
        vec2f(a.depth, b.depth),
        vec2f(a.coverage, b.coverage),
        bend(a, b, along, length),
        is_tip,
    );
}

// How far the ribbon's middle passes a place, px, either sign.
fn ribbon_off(ribbon: Ribbon, at: vec2f) -> f32 {
    return ribbon.along.x * (at.y - ribbon.a.y) - ribbon.along.y * (at.x - ribbon.a.x);
}

// How far from the line between its ends the ribbon reaches, px, filter and bend included.
fn ribbon_reach(ribbon: Ribbon) -> f32 {
    return max(ribbon.half.x, ribbon.half.y) + 0.5 + ribbon.bend;
}

// Of the segment between two points, piece `ix` of `n`.
fn piece_ribbon(a: ScreenPoint, b: ScreenPoint, ix: u32, n: u32, is_tip: bool) -> Ribbon {
    let share = 1.0 / f32(n);
    let t = f32(ix) * share;
    let is_last = ix + 1u == n;
    return ribbon_of(between(a, b, t), between(a, b, select(t + share, 1.0, is_last)), is_tip && is_last);
}

// A point as it is kept: place and direction; half of the width, depth, coverage, and 1 at a tip.
fn kept_point(at: array<vec4f, 2>) -> ScreenPoint {
    return ScreenPoint(at[0].xy, at[0].zw, at[1].x, at[1].y, at[1].z);
}

// The segment between two of them.
fn kept_ribbon(a: array<vec4f, 2>, b: array<vec4f, 2>) -> Ribbon {
    return ribbon_of(kept_point(a), kept_point(b), b[1].w != 0.0);
}

// Piece `ix` of its `n`.
fn kept_piece(a: array<vec4f, 2>, b: array<vec4f, 2>, ix: u32, n: u32) -> Ribbon {
    return piece_ribbon(kept_point(a), kept_point(b), ix, n, b[1].w != 0.0);
}

// Where a pixel is along a ribbon and to its side.
struct RibbonPlace {
    // px: from the middle of the ribbon; beyond its beginning; beyond its end.
    off: f32,
    begin: f32,
    end: f32,
    // Share of the way along it, 0..=1.
    t: f32,
    // May the ribbon cover places of the pixel?
    is_near: bool,
}

fn size_across(at: vec2f) -> f32 {
    return FARTHEST * (abs(at.x) + abs(at.y));
}

fn ribbon_place(ribbon: Ribbon, middle: vec2f) -> RibbonPlace {
    let half_most = max(ribbon.half.x, ribbon.half.y);
    let off = ribbon_off(ribbon, middle);
    let begin = dot(ribbon.begins, middle - ribbon.a);
    let end = dot(ribbon.ends, middle - ribbon.b);
    let near = half_most + size_across(ribbon.along) + 0.5 / f32(PLACES_SIDE);
    let is_round = half_most > 0.5 * WIDE_PX && ribbon.is_tip;
    let beyond = size_across(ribbon.ends) + select(0.0, BEYOND_TIP * half_most, is_round);
    let is_near = abs(off) <= near && begin >= -size_across(ribbon.begins) && end <= beyond;
    let length = begin - end;
    let t = select(0.5, clamp(begin / length, 0.0, 1.0), length > 1e-6);
    return RibbonPlace(off, begin, end, t, is_near);
}

// Share of the surroundings of each place, row by row, that a ribbon covers, and what of its width these places show.
struct Covered {
    covers: array<vec4f, 4>,
    // Of all places.
    sum: f32,
    // Mean of the places across the ribbon, -1..=1, and of their squares.
    across: vec2f,
}

fn cover_places(ribbon: Ribbon, at: RibbonPlace) -> Covered {
    let half_most = max(ribbon.half.x, ribbon.half.y);
    let is_wide = half_most > 0.5 * WIDE_PX;
    let half_width = mix(ribbon.half.x, ribbon.half.y, at.t);
    let is_round = is_wide && ribbon.is_tip;
    // Seen end on it is flat.
    let tip = min(half_width, at.begin - at.end);
    let end_at = select(0.0, BEYOND_TIP * tip, is_round);
    let x = vec4f(-0.375, -0.125, 0.125, 0.375);
    var covered: Covered;
    var sums = vec2f(0.0);
    for (var row = 0u; row < PLACES_SIDE; row++) {
        let y = x[row];
        let off = at.off + ribbon.along.x * y - ribbon.along.y * x;
        let begin = at.begin + ribbon.begins.x * x + ribbon.begins.y * y;
        let end = at.end + ribbon.ends.x * x + ribbon.ends.y * y;
        var half_at = vec4f(half_width);
        if is_round {
            for (var column = 0u; column < PLACES_SIDE; column++) {
                half_at[column] *= round_tip((end_at - end[column]) / tip);
            }
        }
        let inside = clamp((half_at - abs(off)) * f32(PLACES_SIDE) + 0.5, vec4f(0.0), vec4f(1.0));
        // Half open, so that a strand covers no place twice.
        let is_on = (begin >= vec4f(0.0)) & (end < vec4f(end_at));
        let covers = select(vec4f(0.0), inside, is_on);
        covered.covers[row] = covers;
        covered.sum += dot(covers, vec4f(1.0));
        if is_wide {
            let across = clamp(off / half_width, vec4f(-1.0), vec4f(1.0));
            sums += vec2f(dot(covers, across), dot(covers, across * across));
        }
    }
    // All of the width of a narrow ribbon.
    covered.across = select(vec2f(0.0, 1.0 / 3.0), sums / covered.sum, is_wide && covered.sum > 0.0);
    return covered;
}
