// The visibility list: what each pixel shows, from front to back, with the share of the pixel that it covers; strands
// are drawn from it without samples (`pass/listed_picture`). `find_hits` counts the ribbons that may cover something of
// a pixel and then, once `sum_rows`, `place_rows` and `place_pixels` have made room, writes them; `pass/listed_pixels`
// makes lists of them. `count_seen` and `list_seen` list the points that some pixel shows.
// Twin: crates/cpu/src/list.rs.
// #import lib/view
// #import lib/screen_point
// #import lib/pieces
// #import lib/coverage
// #import lib/visible_list
// #import lib/group_sums

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> list: ListLayout;
@group(0) @binding(2) var<storage, read> segments: array<u32>;
@group(0) @binding(3) var<storage, read> points: array<vec4f>;
@group(0) @binding(4) var<storage, read> tangents: array<vec4f>;
// w: half the distance to the point after, or 0 at a tip.
@group(0) @binding(5) var<storage, read> normals: array<vec4f>;
// Points on the screen: place and direction; half of the width, depth, coverage, and 1 at a tip.
@group(0) @binding(6) var<storage, read_write> placed: array<array<vec4f, 2>>;
// The same, to be read.
@group(0) @binding(7) var<storage, read> screen: array<array<vec4f, 2>>;
// Row by row.
@group(0) @binding(8) var<storage, read_write> pixels: array<Pixel>;
// Of each row its number of hits; then of each row the hits of the band before it.
@group(0) @binding(9) var<storage, read_write> rows: array<u32>;
// Three words each: the bits of its depth, the first point of its segment, and which piece of that.
@group(0) @binding(10) var<storage, read_write> hits: array<u32>;
// A bit for each point of a segment that is seen; then the number of entries.
@group(0) @binding(11) var<storage, read> seen: array<u32>;
// The points that are seen, in order.
@group(0) @binding(12) var<storage, read_write> seen_points: array<u32>;
// Numbers of points that are seen and of entries; then of each group of words of `seen` its points.
@group(0) @binding(13) var<storage, read_write> totals: array<u32>;

@compute @workgroup_size(GROUP)
fn place_points(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let point = id.x + id.y * groups.x * GROUP;
    if point >= view.n_points {
        return;
    }
    let at = screen_point(view, points[point], tangents[point].xyz, LISTED_WIDTH_PX);
    let is_tip = select(0.0, 1.0, normals[point].w == 0.0);
    placed[point] = array<vec4f, 2>(
        vec4f(at.at, at.along), vec4f(at.half_width, at.depth, at.coverage, is_tip));
}

// Counts or writes the pixels of the band that a ribbon may cover something of.
fn hit_pixels(ribbon: Ribbon, first: u32, piece: u32) {
    if ribbon.bend < 0.0 {
        return;
    }
    // From the corner of the part of the picture that is drawn.
    let origin = vec2f(view.origin);
    let reach = ribbon_reach(ribbon);
    let low = floor(min(ribbon.a, ribbon.b) - reach - origin);
    let high = floor(max(ribbon.a, ribbon.b) + reach - origin) + 1.0;
    let extent = vec2f(view.extent);
    let left = u32(clamp(low.x, 0.0, extent.x));
    let right = u32(clamp(high.x, 0.0, extent.x));
    let top = u32(clamp(low.y, f32(list.first_row), f32(list.end_row)));
    let bottom = u32(clamp(high.y, f32(list.first_row), f32(list.end_row)));
    // Of a steep ribbon a row shows what is about where its middle crosses it.
    let is_steep = abs(ribbon.along.y) > 0.01;
    let wide = (reach + FARTHEST) / abs(ribbon.along.y) + 0.5;
    for (var y = top; y < bottom; y++) {
        var begin = left;
        var end = right;
        if is_steep {
            let middle = ribbon.a.x + (origin.y + f32(y) + 0.5 - ribbon.a.y) * (ribbon.along.x / ribbon.along.y);
            begin = max(begin, u32(clamp(floor(middle - wide - origin.x), 0.0, extent.x)));
            end = min(end, u32(clamp(ceil(middle + wide - origin.x), 0.0, extent.x)));
        }
        for (var x = begin; x < end; x++) {
            let place = ribbon_place(ribbon, origin + vec2f(f32(x), f32(y)) + 0.5);
            if !place.is_near {
                continue;
            }
            let pixel = x + view.extent.x * y;
            if list.is_writing == 0u {
                atomicAdd(&pixels[pixel].n_hits, 1u);
            } else {
                let hit = 3u * atomicAdd(&pixels[pixel].next, 1u);
                hits[hit] = bitcast<u32>(max(mix(ribbon.depth.x, ribbon.depth.y, place.t), 0.0));
                hits[hit + 1u] = first;
                hits[hit + 2u] = piece;
            }
        }
    }
}

