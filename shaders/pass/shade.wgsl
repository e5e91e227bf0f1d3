// Radiance of every point towards the eye: for each light of the batch the sum of terms that
// crates/scattering/src/closed_form/multiple_scattering.rs explains, or some of them.
// Twin: crates/cpu/src/shade.rs.
// #import lib/view
// #import lib/grid
// #import lib/light
// #import lib/single_scattering
// #import lib/transmittance
// #import lib/multiple_scattering
// #import lib/hair_layers
// #import lib/global_scattering
// #import lib/local_scattering
// #import lib/along_segments
// #if BOUNCE
// #import lib/bounce
// #endif
// #if PAINTED
// #import lib/paint
// #endif
// #if TABLES
// #import lib/multiple_tables
// #endif
// #if ELLIPTIC_TABLES
// #import lib/multiple_tables
// #endif
// #if WIDE
// #import lib/width_profile
// #endif

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> batch: Batch;
@group(0) @binding(2) var<uniform> grid: Grid;
// #if PAINTED
// Every point has its own fibre.
@group(0) @binding(3) var<uniform> hair: PaintedHair;
// PAINT_WIDTH points a row.
@group(0) @binding(20) var paint: texture_2d<u32>;
// #else
@group(0) @binding(3) var<uniform> shading: Shading;
@group(0) @binding(16) var<uniform> around: HairAround;
// #endif
@group(0) @binding(4) var<storage, read> points: array<vec4f>;
@group(0) @binding(5) var<storage, read> tangents: array<vec4f>;
@group(0) @binding(6) var<storage, read> normals: array<vec4f>;
@group(0) @binding(7) var<storage, read> lights: array<Light>;
// #if BOUNCE
// What proxies send back in place of lights, see pass/bounce. The grid is that of its nodes.
@group(0) @binding(8) var<storage, read> bounced: array<vec4f>;
// #else
// Packed records, [light of the batch][voxel].
@group(0) @binding(8) var<storage, read> records: array<vec2u>;
// #endif
@group(0) @binding(9) var<storage, read_write> radiance: array<vec4f>;
// 64 bit each, low word first: points skipped; then for each term of SINGLE_COUNTER.. how many
// products of point and light were evaluated, and how many skipped. At N_SHADED how many points are
// shaded, where these are listed, and from FIRST_SHADED on which.
@group(0) @binding(10) var<storage, read_write> counters: array<atomic<u32>>;
@group(0) @binding(11) var<uniform> axes: TableAxes;
@group(0) @binding(12) var table_c: texture_2d<u32>;
@group(0) @binding(13) var lobes_tt: texture_2d<u32>;
@group(0) @binding(14) var lobes_trt: texture_2d<u32>;
@group(0) @binding(15) var averages: texture_2d<f32>;

// Unblocked shares by shadow maps, [shadow_index / 4][mode][point], eight bits a slot: of all modes but TT,
// then of TT.
@group(0) @binding(17) var<storage, read> visibility: array<u32>;

// #if TABLES
// Multiple scattering of the fibre by look-up, see lib/multiple_tables.
@group(0) @binding(18) var<uniform> tables: MultipleLayout;
@group(0) @binding(19) var rows: texture_3d<f32>;
@group(0) @binding(21) var direct: texture_3d<f32>;
@group(0) @binding(22) var linear: sampler;
// #endif
// #if ELLIPTIC_TABLES
// Functions of an elliptic fibre's tables.
@group(0) @binding(28) var elliptic: texture_2d<f32>;
// #endif

// Lit places of all maps, [map_index / 4][point], eight bits a map.
@group(0) @binding(23) var<storage, read> answers: array<u32>;
// Single scattering of narrow lights, times the view's radiance scale: [point][half][place], see
// lib/along_segments.
@group(0) @binding(24) var<storage, read_write> along: array<vec4u>;

// #if WIDE
// Of strands that are wider than a pixel.
@group(0) @binding(25) var<uniform> profile: WidthProfile;
// #endif

// How open the hair is along the axes around each voxel of the shadow volume, see pass/voxelise.
@group(0) @binding(26) var axis_shares: texture_3d<u32>;
// #if BOUNCE
// That of the shadow volume.
@group(0) @binding(27) var<uniform> hair_grid: Grid;
// #endif

const MAPS_PER_WORD: u32 = 4u;

// The terms that are drawn; the others are not part of the pipeline.
override TERMS: u32 = 7u;

// Words of the counters: how many points are shaded, and the first of them.
const N_SHADED: u32 = 20u;
const FIRST_SHADED: u32 = 21u;

