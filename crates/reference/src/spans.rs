//! The order in which sums of samples are added, so that samples may be drawn in parts, on several
//! machines: it depends on the numbers of the samples alone, not on who drew them.
//!
//! Samples lie in blocks. Inside a block sums are pairwise: two neighbours of `2^k` samples each
//! join when the first starts at a multiple of `2^(k+1)`. Whole blocks are added in turn to the sum
//! of all blocks before them. Blocks have 64 samples up to sample 512, and an eighth of the power of
//! two at or below their first sample beyond: 64 from 512 on, 128 from 1024 on. So a part of any
//! consecutive samples is a few sums, and all samples from the first on are one sum wherever a block
//! ends.

use std::ops::Range;

/// Consecutive samples whose sum is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    pub first: u32,
    pub n: u32,
}

/// Samples of the block that sample `first` lies in.
fn block(first: u32) -> u32 {
    let power = first.checked_ilog2().unwrap_or(0);
    ((1 << power) >> 3).max(64)
}

impl Span {
    /// Whether the sum of `right`, which comes next, is to be added to that of these.
    fn joins(self, right: Span) -> bool {
        let are_halves = self.n == right.n
            && self.first.is_multiple_of(2 * self.n)
            && 2 * self.n <= block(self.first);
        let is_whole_block = right.n == block(right.first);
        are_halves || (self.first == 0 && is_whole_block)
    }
}

/// Adds the sum of `span` to those of the samples before it: to the last of `sums`, as long as the
/// two join.
pub(super) fn push<T>(
    sums: &mut Vec<(Span, T)>,
    mut span: Span,
    mut sum: T,
    add: impl Fn(T, T) -> T,
) {
    while let Some((left, before)) = sums.pop_if(|(left, _)| left.joins(span)) {
        span = Span {
            first: left.first,
            n: left.n + span.n,
        };
        sum = add(before, sum);
    }
    sums.push((span, sum));
}

/// The least number of samples from `n` on of which one sum is left.
pub fn whole_samples(n: u32) -> u32 {
    if n <= block(0) {
        return n.next_power_of_two();
    }
    // Blocks before the one that sample `n - 1` lies in are whole.
    let mut end = 0;
    while end < n {
        end += block(end);
    }
    end
}

/// The spans whose sums are left of these samples.
pub(super) fn spans_of(samples: Range<u32>) -> Vec<Span> {
    let mut spans = Vec::new();
    for first in samples {
        push(&mut spans, Span { first, n: 1 }, (), |(), ()| ());
    }
    spans.into_iter().map(|(span, ())| span).collect()
}

/// The samples that part `index` of `count` draws of `n_samples`: consecutive ones, as many in each
/// part up to an eighth, so cut that few sums are left of them.
///
/// # Panics
/// If there is no such part.
pub fn samples_of_part(index: u32, count: u32, n_samples: u32) -> Range<u32> {
    assert!(index < count, "there is no part {index} of {count}");
    let share = u64::from(n_samples) / (8 * u64::from(count));
    let grain = share.checked_ilog2().map_or(1, |power| 1 << power);
    let end = |index: u32| match index == count {
        true => n_samples,
        false => {
            let even = u64::from(n_samples) * u64::from(index) / u64::from(count);
            (even / grain * grain) as u32
        }
    };
    end(index)..end(index + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sum whose text shows the order of all additions.
    fn added(parts: &[Range<u32>]) -> Vec<(Span, String)> {
        let mut sums = Vec::new();
        let add = |a: String, b: String| format!("({a}{b})");
        for part in parts {
            let mut of_part = Vec::new();
            for first in part.clone() {
                let letter = char::from(b'a' + (first % 26) as u8).to_string();
                push(&mut of_part, Span { first, n: 1 }, letter, add);
            }
            let spans: Vec<Span> = of_part.iter().map(|(span, _)| *span).collect();
            assert_eq!(spans, spans_of(part.clone()));
            for (span, sum) in of_part {
                push(&mut sums, span, sum, add);
            }
        }
        sums
    }

    fn added_at_once(n: u32) -> Vec<(Span, String)> {
        added(std::slice::from_ref(&(0..n)))
    }

    #[test]
    fn whole_blocks_have_one_sum() {
        for (n, whole) in [
            (1, 1),
            (3, 4),
            (63, 64),
            (64, 64),
            (65, 128),
            (1025, 1152),
            (2049, 2304),
        ] {
            assert_eq!(whole_samples(n), whole, "{n}");
            assert_eq!(spans_of(0..whole).len(), 1, "{whole}");
        }
    }

    #[test]
    fn parts_are_added_as_all_samples_are() {
        assert_eq!(added_at_once(6).len(), 2);
        assert_eq!(added_at_once(6)[0].1, "((ab)(cd))");
        for n in [1, 2, 7, 8, 63, 64, 65, 100, 200, 1000, 1030, 2300] {
            let whole = added_at_once(n);
            for count in [1, 2, 3, 7, 16] {
                let parts: Vec<_> = (0..count).map(|ix| samples_of_part(ix, count, n)).collect();
                assert_eq!(added(&parts), whole, "{count} parts of {n}");
            }
            // Cuts anywhere, as gone on with.
            for cut in 0..=n {
                assert_eq!(
                    added(&[0..cut / 2, cut / 2..cut, cut..n]),
                    whole,
                    "{n} cut at {cut}"
                );
            }
        }
    }

    #[test]
    fn few_sums_are_left() {
        // All from the first: one where a block ends, few else.
        for (n, sums) in [
            (0, 0),
            (1, 1),
            (16, 1),
            (64, 1),
            (100, 3),
            (128, 1),
            (192, 1),
            (1000, 3),
            (1 << 14, 1),
            (10_000, 4),
            (1 << 24, 1),
            ((1 << 24) - 1, 21),
        ] {
            assert_eq!(spans_of(0..n).len(), sums, "{n}");
        }
        let most = |n: u32, count: u32| {
            let parts = (0..count).map(|ix| spans_of(samples_of_part(ix, count, n)).len());
            parts.max()
        };
        assert_eq!(most(64, 3), Some(4));
        assert_eq!(most(1024, 7), Some(4));
        assert_eq!(most(1 << 16, 8), Some(8));
        assert_eq!(most(1 << 24, 1000), Some(8));
    }

    #[test]
    fn parts_share_all_samples_evenly() {
        for n in [1, 5, 64, 100, 1000, 12_345, 1 << 24] {
            for count in [1, 2, 3, 7, 100, u32::MAX] {
                let parts = (0..count.min(100)).map(|ix| samples_of_part(ix, count, n));
                let mut end = 0;
                for part in parts {
                    assert_eq!(part.start, end);
                    end = part.end;
                    let even = f64::from(n) / f64::from(count);
                    assert!(
                        (part.len() as f64 - even).abs() <= (even / 8.0).max(1.0),
                        "{n} {count}"
                    );
                }
                assert!(count > 100 || end == n);
            }
        }
    }
}