// Does all that may be drawn between two points lie above or below the band? Where one of them is behind the eye, it
// need not.
fn is_beside_band(a: array<vec4f, 2>, b: array<vec4f, 2>) -> bool {
    // The inner control points of the cubic are a third of its chord from its ends.
    let reach = max(a[1].x, b[1].x) + 1.0 + 0.34 * distance(a[0].xy, b[0].xy);
    let y = vec2f(a[0].y, b[0].y) - f32(view.origin.y);
    return max(y.x, y.y) + reach < f32(list.first_row) || min(y.x, y.y) - reach > f32(list.end_row);
}

// Those of all segments.
@compute @workgroup_size(GROUP)
fn find_hits(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let segment = id.x + id.y * groups.x * GROUP;
    if segment >= list.n_segments {
        return;
    }
    let first = segments[segment];
    let a = screen[first];
    let b = screen[first + 1u];
    if is_beside_band(a, b) {
        return;
    }
    let whole = kept_ribbon(a, b);
    let n = n_pieces(whole.bend);
    for (var ix = 0u; ix < n; ix++) {
        if n == 1u {
            hit_pixels(whole, first, 0u);
        } else {
            hit_pixels(kept_piece(a, b, ix, n), first, ix);
        }
    }
}

// A group for each row.
@compute @workgroup_size(GROUP)
fn sum_rows(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let row = view.extent.x * group.x;
    let share = share_of(local, view.extent.x);
    var sum = 0u;
    for (var x = share.x; x < share.y; x++) {
        sum += atomicLoad(&pixels[row + x].n_hits);
    }
    sums[local] = sum;
    let before = sum_before(local);
    if local == GROUP - 1u {
        rows[group.x] = before + sum;
    }
}

// A group for all rows of the band.
@compute @workgroup_size(GROUP)
fn place_rows(@builtin(local_invocation_index) local: u32) {
    let share = share_of(local, list.end_row - list.first_row) + list.first_row;
    var sum = 0u;
    for (var row = share.x; row < share.y; row++) {
        sum += rows[row];
    }
    sums[local] = sum;
    var before = sum_before(local);
    for (var row = share.x; row < share.y; row++) {
        rows[view.extent.y + row] = before;
        before += rows[row];
    }
}

// A group for each row of the band.
@compute @workgroup_size(GROUP)
fn place_pixels(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let y = list.first_row + group.x;
    let row = view.extent.x * y;
    let share = share_of(local, view.extent.x);
    var sum = 0u;
    for (var x = share.x; x < share.y; x++) {
        sum += atomicLoad(&pixels[row + x].n_hits);
    }
    sums[local] = sum;
    var before = rows[view.extent.y + y] + sum_before(local);
    for (var x = share.x; x < share.y; x++) {
        atomicStore(&pixels[row + x].next, before);
        before += atomicLoad(&pixels[row + x].n_hits);
    }
}

// Words of `seen` with a bit for each point.
fn n_seen_words() -> u32 {
    return (view.n_points + 31u) / 32u;
}

// Points of a word of `seen`.
fn seen_in(word: u32) -> u32 {
    if word < n_seen_words() {
        return seen[word];
    }
    return 0u;
}

// A thread for each word.
@compute @workgroup_size(GROUP)
fn count_seen(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let n = countOneBits(seen_in(GROUP * group.x + local));
    sums[local] = n;
    let before = sum_before(local);
    if local == GROUP - 1u {
        totals[2u + group.x] = before + n;
    }
}

// A thread for each word.
@compute @workgroup_size(GROUP)
fn list_seen(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    // Points of the groups before.
    var sum = 0u;
    for (var other = local; other < group.x; other += GROUP) {
        sum += totals[2u + other];
    }
    sums[local] = sum;
    workgroupBarrier();
    var place = 0u;
    for (var ix = 0u; ix < GROUP; ix++) {
        place += sums[ix];
    }
    workgroupBarrier();
    let word = GROUP * group.x + local;
    var bits = seen_in(word);
    sums[local] = countOneBits(bits);
    place += sum_before(local);
    while bits != 0u {
        seen_points[place] = 32u * word + countTrailingZeros(bits);
        bits &= bits - 1u;
        place++;
    }
    if group.x + 1u == groups.x && local == GROUP - 1u {
        totals[0] = place;
        totals[1] = seen[n_seen_words()];
    }
}
