//! Pictures in bands of rows, whose hits there is room for.

use std::ops::Range;

/// Hits of a band, of so many in each row.
pub(super) fn hits_of(rows: &[u32], band: &Range<u32>) -> u64 {
    let rows = &rows[band.start as usize..band.end as usize];
    rows.iter().map(|n| u64::from(*n)).sum()
}

/// Bands of rows with so many hits each, of at most `most_hits` or one row.
pub(super) fn bands(rows: &[u32], most_hits: u32) -> Vec<Range<u32>> {
    let mut bands = Vec::new();
    let (mut start, mut sum) = (0, 0);
    for (row, n) in (0..).zip(rows) {
        if row > start && sum + u64::from(*n) > u64::from(most_hits) {
            bands.push(start..row);
            (start, sum) = (row, 0);
        }
        sum += u64::from(*n);
    }
    bands.push(start..rows.len() as u32);
    bands
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_have_every_row_once_and_no_more_hits_than_they_may() {
        assert_eq!(bands(&[5, 5, 90, 1, 0], 100), [0..3, 3..5]);
        // A row may have more by itself.
        assert_eq!(bands(&[1, 300, 1, 100], 100), [0..1, 1..2, 2..3, 3..4]);
        assert_eq!(bands(&[0; 7], 100), vec![0..7]);
    }
}
