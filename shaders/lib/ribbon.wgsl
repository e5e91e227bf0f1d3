// Segments on the screen.
// #import lib/view

struct Chunk {
    first_segment: u32,
    n_segments: u32,
}

// Jitter moves a ribbon by at most this much, 1/256 px.
const MAX_JITTER: i32 = 64;

// Whether the box around both ends, with a margin, touches the part of the picture that is drawn, in some pass. Edges
// as `edges_at` has them.
fn in_picture(view: View, a: vec4i, b: vec4i, margin: i32) -> bool {
    let low = min(min(a.xy, a.zw), min(b.xy, b.zw)) - margin;
    let high = max(max(a.xy, a.zw), max(b.xy, b.zw)) + margin;
    let start = 256 * vec2i(view.origin) - 128 * vec2i(view.size);
    let end = start + 256 * vec2i(view.extent);
    return all(low <= end + MAX_JITTER) && all(high >= start - MAX_JITTER);
}
