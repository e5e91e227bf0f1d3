// The baked tables. Textures are rgba32float, read by textureLoad and mixed by hand, so that the
// weights are exact. Twin: crates/scattering/src/closed_form/tables.rs.

const SPACING_LINEAR: u32 = 0u;
const SPACING_LOG: u32 = 1u;

// One axis: texel coordinate = (warp(x) - offset) * scale, clamped to 0..=last.
struct TableAxis {
    spacing: u32,
    offset: f32,
    scale: f32,
    last: f32,
}

struct TableAxes {
    c_lambda: TableAxis,
    c_phi: TableAxis,
    h_eta: TableAxis,
    h_theta_d: TableAxis,
    schlick: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
}

// Two neighbouring texels of an axis and the weight of the second.
struct Cell {
    first: u32,
    fraction: f32,
}

// b_1..b_4 and b_5, b_6.
struct CPair {
    first: vec4f,
    second: vec4f,
}

// The cell of `axis` that `x` falls into; the ends are clamped.
fn table_cell(axis: TableAxis, x: f32) -> Cell {
    var warped = x;
    if axis.spacing == SPACING_LOG {
        warped = log(max(x, 1e-30));
    }
    let at = clamp((warped - axis.offset) * axis.scale, 0.0, axis.last);
    let first = min(floor(at), axis.last - 1.0);
    return Cell(u32(first), at - first);
}

// H_0, H_2, H_4, H_6 from H_TT or H_TRT; x runs along theta_d, y along eta.
fn sample_h(table: texture_2d<f32>, axes: TableAxes, row: Cell, theta_d: f32) -> vec4f {
    let column = table_cell(axes.h_theta_d, abs(theta_d));
    let at = vec2u(column.first, row.first);
    let top_0 = textureLoad(table, at, 0);
    let top_1 = textureLoad(table, at + vec2u(1u, 0u), 0);
    let bottom_0 = textureLoad(table, at + vec2u(0u, 1u), 0);
    let bottom_1 = textureLoad(table, at + vec2u(1u, 1u), 0);
    let top = top_0 + (top_1 - top_0) * column.fraction;
    let bottom = bottom_0 + (bottom_1 - bottom_0) * column.fraction;
    return top + (bottom - top) * row.fraction;
}

// b_1..b_6 of the table C; two texels per phi along x, lambda' along y.
fn sample_c(table: texture_2d<f32>, axes: TableAxes, lambda_p: f32, phi: f32) -> CPair {
    let row = table_cell(axes.c_lambda, lambda_p);
    let column = table_cell(axes.c_phi, abs(phi));
    var pair: array<vec4f, 2>;
    for (var half = 0u; half < 2u; half++) {
        let at = vec2u(2u * column.first + half, row.first);
        let top_0 = textureLoad(table, at, 0);
        let top_1 = textureLoad(table, at + vec2u(2u, 0u), 0);
        let bottom_0 = textureLoad(table, at + vec2u(0u, 1u), 0);
        let bottom_1 = textureLoad(table, at + vec2u(2u, 1u), 0);
        let top = top_0 + (top_1 - top_0) * column.fraction;
        let bottom = bottom_0 + (bottom_1 - bottom_0) * column.fraction;
        pair[half] = top + (bottom - top) * row.fraction;
    }
    return CPair(pair[0], pair[1]);
}
