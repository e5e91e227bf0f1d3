// The baked tables. H textures are rgba32float, C is rgba32uint with eight unorm16 a texel; they
// are read by textureLoad and mixed by hand, so that the weights are exact. Twin: crates/scattering/src/closed_form/tables.rs.

const SPACING_LINEAR: u32 = 0u;
const SPACING_LOG: u32 = 1u;
const SPACING_INVERSE_SQRT: u32 = 2u;
const SPACING_ROOT_SQUARE: u32 = 3u;
const SPACING_RECIPROCAL: u32 = 4u;
const SPACING_CONCAVE: u32 = 5u;

// One axis: texel coordinate = (warp(x) - warp_min) * scale, 0..=last.
struct TableAxis {
    min: f32,
    max: f32,
    warp_min: f32,
    scale: f32,
    last: f32,
    spacing: u32,
    padding_0: u32,
    padding_1: u32,
}

struct TableAxes {
    c_rows: TableAxis,
    c_columns: TableAxis,
    h_rows: TableAxis,
    h_columns: TableAxis,
    schlick: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
}

// Warp of an axis, by its code.
fn table_warp(spacing: u32, x: f32) -> f32 {
    if spacing == SPACING_INVERSE_SQRT {
        let t = 1.0 / sqrt(1.0 + x);
        return 0.5 * (t + sqrt(t));
    }
    if spacing == SPACING_ROOT_SQUARE {
        return 0.6 * sqrt(x) + 0.4 * x * x;
    }
    if spacing == SPACING_RECIPROCAL {
        let r = 1.0 - 1.0 / x;
        return 0.5 * (r + r * r);
    }
    if spacing == SPACING_CONCAVE {
        return x * (1.3 - 0.3 * x);
    }
    if spacing == SPACING_LOG {
        return log(x);
    }
    return x;
}

// Two neighbouring texels of an axis and the weight of the second.
struct Cell {
    first: u32,
    fraction: f32,
}

// b_1..b_4 and b_5..b_8.
struct CShares {
    first: vec4f,
    second: vec4f,
}

// The cell of `axis` that `x` falls into; the ends are clamped.
fn table_cell(axis: TableAxis, x: f32) -> Cell {
    let warped = table_warp(axis.spacing, min(max(x, axis.min), axis.max));
    let at = min(max((warped - axis.warp_min) * axis.scale, 0.0), axis.last);
    let first = u32(min(at, axis.last - 1.0));
    return Cell(first, at - f32(first));
}

// Column variable of the H tables: eta / eta' for the dielectric term, cos(theta_d) for
// Schlick's. Twin: h_column_f32 in crates/scattering/src/table_layout.rs.
fn h_column(eta: f32, cos_theta_d: f32, dielectric: bool) -> f32 {
    let c = clamp(cos_theta_d, 0.0, 1.0);
    if !dielectric {
        return c;
    }
    let below = max((eta - 1.0) * (eta + 1.0) + c * c, 1e-12);
    return min(eta * c / sqrt(below), 1.0);
}

// H_0, H_2, H_4, H_6 from H_TT or H_TRT; columns along x, eta along y; `row` is its cell.
fn sample_h(
    table: texture_2d<f32>,
    axes: TableAxes,
    row: Cell,
    eta: f32,
    cos_theta_d: f32,
) -> vec4f {
    let column = table_cell(axes.h_columns, h_column(eta, cos_theta_d, axes.schlick == 0u));
    let at = vec2u(column.first, row.first);
    let top_0 = textureLoad(table, at, 0);
    let top_1 = textureLoad(table, at + vec2u(1u, 0u), 0);
    let bottom_0 = textureLoad(table, at + vec2u(0u, 1u), 0);
    let bottom_1 = textureLoad(table, at + vec2u(1u, 1u), 0);
    let top = top_0 + (top_1 - top_0) * column.fraction;
    let bottom = bottom_0 + (bottom_1 - bottom_0) * column.fraction;
    return top + (bottom - top) * row.fraction;
}

// Eight unorm16 of a texel.
fn unpack_shares(texel: vec4u) -> CShares {
    return CShares(
        vec4f(unpack2x16unorm(texel.x), unpack2x16unorm(texel.y)),
        vec4f(unpack2x16unorm(texel.z), unpack2x16unorm(texel.w)),
    );
}

// b_1..b_8 of the table C; |cos(phi/2)| along x, kappa along y.
fn sample_c(table: texture_2d<u32>, axes: TableAxes, kappa: f32, cos_half: f32) -> CShares {
    let row = table_cell(axes.c_rows, kappa);
    let column = table_cell(axes.c_columns, cos_half);
    let at = vec2u(column.first, row.first);
    let top_0 = unpack_shares(textureLoad(table, at, 0));
    let top_1 = unpack_shares(textureLoad(table, at + vec2u(1u, 0u), 0));
    let bottom_0 = unpack_shares(textureLoad(table, at + vec2u(0u, 1u), 0));
    let bottom_1 = unpack_shares(textureLoad(table, at + vec2u(1u, 1u), 0));
    let top_first = top_0.first + (top_1.first - top_0.first) * column.fraction;
    let top_second = top_0.second + (top_1.second - top_0.second) * column.fraction;
    let bottom_first = bottom_0.first + (bottom_1.first - bottom_0.first) * column.fraction;
    let bottom_second = bottom_0.second + (bottom_1.second - bottom_0.second) * column.fraction;
    return CShares(
        top_first + (bottom_first - top_first) * row.fraction,
        top_second + (bottom_second - top_second) * row.fraction,
    );
}

// C_k at a cell of the table, k in 1..=6; scale = C_0.
fn c_from_b(b: CShares, k: u32, scale: f32) -> f32 {
    let all = array<f32, 8>(
        b.first.x, b.first.y, b.first.z, b.first.w,
        b.second.x, b.second.y, b.second.z, b.second.w,
    );
    var binomial_ik = 1.0;
    var sum = 0.0;
    for (var i = k; i < 9u; i++) {
        sum += binomial_ik * all[i - 1u];
        binomial_ik *= (f32(i) + 1.0) / (f32(i) + 1.0 - f32(k));
    }
    return scale * sum / (binomial_ik * (9.0 - f32(k)) / 9.0);
}
