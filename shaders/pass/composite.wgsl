// Turns sums of samples into means and puts the background behind them.
// Twin: crates/cpu/src/composite.rs.
// #import lib/view
// #import lib/light
// #if PANORAMA
// #import lib/panorama
// #endif

struct Backdrop {
    color: vec3f,
    // 0 nothing, 1 `color`, 2 the lights, 3 the map
    kind: u32,
    n_lights: u32,
    n_samples: u32,
    pad: vec2u,
    // Of the map: what its texels are multiplied by, and by how much of a turn it is turned.
    factor: vec3f,
    turn: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> backdrop: Backdrop;
@group(0) @binding(2) var<storage, read> lights: array<Light>;
@group(0) @binding(3) var<storage, read> sums: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> picture: array<vec4f>;
// #if PANORAMA
@group(0) @binding(5) var map: texture_2d<f32>;
// #endif

@compute @workgroup_size(8, 8)
fn composite(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= view.extent.x || id.y >= view.extent.y {
        return;
    }
    let index = id.x + view.extent.x * id.y;
    let mean = sums[index] / f32(backdrop.n_samples);
    var rgb = mean.rgb / view.radiance_scale;
    var alpha = mean.a;
    if backdrop.kind != 0u {
        var behind = backdrop.color;
        if backdrop.kind == 2u {
            let omega = ray_direction(view, vec2f(view.origin + id.xy) + 0.5);
            behind = vec3f(0.0);
            // Nothing is seen of it behind closed hair.
            let n_lights = select(backdrop.n_lights, 0u, alpha >= 1.0);
            for (var light_ix = 0u; light_ix < n_lights; light_ix++) {
                behind += light_radiance(lights[light_ix], omega);
            }
        }
        // #if PANORAMA
        if backdrop.kind == 3u {
            let omega = ray_direction(view, vec2f(view.origin + id.xy) + 0.5);
            behind = panorama_radiance(map, omega, backdrop.turn, backdrop.factor);
        }
        // #endif
        rgb += (1.0 - alpha) * behind;
        alpha = 1.0;
    }
    picture[index] = vec4f(rgb, alpha);
}
