// The lists of pixels: hits that `pass/visibility` found are taken by depth, until hardly anything of what is behind can be
// seen, and the list of the pixel is left in their place. The order in which hits come does not matter. Twin: crates/cpu/src/list.rs.
// #import lib/view
// #import lib/screen_point
// #import lib/pieces
// #import lib/coverage
// #import lib/visible_list
// #if PROXIES
// #import lib/proxy
// #endif

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> list: ListLayout;
// Points on the screen, see `pass/visibility`.
@group(0) @binding(7) var<storage, read> screen: array<array<vec4f, 2>>;
// Row by row.
@group(0) @binding(8) var<storage, read_write> pixels: array<Pixel>;
// Three words each. Of a hit the bits of its depth, the first point of its segment, and which piece of that; of an entry
// the first point, where in the ribbon it is, see `packed_place`, and its weight.
@group(0) @binding(10) var<storage, read_write> hits: array<u32>;
// A bit for each point of a segment that is seen; then the number of entries.
@group(0) @binding(11) var<storage, read_write> seen: array<atomic<u32>>;
// Entries of all bands, if they are kept.
@group(0) @binding(14) var<storage, read_write> entries: array<u32>;
// #if PROXIES
@group(0) @binding(17) var<uniform> proxies: Proxies;
// #endif
// [pixel], those with the largest weight of their kind.
@group(0) @binding(18) var<storage, read_write> behind: array<array<SeenSurface, N_BEHIND>>;
// #if MESHES
@group(0) @binding(23) var<storage, read> triangles: array<Triangle>;
// Of each tile its number of triangles, then where they start, then where they end; after that the triangles of all
// tiles.
@group(0) @binding(24) var<storage, read_write> tiles: array<atomic<u32>>;
// #endif

const NO_SURFACE: u32 = 0xffffffffu;

// Depth of what is nowhere.
const NOTHING: f32 = 1e30;

// What proxies and meshes hide of a pixel.
struct Blocked {
    // Depth of the nearest at each place, row by row; more than any hair's where there is none.
    depth: array<vec4f, 4>,
    // Which proxy, or from their number on which triangle.
    surface: array<vec4u, 4>,
    is_any: bool,
}

// #if PROXIES
// The surface that the first triangle is: triangles come after the proxies.
fn first_triangle() -> u32 {
    return proxies.n;
}
// #else
fn first_triangle() -> u32 {
    return 0u;
}
// #endif

// Where a place lies from the middle of its pixel, px.
fn from_middle(row: u32, column: u32) -> vec2f {
    return (vec2f(f32(column), f32(row)) + 0.5) / f32(PLACES_SIDE) - 0.5;
}

fn block(blocked: ptr<function, Blocked>, row: u32, column: u32, depth: f32, surface: u32) {
    let z = (depth - view.near) / (view.far - view.near);
    if z < (*blocked).depth[row][column] {
        (*blocked).depth[row][column] = z;
        (*blocked).surface[row][column] = surface;
        (*blocked).is_any = true;
    }
}

// #if MESHES
fn block_by_triangles(blocked: ptr<function, Blocked>, tile: u32, middle: vec2f) {
    let from_picture_middle = middle - 0.5 * vec2f(view.size);
    var place = list.n_tiles.x * list.n_tiles.y;
    if tile > 0u {
        place = atomicLoad(&tiles[tile - 1u]);
    }
    let end = atomicLoad(&tiles[tile]);
    for (; place < end; place++) {
        let triangle = atomicLoad(&tiles[place]);
        let seen_triangle = triangles[triangle];
        var at = vec3f(0.0);
        var change = vec3f(0.0);
        for (var ix = 0u; ix < 3u; ix++) {
            at[ix] = seen_triangle.sides[ix].x + dot(seen_triangle.sides[ix].yz, from_picture_middle);
            change[ix] = size_across(seen_triangle.sides[ix].yz);
        }
        if any(at < -change) && any(at > change) {
            continue;
        }
        for (var row = 0u; row < PLACES_SIDE; row++) {
            for (var column = 0u; column < PLACES_SIDE; column++) {
                let moved = from_middle(row, column);
                let sides = at + vec3f(
                    dot(seen_triangle.sides[0].yz, moved), dot(seen_triangle.sides[1].yz, moved), dot(seen_triangle.sides[2].yz, moved));
                let depth = seen_triangle.depth / (sides.x + sides.y + sides.z);
                // Neither behind the eye nor along the plane.
                if (all(sides >= vec3f(0.0)) || all(sides <= vec3f(0.0))) && depth > 0.0 && depth < NOTHING {
                    block(blocked, row, column, depth, first_triangle() + triangle);
                }
            }
        }
    }
}
// #else
fn block_by_triangles(blocked: ptr<function, Blocked>, tile: u32, middle: vec2f) {}
// #endif

