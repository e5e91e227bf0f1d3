// Fibres and averages of painted points, for checking them from outside.
// Bindings: crates/runtime/src/probe/painted.rs.
// #import lib/paint

struct Question {
    paint: vec4u,
    theta: f32,
    sin_theta: f32,
    padding_0: u32,
    padding_1: u32,
}

@group(0) @binding(0) var<storage, read> questions: array<Question>;
// Absorption, shifts and widths of the fibre; A_b, Delta_b, sigma_b^2; a_f, beta_f^2.
@group(0) @binding(1) var<storage, read_write> answers: array<array<f32, 24>>;
@group(0) @binding(2) var<uniform> hair: PaintedHair;
@group(0) @binding(3) var averages: texture_2d<f32>;

@compute @workgroup_size(64)
fn probe_paint(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&questions) {
        return;
    }
    let question = questions[id.x];
    let paint = unpack_paint(question.paint);
    let fibre = painted_fibre(hair.fibre, paint);
    let row = painted_averages(hair, fibre, paint);
    let at = sample_averages(averages, row, question.theta);
    let forward = sample_painted_forward(averages, row, question.sin_theta);
    let all = array<vec3f, 8>(
        fibre.sigma_a, fibre.alpha, fibre.beta,
        at.attenuation_b, at.shift_b, at.width_b_2,
        forward.a_f, forward.beta_f_2,
    );
    answers[id.x] = array<f32, 24>(
        all[0].x, all[0].y, all[0].z, all[1].x, all[1].y, all[1].z,
        all[2].x, all[2].y, all[2].z, all[3].x, all[3].y, all[3].z,
        all[4].x, all[4].y, all[4].z, all[5].x, all[5].y, all[5].z,
        all[6].x, all[6].y, all[6].z, all[7].x, all[7].y, all[7].z,
    );
}
