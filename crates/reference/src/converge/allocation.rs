//! How the samples of a picture are shared out among its pixels: more where they are noisier.
//!
//! The error of a picture is least where each pixel has samples in proportion to the standard deviation of
//! one (Neyman 1934). At first all have as many. After 2, 4, 8, ... samples a pixel their noise says how
//! those up to the next power of two are shared out, so that it does not matter by which steps they are taken.
//! A pixel's own samples have no say in how many it takes next, which would bias their mean: its noise
//! is that of the tiles around its own, as much larger as the pixel is brighter.

/// Samples of all pixels before their noise is believed.
pub(super) const FIRST: u32 = 2;

/// Side in pixels of the tiles that noise is told of; smaller than those that errors are told of.
const SIDE: usize = 8;

/// Tiles to each side whose noise counts.
const REACH: usize = 2;

/// Least and most samples of a pixel over the mean of all.
const LEAST: f64 = 0.25;
const MOST: f64 = 8.0;

/// What is known of the noise of a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    /// Place in the picture, rows one after another.
    pub pixel: u32,
    /// About its radiance, all channels; above 0.
    pub scale: f64,
    /// Variance of one sample, all channels.
    pub variance: f64,
}

/// Which pixel takes how many of the samples.
#[derive(Clone, Debug)]
pub(super) struct Allocation {
    /// Mean number of samples a pixel when this was last decided.
    since: u32,
    /// By pixel: samples due then, with a fraction, and due for each that a pixel takes on average since.
    due: Vec<[f64; 2]>,
}

impl Allocation {
    /// The same for each of `n_pixels`.
    pub fn even(n_pixels: usize) -> Allocation {
        Allocation {
            since: 0,
            due: vec![[0.0, 1.0]; n_pixels],
        }
    }

    /// Samples of pixel number `ix` when a pixel has `samples` on average, no fewer than at the last decision.
    pub fn samples(&self, ix: usize, samples: u32) -> u32 {
        let [due, each] = self.due[ix];
        (due + each * f64::from(samples - self.since)) as u32
    }

    /// After how many samples a pixel the rest are shared out anew, if there are `samples` now.
    pub fn next(samples: u32) -> u32 {
        (samples + 1).next_power_of_two().max(FIRST)
    }

    /// Shares out the samples after `samples`, when `noise` is known of the pixels of a picture `width` wide.
    /// `dithers`, one of each pixel in 0..1, say which pixels have one more where a fraction is due.
    pub fn decide(
        &mut self,
        samples: u32,
        noise: &[Noise],
        width: usize,
        dithers: impl Iterator<Item = f64>,
    ) {
        for (due, dither) in self.due.iter_mut().zip(dithers) {
            let first = if self.since == 0 { dither } else { 0.0 };
            due[0] += first + due[1] * f64::from(samples - self.since);
        }
        self.since = samples;
        let deviations = deviations(noise, width);
        let mean = deviations.iter().sum::<f64>() / deviations.len() as f64;
        if mean <= 0.0 {
            self.due.iter_mut().for_each(|due| due[1] = 1.0);
            return;
        }
        let until = f64::from(Allocation::next(samples));
        let more = until - f64::from(samples);
        for (due, deviation) in self.due.iter_mut().zip(&deviations) {
            let wanted = until * (deviation / mean).clamp(LEAST, MOST);
            due[1] = (wanted - due[0]).max(0.0) / more;
        }
        let wanted = self.due.iter().map(|due| due[1]).sum::<f64>() / self.due.len() as f64;
        for due in &mut self.due {
            // More than there are to be had are wanted, or what nobody wants is for all.
            due[1] = match wanted > 1.0 {
                true => due[1] / wanted,
                false => due[1] + (1.0 - wanted),
            };
        }
    }
}

