// Bent segments and tips of close-ups in pieces, which are drawn in place of whole segments. Pieces keep the order of
// their segments, whichever thread makes them: `count` has their number for each block of 256 segments, `place` where
// those of a block go, `cut_segments` makes them. Segments for whose pieces no room is left are drawn as a whole.
// Twin: Curve in crates/cpu/src/raster/ribbons.rs.
// #import lib/view
// #import lib/ribbon
// #import lib/pieces
// #import lib/piece

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> chunk: Chunk;
@group(0) @binding(2) var<storage, read> segments: array<u32>;
@group(0) @binding(3) var<storage, read> edges: array<vec4i>;
// As in pass/ribbons.
@group(0) @binding(4) var<storage, read_write> depth_coverage: array<vec4u>;
@group(0) @binding(5) var<storage, read> points: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> corners: array<u32>;
@group(0) @binding(7) var<storage, read> tangents: array<vec4f>;
// Of each block its number of pieces, then the pieces before it.
@group(0) @binding(8) var<storage, read_write> blocks: array<u32>;
@group(0) @binding(9) var<storage, read_write> pieces: array<Piece>;
// Arguments of the draw: vertices, instances, and the first of both.
@group(0) @binding(10) var<storage, read_write> arguments: vec4u;

const BLOCK: u32 = 256u;

var<workgroup> counts: array<u32, BLOCK>;

fn screen_point_of(point: u32) -> ScreenPoint {
    return screen_point(view, points[point], tangents[point].xyz, SAMPLED_WIDTH_PX);
}

// What segment `first_segment` + `ix` of the chunk is drawn in, if it may be seen: pieces stay within its length of its
// ends.
fn pieces_in_picture(ix: u32) -> Pieces {
    if ix >= chunk.n_segments {
        return Pieces(0u, 0u);
    }
    let segment = chunk.first_segment + ix;
    let first = segments[segment];
    let a = edges[first];
    let b = edges[first + 1u];
    let size = max(max(a.xy, a.zw), max(b.xy, b.zw)) - min(min(a.xy, a.zw), min(b.xy, b.zw));
    if !in_picture(view, a, b, max(size.x, size.y)) {
        return Pieces(0u, 0u);
    }
    let last = arrayLength(&segments) - 1u;
    let is_tip = segment == last || segments[min(segment + 1u, last)] != first + 1u;
    return pieces_of(screen_point_of(first), screen_point_of(first + 1u), is_tip);
}

@compute @workgroup_size(BLOCK)
fn count(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    let pieces = pieces_in_picture(id.x);
    counts[local] = pieces.n_body + pieces.n_tip;
    workgroupBarrier();
    if local > 0u {
        return;
    }
    var sum = 0u;
    for (var ix = 0u; ix < BLOCK; ix++) {
        sum += counts[ix];
    }
    blocks[(chunk.first_segment + id.x) / BLOCK] = sum;
}

@compute @workgroup_size(BLOCK)
fn place(@builtin(local_invocation_index) local: u32) {
    let n_blocks = arrayLength(&blocks);
    let share = (n_blocks + BLOCK - 1u) / BLOCK;
    let begin = min(local * share, n_blocks);
    let end = min(begin + share, n_blocks);
    var sum = 0u;
    for (var block = begin; block < end; block++) {
        sum += blocks[block];
    }
    counts[local] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var ix = 0u; ix < local; ix++) {
        before += counts[ix];
    }
    for (var block = begin; block < end; block++) {
        let n = blocks[block];
        blocks[block] = before;
        before += n;
    }
    if local == BLOCK - 1u {
        arguments = vec4u(6u * min(before, arrayLength(&pieces)), 1u, 0u, 0u);
    }
}

@compute @workgroup_size(BLOCK)
fn cut_segments(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    let cuts = pieces_in_picture(id.x);
    let n = cuts.n_body + cuts.n_tip;
    counts[local] = n;
    workgroupBarrier();
    if n == 0u {
        return;
    }
    var start = blocks[(chunk.first_segment + id.x) / BLOCK];
    for (var ix = 0u; ix < local; ix++) {
        start += counts[ix];
    }
    let room = arrayLength(&pieces);
    if start + n > room {
        // The last ones that are drawn cover nothing.
        for (var ix = start; ix < room; ix++) {
            pieces[ix] = Piece(vec4i(0), vec4i(0), vec2f(0.0), 0u, 0u);
        }
        return;
    }
    let segment = chunk.first_segment + id.x;
    let first = segments[segment];
    let a = screen_point_of(first);
    let b = screen_point_of(first + 1u);
    var piece: Piece;
    piece.end = edges[first];
    piece.depth.y = a.depth;
    var begin = 0.0;
    for (var ix = 0u; ix < n; ix++) {
        let next = cut(cuts, a, b, ix + 1u);
        piece.begin = piece.end;
        piece.end = edges_at(view, next.at);
        piece.depth = vec2f(piece.depth.y, next.at.depth);
        piece.first = first;
        piece.part = pack2x16unorm(vec2f(begin, next.t));
        pieces[start + ix] = piece;
        begin = next.t;
    }
    // What `pass/ribbons` has for segments in the picture, and nothing to draw as a whole.
    depth_coverage[first].z = depth_coverage[first + 1u].y;
    depth_coverage[first].w = segment;
    for (var corner = 6u * id.x; corner < 6u * id.x + 6u; corner++) {
        corners[corner] = 2u * view.n_points;
    }
}
