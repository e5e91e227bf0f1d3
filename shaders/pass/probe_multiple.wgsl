// Answers questions for multiple scattering by look-up, for tests.
// #import lib/multiple_tables

// Where a look-up is asked for.
struct MultipleQuestion {
    theta_j: f32,
    theta_o: f32,
    // Azimuths of light and view.
    phi_j: f32,
    phi_o: f32,
    // Of light that was scattered forward, and of light that comes straight.
    sigma_f: f32,
    lambda: f32,
    cos_theta_j: f32,
    padding: u32,
}

@group(0) @binding(0) var<storage, read> questions: array<MultipleQuestion>;
// Global, local and direct local scattering.
@group(0) @binding(1) var<storage, read_write> answers: array<array<f32, 9>>;
// As in pass/shade.
@group(0) @binding(18) var<uniform> tables: MultipleLayout;
@group(0) @binding(19) var rows: texture_3d<f32>;
@group(0) @binding(21) var direct: texture_3d<f32>;
@group(0) @binding(22) var linear: sampler;
// #if ELLIPTIC_TABLES
@group(0) @binding(28) var elliptic: texture_2d<f32>;
// #endif

@compute @workgroup_size(64)
fn probe_multiple(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&questions) {
        return;
    }
    let at = questions[id.x];
    let light = DirectionInFrame(at.theta_j, at.cos_theta_j, cos(at.phi_j), sin(at.phi_j));
    let view = DirectionInFrame(at.theta_o, cos(at.theta_o), cos(at.phi_o), sin(at.phi_o));
    let azimuths = multiple_between(light, view);
// #if ELLIPTIC_TABLES
    multiple_seen_from(elliptic, view);
// #endif
    let found = multiple_at(
        tables, rows, linear, at.theta_j, at.theta_o, azimuths, at.sigma_f);
    let straight = multiple_direct_at(tables, direct, linear,
        at.theta_j, at.cos_theta_j, at.theta_o, azimuths.cos_delta, at.lambda);
    answers[id.x] = array<f32, 9>(
        found.global.x, found.global.y, found.global.z,
        found.local.x, found.local.y, found.local.z,
        straight.x, straight.y, straight.z,
    );
}