/// Standard deviation of a sample of each pixel: the variance of those around goes with the scale.
fn deviations(noise: &[Noise], width: usize) -> Vec<f64> {
    let place = |noise: &Noise| {
        let pixel = noise.pixel as usize;
        [pixel % width / SIDE, pixel / width / SIDE]
    };
    let across = width.div_ceil(SIDE);
    let down = noise.iter().map(|noise| place(noise)[1] + 1).max();
    let mut tiles = vec![[0.0; 2]; across * down.unwrap_or(0)];
    for noise in noise {
        let [x, y] = place(noise);
        let [variance, scale] = &mut tiles[y * across + x];
        *variance += noise.variance;
        *scale += noise.scale;
    }
    let whole = tiles.iter().fold([0.0; 2], add);
    let ratios: Vec<f64> = (0..tiles.len())
        .map(|ix| {
            let [x, y] = [ix % across, ix / across];
            let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(tiles.len() / across);
            let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(across);
            let others = rows.flat_map(|row| columns.clone().map(move |x| row * across + x));
            let others = others.filter(|other| *other != ix);
            let [variance, scale] = match others.map(|ix| &tiles[ix]).fold([0.0; 2], add) {
                // There are none: a picture of one tile, or one that lies alone.
                [_, 0.0] => whole,
                around => around,
            };
            variance / scale
        })
        .collect();
    let deviation = |noise: &Noise| {
        let [x, y] = place(noise);
        (ratios[y * across + x] * noise.scale).max(0.0).sqrt()
    };
    noise.iter().map(deviation).collect()
}

fn add(sum: [f64; 2], other: &[f64; 2]) -> [f64; 2] {
    [sum[0] + other[0], sum[1] + other[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of a picture 64 pixels wide and high whose right half is ten times as noisy.
    fn halves() -> Vec<Noise> {
        let of = |pixel: u32| Noise {
            pixel,
            scale: 1.0,
            variance: if pixel % 64 < 32 { 0.01 } else { 1.0 },
        };
        (0..64 * 64).map(of).collect()
    }

    fn dithers() -> impl Iterator<Item = f64> {
        (0..).map(|ix| (f64::from(ix) * 0.618).fract())
    }

    #[test]
    fn noisy_pixels_take_more_and_all_together_as_many() {
        let noise = halves();
        let mut allocation = Allocation::even(noise.len());
        for samples in [2, 4, 8, 16] {
            allocation.decide(samples, &noise, 64, dithers());
        }
        let of = |ix: usize| f64::from(allocation.samples(ix, 32));
        let mean = |from: usize| {
            let columns = (from..from + 16).flat_map(|x| (0..64).map(move |y| y * 64 + x));
            columns.map(of).sum::<f64>() / (16.0 * 64.0)
        };
        let [quiet, noisy] = [0, 48].map(mean);
        assert!((6.5..8.5).contains(&quiet), "{quiet}");
        assert!(noisy > 48.0, "{noisy}");
        let all = (0..noise.len()).map(of).sum::<f64>() / noise.len() as f64;
        assert!((all - 32.0).abs() < 0.1, "{all}");
    }

    #[test]
    fn samples_only_grow() {
        let mut noise = halves();
        let mut allocation = Allocation::even(noise.len());
        let mut last = vec![0; noise.len()];
        for samples in 1..40 {
            for (ix, last) in last.iter_mut().enumerate() {
                let now = allocation.samples(ix, samples);
                assert!(now >= *last, "pixel {ix}: {last} and then {now}");
                *last = now;
            }
            if Allocation::next(samples - 1) == samples {
                allocation.decide(samples, &noise, 64, dithers());
                noise.reverse();
                noise
                    .iter_mut()
                    .zip(0..)
                    .for_each(|(noise, ix)| noise.pixel = ix);
            }
        }
        assert!(last.iter().all(|&n| n >= FIRST));
    }

    #[test]
    fn a_pixel_has_no_say_in_its_own_samples() {
        let mut noise = halves();
        let mut before = Allocation::even(noise.len());
        before.decide(FIRST, &noise, 64, dithers());
        noise[20 * 64 + 20].variance = 1e4;
        let mut after = Allocation::even(noise.len());
        after.decide(FIRST, &noise, 64, dithers());
        // Beside another of its tile, and one of the next tile.
        let [own, other, next] = [20 * 64 + 20, 20 * 64 + 21, 20 * 64 + 20 + SIDE];
        let share = |allocation: &Allocation, ix: usize| allocation.due[ix][1];
        assert_eq!(share(&after, own), share(&after, other));
        assert!(share(&after, own) < share(&before, own) + 1e-9);
        assert!(share(&after, next) > 2.0 * share(&before, next));
    }

    #[test]
    fn without_noise_all_take_as_many() {
        let still = |noise: &Noise| Noise {
            variance: 0.0,
            ..*noise
        };
        let noise: Vec<Noise> = halves().iter().map(still).collect();
        let mut allocation = Allocation::even(noise.len());
        allocation.decide(FIRST, &noise, 64, dithers());
        assert!((0..noise.len()).all(|ix| (6..=7).contains(&allocation.samples(ix, 6))));
    }
}
