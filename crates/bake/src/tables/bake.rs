//! Filling the tables.

use rayon::prelude::*;
use strandlight_formats::{Axis as FileAxis, Table, TableFile, TableInfo};
use strandlight_scattering::axis::Axis;
use strandlight_scattering::c_integrals::BernsteinRule;
use strandlight_scattering::closed_form::{
    PackedShares, TableAxes, pack_shares, sample_c, sample_h, table_cell,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::h_moments::MomentRule;
use strandlight_scattering::table_layout::{
    C_CHANNELS, C_COLUMNS, C_FROM_B, C_ROWS, H_CHANNELS, H_COLUMNS, H_ROWS, theta_d_from_h_column,
};

use super::layout::axis_names;
use super::lobes::{N_LOBE_STEPS, REPORT_RANGE, bake_lobes, file_tables, lobe_errors, parameters};
use strandlight_scene::progress::Progress;

/// Nodes of the moments' rule: 1e-14 on the grid of the default axes.
const MOMENT_NODES: usize = 40;

/// Errors of the H tables count up to this theta_d; beyond, the lobes fade out.
pub(super) const H_THETA_D_MAX: f64 = 1.5;

/// Steps of progress that [`bake_tables`] makes.
pub const N_STEPS: u64 = C_ROWS.count as u64 + H_ROWS.count as u64 + N_LOBE_STEPS;

/// Bakes all tables on their default axes: those of [`bake_c_and_h`] and the lobes of TT and TRT.
///
/// The errors of the lobes, measured on random fibres ([`lobe_errors`]), are recorded as
/// parameters; their `max_interpolation_error` is the worst of them, fit and interpolation
/// together. Everything runs in parallel on the current rayon pool; the result does not depend on
/// the number of threads. `progress` gets [`N_STEPS`] steps.
pub fn bake_tables(fresnel: Fresnel, progress: &Progress) -> TableFile {
    let mut file = bake_c_and_h(fresnel, progress);
    file.info.parameters.push((
        "lobes max_interpolation_error".to_owned(),
        format!("worst relative RMSE over phi of the inner integral, {REPORT_RANGE}"),
    ));
    for lobes in bake_lobes(fresnel, progress) {
        let errors = lobe_errors(&lobes);
        let worst = errors.iter().map(|e| e.worst).fold(0.0, f64::max);
        file.info.parameters.extend(parameters(&errors));
        file.tables.extend(file_tables(&lobes, worst));
    }
    file
}

/// Those of `file` that drawing reads: all but `H_TT` and `H_TRT`, which only the paper's scheme
/// does.
pub fn lean(mut file: TableFile) -> TableFile {
    file.tables.retain(|table| !table.name.starts_with("H_"));
    let parameters = &mut file.info.parameters;
    parameters.retain(|(name, _)| !name.starts_with("H "));
    file
}

/// Bakes `C`, `H_TT` and `H_TRT` on their default axes: all that the paper's scheme reads.
///
/// `C` holds Gauss-Legendre quadratures of the positive basis, split at the kink; H
/// Gauss-Legendre quadratures in `s`, `h = cos(pi/2 s^2)`, for both Fresnel terms. Each table's
/// `max_interpolation_error` is measured at the middle of every cell, sampled in single precision
/// by the renderer's functions: for `C`, packed, the largest
/// `|error of C_k| / C_0` over k, for H the largest absolute error where theta_d <= 1.5. Rows run
/// in parallel as in [`bake_tables`].
pub fn bake_c_and_h(fresnel: Fresnel, progress: &Progress) -> TableFile {
    let (h_tt, h_trt) = bake_h(fresnel, progress);
    let tables = vec![bake_c(progress), h_tt, h_trt];
    let parameters = [
        ("fresnel", fresnel.name()),
        (
            "C max_interpolation_error",
            "of C_k over C_0, k = 1..6, cell centres",
        ),
        (
            "H max_interpolation_error",
            "absolute, theta_d <= 1.5, cell centres",
        ),
    ];
    TableFile {
        fresnel: fresnel.name().to_owned(),
        tables,
        info: TableInfo {
            parameters: parameters
                .map(|(name, value)| (name.to_owned(), value.to_owned()))
                .to_vec(),
            ..TableInfo::default()
        },
    }
}

/// Values at the texel centres, rounded, and at the middles of the cells, row by row.
struct Grid<const N: usize> {
    texels: Vec<[f32; N]>,
    middles: Vec<[f64; N]>,
}

/// Evaluates `f(row value, column value)` on the texel centres and the cell middles.
fn evaluate<const N: usize>(
    rows: &Axis,
    columns: &Axis,
    progress: &Progress,
    f: impl Fn(f64, f64) -> [f64; N] + Sync,
) -> Grid<N> {
    let values = |axis: &Axis, shift: f64, count: u32| -> Vec<f64> {
        let last = f64::from(axis.count - 1);
        (0..count)
            .map(|ix| axis.value_from_unit((f64::from(ix) + shift) / last))
            .collect()
    };
    let row_centres = values(rows, 0.0, rows.count);
    let row_middles = values(rows, 0.5, rows.count - 1);
    let column_centres = values(columns, 0.0, columns.count);
    let column_middles = values(columns, 0.5, columns.count - 1);
    let by_row: Vec<Grid<N>> = (0..row_centres.len())
        .into_par_iter()
        .map(|ix| {
            let texels = column_centres
                .iter()
                .map(|&column| f(row_centres[ix], column).map(|value| value as f32))
                .collect();
            let middles = match row_middles.get(ix) {
                Some(&row) => column_middles
                    .iter()
                    .map(|&column| f(row, column))
                    .collect(),
                None => Vec::new(),
            };
            progress.advance(1);
            Grid { texels, middles }
        })
        .collect();
    let mut grid = Grid {
        texels: Vec::with_capacity(row_centres.len() * column_centres.len()),
        middles: Vec::with_capacity(row_middles.len() * column_middles.len()),
    };
    for row in by_row {
        grid.texels.extend(row.texels);
        grid.middles.extend(row.middles);
    }
    grid
}

impl<const N: usize> Grid<N> {
    /// Largest `measure(row value, column value, exact)` over the middles of all cells.
    fn interpolation_error(
        &self,
        [rows, columns]: [&Axis; 2],
        measure: impl Fn(f64, f64, &[f64; N]) -> f64 + Sync,
    ) -> f64 {
        let middle = |axis: &Axis, ix: usize| {
            axis.value_from_unit((ix as f64 + 0.5) / f64::from(axis.count - 1))
        };
        let n_middles = columns.count as usize - 1;
        let errors = self.middles.par_iter().enumerate().map(|(ix, exact)| {
            let (row, column) = (ix / n_middles, ix % n_middles);
            measure(middle(rows, row), middle(columns, column), exact)
        });
        errors.reduce(|| 0.0, f64::max)
    }
}

/// The default axes as the renderer has them.
fn table_axes(fresnel: Fresnel) -> TableAxes {
    TableAxes {
        c_rows: C_ROWS.into(),
        c_columns: C_COLUMNS.into(),
        h_rows: H_ROWS.into(),
        h_columns: H_COLUMNS.into(),
        schlick: u32::from(fresnel == Fresnel::Schlick),
        padding_0: 0,
        padding_1: 0,
        padding_2: 0,
    }
}

/// The shares of `C` and their exact values between.
fn c_grid(rows: &Axis, columns: &Axis, progress: &Progress) -> Grid<9> {
    let rule = BernsteinRule::default();
    evaluate(rows, columns, progress, |kappa, cos_half_phi| {
        rule.shares(kappa, cos_half_phi)
    })
}

/// The `max_interpolation_error` of a `C` of these texels.
fn c_interpolation_error(
    grid: &Grid<9>,
    axes: &TableAxes,
    by: [&Axis; 2],
    texels: &[[f32; 8]],
) -> f64 {
    let packed: Vec<PackedShares> = texels.iter().map(pack_shares).collect();
    grid.interpolation_error(by, |kappa, cos_half, exact| {
        let found = sample_c(&packed, axes, kappa as f32, cos_half as f32);
        c_error(std::array::from_fn(|i| match i {
            0 => 0.0,
            i => f64::from(found[i - 1]) - exact[i],
        }))
    })
}

fn bake_c(progress: &Progress) -> Table {
    let grid = c_grid(&C_ROWS, &C_COLUMNS, progress);
    let texels: Vec<[f32; 8]> = grid.texels.iter().map(|&[_, shares @ ..]| shares).collect();
    // C has no Fresnel term; either will do.
    let axes = table_axes(Fresnel::Dielectric);
    let error = c_interpolation_error(&grid, &axes, [&C_ROWS, &C_COLUMNS], &texels);
    let data = texels.as_flattened().to_vec();
    Table {
        name: "C".to_owned(),
        axes: file_axes([&C_ROWS, &C_COLUMNS], axis_names(None)),
        channels: C_CHANNELS.map(str::to_owned).to_vec(),
        data,
        max_interpolation_error: error as f32,
    }
}

/// Largest error of `C_k / C_0`, k > 0, that errors of the shares make.
fn c_error(shares: [f64; 9]) -> f64 {
    C_FROM_B
        .iter()
        .skip(1)
        .map(|row| {
            row.iter()
                .zip(shares)
                .map(|(m, b)| m * b)
                .sum::<f64>()
                .abs()
        })
        .fold(0.0, f64::max)
}

/// H of TT in channels 0..4 and of TRT in 4..8, and the exact values between.
fn h_grid(fresnel: Fresnel, rows: &Axis, columns: &Axis, progress: &Progress) -> Grid<8> {
    let rule = MomentRule::new(MOMENT_NODES);
    evaluate(rows, columns, progress, |eta, column| {
        let moments = rule.moments(fresnel, eta, column);
        let (tt, trt) = (moments.tt, moments.trt);
        [tt[0], tt[1], tt[2], tt[3], trt[0], trt[1], trt[2], trt[3]]
    })
}

/// The `max_interpolation_error` of an H table of these texels; `first` is its first channel in
/// the grid.
fn h_interpolation_error(
    grid: &Grid<8>,
    axes: &TableAxes,
    by: [&Axis; 2],
    texels: &[[f32; 4]],
    first: usize,
) -> f64 {
    grid.interpolation_error(by, |eta, column, exact| {
        let theta_d = theta_d_from_h_column(eta, column, axes.schlick == 0);
        if theta_d > H_THETA_D_MAX {
            return 0.0;
        }
        let (eta, cos_theta_d) = (eta as f32, theta_d.cos() as f32);
        let row = table_cell(&axes.h_rows, eta);
        let found = sample_h(texels, axes, row, eta, cos_theta_d);
        let errors = found.iter().zip(&exact[first..]);
        errors.fold(0.0, |worst, (found, exact)| {
            worst.max((f64::from(*found) - exact).abs())
        })
    })
}

fn bake_h(fresnel: Fresnel, progress: &Progress) -> (Table, Table) {
    let by = [&H_ROWS, &H_COLUMNS];
    let grid = h_grid(fresnel, by[0], by[1], progress);
    let axes = table_axes(fresnel);
    let table = |name: &str, first: usize| {
        let texels: Vec<[f32; 4]> = grid
            .texels
            .iter()
            .map(|texel| std::array::from_fn(|i| texel[first + i]))
            .collect();
        let error = h_interpolation_error(&grid, &axes, by, &texels, first);
        Table {
            name: name.to_owned(),
            axes: file_axes(by, axis_names(Some(fresnel))),
            channels: H_CHANNELS.map(str::to_owned).to_vec(),
            data: texels.as_flattened().to_vec(),
            max_interpolation_error: error as f32,
        }
    };
    (table("H_TT", 0), table("H_TRT", 4))
}

/// The `max_interpolation_error` of `C` and of H of TT and TRT, in this order, measured again on
/// the texels of `tables`, which are laid out as their bake lays them out.
pub(super) fn measure_again(fresnel: Fresnel, c: &Table, h: &[&Table]) -> Vec<f64> {
    let silent = Progress::silent();
    let axes_of = |table: &Table| [0, 1].map(|ix| table.axes[ix].unnamed());
    let mut axes = table_axes(fresnel);
    let [rows, columns] = axes_of(c);
    (axes.c_rows, axes.c_columns) = (rows.into(), columns.into());
    let texels: Vec<[f32; 8]> = bytemuck::pod_collect_to_vec(&c.data);
    let grid = c_grid(&rows, &columns, &silent);
    let mut errors = vec![c_interpolation_error(
        &grid,
        &axes,
        [&rows, &columns],
        &texels,
    )];
    for (ix, table) in h.iter().enumerate() {
        let [rows, columns] = axes_of(table);
        (axes.h_rows, axes.h_columns) = (rows.into(), columns.into());
        let grid = h_grid(fresnel, &rows, &columns, &silent);
        let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&table.data);
        let by = [&rows, &columns];
        errors.push(h_interpolation_error(&grid, &axes, by, &texels, 4 * ix));
    }
    errors
}