fn nothing_blocked() -> Blocked {
    var blocked: Blocked;
    for (var row = 0u; row < PLACES_SIDE; row++) {
        blocked.depth[row] = vec4f(NOTHING);
        blocked.surface[row] = vec4u(NO_SURFACE);
    }
    return blocked;
}

// #if PROXIES
// What is hidden of the pixel `at`.
fn blocked_places(at: vec2u, middle: vec2f) -> Blocked {
    var blocked = nothing_blocked();
    for (var row = 0u; row < PLACES_SIDE && proxies.n > 0u; row++) {
        for (var column = 0u; column < PLACES_SIDE; column++) {
            let direction = ray_direction(view, middle + from_middle(row, column));
            let away = dot(direction, view.forward);
            for (var proxy = 0u; proxy < proxies.n; proxy++) {
                let distance = entry_distance(proxies.list[proxy], view.eye, direction);
                if distance > 0.0 {
                    block(&blocked, row, column, distance * away, proxy);
                }
            }
        }
    }
    let tile = at.x / TILE + list.n_tiles.x * (at.y / TILE);
    block_by_triangles(&blocked, tile, middle);
    return blocked;
}

// 1 for a proxy, or for a triangle.
fn by_kind(surface: u32) -> vec2f {
    return select(vec2f(0.0, 1.0), vec2f(1.0, 0.0), surface < first_triangle());
}

// Keeps the surfaces that are seen at open places.
fn keep_surfaces(pixel: u32, blocked: Blocked, open: array<vec4f, 4>) {
    var kept = array<SeenSurface, N_BEHIND>();
    // Of proxies and of triangles: the weight of all, and of those that are kept.
    var all_weight = vec2f(0.0);
    var kept_weight = vec2f(0.0);
    var least_surface = 0u;
    while blocked.is_any {
        // The next one; most pixels show one or two.
        var surface = NO_SURFACE;
        for (var row = 0u; row < PLACES_SIDE; row++) {
            for (var column = 0u; column < PLACES_SIDE; column++) {
                let other = blocked.surface[row][column];
                surface = select(surface, other, other >= least_surface && other < surface);
            }
        }
        if surface == NO_SURFACE {
            break;
        }
        least_surface = surface + 1u;
        // Its weight, and times it where its places lie from the middle, and how deep.
        var weight = 0.0;
        var moved = vec2f(0.0);
        var depth = 0.0;
        for (var row = 0u; row < PLACES_SIDE; row++) {
            for (var column = 0u; column < PLACES_SIDE; column++) {
                let share = open[row][column];
                if blocked.surface[row][column] == surface && share > 0.0 {
                    weight += share;
                    moved += share * from_middle(row, column);
                    depth += share * blocked.depth[row][column];
                }
            }
        }
        if weight <= 0.0 {
            continue;
        }
        all_weight += weight * by_kind(surface);
        // In the place of the proxy with less weight, or of the triangle.
        var least = N_BEHIND - 1u;
        if surface < first_triangle() {
            least = select(0u, 1u, kept[1].weight < kept[0].weight);
        }
        if weight > kept[least].weight {
            kept_weight += (weight - kept[least].weight) * by_kind(surface);
            let way = mix(view.near, view.far, depth / weight);
            kept[least] = SeenSurface(surface, weight, pack2x16snorm(moved / weight), way);
        }
    }
    // Those that are kept stand for the others of their kind.
    for (var ix = 0u; ix < N_BEHIND; ix++) {
        let of_kind = by_kind(kept[ix].surface);
        kept[ix].weight *= dot(all_weight, of_kind) / max(dot(kept_weight, of_kind) * PLACES, 1e-6);
    }
    behind[pixel] = kept;
}
// #else
fn blocked_places(at: vec2u, middle: vec2f) -> Blocked {
    return nothing_blocked();
}

