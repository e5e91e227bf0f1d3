//! When the samples of a property are.

use super::cursor::Cursor;
use crate::error::{Error, Result};

/// Times of samples, seconds.
pub(super) struct Sampling {
    /// Of the first samples, rising; never empty.
    times: Vec<f64>,
    /// Seconds after which these times come again; `None` where they never do.
    cycle: Option<f64>,
}

/// Cycles this long or longer never end: what upstream writes for samples at times of their own is
/// the largest double over 32.
const NEVER: f64 = f64::MAX / 64.0;
/// Times as near as this are the same, seconds: frame rates such as 24000 / 1001 are not exact.
pub(super) const SAME_TIME: f64 = 1e-5;

impl Sampling {
    /// One entry of the table: most samples u32, cycle f64, number of times u32, times f64.
    pub fn read(table: &mut Cursor<'_, '_>) -> Result<Self> {
        let start = table.offset;
        table.word()?;
        let cycle = table.double()?;
        let n = table.word()?;
        let mut times = Vec::new();
        for _ in 0..n {
            times.push(table.double()?);
        }
        let rises = times.windows(2).all(|pair| pair[0] < pair[1]);
        let finite = times.iter().all(|time| time.is_finite());
        let whole = match (times.first(), times.last()) {
            (Some(first), Some(last)) => last - first < cycle,
            _ => false,
        };
        if !(rises && finite && whole && cycle > 0.0) {
            let what = format!("a time sampling of {n} times and a cycle of {cycle} s");
            return Err(Error::invalid(format!("{what} makes no sense"), start));
        }
        let cycle = Some(cycle).filter(|&cycle| cycle < NEVER);
        Ok(Sampling { times, cycle })
    }

    /// Time of sample `ix`, seconds; of those behind the last, that of the last.
    pub fn time(&self, ix: u32) -> f64 {
        let (n, ix) = (self.times.len(), ix as usize);
        match self.cycle {
            Some(cycle) => self.times[ix % n] + (ix / n) as f64 * cycle,
            None => self.times[ix.min(n - 1)],
        }
    }

    /// Can there be `n_samples` of it?
    pub fn holds(&self, n_samples: u32) -> bool {
        self.cycle.is_some() || n_samples as usize <= self.times.len()
    }

    /// The last of `n_samples` samples that is not after `time`; the first if all are.
    pub fn index(&self, n_samples: u32, time: f64) -> u32 {
        let (mut low, mut high) = (0, n_samples.saturating_sub(1));
        while low < high {
            let middle = high - (high - low) / 2;
            match self.time(middle) <= time + SAME_TIME {
                true => low = middle,
                false => high = middle - 1,
            }
        }
        low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampling(cycle: f64, times: &[f64]) -> Result<Sampling> {
        let mut bytes = vec![0; 4];
        bytes.extend(cycle.to_le_bytes());
        bytes.extend((times.len() as u32).to_le_bytes());
        bytes.extend(times.iter().flat_map(|time| time.to_le_bytes()));
        Sampling::read(&mut Cursor::new(&bytes, 0, "a table"))
    }

    #[test]
    fn samples_are_found_by_time() {
        let uniform = sampling(1.0 / 24.0, &[1.0 / 24.0]).unwrap();
        let cyclic = sampling(1.0, &[0.0, 0.25]).unwrap();
        let acyclic = sampling(f64::MAX / 32.0, &[0.0, 0.5, 7.0]).unwrap();
        assert_eq!(cyclic.time(3), 1.25);
        assert_eq!(acyclic.time(2), 7.0);
        for sampling in [&uniform, &cyclic, &acyclic] {
            for ix in 0..3 {
                assert_eq!(sampling.index(3, sampling.time(ix)), ix);
                assert_eq!(sampling.index(3, sampling.time(ix) + 0.01), ix);
            }
            assert_eq!(sampling.index(3, -1.0), 0);
            assert_eq!(sampling.index(3, 1e9), 2);
            assert_eq!(sampling.index(0, 0.0), 0);
        }
        assert!(acyclic.holds(3) && !acyclic.holds(4) && cyclic.holds(400));
    }

    #[test]
    fn nonsense_is_refused() {
        for (cycle, times) in [
            (0.0, &[0.0][..]),
            (-1.0, &[0.0]),
            (f64::NAN, &[0.0]),
            (1.0, &[]),
            (1.0, &[0.0, 1.5]),
            (1.0, &[0.5, 0.0]),
            (1.0, &[f64::INFINITY]),
        ] {
            assert!(sampling(cycle, times).is_err(), "{cycle} {times:?}");
        }
    }
}