const SINGLE_COUNTER: u32 = 1u;
const DIRECT_LOCAL_COUNTER: u32 = 3u;
const GLOBAL_COUNTER: u32 = 5u;
const LOCAL_COUNTER: u32 = 7u;

// #if PAINTED
// Texels a row of the paint; twin in crates/render/src/passes/painted.rs.
const PAINT_WIDTH: u32 = 1024u;
// #else
// Sines less one, the index of the last.
const LAST_FORWARD: f32 = 63.0;

// What the hair around a point does to light. Twin: crates/render/src/passes/scattering.rs.
struct HairAround {
    // By the sine of the inclination, 0..=1: a_f, then beta_f^2.
    forward: array<vec4f, 128>,
    layers: HairLayers,
}
// #endif

fn count(counter: u32, n: u32) {
    let before = atomicAdd(&counters[2u * counter], n);
    if before + n < before {
        atomicAdd(&counters[2u * counter + 1u], 1u);
    }
}

// Of a slot at a point; `is_tt` is 1 for TT, 0 for the other modes.
fn unblocked_share(shadow_index: u32, is_tt: u32, point_ix: u32) -> f32 {
    let row = 2u * (shadow_index / 4u) + is_tt;
    let at = min(row * view.n_points + point_ix, arrayLength(&visibility) - 1u);
    return f32((visibility[at] >> (8u * (shadow_index % 4u))) & 255u) / 255.0;
}

// #if BOUNCE
// Numbers of all lobes at a place, three vectors each: trilinear look-up.
fn bounced_at(g: vec3f) -> array<vec4f, 6> {
    let base = vec3u(g);
    let f = g - vec3f(base);
    var sums = array<vec4f, 6>();
    for (var corner = 0u; corner < 8u; corner++) {
        let offset = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
        let w = select(1.0 - f, f, offset == vec3u(1u));
        let first = 6u * voxel_index(grid, base + offset);
        for (var ix = 0u; ix < 6u; ix++) {
            sums[ix] += (w.x * w.y * w.z) * bounced[first + ix];
        }
    }
    return sums;
}
// #else
fn record_numbers(at: u32) -> vec4f {
    let record = unpack_record(records[at]);
    return vec4f(record.shares, record.sin_theta);
}

// Trilinear look-up in the records of one light.
fn record_at(first: u32, g: vec3f) -> ShadowRecord {
    let base = vec3u(g);
    let f = g - vec3f(base);
    let corner = first + voxel_index(grid, base);
    let row = grid.dims.x;
    let above = corner + grid.dims.x * grid.dims.y;
    let x00 = mix(record_numbers(corner), record_numbers(corner + 1u), f.x);
    let x10 = mix(record_numbers(corner + row), record_numbers(corner + row + 1u), f.x);
    let x01 = mix(record_numbers(above), record_numbers(above + 1u), f.x);
    let x11 = mix(record_numbers(above + row), record_numbers(above + row + 1u), f.x);
    let numbers = mix(mix(x00, x10, f.y), mix(x01, x11, f.y), f.z);
    return ShadowRecord(numbers.xyz, numbers.w);
}
// #endif

// Trilinear look-up of how open the hair is.
fn axis_shares_at(g: vec3f) -> AxisShares {
    let base = vec3u(g);
    let f = g - vec3f(base);
    var sums = array<vec2f, 3>();
    for (var corner = 0u; corner < 8u; corner++) {
        let offset = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
        let w = select(1.0 - f, f, offset == vec3u(1u));
        let voxel = base + offset;
        for (var axis = 0u; axis < 3u; axis++) {
            let texel = textureLoad(axis_shares, vec3u(3u * voxel.x + axis, voxel.yz), 0).x;
            sums[axis] += (w.x * w.y * w.z) * unpack2x16unorm(texel);
        }
    }
    return AxisShares(
        vec3f(sums[0].x, sums[1].x, sums[2].x), vec3f(sums[0].y, sums[1].y, sums[2].y));
}

// Where the places of the batch end.
fn end_place() -> u32 {
    if batch.are_listed == 0u {
        return batch.end_point;
    }
    return min(batch.end_point, atomicLoad(&counters[N_SHADED]));
}

// The point at a place of the batch.
fn shaded_point(place: u32) -> u32 {
    if batch.are_listed == 0u {
        return place;
    }
    return atomicLoad(&counters[FIRST_SHADED + place]);
}

