// #import lib/constants
// #import lib/frame
// #import lib/half_circle
// Multiple scattering of one fibre by look-up: rgba16float 3D textures, filtered by the hardware.
// Twin: crates/scattering/src/multiple_tables, functions without the prefix multiple_; axes.rs and
// source.rs there explain the layout. With the feature ELLIPTIC_TABLES they are those of an elliptic fibre,
// and multiple_seen_from has to run before the first look-up of an invocation.

// Where the rows of a table stand.
struct MultipleAxes {
    // Nodes over width, sum and difference.
    count: vec3u,
    // w / (w + middle) of a width is even between nodes.
    middle: f32,
    // That of the least width, and nodes per unit of it.
    first: f32,
    scale: f32,
    // Squared width of the ridge under a light of width 0.
    ridge_2: f32,
    padding: f32,
}

// Where the rows of both tables stand, and what their numbers mean.
struct MultipleLayout {
    // Of global and local scattering: four blocks of layers a half, a texel of each is a row.
    rows: MultipleAxes,
    // Of direct local scattering, a texel a row.
    direct: MultipleAxes,
    // Factors of cos((2 k + 1) Delta) in the functions of the lag.
    functions: array<vec4f, 6>,
    // What 1 in a texel stands for.
    row_scales: vec4f,
    direct_scales: vec4f,
    sum_middle: f32,
    least_difference: f32,
    pole: f32,
    grazing: f32,
    last_node: f32,
    terms: u32,
    // Halves of a row: 2 of an elliptic fibre, else 1.
    n_halves: u32,
    padding: u32,
}

// Cosine and sine of phi_j - phi_o, from the view to a light. A round fibre looks at the first alone, an elliptic one at
// phi_o, too: see multiple_seen_from.
struct MultipleAzimuths {
    cos_delta: f32,
    sin_delta: f32,
}

// M^G and M^L.
struct MultipleScattering {
    global: vec3f,
    local: vec3f,
}

// Half of the nodes have sums below this.
fn multiple_sum_middle(tables: MultipleLayout, axes: MultipleAxes, width: f32) -> f32 {
    return tables.sum_middle * sqrt(sqrt(width * width + axes.ridge_2));
}

// The width of layer `ix`.
fn multiple_width_of(axes: MultipleAxes, ix: u32) -> f32 {
    let at = axes.first + f32(ix) / axes.scale;
    return axes.middle * at / (1.0 - at);
}

// theta_j and theta_o of row `ix` of a layer.
fn multiple_inclinations_of(
    tables: MultipleLayout,
    axes: MultipleAxes,
    width: f32,
    ix: u32,
) -> vec2f {
    let last = vec2f(axes.count.yz - 1u);
    let node = 2.0 * vec2f(vec2u(ix / axes.count.z, ix % axes.count.z)) / last - 1.0;
    let middle = multiple_sum_middle(tables, axes, width);
    let scaled = node.x * (PI / (PI + middle));
    let sum = middle * scaled / (1.0 - abs(scaled));
    let share = node.y * (2.0 - abs(node.y));
    let difference = share * (PI - abs(sum));
    let limit = HALF_PI - tables.pole;
    return clamp(0.5 * vec2f(sum + difference, sum - difference), vec2f(-limit), vec2f(limit));
}

// Where a light of this width and inclination stands, seen from theta_o: nodes along width, sum
// and difference.
fn multiple_place(
    tables: MultipleLayout,
    axes: MultipleAxes,
    width: f32,
    theta_j: f32,
    theta_o: f32,
) -> vec3f {
    let sum = theta_j + theta_o;
    let difference = theta_j - theta_o;
    let middle = multiple_sum_middle(tables, axes, width);
    let p = sum * (1.0 + middle / PI) / (middle + abs(sum));
    let most = max(PI - abs(sum), tables.least_difference);
    let rest = max(1.0 - abs(difference) / most, 0.0);
    let q = select(1.0, -1.0, difference < 0.0) * (1.0 - sqrt(rest));
    let last = vec3f(axes.count - 1u);
    let along = vec3f(
        (width / (width + axes.middle) - axes.first) * axes.scale,
        (0.5 + 0.5 * p) * last.y,
        (0.5 + 0.5 * q) * last.z,
    );
    return clamp(along, vec3f(0.0), last);
}

// The functions of the lag, after a zero, at the lag of this cosine: by Clenshaw's recurrence.
fn multiple_lag_functions(tables: MultipleLayout, cosine: f32) -> vec4f {
    let twice = 4.0 * cosine * cosine - 2.0;
    let f = tables.functions;
    let s_4 = f[4] + twice * f[5];
    let s_3 = f[3] + twice * s_4 - f[5];
    let s_2 = f[2] + twice * s_3 - s_4;
    let s_1 = f[1] + twice * s_2 - s_3;
    return cosine * (f[0] + (twice - 1.0) * s_1 - s_2);
}

// Those of a light from this direction.
fn multiple_between(light: DirectionInFrame, view: DirectionInFrame) -> MultipleAzimuths {
    let cos_delta = view.cos_phi * light.cos_phi + view.sin_phi * light.sin_phi;
    return MultipleAzimuths(
        clamp(cos_delta, -1.0, 1.0),
        view.cos_phi * light.sin_phi - view.sin_phi * light.cos_phi,
    );
}

// #if ELLIPTIC_TABLES
// Parts of an order: a constant in the lag, then cosines, then as many sines.
const ORDER_PARTS: u32 = 13u;

// Factors of these in the eight functions, from the view of the invocation.
var<private> multiple_seen: array<array<vec4f, 2>, ORDER_PARTS>;

