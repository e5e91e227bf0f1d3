// Fills the tables of multiple scattering of a fibre: rows from the closed form, then balanced and
// rounded into the textures that shading filters.
// Twins: crates/scattering/src/multiple_tables/fill.rs, which explains the rows, and balance in
// axes.rs.
// #import lib/fibre
// #import lib/frame
// #import lib/multiple_scattering
// #import lib/local_scattering
// #import lib/half_circle
// #import lib/mean_cosine
// #import lib/outer_integral
// #import lib/fisher
// #import lib/multiple_tables

@group(0) @binding(0) var<uniform> tables: MultipleLayout;
@group(0) @binding(1) var<uniform> fibre: Fibre;
@group(0) @binding(2) var averages: texture_2d<f32>;
// N_t^G over cos(theta_d), [half][mode][node].
@group(0) @binding(3) var<storage, read> profiles: array<array<vec4f, 4>>;
// [half][width][sum][difference], four each; of direct local scattering [width][sum][difference].
@group(0) @binding(4) var<storage, read_write> rows: array<vec4f>;
@group(0) @binding(5) var texels: texture_storage_3d<rgba16float, write>;

// Cosine of the lag at which the share of direct light within a half circle is that of the closed
// form.
const MATCHED_COSINE: f32 = 0.5;
// Above this share it says too little of the sharpness.
const ALL: f32 = 0.99;

fn direction(theta: f32, azimuth: vec2f) -> DirectionInFrame {
    return DirectionInFrame(theta, max(cos(theta), 0.0), azimuth.x, azimuth.y);
}

// Adds `factor` times N_t^G at cos_theta_d to half a row. `profile`: half times three and mode.
fn add(sum: ptr<function, array<vec4f, 4>>, profile: u32, cos_theta_d: f32, factor: f32) {
    let place = (1.0 + tables.grazing) * cos_theta_d / (tables.grazing + cos_theta_d);
    let at = clamp(tables.last_node * place, 0.0, tables.last_node);
    let first = min(floor(at), tables.last_node - 1.0);
    let high = factor * (at - first);
    let low = factor - high;
    let ix = profile * (u32(tables.last_node) + 1u) + u32(first);
    let below = profiles[ix];
    let above = profiles[ix + 1u];
    (*sum)[0] += low * below[0] + high * above[0];
    (*sum)[1] += low * below[1] + high * above[1];
    (*sum)[2] += low * below[2] + high * above[2];
    (*sum)[3] += low * below[3] + high * above[3];
}

// Global scattering of one mode by the factors of its N_t^G.
fn add_global(
    sum: ptr<function, array<vec4f, 4>>,
    half: u32,
    mode: u32,
    light: DirectionInFrame,
    theta_o: f32,
    sigma_f: f32,
) {
    let profile = 3u * half + mode;
    if (fibre.modes & (1u << mode)) == 0u {
        return;
    }
    if is_energy(fibre) {
        let share = forward_share(mode, light.theta, theta_o, sigma_f, fibre);
        let cosine = mean_cosine(light.theta, light.cos_theta, sigma_f);
        let cos_o = inclination(theta_o).cos_theta_d;
        add(sum, profile, cos_o, share / (SQRT_PI * sigma_f * cosine));
        return;
    }
    let rule = outer_rule(light.theta, sigma_f, theta_o, fibre.alpha[mode], fibre.beta[mode]);
    if rule.ln_bound < LN_CULL {
        return;
    }
    // The pi of both Gaussians.
    let scale = 1.0 / (PI * sigma_f * mean_cosine(light.theta, light.cos_theta, sigma_f));
    let extent = node_extent(rule);
    let count = node_count(extent, (fibre.nodes >> (4u * mode)) & 15u);
    for (var ix = 0u; ix < count; ix++) {
        let place = node_place(rule, node_constants(extent, count, ix));
        let lobe = (rule.to_lobe + place.step) * rule.inverse_width;
        let from_light = (rule.to_light + place.step) / sigma_f;
        let fall = exp(-lobe * lobe - from_light * from_light);
        let weight = place.weight * rule.inverse_width * fall;
        let cos_i = max(cos(place.theta_i), 0.0);
        let cos_d = inclination(0.5 * (theta_o - place.theta_i)).cos_theta_d;
        let ratio = min(cos_i / cos_d, 2.0);
        add(sum, profile, cos_d, scale * weight * (ratio * ratio));
    }
}

// Direct local scattering as if light came from everywhere in azimuth, and the cosine of the
// inclination that gives the light the sharpness in azimuth that all nodes have together.
fn direct_row(lambda: f32, theta_j: f32, theta_o: f32) -> vec4f {
    let light = LightInFrame(direction(theta_j, vec2f(1.0, 0.0)), lambda);
    let side = direction(theta_o, vec2f(0.0, 1.0));
    let matched = vec2f(MATCHED_COSINE, sqrt(1.0 - MATCHED_COSINE * MATCHED_COSINE));
    // Half of a circle of light is in half a circle, whatever its sharpness.
    let whole = 2.0 * direct_local_scattering(light, side, averages, AverageRow());
    let found = direct_local_scattering(
        light, direction(theta_o, matched), averages, AverageRow());
    let share = (found.x + found.y + found.z) / max(whole.x + whole.y + whole.z, 1e-30);
    var cosine = 0.0;
    if share < ALL {
        let kappa = 2.0 * light.direction.cos_theta / (lambda * lambda);
        cosine = cosine_of_share(kappa, share);
    } else {
        // All light is on one side: any sharpness of this order does.
        let mean = local_rule(theta_j, lambda, theta_o, averages, AverageRow()).rule.mean;
        cosine = max(cos(clamp(mean, -HALF_PI, HALF_PI)), 0.0);
    }
    return vec4f(whole, cosine);
}

