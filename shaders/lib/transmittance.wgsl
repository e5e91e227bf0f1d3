// What hair leaves of a light: records of the sweep and the shares made of them.
// Twin: crates/scattering/src/closed_form/transmittance.rs.

// Exponents below 1 at which a record holds shares.
const P_1: f32 = 0.25;
const P_2: f32 = 0.0625;
// Factor of shares in half floats.
const RECORD_SCALE: f32 = 32768.0;
// Least share that is distinguished from none.
const LEAST_SHARE: f32 = 2e-9;

// E exp(-p tau) at p = 1, P_1, P_2, and the sine of the inclination to the crossed fibres.
struct ShadowRecord {
    shares: vec3f,
    sin_theta: f32,
}

fn pack_record(record: ShadowRecord) -> vec2u {
    let shares = record.shares * RECORD_SCALE;
    return vec2u(pack2x16float(shares.xy), pack2x16float(vec2f(shares.z, record.sin_theta)));
}

fn unpack_record(packed: vec2u) -> ShadowRecord {
    let a = unpack2x16float(packed.x);
    let b = unpack2x16float(packed.y);
    return ShadowRecord(vec3f(a, b.x) / RECORD_SCALE, b.y);
}

// Shares after half a step of optical depth, and what is gathered of depth times sin^2.
fn pass_through(entering: vec4f, depth: f32, sin_2: f32) -> vec4f {
    return vec4f(entering.xyz * shares_of_ray(exp(-P_2 * depth)), entering.w + depth * sin_2);
}

// Shares of a single ray at p = 1, P_1 and P_2, of which the last is at_p_2.
fn shares_of_ray(at_p_2: f32) -> vec3f {
    let squared = at_p_2 * at_p_2;
    let at_p_1 = squared * squared;
    return vec3f((at_p_1 * at_p_1) * (at_p_1 * at_p_1), at_p_1, at_p_2);
}

// Effective optical depth of a share at P_2.
fn depth_of_share(share: f32) -> f32 {
    return -log(max(share, 1e-30)) / P_2;
}

// Adds direction k (from 0) of n to the sum of those before it.
fn add_to_record(sum: ShadowRecord, here: vec4f, k: f32, n: f32) -> ShadowRecord {
    let depth = depth_of_share(here.z);
    let depth_before = select(0.0, k * depth_of_share(sum.shares.z * n / max(k, 1.0)), k > 0.0);
    let sin_2_depth = here.w + depth_before * sum.sin_theta * sum.sin_theta;
    let sin_2 = clamp(sin_2_depth / max(depth + depth_before, 1e-6), 0.0, 1.0);
    return ShadowRecord(sum.shares + here.xyz / n, sqrt(sin_2));
}

// 1 / (-ln T(p) / p), the inverse of the effective depth, and its slope in p.
struct Reach {
    value: vec3f,
    slope: vec3f,
}

fn reach_at(record: ShadowRecord, p: vec3f) -> Reach {
    let exponents = vec3f(1.0, P_1, P_2);
    let depths = -log(max(record.shares, vec3f(LEAST_SHARE)));
    let reach = exponents / max(depths, 1e-6 * exponents);
    let slope_low = (reach.y - reach.z) / (P_1 - P_2);
    let slope_high = (reach.x - reach.y) / (1.0 - P_1);
    let bend = (slope_high - slope_low) / (1.0 - P_2);
    let slope = slope_low + (p - P_1) * bend;
    let value = reach.z + (p - P_2) * slope;
    return Reach(max(value, vec3f(1e-3)), slope + (p - P_2) * bend);
}

// E exp(-p tau), p in 0.03..=1 for each channel.
fn transmitted(record: ShadowRecord, p: vec3f) -> vec3f {
    let share = exp(-p / reach_at(record, p).value);
    return clamp(share, vec3f(min(record.shares.x, 1.0)), vec3f(1.0));
}

// Mean number of forward scatterings of the light that underwent at least one and was left by
// factors of 1 - p; share is transmitted(record, p).
fn forward_events(record: ShadowRecord, p: vec3f, share: vec3f) -> vec3f {
    let a_f = 1.0 - p;
    let reach = reach_at(record, p);
    let depth = (1.0 - p * reach.slope / reach.value) / reach.value;
    let events = a_f * share * depth / max(share - record.shares.x, vec3f(1e-6));
    return clamp(events, vec3f(1.0), 1.0 + a_f * (16.0 * depth_of_share(record.shares.z)));
}
