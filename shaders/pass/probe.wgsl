// #import lib/special
// #import lib/circular_gaussian
// #import lib/paper/fresnel
// #import lib/fibre
// #import lib/frame
// #import lib/tables
// #import lib/outer_integral
// #import lib/single_scattering
// #import lib/averages
// #import lib/half_circle
// #import lib/mean_cosine
// #import lib/global_scattering
// #import lib/local_scattering
// #import lib/paper/azimuthal
// #import lib/paper/single_scattering
// One library function a thread: values for checking the shaders from outside.
// Layout and meaning of the fields: crates/runtime/src/probe/mod.rs.

struct Query {
    fibre: Fibre,
    light: DirectionInFrame,
    view: DirectionInFrame,
    x: f32,
    y: f32,
    z: f32,
    w: f32,
    function: u32,
    mode: u32,
    scheme: u32,
    optics: u32,
}

// Scheme of the query; anything else is the renderer's.
const PAPER: u32 = 1u;

const TABLE_C: u32 = 0u;
const TABLE_H: u32 = 1u;
const AZIMUTHAL: u32 = 2u;
const SINGLE: u32 = 3u;
const SPECIAL: u32 = 4u;
const CIRCULAR_GAUSSIAN: u32 = 5u;
const FRESNEL: u32 = 6u;
const FRAME: u32 = 7u;
const OUTER_NODE: u32 = 8u;
const GLOBAL: u32 = 9u;
const LOCAL: u32 = 10u;
const DIRECT_LOCAL: u32 = 11u;
const AVERAGE: u32 = 12u;
const HALF_CIRCLE: u32 = 13u;

@group(0) @binding(0) var<storage, read> queries: array<Query>;
@group(0) @binding(1) var<storage, read_write> answers: array<vec4f>;
@group(0) @binding(2) var<uniform> axes: TableAxes;
@group(0) @binding(3) var table_c: texture_2d<u32>;
@group(0) @binding(4) var table_h_tt: texture_2d<f32>;
@group(0) @binding(5) var table_h_trt: texture_2d<f32>;
@group(0) @binding(6) var lobes_tt: texture_2d<u32>;
@group(0) @binding(7) var lobes_trt: texture_2d<u32>;
@group(0) @binding(8) var<storage, read> optics: array<Shading>;
@group(0) @binding(9) var averages: texture_2d<f32>;

// C_k as Tables::c_k answers it.
fn probe_c(k: u32, lambda_p: f32, phi: f32) -> f32 {
    let kappa = 2.0 / (lambda_p * lambda_p);
    let scale = c_0(kappa);
    if k == 0u {
        return scale;
    }
    return c_from_b(sample_c(table_c, axes, kappa, abs(cos(0.5 * phi))), min(k, 6u), scale);
}

// H_0, H_2, H_4, H_6 as Tables::h answers them.
fn probe_h(mode: u32, eta: f32, theta_d: f32) -> vec4f {
    let row = table_cell(axes.h_rows, eta);
    let cos_theta_d = max(cos(theta_d), 0.0);
    if mode == 2u {
        return sample_h(table_h_trt, axes, row, eta, cos_theta_d);
    }
    return sample_h(table_h_tt, axes, row, eta, cos_theta_d);
}

fn azimuthal_by_paper(q: Query) -> vec3f {
    let kappa = 2.0 / (q.x * q.x);
    let at = inclination(q.z);
    let lag = lag_between(q.view.cos_phi, q.view.sin_phi, q.light.cos_phi, q.light.sin_phi);
    let row = table_cell(axes.h_rows, q.fibre.eta);
    if q.mode == 0u {
        return vec3f(paper_azimuthal_r(kappa, lag, at, q.fibre, axes, table_c));
    }
    if q.mode == 1u {
        return paper_azimuthal_tt(kappa, lag, at, q.fibre, row, axes, table_h_tt);
    }
    return paper_azimuthal_trt(kappa, lag, at, q.fibre, row, axes, table_h_trt);
}

fn single_by_paper(q: Query) -> vec3f {
    let light = LightInFrame(q.light, q.x);
    if q.mode == 3u {
        return paper_single_scattering(
            light, q.view, q.fibre, axes, table_c, table_h_tt, table_h_trt
        );
    }
    return paper_single_scattering_mode(
        q.mode, light, q.view, q.fibre, axes, table_c, table_h_tt, table_h_trt
    );
}