// Looks at the functions, a row of two texels a part of an order, from this view.
fn multiple_seen_from(functions: texture_2d<f32>, view: DirectionInFrame) {
    let cos_view = 1.0 - 2.0 * view.sin_phi * view.sin_phi;
    let sin_view = 2.0 * view.sin_phi * view.cos_phi;
    let n_rows = textureDimensions(functions).y;
    for (var part = 0u; part < ORDER_PARTS; part++) {
        var cosine = 1.0;
        var sine = 0.0;
        var low = vec4f(0.0);
        var high = vec4f(0.0);
        for (var row = part; row < n_rows; row += ORDER_PARTS) {
            let turn = select(cosine, sine, part > ORDER_PARTS / 2u);
            low += turn * textureLoad(functions, vec2u(0u, row), 0);
            high += turn * textureLoad(functions, vec2u(1u, row), 0);
            let before = cosine;
            cosine = before * cos_view - sine * sin_view;
            sine = sine * cos_view + before * sin_view;
        }
        multiple_seen[part] = array<vec4f, 2>(low, high);
    }
}

// The functions at these azimuths; the first is 1.
fn multiple_elliptic_functions(azimuths: MultipleAzimuths) -> array<vec4f, 2> {
    let cos_2 = 1.0 - 2.0 * azimuths.sin_delta * azimuths.sin_delta;
    let sin_2 = 2.0 * azimuths.sin_delta * azimuths.cos_delta;
    var cosine = azimuths.cos_delta;
    var sine = azimuths.sin_delta;
    var low = multiple_seen[0][0];
    var high = multiple_seen[0][1];
    for (var k = 1u; k <= ORDER_PARTS / 2u; k++) {
        low += cosine * multiple_seen[k][0] + sine * multiple_seen[ORDER_PARTS / 2u + k][0];
        high += cosine * multiple_seen[k][1] + sine * multiple_seen[ORDER_PARTS / 2u + k][1];
        let before = cosine;
        cosine = before * cos_2 - sine * sin_2;
        sine = sine * cos_2 + before * sin_2;
    }
    return array<vec4f, 2>(low, high);
}
// #endif

// M^G and M^L, linear RGB, >= 0, of light of width sigma_f at inclination theta_j seen from
// theta_o.
fn multiple_at(
    tables: MultipleLayout,
    rows: texture_3d<f32>,
    linear: sampler,
    theta_j: f32,
    theta_o: f32,
    azimuths: MultipleAzimuths,
    sigma_f: f32,
) -> MultipleScattering {
// #if ELLIPTIC_TABLES
    let block = 0.125;
// #else
    let block = 0.25;
// #endif
    let count = vec3f(tables.rows.count);
    let place = multiple_place(tables, tables.rows, sigma_f, theta_j, theta_o) + 0.5;
    let at = vec3f(place.z / count.z, place.y / count.y, block * place.x / count.x);
    let step = vec3f(0.0, 0.0, block);
    let x_0 = textureSampleLevel(rows, linear, at, 0.0);
    let x_1 = textureSampleLevel(rows, linear, at + step, 0.0);
    let x_2 = textureSampleLevel(rows, linear, at + 2.0 * step, 0.0);
    let x_3 = textureSampleLevel(rows, linear, at + 3.0 * step, 0.0);
// #if ELLIPTIC_TABLES
    let functions = multiple_elliptic_functions(azimuths);
    let f_0 = functions[0];
    let f_1 = functions[1];
    let x_4 = textureSampleLevel(rows, linear, at + 4.0 * step, 0.0);
    let x_5 = textureSampleLevel(rows, linear, at + 5.0 * step, 0.0);
    let x_6 = textureSampleLevel(rows, linear, at + 6.0 * step, 0.0);
    let x_7 = textureSampleLevel(rows, linear, at + 7.0 * step, 0.0);
    let global = x_0.xyz + f_0.y * x_1.xyz + f_0.z * x_2.xyz + f_0.w * x_3.xyz
        + f_1.x * x_4.xyz + f_1.y * x_5.xyz + f_1.z * x_6.xyz + f_1.w * x_7.xyz;
// #else
    let functions = multiple_lag_functions(tables, azimuths.cos_delta);
    let global = x_0.xyz + functions.y * x_1.xyz + functions.z * x_2.xyz + functions.w * x_3.xyz;
// #endif
    let overlap = PI - acos(clamp(azimuths.cos_delta, -1.0, 1.0));
    let local = overlap * max(vec3f(x_0.w, x_1.w, x_2.w), vec3f(0.0));
    return MultipleScattering(
        tables.row_scales.xyz * max(global, vec3f(0.0)),
        tables.row_scales.w * local,
    );
}

// M^{L,dir}, likewise, of a light of width lambda whose inclination has this cosine.
fn multiple_direct_at(
    tables: MultipleLayout,
    direct: texture_3d<f32>,
    linear: sampler,
    theta_j: f32,
    cos_theta_j: f32,
    theta_o: f32,
    cos_delta: f32,
    lambda: f32,
) -> vec3f {
    let count = vec3f(tables.direct.count);
    let place = multiple_place(tables, tables.direct, lambda, theta_j, theta_o) + 0.5;
    let x = tables.direct_scales
        * max(textureSampleLevel(direct, linear, place.zyx / count.zyx, 0.0), vec4f(0.0));
    let kappa = 2.0 * cos_theta_j * x.w / (lambda * lambda);
    return half_circle(kappa, cos_delta) * x.xyz;
}
