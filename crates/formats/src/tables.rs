//! Baked tables that describe their own axes.

use strandlight_scattering::axis::{self, Spacing};

use crate::error::{Error, Result};
use crate::input::tool_version;
use crate::validate::{finite, in_range, short_name};

/// One axis of a table: [`axis::Axis`] with a name. Files hold the name of the spacing.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Name of the variable, e.g. `lambda_p`, `phi`, `eta`, `theta_d`.
    pub name: String,
    /// Value at the first texel centre.
    pub min: f64,
    /// Value at the last texel centre.
    pub max: f64,
    /// Number of texels.
    pub count: u32,
    /// Placement of the centres between.
    pub spacing: Spacing,
}

impl Axis {
    /// The rule of all axes, as recorded in files: `u = i / (count - 1)` at the centre of texel
    /// i, so that the first centre stands at `min` and the last at `max`.
    pub const TEXEL_CENTRES: &str = "centres-at-both-ends";

    /// `axis`, called `name`.
    pub fn new(name: impl Into<String>, axis: &axis::Axis) -> Axis {
        Axis {
            name: name.into(),
            min: axis.min,
            max: axis.max,
            count: axis.count,
            spacing: axis.spacing,
        }
    }

    /// The axis without its name, to sample along.
    pub const fn unnamed(&self) -> axis::Axis {
        axis::Axis {
            min: self.min,
            max: self.max,
            count: self.count,
            spacing: self.spacing,
        }
    }
}

/// A table of float32 texels over one to four axes with up to 16 channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Unique name, e.g. `C`, `H_TT`, `lobes_TRT_shares`.
    pub name: String,
    /// Slowest-varying axis first: `[rows, columns]` or more.
    pub axes: Vec<Axis>,
    /// What each float of a texel is, fastest-varying of all.
    pub channels: Vec<String>,
    /// `[rows][columns][channels]`, in the order of the axes.
    pub data: Vec<f32>,
    /// Largest error found when baking, in the unit that the file's parameters name.
    pub max_interpolation_error: f32,
}

/// Everything about a table but its data.
#[derive(Clone, Debug, PartialEq)]
pub struct TableHeader {
    /// See [`Table::name`].
    pub name: String,
    /// See [`Table::axes`].
    pub axes: Vec<Axis>,
    /// See [`Table::channels`].
    pub channels: Vec<String>,
    /// See [`Table::max_interpolation_error`].
    pub max_interpolation_error: f32,
}

/// A `.tables` file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableFile {
    /// Fresnel term of all tables that hold one: `dielectric` or `schlick`.
    pub fresnel: String,
    /// All tables.
    pub tables: Vec<Table>,
    /// How they were made.
    pub info: TableInfo,
}

/// How tables were made.
#[derive(Clone, Debug, PartialEq)]
pub struct TableInfo {
    /// Program that baked them.
    pub tool_version: String,
    /// Parameters of the bake as name and value, in order.
    pub parameters: Vec<(String, String)>,
}

impl Default for TableInfo {
    fn default() -> Self {
        TableInfo {
            tool_version: tool_version(),
            parameters: Vec::new(),
        }
    }
}

/// Most texels along an axis: what every GPU takes as a texture size.
const MAX_AXIS_COUNT: u32 = 8192;
/// Most floats in a table: 256 MiB.
const MAX_FLOATS: u64 = 1 << 26;

impl TableHeader {
    /// Texture format of a texel: as many `rgba32float` texels side by side as the channels
    /// need, or single floats when the channels are no multiple of four.
    pub fn format(&self) -> String {
        match (self.channels.len() / 4, self.channels.len() % 4) {
            (1, 0) => "rgba32float".to_owned(),
            (n, 0) => format!("{n} x rgba32float"),
            (_, _) => format!("{} x r32float", self.channels.len()),
        }
    }

    /// Number of floats that the axes and channels ask for.
    ///
    /// # Errors
    /// `Value` when it passes 2^26.
    pub fn n_floats(&self) -> Result<usize> {
        self.axes
            .iter()
            .map(|axis| u64::from(axis.count))
            .chain([self.channels.len() as u64])
            .try_fold(1u64, |product, count| product.checked_mul(count))
            .filter(|&n| n <= MAX_FLOATS)
            .map(|n| n as usize)
            .ok_or_else(|| {
                Error::value(
                    format!("size of table {}", self.name),
                    "too large",
                    format!("at most {MAX_FLOATS} floats"),
                )
            })
    }