fn keep_surfaces(pixel: u32, blocked: Blocked, open: array<vec4f, 4>) {}
// #endif

// A hit; sorted by depth, then by point, then by piece. No two of a pixel are equal.
struct Hit {
    depth: u32,
    first: u32,
    piece: u32,
}

fn hit_at(place: u32) -> Hit {
    return Hit(hits[3u * place], hits[3u * place + 1u], hits[3u * place + 2u]);
}

fn put_hit(place: u32, hit: Hit) {
    hits[3u * place] = hit.depth;
    hits[3u * place + 1u] = hit.first;
    hits[3u * place + 2u] = hit.piece;
}

fn is_before(a: Hit, b: Hit) -> bool {
    if a.depth != b.depth {
        return a.depth < b.depth;
    }
    if a.first != b.first {
        return a.first < b.first;
    }
    return a.piece < b.piece;
}

// Is the hit at place `a` before that at `b`, their depths being these?
fn is_place_before(a: u32, depth_a: u32, b: u32, depth_b: u32) -> bool {
    return depth_a < depth_b || (depth_a == depth_b && a != b && is_before(hit_at(a), hit_at(b)));
}

// Puts a hit into the heap of `n` hits from `start` on, at the place `at` or below: the nearest is on top, and four are
// below each, whose depths are read at once.
fn sift(start: u32, n: u32, at: u32, hit: Hit) {
    let last = start + n - 1u;
    var place = at;
    loop {
        if 4u * place + 1u >= n {
            break;
        }
        let below = min(vec4u(start + 4u * place) + vec4u(1u, 2u, 3u, 4u), vec4u(last));
        let depths = vec4u(hits[3u * below.x], hits[3u * below.y], hits[3u * below.z], hits[3u * below.w]);
        var nearest = below.x;
        var depth = depths.x;
        for (var ix = 1u; ix < 4u; ix++) {
            if is_place_before(below[ix], depths[ix], nearest, depth) {
                nearest = below[ix];
                depth = depths[ix];
            }
        }
        if hit.depth < depth || (hit.depth == depth && is_before(hit, hit_at(nearest))) {
            break;
        }
        put_hit(start + place, hit_at(nearest));
        place = nearest - start;
    }
    put_hit(start + place, hit);
}

// Share of the way along its segment, and means over the width.
fn packed_place(t: f32, across: vec2f) -> u32 {
    let of_across = u32(i32(round(127.0 * across.x)) & 255) | (u32(round(255.0 * across.y)) << 8u);
    return u32(t * 65535.0 + 0.5) | (of_across << 16u);
}

fn mark(point: u32) {
    let bit = 1u << (point % 32u);
    // Looking is cheaper than changing.
    if (atomicLoad(&seen[point / 32u]) & bit) == 0u {
        atomicOr(&seen[point / 32u], bit);
    }
}

// What of a hit a pixel shows.
struct Shown {
    // Of each place, row by row.
    covers: array<vec4f, 4>,
    // See `packed_place`.
    place: u32,
}

fn shown_of(hit: Hit, middle: vec2f) -> Shown {
    let a = screen[hit.first];
    let b = screen[hit.first + 1u];
    var ribbon = kept_ribbon(a, b);
    var part = vec2f(0.0, 1.0);
    let n_of_segment = n_pieces(ribbon.bend);
    if n_of_segment > 1u {
        ribbon = kept_piece(a, b, hit.piece, n_of_segment);
        part = vec2f(f32(hit.piece), 1.0) / f32(n_of_segment);
    }
    let place = ribbon_place(ribbon, middle);
    let covered = cover_places(ribbon, place);
    let coverage = mix(ribbon.coverage.x, ribbon.coverage.y, place.t);
    var shown: Shown;
    for (var row = 0u; row < PLACES_SIDE; row++) {
        shown.covers[row] = covered.covers[row] * coverage;
    }
    shown.place = packed_place(part.x + part.y * place.t, covered.across);
    return shown;
}

