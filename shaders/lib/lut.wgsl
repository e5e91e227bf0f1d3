// LUTs: what they take, and which of their samples. Twin: crates/scene/src/lut.rs, which explains
// the encodings.
// #import lib/tone

const LUT_LOG2: u32 = 0u;
const LUT_SRGB: u32 = 1u;
const LUT_LINEAR: u32 = 2u;

// Linear radiance as a LUT takes it.
fn encoded(v: f32, input: u32) -> f32 {
    if input == LUT_SRGB {
        return srgb_from_linear(clamp(v, 0.0, 1.0));
    }
    if input == LUT_LINEAR {
        return clamp(v, -1e30, 1e30);
    }
    // Ten stops on either side of middle grey.
    return clamp((log2(clamp(v, 1e-10, 1e10) / 0.18) + 10.0) / 20.0, 0.0, 1.0);
}

// Where v lies among samples 0 to size - 1 at inputs from low to high.
fn place(v: f32, low: f32, high: f32, size: u32) -> f32 {
    return clamp((v - low) / (high - low), 0.0, 1.0) * f32(size - 1u);
}

// Four samples of a grid and their weights.
struct Tetrahedron {
    corners: vec4u,
    weights: vec4f,
}

// The four samples of a grid around the place `at`, in units of samples, and their weights, which
// add up to 1.
fn tetrahedron(at: vec3f, size: u32) -> Tetrahedron {
    let base = min(vec3u(at), vec3u(size - 2u));
    let f = at - vec3f(base);
    let step = vec3u(1u, size, size * size);
    // Steps and fractions along the axes: that of the largest fraction first, then the middle one.
    var order = step;
    var fractions = f;
    if f.x >= f.y {
        if f.y < f.z {
            if f.x >= f.z {
                order = step.xzy;
                fractions = f.xzy;
            } else {
                order = step.zxy;
                fractions = f.zxy;
            }
        }
    } else if f.y < f.z {
        order = step.zyx;
        fractions = f.zyx;
    } else if f.x >= f.z {
        order = step.yxz;
        fractions = f.yxz;
    } else {
        order = step.yzx;
        fractions = f.yzx;
    }
    let corner = base.x + size * (base.y + size * base.z);
    let second = corner + order.x;
    let third = second + order.y;
    return Tetrahedron(
        vec4u(corner, second, third, third + order.z),
        vec4f(
            1.0 - fractions.x,
            fractions.x - fractions.y,
            fractions.y - fractions.z,
            fractions.z));
}
