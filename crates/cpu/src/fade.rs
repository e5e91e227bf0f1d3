//! Refinements of a picture that is being looked at, faded in.

/// How much a picture may differ from the one that a screen showed before, of the same scene and view:
/// relative RMS difference of their levels.
pub(super) const MAX_STEP: f64 = 0.02;

/// Most pictures of a fade: half a second at 60 a second.
const MAX_STEPS: u32 = 30;

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
        let (n, step) = (self.n_steps, self.step);
        pixels.clear();
        pixels.extend(self.from.iter().zip(&self.to).map(|(from, to)| {
            let mut pixel = *from;
            for (level, to) in pixel.iter_mut().zip(to) {
                let sum = u32::from(*level) * (n - step) + u32::from(*to) * step;
                *level = ((sum + n / 2) / n) as u8;
            }
            pixel
        }));
        false
    }
}

/// Relative RMS difference of the levels of two pictures, over those of the brighter one.
pub(super) fn difference(a: &[[u8; 4]], b: &[[u8; 4]]) -> f64 {
    let (mut off, mut sum_a, mut sum_b) = (0_u64, 0_u64, 0_u64);
    let square = |level: u8| u64::from(level) * u64::from(level);
    for (a, b) in a.iter().zip(b) {
        for (&a, &b) in a.iter().zip(b).take(3) {
            off += square(a.abs_diff(b));
            sum_a += square(a);
            sum_b += square(b);
        }
    }
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