fn azimuthal_by_lobes(q: Query, shading: Shading) -> vec3f {
    let kappa = 2.0 / (q.x * q.x);
    let at = inclination(q.z);
    let lag = lag_between(q.view.cos_phi, q.view.sin_phi, q.light.cos_phi, q.light.sin_phi);
    if q.mode == 0u {
        return vec3f(azimuthal_r(kappa, lag, at, shading.reflectance, axes, table_c));
    }
    if q.mode == 1u {
        let lobes = sample_row(lobes_tt, shading.tt, at.cos_theta_d);
        return azimuthal_tt(kappa, lag, lobes);
    }
    if is_elliptic(shading.fibre) {
        // As two nodes of the outer integral weigh it.
        let elliptic = elliptic_lag(q.view, q.light, lag);
        let u = 0.70710677;
        let first = azimuthal_elliptic(kappa, elliptic, at.cos_theta_d, -u, shading, lobes_trt);
        let second = azimuthal_elliptic(kappa, elliptic, at.cos_theta_d, u, shading, lobes_trt);
        return 0.5 * (first + second);
    }
    let lobes = sample_lobes(lobes_trt, shading.trt, shading.fibre.eta, at.cos_theta_d);
    // None of model marschner.
    let further = further_orders(shading.fibre, at.cos_theta_d);
    return azimuthal_trt(kappa, lag, lobes) + bessel_i0e_fast(kappa) * further;
}

fn single_by_lobes(q: Query, shading: Shading) -> vec3f {
    let light = LightInFrame(q.light, q.x);
    if q.mode == 3u {
        return single_scattering(light, q.view, shading, axes, table_c, lobes_tt, lobes_trt);
    }
    return single_scattering_mode(
        q.mode, light, q.view, shading, axes, table_c, lobes_tt, lobes_trt
    );
}

fn global_by_lobes(q: Query, shading: Shading) -> vec3f {
    if q.mode == 3u {
        return global_scattering(q.light, q.view, q.x, shading, lobes_tt, lobes_trt);
    }
    return global_scattering_mode(q.mode, q.light, q.view, q.x, shading, lobes_tt, lobes_trt);
}

fn average_by_name(q: Query) -> vec3f {
    let at = sample_averages(averages, q.optics, q.x);
    if q.mode == 0u {
        return at.a_f;
    }
    if q.mode == 1u {
        return sqrt(at.beta_f_2);
    }
    if q.mode == 2u {
        return at.attenuation_b;
    }
    if q.mode == 3u {
        return at.shift_b;
    }
    return sqrt(at.width_b_2);
}

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&queries) {
        return;
    }
    let q = queries[id.x];
    var answer = vec4f(0.0);
    switch q.function {
        case TABLE_C: {
            answer.x = probe_c(q.mode, q.x, q.y);
        }
        case TABLE_H: {
            answer = probe_h(q.mode, q.x, q.y);
        }
        case AZIMUTHAL: {
            if q.scheme == PAPER {
                answer = vec4f(azimuthal_by_paper(q), 0.0);
            } else {
                answer = vec4f(azimuthal_by_lobes(q, optics[q.optics]), 0.0);
            }
        }
        case SINGLE: {
            if q.scheme == PAPER {
                answer = vec4f(single_by_paper(q), 0.0);
            } else {
                answer = vec4f(single_by_lobes(q, optics[q.optics]), 0.0);
            }
        }
        case SPECIAL: {
            let pair = erf_pair(q.x);
            answer = vec4f(pair.gauss, pair.erf, bessel_i0e(q.y), bessel_i1e(q.y));
        }
        case CIRCULAR_GAUSSIAN: {
            let product = product_integral(q.x, q.y, q.z);
            let lobe = lobe_integral(q.x, q.y, q.z * q.z);
            answer = vec4f(product, c_0(q.x), lobe, bessel_i0e_fast(q.x));
        }
        case FRESNEL: {
            answer = vec4f(
                paper_transmittance_dielectric(q.x, q.y), paper_transmittance_schlick(q.x, q.y), 0.0, 0.0
            );
        }
        case OUTER_NODE: {
            let mode = min(q.mode, 2u);
            let alpha = q.fibre.alpha[mode];
            let rule = outer_rule(q.light.theta, q.x, q.view.theta, alpha, q.fibre.beta[mode]);
            let node = outer_node(rule, GAUSS_HERMITE[min(u32(q.y), 35u)]);
            answer = vec4f(node.theta_i, node.weight, rule.ln_bound, rule.spread);
        }
        case GLOBAL: {
            answer = vec4f(global_by_lobes(q, optics[q.optics]), 0.0);
        }
        case LOCAL: {
            answer = vec4f(local_scattering(q.light, q.view, q.x, averages, q.optics), 0.0);
        }
        case DIRECT_LOCAL: {
            let light = LightInFrame(q.light, q.x);
            answer = vec4f(direct_local_scattering(light, q.view, averages, q.optics), 0.0);
        }
        case AVERAGE: {
            answer = vec4f(average_by_name(q), 0.0);
        }
        case HALF_CIRCLE: {
            answer.x = half_circle(q.x, q.y);
            answer.y = mean_cosine(q.z, max(cos(q.z), 0.0), q.w);
        }
        default: {
            let d = direction_in_frame(vec3f(q.x, q.y, q.z));
            answer = vec4f(d.theta, d.cos_theta, d.cos_phi, d.sin_phi);
        }
    }
    answers[id.x] = answer;
}
