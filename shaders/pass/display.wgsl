// From the linear picture to the screen's: exposure, tone map, sRGB, multiplied by alpha, dithered.
// Twin: Picture::to_srgb8 in crates/scene/src/picture.rs, whose alpha is straight.
// #import lib/view
// #import lib/tone

struct Grade {
    // 2^exposure
    scale: f32,
    // TONE_NONE or TONE_FILMIC
    tone_map: u32,
    pad: vec2u,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> grade: Grade;
@group(0) @binding(2) var<storage, read> picture: array<vec4f>;
@group(0) @binding(3) var screen: texture_storage_2d<rgba8unorm, write>;

@compute @workgroup_size(8, 8)
fn show(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= view.extent.x || id.y >= view.extent.y {
        return;
    }
    let pixel = picture[id.x + view.extent.x * id.y];
    // A pixel without coverage has no colour.
    let factor = select(0.0, grade.scale / max(pixel.a, 1e-30), pixel.a > 0.0);
    let alpha = clamp(pixel.a, 0.0, 1.0);
    let rgb = display(pixel.rgb * factor, grade.tone_map);
    let levels = level(vec4f(rgb * alpha, alpha), dither(id.xy));
    textureStore(screen, vec2i(id.xy), levels / 255.0);
}
