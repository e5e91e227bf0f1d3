// A draft of the light on everything, for the first picture of a scene: it is there before any
// shadow is, and the first shading takes its place. Hair is an even ball of fog around the
// strands; a fibre mirrors some light as R does, and sends on what it does not absorb of the rest,
// more of it forward than back. Only the strongest lights count, for all of them.
// No twin: no finished picture holds anything of it.
// #import lib/view
// #import lib/light
// #if PROXIES
// #import lib/irradiance
// #import lib/proxy
// #endif

const MOST_LIGHTS: u32 = 16u;

// How much more light a fibre sends on forward than on the average, as a share.
const FORWARD: f32 = 0.9;

struct Preview {
    // The ball.
    centre: vec3f,
    radius: f32,
    // Share of light that a fibre sends on.
    albedo: vec3f,
    // Optical depth of a radius.
    depth: f32,
    // Of R in the inclination of the light: shift, squared width.
    shift: f32,
    width_2: f32,
    // Share of light that R mirrors.
    mirrored: f32,
    n_lights: u32,
    lights: array<Light, MOST_LIGHTS>,
}

@group(0) @binding(0) var<uniform> look: Preview;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> points: array<vec4f>;
@group(0) @binding(3) var<storage, read> tangents: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> radiance: array<vec4f>;
// #if PROXIES
@group(0) @binding(5) var<uniform> proxies: Proxies;
// [proxy][row][column] (rgb, 0), times the view's radiance scale.
@group(0) @binding(6) var<storage, read_write> light_maps: array<vec4f>;
// #endif

// Optical depth of the fog before a light.
fn depth_towards(position: vec3f, direction: vec3f) -> f32 {
    let p = (position - look.centre) / look.radius;
    let b = dot(p, direction);
    let half_chord = sqrt(max(b * b - dot(p, p) + 1.0, 0.0));
    return look.depth * max(half_chord - b - max(-b - half_chord, 0.0), 0.0);
}

@compute @workgroup_size(64)
fn look_at_strands(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let point_ix = id.x + id.y * groups.x * 64u;
    if point_ix >= view.n_points {
        return;
    }
    let position = points[point_ix].xyz;
    let u = tangents[point_ix].xyz;
    let eye = normalize(view.eye - position);
    let sin_o = clamp(dot(u, eye), -1.0, 1.0);
    let theta_o = asin(sin_o);
    let eye_across = eye - u * sin_o;
    var sum = vec3f(0.0);
    for (var ix = 0u; ix < look.n_lights; ix++) {
        let light = look.lights[ix];
        let depth = depth_towards(position, light.direction);
        let sin_i = clamp(dot(u, light.direction), -1.0, 1.0);
        let light_across = light.direction - u * sin_i;
        let squares = dot(light_across, light_across) * dot(eye_across, eye_across);
        let cos_phi = dot(light_across, eye_across) * inverseSqrt(max(squares, 1e-12));
        // Half of it, phi being 0 where light and eye are on the same side.
        let cos_half = sqrt(max(0.5 + 0.5 * cos_phi, 0.0));
        let width_2 = look.width_2 + light.lambda * light.lambda;
        let off = asin(sin_i) + theta_o - look.shift;
        let longitudinal = 0.5641896 * inverseSqrt(width_2) * exp(-off * off / width_2);
        let gloss = look.mirrored * 0.25 * cos_half * longitudinal * exp(-depth);
        // 1 / pi^2 of light that comes across the fibre would be even to all sides; a third of
        // that makes pictures about as bright as the lit ones. What is sent on lights what lies
        // deeper.
        let sent_on = 0.03 * (1.0 - FORWARD * cos_phi);
        let body = look.albedo * exp(-depth * (1.0 - look.albedo)) * sent_on;
        let cos_i = sqrt(max(1.0 - sin_i * sin_i, 0.0));
        sum += light.rgb * (light.solid_angle * cos_i) * (body + gloss);
    }
    radiance[point_ix] = vec4f(sum * view.radiance_scale, 0.0);
}

// #if PROXIES
@compute @workgroup_size(64)
fn look_at_proxies(@builtin(global_invocation_id) id: vec3u) {
    let own = id.y;
    if id.x >= LIGHT_MAP_SIDE * LIGHT_MAP_SIDE || own >= proxies.n {
        return;
    }
    let proxy = proxies.list[own];
    let position = texel_position(proxy, vec2u(id.x % LIGHT_MAP_SIDE, id.x / LIGHT_MAP_SIDE));
    let normal = surface_normal(proxy, position);
    var sum = vec3f(0.0);
    for (var ix = 0u; ix < look.n_lights; ix++) {
        let light = look.lights[ix];
        var left = exp(-depth_towards(position, light.direction));
        for (var other = 0u; other < proxies.n; other++) {
            if other != own && is_blocked_by(proxies.list[other], position, light.direction) {
                left = 0.0;
            }
        }
        sum += light.rgb * (left * irradiance(dot(normal, light.direction), light.lambda));
    }
    let sent_back = proxy.albedo * 0.31830987;
    light_maps[own * LIGHT_MAP_SIDE * LIGHT_MAP_SIDE + id.x] =
        vec4f(sent_back * sum * view.radiance_scale, 0.0);
}
// #endif