// Whether a point or a segment that it is an end of can touch the picture.
fn in_view(point_ix: u32) -> bool {
    let point = points[point_ix];
    let screen = screen_position(view, point.xyz);
    let half_way = max(tangents[point_ix].w, normals[point_ix].w);
    let margin = shading_margin(view, screen.z, 2.0 * half_way + point.w);
    let low = vec2f(-margin);
    let high = vec2f(view.size) + margin;
    return screen.z >= view.near && all(screen.xy > low) && all(screen.xy < high);
}

// #if PAINTED
// #else
// a_f and beta_f^2 between two entries.
struct ForwardAverages {
    a_f: vec3f,
    beta_f_2: vec3f,
}

fn sample_forward(sin_theta: f32) -> ForwardAverages {
    let at = clamp(sin_theta, 0.0, 1.0) * LAST_FORWARD;
    let first = min(floor(at), LAST_FORWARD - 1.0);
    let fraction = at - first;
    let ix = 2u * u32(first);
    return ForwardAverages(
        mix(around.forward[ix].xyz, around.forward[ix + 2u].xyz, fraction),
        mix(around.forward[ix + 1u].xyz, around.forward[ix + 3u].xyz, fraction),
    );
}
// #endif

// Adds to the counts of a term.
fn count_term(counter: u32, evaluated: u32) {
    count(counter, evaluated);
    count(counter + 1u, batch.n_lights - evaluated);
}

// #if WIDE
// Factors of R, TT and TRT over the width of a strand.
fn sides_of(light: LightInFrame, eye: DirectionInFrame) -> vec3f {
    let place = profile_place(light, eye);
    let here = place.first;
    let wider = here + N_PROFILE_LAGS;
    return profile_sides(place, profile.sides[here], profile.sides[here + 1u],
        profile.sides[wider], profile.sides[wider + 1u]);
}
// #endif

