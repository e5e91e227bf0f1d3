//! Fewer strands that cover as much.

use glam::Vec3;
use strandlight_formats::{Attribute, Domain, Groom, HairSection, MAX_DIAMETER_CM};

use super::edit::{EditError, edited, scale_widths, subset};
use super::noise::{Noise, Purpose};

/// A groom of `strands` of the strands of `groom`, 1 to as many as it has, spread evenly over the
/// roots: one of each stretch of a curve that visits the roots of a neighbourhood together (Morton's
/// order). The same `seed` picks the same strands.
///
/// The strands that stay become wider by one factor, so that [`coverage`] stays; a groom without
/// widths gets attribute `diameter`. Closest guides stay where all that have a share in a strand do: see
/// [`subset`].
///
/// # Errors
/// A number of strands out of range; a width above what a groom can hold, 10 cm.
pub fn thin(groom: &Groom, strands: u32, seed: u64) -> Result<Groom, EditError> {
    groom.validate()?;
    let n = groom.n_strands() as u64;
    let wanted = u64::from(strands);
    if !(1..=n).contains(&wanted) {
        let range = format!("1..={n}, as many as the groom has");
        return Err(EditError::range("strands", strands, range));
    }
    let order = along_curve(groom);
    let noise = Noise::new(seed);
    let mut kept: Vec<usize> = (0..strands)
        .map(|ix| {
            let at = |ix: u64| ix * n / wanted;
            let (from, to) = (at(u64::from(ix)), at(u64::from(ix) + 1));
            let pick = f64::from(noise.unit(ix, Purpose::Thin, 0)) * (to - from) as f64;
            order[(from + (pick as u64).min(to - from - 1)) as usize] as usize
        })
        .collect();
    kept.sort_unstable();
    let before = coverage(groom);
    let mut thinned = subset(groom, &kept);
    let after = coverage(&thinned);
    let factor = if after > 0.0 { before / after } else { 1.0 };
    if drawn(&thinned).is_none() {
        thinned
            .attributes
            .retain(|attribute| attribute.name != "diameter");
        thinned.attributes.push(Attribute {
            name: "diameter".to_owned(),
            domain: Domain::Groom,
            components: 1,
            data: vec![HairSection::DEFAULT_DIAMETER_CM as f32],
        });
    }
    scale_widths(&mut thinned, factor);
    let widths = drawn(&thinned).map_or(&[][..], |attribute| &attribute.data);
    let widest = widths.iter().copied().fold(0.0, f32::max);
    if widest > MAX_DIAMETER_CM {
        let range = format!(
            "more: so few would have to be {widest} cm wide (attribute diameter); the limit is {MAX_DIAMETER_CM} cm"
        );
        return Err(EditError::range("strands", strands, range));
    }
    thinned.source = edited(
        &groom.source,
        format!("thin --strands {strands} --seed {seed}"),
    );
    thinned.validate()?;
    Ok(thinned)
}

/// Area of all strands seen from the side, cm^2: the sum of length times mean width of their
/// segments.
pub fn coverage(groom: &Groom) -> f64 {
    let width = |strand: usize, point: usize| {
        drawn(groom).map_or(HairSection::DEFAULT_DIAMETER_CM, |attribute| {
            f64::from(match attribute.domain {
                Domain::Groom => attribute.data[0],
                Domain::Strand => attribute.data[strand],
                Domain::Point => attribute.data[point],
            })
        })
    };
    let mut sum = 0.0;
    for strand in 0..groom.n_strands() {
        for point in groom.strand(strand).skip(1) {
            let length =
                Vec3::from(groom.points[point - 1]).distance(Vec3::from(groom.points[point]));
            sum += f64::from(length) * 0.5 * (width(strand, point - 1) + width(strand, point));
        }
    }
    sum
}

/// The widths that are drawn.
fn drawn(groom: &Groom) -> Option<&Attribute> {
    groom.attribute("diameter").filter(|a| a.components == 1)
}

