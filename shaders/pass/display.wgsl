// From the linear picture to the screen's: exposure, tone map and sRGB or a LUT, multiplied by alpha, dithered.
// Twin: Picture::to_srgb8 in crates/scene/src/picture.rs, whose alpha is straight.
// #import lib/view
// #import lib/tone
// #import lib/lut

struct Grade {
    // 2^exposure
    scale: f32,
    // TONE_NONE, TONE_FILMIC, TONE_AGX or TONE_LUT, which is ACES 2 too; what follows is of the last.
    tone_map: u32,
    // LUT_LOG2, LUT_SRGB or LUT_LINEAR
    lut_input: u32,
    // Samples of the curves, and along an edge of the grid; 0 where there are none.
    curve_size: u32,
    curve_low: vec3f,
    grid_size: u32,
    curve_high: vec3f,
    pad: u32,
    grid_low: vec3f,
    pad2: u32,
    grid_high: vec3f,
    pad3: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> grade: Grade;
@group(0) @binding(2) var<storage, read> picture: array<vec4f>;
@group(0) @binding(3) var screen: texture_storage_2d<rgba8unorm, write>;
// Samples of the curves, then of the grid: red, green, blue.
@group(0) @binding(4) var<storage, read> lut: array<f32>;

// A channel by its curve, between whose samples are straight lines.
fn along_curve(v: f32, channel: u32) -> f32 {
    let at = place(v, grade.curve_low[channel], grade.curve_high[channel], grade.curve_size);
    let below = min(u32(at), grade.curve_size - 2u);
    let a = lut[3u * below + channel];
    let b = lut[3u * below + 3u + channel];
    return a + (at - f32(below)) * (b - a);
}

fn grid_sample(ix: u32) -> vec3f {
    let first = 3u * (grade.curve_size + ix);
    return vec3f(lut[first], lut[first + 1u], lut[first + 2u]);
}

// sRGB of linear radiance by the LUT. Twin: Lut::display in crates/scene/src/lut.rs.
fn by_lut(rgb: vec3f) -> vec3f {
    var v = vec3f(
        encoded(rgb.x, grade.lut_input),
        encoded(rgb.y, grade.lut_input),
        encoded(rgb.z, grade.lut_input));
    if grade.curve_size > 0u {
        v = vec3f(along_curve(v.x, 0u), along_curve(v.y, 1u), along_curve(v.z, 2u));
    }
    if grade.grid_size > 0u {
        let at = vec3f(
            place(v.x, grade.grid_low.x, grade.grid_high.x, grade.grid_size),
            place(v.y, grade.grid_low.y, grade.grid_high.y, grade.grid_size),
            place(v.z, grade.grid_low.z, grade.grid_high.z, grade.grid_size));
        let around = tetrahedron(at, grade.grid_size);
        v = around.weights.x * grid_sample(around.corners.x)
            + around.weights.y * grid_sample(around.corners.y)
            + around.weights.z * grid_sample(around.corners.z)
            + around.weights.w * grid_sample(around.corners.w);
    }
    return clamp(v, vec3f(0.0), vec3f(1.0));
}

@compute @workgroup_size(8, 8)
fn show(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= view.extent.x || id.y >= view.extent.y {
        return;
    }
    let pixel = picture[id.x + view.extent.x * id.y];
    // A pixel without coverage has no colour.
    let factor = select(0.0, grade.scale / max(pixel.a, 1e-30), pixel.a > 0.0);
    let alpha = clamp(pixel.a, 0.0, 1.0);
    var rgb = pixel.rgb * factor;
    if grade.tone_map == TONE_LUT {
        rgb = by_lut(rgb);
    } else {
        rgb = display(rgb, grade.tone_map);
    }
    let levels = level(vec4f(rgb * alpha, alpha), dither(id.xy));
    textureStore(screen, vec2i(id.xy), levels / 255.0);
}