@compute @workgroup_size(64)
fn shade(@builtin(global_invocation_id) id: vec3u) {
    let place = batch.first_point + id.x;
    if place >= end_place() {
        return;
    }
    let point_ix = shaded_point(place);
    let position = points[point_ix].xyz;
    if !in_view(point_ix) {
// #if BOUNCE
// #else
        count(0u, 1u);
// #endif
        return;
    }
    let u = tangents[point_ix].xyz;
    let v = normals[point_ix].xyz;
    let w = cross(u, v);
    let frame = transpose(mat3x3f(u, v, w));
    let eye = direction_in_frame(frame * (view.eye - position));
    let lift = SELF_LIFT * grid.h;
    let n_voxels = grid.dims.x * grid.dims.y * grid.dims.z;
// #if PAINTED
    let painted = unpack_paint(
        textureLoad(paint, vec2u(point_ix % PAINT_WIDTH, point_ix / PAINT_WIDTH), 0));
    let fibre = painted_fibre(hair.fibre, painted);
    let shading = painted_shading(hair, fibre);
    let row = painted_averages(hair, fibre, painted);
// #else
    let row = 0u;
// #endif
    var sum = vec3f(0.0);
    // Mean over the channels of how much brighter single scattering is at the right edge than in the middle.
    var side = 0.0;
    var evaluated = vec4u(0u);
// #if BOUNCE
    var lobes = bounced_at(grid_position(grid, position));
// #endif
    var behind = AxisDensities();
    var layers = HairLayers();
    if (TERMS & (TERM_LOCAL | TERM_GLOBAL)) != 0u {
// #if PAINTED
        layers = painted_layers(averages, row);
// #else
        layers = around.layers;
// #endif
// #if BOUNCE
        behind = axis_densities(layers, axis_shares_at(grid_position(hair_grid, position)));
// #else
        behind = axis_densities(layers, axis_shares_at(grid_position(grid, position)));
// #endif
    }
// #if ELLIPTIC_TABLES
    multiple_seen_from(elliptic, eye);
// #endif
    for (var ix = 0u; ix < batch.n_lights; ix++) {
// #if BOUNCE
        let scale = 1.0 / view.radiance_scale;
        let light = lobe_light(lobes[3u * ix + 1u].xyz * scale, lobes[3u * ix + 2u].xyz * scale);
        let record = ShadowRecord(exp(-lobes[3u * ix].xyz), lobes[3u * ix].w);
        let unblocked = record.shares.x;
        let unblocked_tt = unblocked;
// #else
        let light = lights[batch.first_light + ix];
        // A strand does not shadow itself, but its voxel holds it: a little towards the light it
        // holds less of it.
        let record = record_at(light.record * n_voxels, grid_position(grid, position + light.direction * lift));
        var unblocked = record.shares.x;
        var unblocked_tt = unblocked;
        if light.shadow_index != NO_SLOT {
            unblocked = unblocked_share(light.shadow_index, 0u, point_ix);
            unblocked_tt = unblocked_share(light.shadow_index, 1u, point_ix);
        }
// #endif
        let direct_power = max(unblocked, unblocked_tt) * light.power;
        var density_back = vec3f(0.0);
        if (TERMS & (TERM_LOCAL | TERM_GLOBAL)) != 0u {
            density_back = batch.density_back * local_density(behind, light.direction);
        }
        let source = light_in_frame(frame * light.direction, light.lambda);
// #if TABLES
        let towards = source.direction;
        let azimuths = multiple_between(towards, eye);
// #endif
        if batch.are_along != 0u && light.n_maps > 0u {
            // `shade_narrow` adds it.
            let is_lit = unblocked > 0.0 && light.power >= batch.min_power;
            evaluated.x += select(0u, 1u, (TERMS & TERM_SINGLE) != 0u && is_lit);
        } else if (TERMS & TERM_SINGLE) != 0u && direct_power >= batch.min_power {
            let shares = vec3f(unblocked, unblocked_tt, unblocked);
            let scattered = shadowed_single_scattering(
                source, eye, shading, shares, axes, table_c, lobes_tt, lobes_trt);
            sum += light.rgb * scattered;
            evaluated.x++;
// #if WIDE
            let of_side = shadowed_single_scattering(source, eye, shading,
                shares * sides_of(source, eye), axes, table_c, lobes_tt, lobes_trt);
            side += dot(light.rgb, of_side) / 3.0;
// #endif
        }
        if (TERMS & TERM_LOCAL) != 0u && direct_power * batch.max_local >= batch.min_power {
// #if TABLES
            let scattered = multiple_direct_at(tables, direct, linear,
                towards.theta, towards.cos_theta, eye.theta, azimuths.cos_delta, light.lambda);
// #else
            let scattered = direct_local_scattering(source, eye, averages, row);
// #endif
            let factor = density_back * unblocked * light.solid_angle;
            sum += factor * light.rgb * scattered;
            evaluated.y++;
        }
        if (TERMS & (TERM_LOCAL | TERM_GLOBAL)) == 0u {
            continue;
        }
// #if PAINTED
        let at = sample_painted_forward(averages, row, record.sin_theta);
// #else
        let at = sample_forward(record.sin_theta);
// #endif
        let arriving = forward_light(
            record, at.a_f, at.beta_f_2, light.rgb, light.lambda, layers, density_back);
        let gained = batch.density_forward * arriving.gained;
        let power = max(max(gained.x, gained.y), gained.z) * light.power;
        let radiance_in = light.solid_angle * gained * light.rgb;
        let global_in = batch.density_forward * arriving.global;
        let global_power = max(max(global_in.x, global_in.y), global_in.z) * light.power;
        let has_global = (TERMS & TERM_GLOBAL) != 0u && global_power >= batch.min_power;
        let has_local =
            (TERMS & TERM_LOCAL) != 0u && power * batch.max_local >= batch.min_power;
// #if TABLES
        if !(has_global || has_local) {
            continue;
        }
        let scattered = multiple_at(
            tables, rows, linear, towards.theta, eye.theta, azimuths, arriving.sigma_f);
// #endif
        if has_global {
// #if TABLES
            let global = scattered.global;
// #else
            let global = global_scattering(
                source.direction, eye, arriving.sigma_f, shading, lobes_tt, lobes_trt);
// #endif
            sum += light.solid_angle * global_in * light.rgb * global;
            evaluated.z++;
        }
        if has_local {
// #if TABLES
            let local = scattered.local;
// #else
            let local =
                local_scattering(source.direction, eye, arriving.sigma_f, averages, row);
// #endif
            sum += density_back * radiance_in * local;
            evaluated.w++;
        }
    }
    // The first batch overwrites what an earlier view left.
    var before = vec4f(0.0);
    if batch.first_light > 0u {
        before = radiance[point_ix];
    }
    radiance[point_ix] = before + vec4f(sum, side) * view.radiance_scale;
// #if BOUNCE
// #else
    if (TERMS & TERM_SINGLE) != 0u {
        count_term(SINGLE_COUNTER, evaluated.x);
    }
    if (TERMS & TERM_LOCAL) != 0u {
        count_term(DIRECT_LOCAL_COUNTER, evaluated.y);
        count_term(LOCAL_COUNTER, evaluated.w);
    }
    if (TERMS & TERM_GLOBAL) != 0u {
        count_term(GLOBAL_COUNTER, evaluated.z);
    }
// #endif
}