fn put_entry(entry: u32, hit: Hit, place: u32, weight: f32) {
    hits[3u * entry] = hit.first;
    hits[3u * entry + 1u] = place;
    hits[3u * entry + 2u] = bitcast<u32>(weight / PLACES);
    mark(hit.first);
    mark(hit.first + 1u);
}

// Copies the entries of a pixel, which end at this hit, to where those of the pixels before end, if there is room for all.
fn keep_entries(pixel: u32, end: u32, n_before: u32, n_entries: u32) {
    let end_there = n_before + n_entries;
    if 3u * end_there > arrayLength(&entries) {
        return;
    }
    for (var word = 3u * n_entries; word > 0u; word--) {
        entries[3u * end_there - word] = hits[3u * end - word];
    }
    atomicStore(&pixels[pixel].next, end_there);
}

// A thread for each pixel of the band.
@compute @workgroup_size(8, 8)
fn list_pixels(@builtin(global_invocation_id) id: vec3u) {
    let at = vec2u(id.x, list.first_row + id.y);
    if at.x >= view.extent.x || at.y >= list.end_row {
        return;
    }
    let pixel = at.x + view.extent.x * at.y;
    let middle = vec2f(view.origin + at) + 0.5;
    let blocked = blocked_places(at, middle);
    // Of each place what nothing covers yet.
    var open = array<vec4f, 4>(vec4f(1.0), vec4f(1.0), vec4f(1.0), vec4f(1.0));
    var n = atomicLoad(&pixels[pixel].n_hits);
    let end = atomicLoad(&pixels[pixel].next);
    let start = end - n;
    for (var place = (n + 2u) / 4u; place > 0u; place--) {
        sift(start, n, place - 1u, hit_at(start + place - 1u));
    }
    var n_entries = 0u;
    var is_closed = false;
    while n > 0u && !is_closed {
        let hit = hit_at(start);
        n--;
        if n > 0u {
            sift(start, n, 0u, hit_at(start + n));
        }
        let shown = shown_of(hit, middle);
        var weight = 0.0;
        var left = 0.0;
        for (var row = 0u; row < PLACES_SIDE; row++) {
            let is_before_surface = vec4f(bitcast<f32>(hit.depth)) <= blocked.depth[row];
            let shares = select(vec4f(0.0), open[row] * shown.covers[row], is_before_surface);
            open[row] -= shares;
            left += dot(select(vec4f(0.0), open[row], is_before_surface), vec4f(1.0));
            weight += dot(shares, vec4f(1.0));
        }
        is_closed = left < CLOSED * PLACES;
        if weight > 0.0 {
            // There is room: the hit was taken off the heap.
            n_entries++;
            put_entry(end - n_entries, hit, shown.place, weight);
        }
    }
    pixels[pixel].n_entries = n_entries;
    var n_before = 0u;
    if n_entries > 0u {
        n_before = atomicAdd(&seen[(view.n_points + 31u) / 32u], n_entries);
    }
    if is_closed && !blocked.is_any {
        // Hair is behind all that was left out.
        let left = open[0] + open[1] + open[2] + open[3];
        let scale = 1.0 / (1.0 - dot(left, vec4f(1.0)) / PLACES);
        for (var ix = 1u; ix <= n_entries; ix++) {
            let entry = 3u * (end - ix) + 2u;
            hits[entry] = bitcast<u32>(scale * bitcast<f32>(hits[entry]));
        }
    }
    if list.is_keeping != 0u {
        keep_entries(pixel, end, n_before, n_entries);
    }
    keep_surfaces(pixel, blocked, open);
}
