//! Other points on the same strands.

use strandlight_formats::Groom;

use super::edit::{EditError, edited};
use super::spec::{MAX_GENERATED_POINTS, MAX_POINTS_PER_STRAND};

/// Which points strands get.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resample {
    /// So many at equal distances, 2..=[`MAX_POINTS_PER_STRAND`].
    Points(u32),
    /// As few of their own as keep the others within a distance of the line, cm, and widths and paint near.
    MaxError(f32),
}

/// The groom with other points: [`Groom::resampled`] or [`Groom::simplified`].
///
/// # Errors
/// Numbers out of range.
pub fn resample(groom: &Groom, how: Resample) -> Result<Groom, EditError> {
    let (made, text) = match how {
        Resample::Points(n) => {
            if !(2..=MAX_POINTS_PER_STRAND).contains(&n) {
                let range = format!("2..={MAX_POINTS_PER_STRAND}");
                return Err(EditError::range("points per strand", n, range));
            }
            let total = groom.n_strands() as u64 * u64::from(n);
            if total > MAX_GENERATED_POINTS {
                let range = format!("at most {MAX_GENERATED_POINTS}");
                return Err(EditError::range("number of points", total, range));
            }
            (groom.resampled(n)?, format!("resample --points {n}"))
        }
        Resample::MaxError(cm) => (groom.simplified(cm)?, format!("resample --max-error {cm}")),
    };
    let source = edited(&groom.source, text);
    Ok(Groom { source, ..made })
}

#[cfg(test)]
mod tests {
    use super::super::edit_samples::{attribute, head};
    use super::super::stats;
    use super::*;
    use strandlight_formats::Domain;

    #[test]
    fn strands_keep_ends_and_lengths() {
        let mut groom = head(40);
        let n = groom.points.len();
        let widths = (0..n).map(|ix| 0.01 + (ix % 12) as f32 * 0.001).collect();
        groom
            .attributes
            .push(attribute("diameter", Domain::Point, 1, widths));
        let more = resample(&groom, Resample::Points(34)).unwrap();
        assert_eq!(more.points.len(), 40 * 34);
        let (a, b) = (stats(&groom).length_cm, stats(&more).length_cm);
        assert!((a.median / b.median - 1.0).abs() < 1e-3, "{a:?} {b:?}");
        let fewer = resample(&groom, Resample::MaxError(0.05)).unwrap();
        assert!(fewer.points.len() < n, "{}", fewer.points.len());
        for groom_of in [&more, &fewer] {
            for ix in 0..40 {
                let (old, new) = (groom.strand(ix), groom_of.strand(ix));
                assert_eq!(groom.points[old.start], groom_of.points[new.start]);
                assert_eq!(groom.points[old.end - 1], groom_of.points[new.end - 1]);
                let tip = groom_of.attributes[0].data[new.end - 1];
                assert_eq!(tip, groom.attributes[0].data[old.end - 1]);
            }
            assert_eq!(groom_of.source.parameters.last().unwrap().0, "edit");
        }
        for bad in [
            Resample::Points(1),
            Resample::Points(5000),
            Resample::MaxError(-1.0),
        ] {
            assert!(resample(&groom, bad).is_err(), "{bad:?}");
        }
    }
}
