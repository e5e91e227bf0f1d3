//! Refinements of a picture that is being looked at, faded in.

use rayon::prelude::*;

/// How much a picture may differ from the one that a screen showed before, of the same scene and view:
/// relative RMS difference of their levels.
pub(super) const MAX_STEP: f64 = 0.02;

/// Most pictures of a fade: half a second at 60 a second.
const MAX_STEPS: u32 = 30;

/// Pixels that a thread works on at a time.
const PIXELS_AT_ONCE: usize = 1 << 13;

// Sums of squares of their levels fit into 32 bits.
const _: () = assert!((PIXELS_AT_ONCE as u64) * 3 * 255 * 255 <= u32::MAX as u64);

/// One picture becomes another within some steps.
#[derive(Debug)]
pub(super) struct Fade {
    from: Vec<[u8; 4]>,
    to: Vec<[u8; 4]>,
    step: u32,
    n_steps: u32,
}

impl Fade {
    /// From what is shown to what takes its place. As many steps as it takes for none to be larger than
    /// [`MAX_STEP`]; none where it is small enough at once, and where all changes: then `to` comes back.
    pub fn new(from: &[[u8; 4]], to: Vec<[u8; 4]>) -> Result<Fade, Vec<[u8; 4]>> {
        // A little below, for levels are rounded.
        let n_steps = (difference(from, &to) / (0.9 * MAX_STEP)).ceil();
        if from.len() != to.len() || n_steps <= 1.0 {
            return Err(to);
        }
        Ok(Fade {
            from: from.to_vec(),
            to,
            step: 0,
            n_steps: n_steps.min(f64::from(MAX_STEPS)) as u32,
        })
    }

    /// Puts the next picture into `pixels`; answers whether it was the last.
    pub fn advance(&mut self, pixels: &mut Vec<[u8; 4]>) -> bool {
        self.step += 1;
        if self.step >= self.n_steps {
            std::mem::swap(pixels, &mut self.to);
            return true;
        }
        // Weights that add up to 1 << 16.
        let to_weight = (self.step << 16) / self.n_steps;
        let from_weight = (1 << 16) - to_weight;
        pixels.resize(self.to.len(), [0; 4]);
        let pixels = pixels.par_chunks_mut(PIXELS_AT_ONCE);
        let ends = (self.from.par_chunks(PIXELS_AT_ONCE)).zip(self.to.par_chunks(PIXELS_AT_ONCE));
        pixels.zip(ends).for_each(|(pixels, (from, to))| {
            let ends = from.as_flattened().iter().zip(to.as_flattened());
            for (level, (from, to)) in pixels.as_flattened_mut().iter_mut().zip(ends) {
                let sum = u32::from(*from) * from_weight + u32::from(*to) * to_weight;
                *level = ((sum + (1 << 15)) >> 16) as u8;
            }
        });
        false
    }
}

/// Relative RMS difference of the levels of two pictures, over those of the brighter one.
pub(super) fn difference(a: &[[u8; 4]], b: &[[u8; 4]]) -> f64 {
    let chunks = (a.par_chunks(PIXELS_AT_ONCE)).zip(b.par_chunks(PIXELS_AT_ONCE));
    let sums = chunks.map(|(a, b)| {
        let mut sums = [0_u32; 3];
        for (a, b) in a.iter().zip(b) {
            for (&a, &b) in a.iter().zip(b).take(3) {
                let levels = [a.abs_diff(b), a, b];
                for (sum, level) in sums.iter_mut().zip(levels) {
                    *sum += u32::from(level) * u32::from(level);
                }
            }
        }
        sums.map(u64::from)
    });
    let add = |a: [u64; 3], b: [u64; 3]| [0, 1, 2].map(|ix| a[ix] + b[ix]);
    let [off, sum_a, sum_b] = sums.reduce(|| [0; 3], add);
    (off as f64 / sum_a.max(sum_b).max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_step_is_large_and_the_last_one_is_the_picture() {
        let from: Vec<[u8; 4]> = (0..200_u8).map(|x| [x, 100, 30, 255]).collect();
        let to: Vec<[u8; 4]> = (0..200_u8).map(|x| [x / 2 + 60, 90, 40, 250]).collect();
        assert!(difference(&from, &to) > 3.0 * MAX_STEP);
        let mut fade = Fade::new(&from, to.clone()).expect("a large step");
        let mut pixels = from.clone();
        let mut n = 0;
        loop {
            let before = pixels.clone();
            let is_last = fade.advance(&mut pixels);
            n += 1;
            let step = difference(&before, &pixels);
            assert!(step > 0.0 && step <= MAX_STEP, "{n}: {step}");
            if is_last {
                break;
            }
        }
        assert!(n > 3);
        assert_eq!(pixels, to);
    }

    #[test]
    fn small_steps_and_other_sizes_are_not_faded() {
        let a = vec![[100, 100, 100, 255]; 10];
        let b = vec![[101, 100, 100, 255]; 10];
        assert_eq!(Fade::new(&a, b.clone()).unwrap_err(), b);
        let c = vec![[200; 4]; 5];
        assert_eq!(Fade::new(&a, c.clone()).unwrap_err(), c);
        // From black in one step would be all of it.
        let black = vec![[0; 4]; 10];
        let mut fade = Fade::new(&black, a.clone()).expect("a large step");
        let mut pixels = black.clone();
        while !fade.advance(&mut pixels) {}
        assert_eq!(pixels, a);
    }
}
