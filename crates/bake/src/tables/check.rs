//! A check of tables and its worst value.

/// The entry of a check with the largest error.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Worst {
    /// Which value: table, channel, texel or point.
    pub entry: String,
    /// What the table says.
    pub found: f64,
    /// What it should be.
    pub expected: f64,
    /// Error in the unit of the check's tolerance; NaN counts as infinite.
    pub error: f64,
}

/// One check over many values.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// What is checked and in which unit.
    pub name: &'static str,
    /// Name of the table.
    pub table: &'static str,
    /// Number of values compared.
    pub n_values: u64,
    /// Largest error accepted.
    pub tolerance: f64,
    /// The worst value.
    pub worst: Worst,
}

impl Check {
    /// Did every value pass?
    pub fn passed(&self) -> bool {
        self.n_values > 0 && self.worst.error <= self.tolerance
    }
}