// The factor 0..=1 of kappa with which this share of a circular Gaussian lies within the half
// circle around a direction that is MATCHED_COSINE off its centre, to 2e-4.
fn cosine_of_share(kappa: f32, share: f32) -> f32 {
    var low = 0.0;
    var high = 1.0;
    for (var step = 0u; step < 12u; step++) {
        let middle = 0.5 * (low + high);
        if half_circle(kappa * middle, MATCHED_COSINE) < share {
            low = middle;
        } else {
            high = middle;
        }
    }
    return 0.5 * (low + high);
}

@compute @workgroup_size(64)
fn fill_rows(@builtin(global_invocation_id) id: vec3u) {
    let axes = tables.rows;
    let layer = axes.count.y * axes.count.z;
    let half = id.x / (axes.count.x * layer);
    let ix = id.x % (axes.count.x * layer);
    if half >= tables.n_halves {
        return;
    }
    let width = multiple_width_of(axes, ix / layer);
    let theta = multiple_inclinations_of(tables, axes, width, ix % layer);
    let light = direction(theta.x, vec2f(1.0, 0.0));
    var sum = array<vec4f, 4>(vec4f(0.0), vec4f(0.0), vec4f(0.0), vec4f(0.0));
    if (tables.terms & TERM_GLOBAL) != 0u {
        // Not a loop over the modes: see lib/global_scattering.
        add_global(&sum, half, 0u, light, theta.y, width);
        add_global(&sum, half, 1u, light, theta.y, width);
        add_global(&sum, half, 2u, light, theta.y, width);
    }
    var local = vec3f(0.0);
    if (tables.terms & TERM_LOCAL) != 0u && half == 0u {
        // Over the overlap of the half circles, pi - Delta.
        let view = direction(theta.y, vec2f(1.0, 0.0));
        local = local_scattering(light, view, width, averages, AverageRow()) / PI;
    }
    let first = 4u * id.x;
    rows[first] = vec4f(sum[0].xyz, local.x);
    rows[first + 1u] = vec4f(sum[1].xyz, local.y);
    rows[first + 2u] = vec4f(sum[2].xyz, local.z);
    rows[first + 3u] = vec4f(sum[3].xyz, 0.0);
}

@compute @workgroup_size(64)
fn fill_direct(@builtin(global_invocation_id) id: vec3u) {
    let axes = tables.direct;
    let layer = axes.count.y * axes.count.z;
    if id.x >= axes.count.x * layer {
        return;
    }
    let width = multiple_width_of(axes, id.x / layer);
    let theta = multiple_inclinations_of(tables, axes, width, id.x % layer);
    rows[id.x] = direct_row(width, theta.x, theta.y);
}

// Weights of a node and of those before and after: those within an axis lose a twelfth of the
// second difference.
fn balance_weights(ix: u32, count: u32) -> vec3f {
    let is_within = ix > 0u && ix + 1u < count;
    return select(vec3f(0.0, 1.0, 0.0), vec3f(-1.0, 14.0, -1.0) / 12.0, is_within);
}

// The vector of row `ix` among those from `first` on, each `stride` after the one before, balanced along all axes.
fn balance(axes: MultipleAxes, ix: u32, first: u32, stride: u32) -> vec4f {
    let layer = axes.count.y * axes.count.z;
    let at = vec3u(ix / layer, ix % layer / axes.count.z, ix % axes.count.z);
    let along_w = balance_weights(at.x, axes.count.x);
    let along_p = balance_weights(at.y, axes.count.y);
    let along_q = balance_weights(at.z, axes.count.z);
    let last = axes.count - 1u;
    var sum = vec4f(0.0);
    for (var k = 0u; k < 27u; k++) {
        let by = vec3u(k / 9u, k / 3u % 3u, k % 3u);
        let weight = along_w[by.x] * along_p[by.y] * along_q[by.z];
        // Beyond the ends the weight is 0.
        let node = min(max(at + by, vec3u(1u)) - 1u, last);
        let row = (node.x * axes.count.y + node.y) * axes.count.z + node.z;
        sum += weight * rows[first + stride * row];
    }
    return sum;
}

// As a half float has it, to the nearest: a device may cut digits off. Half floats end at 65504.
fn stored(value: vec4f) -> vec4f {
    let bits = bitcast<vec4u>(clamp(value, vec4f(-6.5e4), vec4f(6.5e4)));
    return bitcast<vec4f>((bits + 0x1000u) & vec4u(0xffffe000u));
}

@compute @workgroup_size(64)
fn balance_rows(@builtin(global_invocation_id) id: vec3u) {
    let axes = tables.rows;
    let layer = axes.count.y * axes.count.z;
    let n_rows = axes.count.x * layer;
    let half = id.x / (4u * n_rows);
    let ix = id.x % (4u * n_rows) / 4u;
    let block = id.x % 4u;
    if half >= tables.n_halves {
        return;
    }
    let z = ix / layer + (4u * half + block) * axes.count.x;
    let at = vec3u(ix % axes.count.z, ix % layer / axes.count.z, z);
    let found = balance(axes, ix, 4u * half * n_rows + block, 4u);
    textureStore(texels, at, stored(found / tables.row_scales));
}

@compute @workgroup_size(64)
fn balance_direct(@builtin(global_invocation_id) id: vec3u) {
    let axes = tables.direct;
    let layer = axes.count.y * axes.count.z;
    if id.x >= axes.count.x * layer {
        return;
    }
    let at = vec3u(id.x % axes.count.z, id.x % layer / axes.count.z, id.x / layer);
    textureStore(texels, at, stored(balance(axes, id.x, 0u, 1u) / tables.direct_scales));
}
