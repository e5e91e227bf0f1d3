// Adds the four samples of each pixel of one pass to the picture, in full precision.
// #import lib/view

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var samples: texture_multisampled_2d<f32>;
@group(0) @binding(2) var<storage, read_write> picture: array<vec4f>;

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= view.size.x || id.y >= view.size.y {
        return;
    }
    let at = vec2i(id.xy);
    let sum = textureLoad(samples, at, 0) + textureLoad(samples, at, 1)
        + textureLoad(samples, at, 2) + textureLoad(samples, at, 3);
    picture[id.x + view.size.x * id.y] += sum;
}
