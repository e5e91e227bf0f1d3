// #import lib/single_scattering
// #import lib/painted_lobes
// #import lib/painted_averages
// Paint of a point as shading reads it. Twin: crates/scattering/src/closed_form/paint.rs.

// A point's paint.
struct PointPaint {
    dye: vec3f,
    weight: f32,
    width_scale: f32,
    shift_scale: f32,
    // Absorption of the hair around the point; below 0 where that is as the point.
    around: vec3f,
}

// What painted points have in common.
struct PaintedHair {
    fibre: Fibre,
    reflectance: Reflectance,
    tt: PaintedDecode,
    trt: PaintedDecode,
    averages: PaintedAverages,
}

// Ranges of widths and shifts.
const WIDTH_MIN: f32 = 0.001;
const WIDTH_MAX: f32 = 1.5;
const SHIFT_MAX: f32 = 0.5;

// Steps of a channel of absorption around, ten bits.
const AROUND_STEPS: f32 = 1023.0;

// Absorption around by the last word of a texel.
fn unpack_around(word: u32) -> vec3f {
    if word == 0u {
        return vec3f(-1.0);
    }
    let steps = (vec3u(word) >> vec3u(0u, 10u, 20u)) & vec3u(1023u);
    let place = vec3f(steps) / AROUND_STEPS;
    return LAYER_MIDDLE * place * place / max(1.0 - place * place, vec3f(1e-3));
}

// The paint of a texel.
fn unpack_paint(texel: vec4u) -> PointPaint {
    let rg = unpack2x16float(texel.x);
    let bw = unpack2x16float(texel.y);
    let scales = unpack2x16float(texel.z);
    return PointPaint(vec3f(rg, bw.x), bw.y, scales.x, scales.y, unpack_around(texel.w));
}

// The fibre of a painted point.
fn painted_fibre(fibre: Fibre, paint: PointPaint) -> Fibre {
    var painted = fibre;
    painted.sigma_a = mix(fibre.sigma_a, paint.dye, paint.weight);
    painted.alpha = clamp(paint.shift_scale * fibre.alpha, vec3f(-SHIFT_MAX), vec3f(SHIFT_MAX));
    painted.beta = clamp(paint.width_scale * fibre.beta, vec3f(WIDTH_MIN), vec3f(WIDTH_MAX));
    return painted;
}

// Where the averages of a point of this fibre (painted_fibre's) stand: those of the hair around it.
fn painted_averages(hair: PaintedHair, fibre: Fibre, paint: PointPaint) -> AverageRow {
    let sigma_a = select(fibre.sigma_a, paint.around, paint.around.x >= 0.0);
    return average_row(hair.averages, sigma_a, paint.width_scale, paint.shift_scale);
}

// #if PAINTED
// What the shading of a point of this fibre (painted_fibre's) reads.
fn painted_shading(hair: PaintedHair, fibre: Fibre) -> Shading {
    let sigma_a = fibre.sigma_a;
    return Shading(
        fibre,
        hair.reflectance,
        hair.tt,
        hair.trt,
        array<LobeLayer, 3>(
            lobe_layer(hair.tt, sigma_a.x),
            lobe_layer(hair.tt, sigma_a.y),
            lobe_layer(hair.tt, sigma_a.z),
        ),
        array<LobeLayer, 3>(
            lobe_layer(hair.trt, sigma_a.x),
            lobe_layer(hair.trt, sigma_a.y),
            lobe_layer(hair.trt, sigma_a.z),
        ),
    );
}
// #endif
