// #import lib/lobes
// The lobes of TT and TRT of a fibre whose absorption is painted, rgba32uint: shapes over theta_d in
// the first row, then amplitudes over theta_d (x) and absorption (y), those of a layer and of the
// next in one texel; read by textureLoad and mixed by hand.
// Twin: crates/scattering/src/closed_form/painted_lobes.rs, which explains the layout.

// How the texels of one mode are placed and decoded.
struct PaintedDecode {
    warp: f32,
    last: f32,
    lambda_scale: f32,
    amplitude_scale: f32,
    last_layer: f32,
    layer_scale: f32,
    decay: f32,
    padding: u32,
}

// Where an absorption stands among the layers.
struct LobeLayer {
    first: u32,
    fraction: f32,
    factor: f32,
}

// Absorption in the middle of the layers.
const LAYER_MIDDLE: f32 = 3.0;

// The layer of absorption sigma_a >= 0.
fn lobe_layer(decode: PaintedDecode, sigma_a: f32) -> LobeLayer {
    let at = min(decode.layer_scale * (sigma_a / (LAYER_MIDDLE + sigma_a)), decode.last_layer);
    let first = min(floor(at), decode.last_layer - 1.0);
    return LobeLayer(u32(first), at - first, exp(-decode.decay * sigma_a));
}

// Amplitudes of the three lobes for the channel of this layer, over u^2.
fn painted_amplitude(
    painted: texture_2d<u32>,
    first: u32,
    fraction: f32,
    layer: LobeLayer,
) -> vec3f {
    let a = textureLoad(painted, vec2u(first, layer.first + 1u), 0);
    let b = textureLoad(painted, vec2u(first + 1u, layer.first + 1u), 0);
    let near = vec3f(mix_floats(a.x, b.x, fraction), mix_floats(a.y, b.y, fraction).x);
    let far = vec3f(mix_floats(a.z, b.z, fraction), mix_floats(a.w, b.w, fraction).x);
    return layer.factor * mix(near, far, layer.fraction);
}

// The lobes at cos_theta_d >= 0 of a point whose channels have these layers.
fn sample_painted_lobes(
    painted: texture_2d<u32>,
    decode: PaintedDecode,
    layers: array<LobeLayer, 3>,
    cos_theta_d: f32,
) -> Lobes {
    let u = lobe_place(decode.warp, cos_theta_d);
    let at = u * decode.last;
    let first = min(floor(at), decode.last - 1.0);
    let fraction = at - first;
    let ix = u32(first);
    let low = textureLoad(painted, vec2u(ix, 0u), 0);
    let high = textureLoad(painted, vec2u(ix + 1u, 0u), 0);
    let x = mix_fractions(low.x, high.x, fraction);
    let y = mix_fractions(low.y, high.y, fraction);
    let z = mix_fractions(low.z, high.z, fraction);
    let w = mix_fractions(low.w, high.w, fraction);
    let height = decode.amplitude_scale * u * u;
    let r = height * painted_amplitude(painted, ix, fraction, layers[0]);
    let g = height * painted_amplitude(painted, ix, fraction, layers[1]);
    let b = height * painted_amplitude(painted, ix, fraction, layers[2]);
    return Lobes(
        decode.lambda_scale * vec3f(x, y.x),
        2.0 * vec2f(y.y, z.y) - 1.0,
        2.0 * vec2f(z.x, w.x) - 1.0,
        array<vec3f, 3>(vec3f(r.x, g.x, b.x), vec3f(r.y, g.y, b.y), vec3f(r.z, g.z, b.z)),
    );
}