fn file_axes(axes: [&Axis; 2], names: [&str; 2]) -> Vec<FileAxis> {
    axes.iter()
        .zip(names)
        .map(|(axis, name)| FileAxis::new(name, axis))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_thread_count_changes_nothing() {
        let bake = |n| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(n)
                .build()
                .unwrap()
                .install(|| bake_tables(Fresnel::Dielectric, &Progress::silent()))
        };
        assert!(bake(1) == bake(3));
    }

    #[test]
    fn interpolation_keeps_its_promise() {
        for (fresnel, h_error) in [(Fresnel::Dielectric, 7e-4), (Fresnel::Schlick, 2.5e-4)] {
            let file = bake_c_and_h(fresnel, &Progress::silent());
            file.validate().unwrap();
            let errors: Vec<f32> = file
                .tables
                .iter()
                .map(|table| table.max_interpolation_error)
                .collect();
            println!("{}: C, H_TT, H_TRT {errors:?}", fresnel.name());
            assert!(errors[0] < 2.5e-4 && errors[0] > 1e-5);
            assert!(errors[1] < h_error && errors[2] < h_error);
        }
    }

    /// Largest `measure(row, column, interpolated - exact)`, cell by cell: at the middle, the mean
    /// of the corners, which needs no sampler of other axes.
    fn error_of_means<const N: usize>(
        grid: &Grid<N>,
        n_columns: usize,
        measure: impl Fn(usize, [f64; N]) -> f64,
    ) -> f64 {
        let mut worst = 0.0f64;
        for (ix, exact) in grid.middles.iter().enumerate() {
            let (row, column) = (ix / (n_columns - 1), ix % (n_columns - 1));
            let corner = row * n_columns + column;
            let corners = [0, 1, n_columns, n_columns + 1].map(|n| grid.texels[corner + n]);
            let error = std::array::from_fn(|i| {
                let sum: f64 = corners.iter().map(|texel| f64::from(texel[i])).sum();
                0.25 * sum - exact[i]
            });
            worst = worst.max(measure(column, error));
        }
        worst
    }

    #[test]
    fn the_papers_axes_are_worse_at_the_same_size() {
        use strandlight_scattering::axis::Spacing;
        use strandlight_scattering::table_layout::h_column;
        let axis = |min, max, count, spacing| Axis {
            min,
            max,
            count,
            spacing,
        };
        let silent = Progress::silent();
        // lambda_p logarithmic, 128; phi linear, 64.
        let rows = axis(0.001, 10.0, 128, Spacing::Log);
        let columns = axis(0.0, std::f64::consts::PI, 64, Spacing::Linear);
        let rule = BernsteinRule::default();
        let grid = evaluate(&rows, &columns, &silent, |lambda_p, phi| {
            rule.shares(2.0 / (lambda_p * lambda_p), (0.5 * phi).cos())
        });
        let c = error_of_means(&grid, 64, |_, b| c_error(b));
        // eta logarithmic, 128; theta_d linear, 64, counted up to 1.5.
        let rows = axis(1.0, 10.0, 128, Spacing::Log);
        let columns = axis(0.0, std::f64::consts::FRAC_PI_2, 64, Spacing::Linear);
        let rule = MomentRule::new(MOMENT_NODES);
        let [dielectric, schlick] = Fresnel::ALL.map(|fresnel| {
            let grid = evaluate(&rows, &columns, &silent, |eta, theta_d| {
                let column = h_column(eta, theta_d.cos(), fresnel == Fresnel::Dielectric);
                rule.moments(fresnel, eta, column).tt
            });
            let counted = |column: usize| columns.value_from_unit((column as f64 + 0.5) / 63.0);
            error_of_means(&grid, 64, |column, error| {
                if counted(column) > H_THETA_D_MAX {
                    return 0.0;
                }
                error.iter().fold(0.0, |worst: f64, e| worst.max(e.abs()))
            })
        });
        println!(
            "the paper's axes: C {c:.2e}, H dielectric {dielectric:.2e}, Schlick {schlick:.2e}"
        );
        assert!(c > 2.5e-3 && dielectric > 0.1 && schlick > 1.5e-3);
    }
}
