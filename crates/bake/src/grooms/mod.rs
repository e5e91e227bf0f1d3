//! Seeded procedural grooms: hair of five styles grown on a head-sized ellipsoid, and of one on a
//! bust.
//!
//! - [`GrowSpec`]: style, size and seed.
//! - [`generate`]: grows it, in parallel, to the same bytes on any number of threads.
//! - [`bust`]: head and shoulders.
//!
//! Each strand grows by marching: a direction field (away from the parting, down by gravity, out of
//! the head) is followed from the root; strands of a clump then draw towards the clump's guide;
//! curls and wander are laid onto the resampled path. Every random number is a hash of the seed,
//! the strand and a purpose, so nothing depends on the order of work.
//!
//! And grooms from elsewhere: [`check()`] and [`stats()`] look at them; [`thin()`], [`resample()`],
//! [`interpolate()`], [`Transform`], [`turn_strands`] and [`dye_from_color`] change them, [`merge()`]
//! joins them.

mod bust;
mod check;
mod dye;
mod edit;
#[cfg(test)]
mod edit_samples;
mod growth;
mod interpolate;
mod layered;
mod merge;
mod nearest;
mod noise;
mod presets;
mod resample;
mod roots;
mod scalp;
mod shape;
mod spec;
mod stats;
mod thin;
mod transform;

pub use check::{FINDINGS, Finding, check, finding_of_error};
pub use dye::{Dyed, dye_from_color};
pub use edit::{EditError, guides, subset};
pub use interpolate::{InterpolateSpec, Interpolated, interpolate};
pub use merge::{MergeInput, Merged, merge};
pub use presets::{PRESETS, Preset};
pub use resample::{Resample, resample};
pub use roots::{turn_strands, turned_strands};
pub use scalp::HEAD_RADII;
pub use spec::{
    GrowError, GrowSpec, MAX_GENERATED_POINTS, MAX_POINTS_PER_STRAND, MAX_STRANDS, Style,
};
pub use stats::{AttributeRange, GroomStats, Spread, stats};
pub use thin::{coverage, thin};
pub use transform::Transform;

use rayon::prelude::*;
use strandlight_formats::{
    Attribute, Domain, Groom, GroomSource, HairSection, Mesh, MeshSource, tool_version,
};

use strandlight_scene::progress::Progress;

use bust::field;
use growth::{Grower, Habit};
use layered::Layered;
use noise::Noise;

/// Strands on a human head.
pub const FULL_HEAD: u32 = 100_000;

/// Head and shoulders in the place that hair grows on, cm; hair of [`Style::Layered`] lies on them. A
/// closed surface of some 36,000 triangles down to the chest.
pub fn bust() -> Mesh {
    let (positions, triangles) = field().mesh();
    let normals = positions.iter().map(|&p| bust::normal(p.into()).to_array());
    Mesh {
        normals: normals.collect(),
        uvs: Vec::new(),
        source: MeshSource {
            parameters: vec![("shape".to_owned(), "bust".to_owned())],
            ..MeshSource::default()
        },
        positions,
        triangles,
    }
}

/// Grows the hair that `spec` asks for on a head of 15 x 23 x 19 cm around the origin, facing +Z.
/// All strands have exactly `points_per_strand` points, root first, at equal distances before
/// curls are laid on. Attribute `diameter` holds one value for all: that of a human hair, 0.008 cm,
/// thicker where fewer than [`FULL_HEAD`] strands must cover the head; of [`Style::Layered`] one per
/// point, for its strands taper.
///
/// # Errors
/// [`GrowError`] when a count is outside its range.
pub fn generate(spec: &GrowSpec, progress: &Progress) -> Result<Groom, GrowError> {
    spec.validate()?;
    let grower = match Habit::of(spec.style) {
        Some(habit) => AnyGrower::Habitual(Grower::new(spec, habit)),
        None => AnyGrower::Layered(Layered::new(spec.strands, Noise::new(spec.seed))),
    };
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
    let thick = diameter_cm(spec.strands);
    let (domain, data) = match spec.style {
        Style::Layered => {
            let last = (n_points - 1) as f32;
            let tapered = (0..n_points).map(|ix| thick * Layered::taper(ix as f32 / last));
            let strand: Vec<f32> = tapered.collect();
            (Domain::Point, strand.repeat(spec.strands as usize))
        }
        _ => (Domain::Groom, vec![thick]),
    };
    let diameter = Attribute {
        name: "diameter".to_owned(),
        domain,
        components: 1,
        data,
    };
    Ok(Groom {
        points,
        strand_offsets,
        source,
        attributes: vec![diameter],
    })
}

/// What grows the strands of a style.
enum AnyGrower {
    Habitual(Grower),
    Layered(Layered),
}

impl AnyGrower {
    /// Fills `points` with a strand.
    fn grow(&self, strand: u32, points: &mut [[f32; 3]]) {
        match self {
            AnyGrower::Habitual(grower) => grower.grow(strand, points),
            AnyGrower::Layered(grower) => grower.grow(strand, points),
        }
    }
}

/// Fibre diameter at which `strands` look like a head of hair. Fewer strands are thickened, by
/// less than what would keep their area, so that they stay fine.
fn diameter_cm(strands: u32) -> f32 {
    let missing = FULL_HEAD as f32 / strands as f32;
    HairSection::DEFAULT_DIAMETER_CM as f32 * missing.max(1.0).powf(0.7).min(20.0)
}

#[cfg(test)]
mod tests;