/// The strands in Morton's order of their roots.
fn along_curve(groom: &Groom) -> Vec<u32> {
    let root = |ix: usize| Vec3::from(groom.points[groom.strand(ix).start]);
    let n = groom.n_strands();
    let (mut min, mut max) = (root(0), root(0));
    for ix in 1..n {
        (min, max) = (min.min(root(ix)), max.max(root(ix)));
    }
    let scale = 65_535.0 / (max - min).max_element().max(f32::MIN_POSITIVE);
    let key = |ix: u32| {
        let cell = ((root(ix as usize) - min) * scale).to_array();
        let spread = cell.map(|x| spread_bits(x.clamp(0.0, 65_535.0) as u64));
        (spread[0] | spread[1] << 1 | spread[2] << 2, ix)
    };
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.sort_by_cached_key(|&ix| key(ix));
    order
}

/// The lowest 16 bits with two zeros between each.
fn spread_bits(x: u64) -> u64 {
    (0..16).map(|bit| (x >> bit & 1) << (3 * bit)).sum()
}

#[cfg(test)]
mod tests {
    use super::super::edit_samples::{attribute, head, per_strand};
    use super::*;

    #[test]
    fn coverage_stays_whatever_the_widths_are_given_for() {
        let bare = head(400);
        let n_points = bare.points.len();
        for diameter in [
            None,
            Some(attribute("diameter", Domain::Groom, 1, vec![0.02])),
            Some(per_strand("diameter", &bare, |ix| {
                0.01 + 0.0001 * ix as f32
            })),
            Some(attribute(
                "diameter",
                Domain::Point,
                1,
                (0..n_points)
                    .map(|ix| 0.01 + (ix % 7) as f32 * 0.001)
                    .collect(),
            )),
        ] {
            let mut groom = bare.clone();
            groom.attributes.extend(diameter);
            for strands in [20, 40, 333, 400] {
                let thinned = thin(&groom, strands, 5).unwrap();
                assert_eq!(thinned.n_strands(), strands as usize);
                let ratio = coverage(&thinned) / coverage(&groom);
                assert!((ratio - 1.0).abs() < 1e-5, "{strands}: {ratio}");
            }
        }
        // What coverage is: two segments of 2 cm, 0.1 to 0.3 and 0.3 to 0.1 wide.
        let mut one = Groom {
            points: vec![[0.0; 3], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0]],
            strand_offsets: vec![0, 3],
            ..Groom::default()
        };
        one.attributes
            .push(attribute("diameter", Domain::Point, 1, vec![0.1, 0.3, 0.1]));
        assert!((coverage(&one) - 0.8).abs() < 1e-6);
    }

    #[test]
    fn picks_follow_the_seed_and_spread_over_the_head() {
        let mut groom = head(1000);
        groom
            .attributes
            .push(per_strand("id", &groom, |ix| ix as f32));
        let thinned = thin(&groom, 100, 1).unwrap();
        assert_eq!(thinned, thin(&groom, 100, 1).unwrap());
        let other = thin(&groom, 100, 2).unwrap();
        assert_ne!(thinned.points, other.points);
        // Attributes go with their strands.
        let ids = &thinned.attribute("id").unwrap().data;
        assert!(ids.windows(2).all(|pair| pair[0] < pair[1]));
        for (ix, &id) in ids.iter().enumerate() {
            let (own, all) = (thinned.strand(ix), groom.strand(id as usize));
            assert_eq!(thinned.points[own], groom.points[all]);
        }
        // A tenth of each half, give or take what strata allow.
        let left = (0..100).filter(|&ix| thinned.points[thinned.strand(ix).start][0] < 0.0);
        let left = left.count();
        assert!((40..=60).contains(&left), "{left}");
        assert_eq!(thinned.source.parameters.last().unwrap().0, "edit");
        let twice = thin(&thinned, 10, 1).unwrap();
        assert_eq!(twice.source.parameters.last().unwrap().0, "edit_2");
    }

    #[test]
    fn impossible_numbers_are_refused() {
        let groom = head(20);
        for strands in [0, 21, u32::MAX] {
            let error = thin(&groom, strands, 0).unwrap_err().to_string();
            assert!(error.contains("1..=20"), "{error}");
        }
        let mut wide = groom.clone();
        wide.attributes
            .push(attribute("diameter", Domain::Groom, 1, vec![1.0]));
        let error = thin(&wide, 1, 0).unwrap_err().to_string();
        assert!(error.starts_with("strands is 1, must be more"), "{error}");
        assert!(error.contains("attribute diameter"), "{error}");
    }
}
