//! What to grow, and how much of it can be grown.

/// How the hair is worn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Style {
    /// Long, parted in the middle, straight.
    Straight,
    /// Long, parted, in loose waves.
    Wavy,
    /// Long, in tight helical curls.
    Curly,
    /// Drawn to a tie at the back of the head and falling from there.
    Ponytail,
    /// Chin-long with a fringe, ends turned in.
    Bob,
    /// Shoulder-long in layers, parted at the side, on head and shoulders.
    Layered,
}

impl Style {
    /// All styles.
    pub const ALL: [Style; 6] = [
        Style::Straight,
        Style::Wavy,
        Style::Curly,
        Style::Ponytail,
        Style::Bob,
        Style::Layered,
    ];

    /// The name used by the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Style::Straight => "straight",
            Style::Wavy => "wavy",
            Style::Curly => "curly",
            Style::Ponytail => "ponytail",
            Style::Bob => "bob",
            Style::Layered => "layered",
        }
    }
}

/// What to grow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GrowSpec {
    /// How the hair is worn.
    pub style: Style,
    /// Number of strands, 1..=[`MAX_STRANDS`].
    pub strands: u32,
    /// Points of each strand, 2..=[`MAX_POINTS_PER_STRAND`].
    pub points_per_strand: u32,
    /// Any number; the same one gives the same hair.
    pub seed: u64,
}

/// Most strands: ten heads.
pub const MAX_STRANDS: u32 = 1_000_000;
/// Most points of a strand.
pub const MAX_POINTS_PER_STRAND: u32 = 4096;
/// Most points in all: 768 MiB of positions.
pub const MAX_GENERATED_POINTS: u64 = 64 << 20;

/// A size that cannot be grown.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GrowError {
    /// A count outside its range.
    #[error("{field} is {value}, outside {min}..={max}")]
    OutOfRange {
        /// `strands` or `points per strand`.
        field: &'static str,
        /// What was asked for.
        value: u32,
        /// Smallest accepted value.
        min: u32,
        /// Largest accepted value.
        max: u32,
    },
    /// Both counts are in range but their product is not.
    #[error(
        "{strands} strands of {points_per_strand} points are more than {MAX_GENERATED_POINTS} points"
    )]
    TooManyPoints {
        /// Strands asked for.
        strands: u32,
        /// Points per strand asked for.
        points_per_strand: u32,
    },
}

impl GrowSpec {
    pub(super) fn validate(&self) -> Result<(), GrowError> {
        for (field, value, min, max) in [
            ("strands", self.strands, 1, MAX_STRANDS),
            (
                "points per strand",
                self.points_per_strand,
                2,
                MAX_POINTS_PER_STRAND,
            ),
        ] {
            if !(min..=max).contains(&value) {
                return Err(GrowError::OutOfRange {
                    field,
                    value,
                    min,
                    max,
                });
            }
        }
        if u64::from(self.strands) * u64::from(self.points_per_strand) > MAX_GENERATED_POINTS {
            let GrowSpec {
                strands,
                points_per_strand,
                ..
            } = *self;
            return Err(GrowError::TooManyPoints {
                strands,
                points_per_strand,
            });
        }
        Ok(())
    }
}
