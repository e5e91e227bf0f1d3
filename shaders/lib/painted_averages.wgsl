// #import lib/constants
// #import lib/hair_layers
// #import lib/painted_lobes
// The averages of dual scattering of painted fibres: rgba32float, read by textureLoad and mixed by
// hand. Twin: crates/scattering/src/closed_form/painted_averages.rs, which explains the layout.
// Takes the place of lib/averages, with an AverageRow for the row of a fibre.

// How the texels are placed.
struct PaintedAverages {
    last_layer: f32,
    layer_scale: f32,
    last_width: f32,
    last_shift: f32,
    scale_first: f32,
    scale_range: f32,
    padding_0: u32,
    padding_1: u32,
}

// Where a point stands among the rows; the same for all lights and nodes.
struct AverageRow {
    rows: vec3u,
    fractions: vec3f,
    width_fraction: f32,
    shift_fraction: f32,
    width_step: u32,
    shift_step: u32,
    width_scale_2: f32,
    shift_scale: f32,
}

// What many events send back, at one inclination.
struct Averages {
    attenuation_b: vec3f,
    shift_b: vec3f,
    width_b_2: vec3f,
    // As in lib/averages: painted hair is not of model energy.
    energy: f32,
}

// What one event sends on.
struct ForwardAverages {
    a_f: vec3f,
    beta_f_2: vec3f,
}

// Inclinations less one, the index of the last.
const LAST_INCLINATION: f32 = 127.0;
// Where the columns over the sine begin, and the index of the last of those.
const FIRST_SINE: u32 = 128u;
const LAST_SINE: f32 = 63.0;

// Where a factor stands, 0..1.
fn painted_place(scale: f32) -> f32 {
    return scale / (1.0 + scale);
}

// The rows of a point of this absorption >= 0 and these factors.
fn average_row(
    decode: PaintedAverages,
    sigma_a: vec3f,
    width_scale: f32,
    shift_scale: f32,
) -> AverageRow {
    let at = clamp(
        decode.layer_scale * sqrt(sigma_a / (LAYER_MIDDLE + sigma_a)),
        vec3f(0.0),
        vec3f(decode.last_layer),
    );
    let first = min(floor(at), vec3f(decode.last_layer - 1.0));
    let last = vec2f(decode.last_width, decode.last_shift);
    let places = vec2f(painted_place(width_scale), painted_place(shift_scale));
    let scale_at = clamp((places - decode.scale_first) / decode.scale_range * last, vec2f(0.0), last);
    let scale_first = max(min(floor(scale_at), last - 1.0), vec2f(0.0));
    let layers = u32(decode.last_layer) + 1u;
    let widths = u32(decode.last_width) + 1u;
    let base = layers * (u32(scale_first.x) + widths * u32(scale_first.y));
    return AverageRow(
        base + vec3u(first),
        at - first,
        scale_at.x - scale_first.x,
        scale_at.y - scale_first.y,
        select(0u, layers, decode.last_width > 0.0),
        select(0u, layers * widths, decode.last_shift > 0.0),
        width_scale * width_scale,
        shift_scale,
    );
}

// Between a column and its right neighbour.
fn mix_columns(averages: texture_2d<f32>, column: u32, fraction: f32, row: u32) -> vec4f {
    let low = textureLoad(averages, vec2u(column, row), 0);
    let high = textureLoad(averages, vec2u(column + 1u, row), 0);
    return low + (high - low) * fraction;
}

// Between a layer and the next, too.
fn mix_layers(
    averages: texture_2d<f32>,
    column: u32,
    fraction: f32,
    row: u32,
    layer: f32,
) -> vec4f {
    let near = mix_columns(averages, column, fraction, row);
    let far = mix_columns(averages, column, fraction, row + 1u);
    return near + (far - near) * layer;
}

// Between a factor of widths and the next, too, where they are painted.
fn mix_widths(
    averages: texture_2d<f32>,
    column: u32,
    fraction: f32,
    row: u32,
    layer: f32,
    at: AverageRow,
) -> vec4f {
    let near = mix_layers(averages, column, fraction, row, layer);
// #if PAINTED_WIDTHS
    let far = mix_layers(averages, column, fraction, row + at.width_step, layer);
    return near + (far - near) * at.width_fraction;
// #else
    return near;
// #endif
}

// Between a factor of shifts and the next, too, where they are painted.
fn mix_slices(
    averages: texture_2d<f32>,
    column: u32,
    fraction: f32,
    row: u32,
    layer: f32,
    at: AverageRow,
) -> vec4f {
    let near = mix_widths(averages, column, fraction, row, layer, at);
// #if PAINTED_SHIFTS
    let far = mix_widths(averages, column, fraction, row + at.shift_step, layer, at);
    return near + (far - near) * at.shift_fraction;
// #else
    return near;
// #endif
}

// The averages that local scattering needs at incident inclination theta.
fn sample_averages(averages: texture_2d<f32>, row: AverageRow, theta: f32) -> Averages {
    let at = min(max((theta + HALF_PI) * (LAST_INCLINATION / PI), 0.0), LAST_INCLINATION);
    let first = min(floor(at), LAST_INCLINATION - 1.0);
    let fraction = at - first;
    let column = u32(first);
    let r = mix_slices(averages, column, fraction, row.rows.x, row.fractions.x, row);
    let g = mix_slices(averages, column, fraction, row.rows.y, row.fractions.y, row);
    let b = mix_slices(averages, column, fraction, row.rows.z, row.fractions.z, row);
    return Averages(
        vec3f(r.x, g.x, b.x),
        row.shift_scale * vec3f(r.y, g.y, b.y),
        row.width_scale_2 * vec3f(r.z, g.z, b.z),
        0.0,
    );
}

// a_f and beta_f^2 at the sine of the inclination, 0..=1.
fn sample_painted_forward(
    averages: texture_2d<f32>,
    row: AverageRow,
    sin_theta: f32,
) -> ForwardAverages {
    let at = clamp(sin_theta, 0.0, 1.0) * LAST_SINE;
    let first = min(floor(at), LAST_SINE - 1.0);
    let fraction = at - first;
    let column = FIRST_SINE + u32(first);
    let r = mix_slices(averages, column, fraction, row.rows.x, row.fractions.x, row);
    let g = mix_slices(averages, column, fraction, row.rows.y, row.fractions.y, row);
    let b = mix_slices(averages, column, fraction, row.rows.z, row.fractions.z, row);
    return ForwardAverages(
        vec3f(r.x, g.x, b.x),
        row.width_scale_2 * vec3f(r.y, g.y, b.y),
    );
}

// The layers of hair that is painted as a point is.
fn painted_layers(averages: texture_2d<f32>, row: AverageRow) -> HairLayers {
    let a_f = sample_painted_forward(averages, row, LAYERS_SINE).a_f;
    let up = sample_averages(averages, row, LAYERS_THETA).attenuation_b;
    let down = sample_averages(averages, row, -LAYERS_THETA).attenuation_b;
    return layers_of(a_f, 0.5 * (up + down));
}
