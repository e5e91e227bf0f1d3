// The lobes of painted fibres at points, for checking them from outside.
// Bindings: crates/runtime/src/probe/painted.rs.
// #import lib/painted_lobes

// cos(theta_d) and sigma_a of the three channels.
@group(0) @binding(0) var<storage, read> points: array<vec4f>;
// Widths, cos(mu/2) and sin(mu/2) of the pairs, amplitudes per lobe, then channel.
@group(0) @binding(1) var<storage, read_write> answers: array<array<f32, 16>>;
@group(0) @binding(2) var<uniform> decode: PaintedDecode;
@group(0) @binding(3) var painted: texture_2d<u32>;

@compute @workgroup_size(64)
fn probe_painted(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&points) {
        return;
    }
    let point = points[id.x];
    let layers = array<LobeLayer, 3>(
        lobe_layer(decode, point.y),
        lobe_layer(decode, point.z),
        lobe_layer(decode, point.w),
    );
    let lobes = sample_painted_lobes(painted, decode, layers, point.x);
    let a = lobes.amplitude;
    answers[id.x] = array<f32, 16>(
        lobes.lambda.x, lobes.lambda.y, lobes.lambda.z,
        lobes.cos_half.x, lobes.cos_half.y, lobes.sin_half.x, lobes.sin_half.y,
        a[0].x, a[0].y, a[0].z, a[1].x, a[1].y, a[1].z, a[2].x, a[2].y, a[2].z,
    );
}
