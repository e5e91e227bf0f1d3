//! The tables of a file that the mathematics reads.

use strandlight_formats::{Table, TableFile};
use strandlight_scattering::fresnel::{Fresnel, UnknownFresnel};
use strandlight_scattering::table_layout;

/// Why a table cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// A table is not in the file.
    #[error("there is no table {name}")]
    Missing {
        /// Its name.
        name: &'static str,
    },
    /// A table has other axes or channels than this program reads.
    #[error("table {table} has {what} {found}, not {expected}")]
    Layout {
        /// Name of the table.
        table: String,
        /// `axes` or `channels`.
        what: &'static str,
        /// What the file has.
        found: String,
        /// What is read.
        expected: String,
    },
    /// The Fresnel term is unknown.
    #[error(transparent)]
    Fresnel(#[from] UnknownFresnel),
    /// The renderer cannot read the tables.
    #[error(transparent)]
    Shading(#[from] strandlight_scene::tables::ShadingTablesError),
}

/// The Fresnel term that a file's H tables hold.
///
/// # Errors
/// [`TableError::Fresnel`].
pub fn fresnel_of(file: &TableFile) -> Result<Fresnel, TableError> {
    Ok(file.fresnel.parse()?)
}

/// Names of the axes of `C` (`None`) or of an H table.
pub(super) fn axis_names(h_table: Option<Fresnel>) -> [&'static str; 2] {
    match h_table {
        None => table_layout::C_AXIS_NAMES,
        Some(Fresnel::Dielectric) => table_layout::H_AXIS_NAMES_DIELECTRIC,
        Some(Fresnel::Schlick) => table_layout::H_AXIS_NAMES_SCHLICK,
    }
}

/// The table `name`, with the axis names and channels this program reads; sizes, ranges and
/// spacings may differ from the default.
pub(super) fn find_table<'a>(
    file: &'a TableFile,
    name: &'static str,
    h_table: Option<Fresnel>,
) -> Result<&'a Table, TableError> {
    let table = file.table(name).ok_or(TableError::Missing { name })?;
    let axes: Vec<&str> = table.axes.iter().map(|axis| axis.name.as_str()).collect();
    let channels: Vec<&str> = table.channels.iter().map(String::as_str).collect();
    let expected_channels: &[&str] = match h_table {
        None => &table_layout::C_CHANNELS,
        Some(_) => &table_layout::H_CHANNELS,
    };
    let check = |what, found: &[&str], expected: &[&str]| {
        if found == expected {
            return Ok(());
        }
        Err(TableError::Layout {
            table: name.to_owned(),
            what,
            found: found.join(" "),
            expected: expected.join(" "),
        })
    };
    check("axes", &axes, &axis_names(h_table))?;
    check("channels", &channels, expected_channels)?;
    let n_floats = table
        .axes
        .iter()
        .map(|axis| axis.count as usize)
        .product::<usize>()
        * table.channels.len();
    if table.data.len() != n_floats || table.axes.iter().any(|axis| axis.count < 2) {
        return Err(TableError::Layout {
            table: name.to_owned(),
            what: "data",
            found: format!("{} floats", table.data.len()),
            expected: format!("{n_floats} floats on axes of at least 2 texels"),
        });
    }
    Ok(table)
}
