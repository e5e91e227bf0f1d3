// Single scattering of every light at every view, summed over the lights: what `strandlight bench`
// times on the adapter. One view a thread, all under one fibre, as the shading pass does it.
// Bindings: crates/runtime/src/probe/bench.rs.
// #import lib/fibre
// #import lib/frame
// #import lib/tables
// #import lib/single_scattering
// #import lib/paper/single_scattering

@group(0) @binding(0) var<uniform> shading: Shading;
@group(0) @binding(1) var<storage, read> lights: array<LightInFrame>;
@group(0) @binding(2) var<storage, read> views: array<DirectionInFrame>;
@group(0) @binding(3) var<storage, read_write> answers: array<vec4f>;
@group(0) @binding(4) var<uniform> axes: TableAxes;
@group(0) @binding(5) var table_c: texture_2d<u32>;
@group(0) @binding(6) var table_h_tt: texture_2d<f32>;
@group(0) @binding(7) var table_h_trt: texture_2d<f32>;
@group(0) @binding(8) var lobes_tt: texture_2d<u32>;
@group(0) @binding(9) var lobes_trt: texture_2d<u32>;

@compute @workgroup_size(64)
fn bench_paper(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&views) {
        return;
    }
    let view = views[id.x];
    var sum = vec3f(0.0);
    for (var ix = 0u; ix < arrayLength(&lights); ix++) {
        sum += paper_single_scattering(
            lights[ix], view, shading.fibre, axes, table_c, table_h_tt, table_h_trt
        );
    }
    answers[id.x] = vec4f(sum, 0.0);
}

@compute @workgroup_size(64)
fn bench_lobes(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&views) {
        return;
    }
    let view = views[id.x];
    var sum = vec3f(0.0);
    for (var ix = 0u; ix < arrayLength(&lights); ix++) {
        sum += single_scattering(
            lights[ix], view, shading, axes, table_c, lobes_tt, lobes_trt
        );
    }
    answers[id.x] = vec4f(sum, 0.0);
}