// Single scattering of the narrow lights of the batch at the places about each point.
@compute @workgroup_size(64)
fn shade_narrow(@builtin(global_invocation_id) id: vec3u) {
    let place = batch.first_point + id.x;
    if place >= end_place() {
        return;
    }
    let point_ix = shaded_point(place);
    let position = points[point_ix].xyz;
    var sums = array<vec3f, 8>();
// #if WIDE
    var side = 0.0;
// #endif
    if in_view(point_ix) {
        let before = tangents[point_ix].w;
        let after = normals[point_ix].w;
        let others = vec3u(
            select(point_ix, point_ix - 1u, before > 0.0),
            point_ix,
            select(point_ix, point_ix + 1u, after > 0.0),
        );
// #if PAINTED
        let painted = unpack_paint(
            textureLoad(paint, vec2u(point_ix % PAINT_WIDTH, point_ix / PAINT_WIDTH), 0));
        let shading = painted_shading(hair, painted_fibre(hair.fibre, painted));
// #endif
        for (var ix = 0u; ix < batch.n_lights; ix++) {
            let light = lights[batch.first_light + ix];
            var n_lit = array<u32, 8>();
            var is_lit = false;
            for (var map = light.first_map; map < light.first_map + light.n_maps; map++) {
                let word = answers[map / MAPS_PER_WORD * view.n_points + point_ix];
                let answer = (word >> (8u * (map % MAPS_PER_WORD))) & 255u;
                is_lit |= answer != 0u;
                let lit = even_halves(answer, before, after);
                for (var place = 0u; place < N_PLACES; place++) {
                    n_lit[place] += (lit >> place) & 1u;
                }
            }
            if !is_lit || light.power < batch.min_power {
                continue;
            }
            // At the middle of the segment before, the point, and the middle of that after it.
            var nodes = array<vec3f, 3>();
            for (var node = 0u; node < 3u; node++) {
                let other = others[node];
                let along_both = tangents[point_ix].xyz + tangents[other].xyz;
                var u = along_both / max(length(along_both), 1e-20);
                let across_both = normals[point_ix].xyz + normals[other].xyz;
                var v = across_both - u * dot(u, across_both);
                // Where a strand turns straight back there is none between.
                if dot(along_both, along_both) < LEAST_NORMAL || dot(v, v) < LEAST_NORMAL {
                    u = tangents[point_ix].xyz;
                    v = normals[point_ix].xyz;
                }
                v = normalize(v);
                let frame = transpose(mat3x3f(u, v, cross(u, v)));
                let middle = 0.5 * (position + points[other].xyz);
                let eye = direction_in_frame(frame * (view.eye - middle));
                let source = light_in_frame(frame * light.direction, light.lambda);
                let scattered = shadowed_single_scattering(
                    source, eye, shading, vec3f(1.0), axes, table_c, lobes_tt, lobes_trt);
                nodes[node] = light.rgb * scattered;
            }
// #if WIDE
            let u = tangents[point_ix].xyz;
            let v = normals[point_ix].xyz;
            let frame = transpose(mat3x3f(u, v, cross(u, v)));
            let eye = direction_in_frame(frame * (view.eye - position));
            let source = light_in_frame(frame * light.direction, light.lambda);
            let of_side = shadowed_single_scattering(
                source, eye, shading, sides_of(source, eye), axes, table_c, lobes_tt, lobes_trt);
            var n_places = 0u;
            for (var place = 0u; place < N_PLACES; place++) {
                n_places += n_lit[place];
            }
            let share = f32(n_places) / f32(N_PLACES * light.n_maps);
            side += share * dot(light.rgb, of_side) / 3.0;
// #endif
            let of_map = view.radiance_scale / f32(light.n_maps);
            for (var place = 0u; place < N_PLACES; place++) {
                let half_ix = place / HALF;
                let t = (f32(place % HALF) + 0.5) / f32(HALF);
                let value = mix(nodes[half_ix], nodes[half_ix + 1u], t);
                sums[place] += f32(n_lit[place]) * of_map * value;
            }
        }
    }
// #if WIDE
    radiance[point_ix].w += side * view.radiance_scale;
// #endif
    for (var half_ix = 0u; half_ix < 2u; half_ix++) {
        let at = HALF * half_ix;
        along[2u * point_ix + half_ix] = vec4u(
            pack_radiance(sums[at]),
            pack_radiance(sums[at + 1u]),
            pack_radiance(sums[at + 2u]),
            pack_radiance(sums[at + 3u]),
        );
    }
}