    /// Checks names, axes and channels.
    ///
    /// # Errors
    /// `Value` naming the first entry that breaks a promise.
    pub fn validate(&self) -> Result<()> {
        short_name("table name", &self.name)?;
        let name = &self.name;
        in_range(
            format!("number of axes of table {name}"),
            self.axes.len() as f64,
            1.0,
            4.0,
        )?;
        in_range(
            format!("number of channels of table {name}"),
            self.channels.len() as f64,
            1.0,
            16.0,
        )?;
        for axis in &self.axes {
            short_name(format!("axis name of table {name}"), &axis.name)?;
            let key = format!("axis {} of table {name}", axis.name);
            in_range(
                format!("count of {key}"),
                f64::from(axis.count),
                2.0,
                f64::from(MAX_AXIS_COUNT),
            )?;
            let ordered = axis.min.is_finite() && axis.max.is_finite() && axis.min < axis.max;
            if !ordered || !axis.spacing.accepts_range(axis.min, axis.max) {
                return Err(Error::value(
                    format!("range of {key}"),
                    format!("{}..={}", axis.min, axis.max),
                    format!(
                        "finite and rising, as spacing {} needs",
                        axis.spacing.name()
                    ),
                ));
            }
        }
        for channel in &self.channels {
            short_name(format!("channel name of table {name}"), channel)?;
        }
        let error = self.max_interpolation_error;
        if !(error.is_finite() && error >= 0.0) {
            let key = format!("max_interpolation_error of table {name}");
            return Err(Error::value(key, error, "finite and not negative"));
        }
        self.n_floats().map(|_| ())
    }

    /// The table with these axes and channels over `data`.
    ///
    /// # Errors
    /// `Value` when something breaks a promise.
    pub(crate) fn with_data(self, data: Vec<f32>) -> Result<Table> {
        let table = Table {
            name: self.name,
            axes: self.axes,
            channels: self.channels,
            data,
            max_interpolation_error: self.max_interpolation_error,
        };
        table.validate()?;
        Ok(table)
    }
}

impl Table {
    /// Everything but the data.
    pub fn header(&self) -> TableHeader {
        TableHeader {
            name: self.name.clone(),
            axes: self.axes.clone(),
            channels: self.channels.clone(),
            max_interpolation_error: self.max_interpolation_error,
        }
    }

    /// Checks the header, the amount of data, and that all of it is finite.
    ///
    /// # Errors
    /// `Value` naming the first entry that breaks a promise.
    pub fn validate(&self) -> Result<()> {
        let header = self.header();
        header.validate()?;
        let expected = header.n_floats()?;
        if self.data.len() != expected {
            return Err(Error::value(
                format!("number of floats of table {}", self.name),
                self.data.len(),
                expected.to_string(),
            ));
        }
        for (ix, &value) in self.data.iter().enumerate() {
            finite(|| format!("table {}[{ix}]", self.name), value)?;
        }
        Ok(())
    }
}

impl TableFile {
    /// The table called `name`.
    pub fn table(&self, name: &str) -> Option<&Table> {
        self.tables.iter().find(|table| table.name == name)
    }

    /// Checks every table, that their names differ, and the Fresnel term.
    ///
    /// # Errors
    /// `Value` naming the first entry that breaks a promise.
    pub fn validate(&self) -> Result<()> {
        validate_file(&self.fresnel, self.tables.iter().map(|table| &table.name))?;
        self.tables.iter().try_for_each(Table::validate)
    }
}

/// What is checked across the tables of a file.
pub(crate) fn validate_file<'a>(
    fresnel: &str,
    names: impl ExactSizeIterator<Item = &'a String>,
) -> Result<()> {
    if !matches!(fresnel, "dielectric" | "schlick") {
        return Err(Error::value(
            "fresnel",
            format!("{fresnel:?}"),
            "dielectric or schlick",
        ));
    }
    in_range("number of tables", names.len() as f64, 1.0, 256.0)?;
    let mut names: Vec<_> = names.collect();
    names.sort_unstable();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(Error::value("table name", pair[0], "unique")),
        None => Ok(()),
    }
}
