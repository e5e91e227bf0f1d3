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
mod spec;

pub use scalp::HEAD_RADII;
pub use spec::{GrowError, GrowSpec, MAX_POINTS, MAX_POINTS_PER_STRAND, MAX_STRANDS, Style};

use rayon::prelude::*;
use strandlight_formats::{Attribute, Domain, Groom, GroomSource, HairSection, tool_version};

use strandlight_scene::progress::Progress;

/// Strands on a human head.
pub const FULL_HEAD: u32 = 100_000;

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
