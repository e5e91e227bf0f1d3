//! Seeded procedural grooms: hair of five styles grown on a head-sized ellipsoid.
//!
//! - [`GrowSpec`]: style, size and seed.
//! - [`generate`]: grows it, in parallel, to the same bytes on any number of threads.
//!
//! Each strand grows by marching: a direction field (away from the parting, down by gravity, out of
//! the head) is followed from the root; strands of a clump then draw towards the clump's guide;
//! curls and wander are laid onto the resampled path. Every random number is a hash of the seed,
//! the strand and a purpose, so nothing depends on the order of work.

mod growth;
mod noise;
mod scalp;
mod shape;

pub use scalp::HEAD_RADII;

use rayon::prelude::*;
use strandlight_formats::{Attribute, Domain, Groom, GroomSource, HairSection, tool_version};

use strandlight_scene::progress::Progress;

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
}

impl Style {
    /// All styles.
    pub const ALL: [Style; 5] = [
        Style::Straight,
        Style::Wavy,
        Style::Curly,
        Style::Ponytail,
        Style::Bob,
    ];

    /// The name used by the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Style::Straight => "straight",
            Style::Wavy => "wavy",
            Style::Curly => "curly",
            Style::Ponytail => "ponytail",
            Style::Bob => "bob",
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
pub const MAX_POINTS: u64 = 64 << 20;

/// Strands on a human head.
pub const FULL_HEAD: u32 = 100_000;

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
    #[error("{strands} strands of {points_per_strand} points are more than {MAX_POINTS} points")]
    TooManyPoints {
        /// Strands asked for.
        strands: u32,
        /// Points per strand asked for.
        points_per_strand: u32,
    },
}

impl GrowSpec {
    fn validate(&self) -> Result<(), GrowError> {
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
        if u64::from(self.strands) * u64::from(self.points_per_strand) > MAX_POINTS {
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

/// Grows the hair that `spec` asks for on a head of 15 x 23 x 19 cm around the origin, facing +Z.
/// All strands have exactly `points_per_strand` points, root first, at equal distances before
/// curls are laid on. Attribute `diameter` holds one value for all: that of a human hair, 0.008 cm,
/// thicker where fewer than [`FULL_HEAD`] strands must cover the head.
///
/// # Errors
/// [`GrowError`] when a count is outside its range.
pub fn generate(spec: &GrowSpec, progress: &Progress) -> Result<Groom, GrowError> {
    spec.validate()?;
    let grower = growth::Grower::new(spec);
    let n_points = spec.points_per_strand as usize;
    let mut points = vec![[0.0_f32; 3]; spec.strands as usize * n_points];
    points
        .par_chunks_mut(n_points)
        .enumerate()
        .for_each(|(strand_ix, points)| {
            grower.grow(strand_ix as u32, points);
            progress.advance(1);
        });
    progress.finish();
    let strand_offsets = (0..=spec.strands)
        .map(|ix| ix * spec.points_per_strand)
        .collect();
    let source = GroomSource {
        tool_version: tool_version(),
        parameters: vec![
            ("style".to_owned(), spec.style.name().to_owned()),
            ("strands".to_owned(), spec.strands.to_string()),
            (
                "points_per_strand".to_owned(),
                spec.points_per_strand.to_string(),
            ),
            ("seed".to_owned(), spec.seed.to_string()),
        ],
        ..GroomSource::default()
    };
    let diameter = Attribute {
        name: "diameter".to_owned(),
        domain: Domain::Groom,
        components: 1,
        data: vec![diameter_cm(spec.strands)],
    };
    Ok(Groom {
        points,
        strand_offsets,
        source,
        attributes: vec![diameter],
    })
}

/// Fibre diameter at which `strands` look like a head of hair. Fewer strands are thickened, by
/// less than what would keep their area, so that they stay fine.
fn diameter_cm(strands: u32) -> f32 {
    let missing = FULL_HEAD as f32 / strands as f32;
    HairSection::DEFAULT_DIAMETER_CM as f32 * missing.max(1.0).powf(0.7).min(20.0)
}

#[cfg(test)]
mod tests;
