//! What each light comes to at the visible points, kept for lights of other colours.
//!
//! A light that is dimmed, tinted, off or on again then shows after a few multiplications a point. That is
//! right but for the width of forward scattered light, which takes its mean over the channels with the
//! light's colour, and for rounding; so the picture is shaded again as soon as that one is shown.

use rayon::prelude::*;
use strandlight_scattering::wide::LANES;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::strands::Strands;

use super::super::along_segments::{Along, add_along, shares_along};
use super::super::halves::{n_numbers, whole};
use super::super::radiance::Radiance;
use super::super::unblocked::{Unblocked, VisiblePoint};

/// Most bytes that are kept.
const MAX_BYTES: usize = 256 << 20;

/// Visible points that a thread works on at a time.
const CHUNK: usize = 256;

/// Radiance of the visible points by light, for an amplitude of 1.
pub(super) struct Kept {
    /// The lights, indices in the scene's list: a column each.
    lights: Vec<u32>,
    /// Columns of narrow lights. What single scattering of them comes to at the nodes about a place, unblocked,
    /// has columns of its own after those of all lights, [`N_NODES`] each.
    narrow: Vec<usize>,
    /// Columns that are found at all places.
    is_found: Vec<bool>,
    /// `[place][channel][column]`, whole vectors of columns: the upper halves of floats.
    numbers: Vec<u16>,
    /// Have all places numbers of the fibre as it is, but for paint?
    is_whole: bool,
    /// By place, light of the proxies at painted points; nothing where there is none. And what the proxies sent back in all.
    bounced: (Vec<[f32; 4]>, [f32; 3]),
}

/// Columns of single scattering of a narrow light.
pub(in super::super) const N_NODES: usize = 3;

/// Columns of narrow lights among those of `lights`, indices into `all`.
pub(in super::super) fn narrow_columns(lights: &[u32], all: &[LightRecord]) -> Vec<usize> {
    let columns = (0..).zip(lights);
    columns
        .filter(|(_, light)| all[**light as usize].is_narrow())
        .map(|(column, _)| column)
        .collect()
}

impl Kept {
    /// Nothing yet of some `lights` of `all`, at `n_places` points; none if it is too much.
    pub fn new(lights: &[u32], all: &[LightRecord], n_places: usize) -> Option<Kept> {
        let narrow = narrow_columns(lights, all);
        let n = n_numbers(lights.len() + N_NODES * narrow.len()) * n_places;
        (size_of::<u16>() * n <= MAX_BYTES).then(|| Kept {
            lights: lights.to_vec(),
            narrow,
            is_found: vec![false; lights.len()],
            numbers: vec![0; n],
            is_whole: false,
            bounced: (Vec::new(), [0.0; 3]),
        })
    }

    /// Has it room for what is found of these `lights` of `all` at as many points?
    pub fn is_of(&self, lights: &[u32], all: &[LightRecord], n_places: usize) -> bool {
        self.lights == lights
            && self.narrow == narrow_columns(lights, all)
            && self.numbers.len() == self.n_numbers() * n_places
    }

    /// Numbers of a place.
    fn n_numbers(&self) -> usize {
        n_numbers(self.lights.len() + N_NODES * self.narrow.len())
    }

    /// What was found is that of another fibre, or of other shadows: the lights and places are the same.
    pub fn outdate(&mut self) {
        self.is_found.fill(false);
        self.is_whole = false;
    }

    /// Some places have other paint, where what was found is to be taken anew.
    pub fn repaint(&mut self) {
        self.is_found.fill(false);
    }

    /// Has it all but what is repainted?
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Takes light of the proxies at painted points, nothing at others, of some places; none is that of no place at all.
    pub fn take_bounced(
        &mut self,
        places: &[u32],
        found: Option<&[[f32; 4]]>,
        sent_back: [f32; 3],
    ) {
        let n_places = self.numbers.len() / self.n_numbers().max(1);
        let (bounced, of) = &mut self.bounced;
        bounced.resize(if found.is_some() { n_places } else { 0 }, [0.0; 4]);
        for (&place, found) in places.iter().zip(found.unwrap_or_default()) {
            bounced[place as usize] = *found;
        }
        *of = sent_back;
    }

    /// That light by place, and what the proxies sent back in all; nothing where no point is painted.
    pub fn bounced(&self) -> (&[[f32; 4]], [f32; 3]) {
        (&self.bounced.0, self.bounced.1)
    }

    /// Takes what was found of the lights of `all` that are not black, at some places.
    pub fn take(&mut self, all: &[LightRecord], places: &[u32], found: &[u16]) {
        let n = self.n_numbers();
        let n_row = n / 3;
        let of_nodes = self.narrow.iter().flat_map(|column| [*column; N_NODES]);
        let columns = (0..self.lights.len()).chain(of_nodes);
        let is_lit: Vec<bool> = columns
            .map(|column| all[self.lights[column] as usize].power > 0.0)
            .collect();
        for (&place, found) in places.iter().zip(found.chunks_exact(n)) {
            let numbers = &mut self.numbers[n * place as usize..][..n];
            let at = |channel: usize, column: usize| channel * n_row + column;
            if is_lit.iter().all(|is_lit| *is_lit) {
                numbers.copy_from_slice(found);
                continue;
            }
            for channel in 0..3 {
                for (column, is_lit) in is_lit.iter().enumerate() {
                    if *is_lit {
                        numbers[at(channel, column)] = found[at(channel, column)];
                    }
                }
            }
        }
    }

    /// All is found of the lights that are not black.
    pub fn is_taken(&mut self, all: &[LightRecord]) {
        self.is_whole = true;
        for (is_found, light) in self.is_found.iter_mut().zip(&self.lights) {
            *is_found |= all[*light as usize].power > 0.0;
        }
    }

    /// Is there all that shows of the lights?
    pub fn serves(&self, all: &[LightRecord]) -> bool {
        let column = |light: usize| self.lights.iter().position(|ix| *ix as usize == light);
        all.iter().enumerate().all(|(ix, light)| {
            light.power <= 0.0 || column(ix).is_some_and(|column| self.is_found[column])
        })
    }

    /// Radiance of the `visible` points of `strands` in the colours of `all`, times `scale`, by the shadow
    /// `maps`.
    pub fn radiance(
        &self,
        all: &[LightRecord],
        (strands, visible): (&Strands, &[u32]),
        maps: &Unblocked,
        scale: f32,
    ) -> Radiance {
        Radiance {
            at: self.at(all, scale),
            along: match self.narrow[..] {
                [] => Vec::new(),
                _ => self.along(all, (strands, visible), maps, scale),
            },
        }
    }

    /// Of narrow lights along segments.
    fn along(
        &self,
        all: &[LightRecord],
        (strands, visible): (&Strands, &[u32]),
        maps: &Unblocked,
        scale: f32,
    ) -> Vec<Along> {
        let n = self.n_numbers();
        let n_row = n / 3;
        let of_place = |(place, numbers): (usize, &[u16])| {
            let point = visible[place] as usize;
            let at = VisiblePoint { place, point };
            let mut along = Along::default();
            let columns = (self.lights.len()..).step_by(N_NODES);
            for (column, of) in columns.zip(&self.narrow) {
                let light = &all[self.lights[*of] as usize];
                if light.power > 0.0
                    && let Some(shares) = shares_along(strands, maps, light, at, scale)
                {
                    let nodes = [0, 1, 2].map(|node| {
                        let value = |channel| whole(numbers[channel * n_row + column + node]);
                        [0, 1, 2].map(|channel| light.rgb[channel] * value(channel))
                    });
                    add_along(&mut along, &shares, &nodes);
                }
            }
            along
        };
        let numbers = self.numbers.par_chunks_exact(n);
        numbers.enumerate().map(of_place).collect()
    }

    /// Of all but that: rgb, and zero.
    fn at(&self, all: &[LightRecord], scale: f32) -> Vec<[f32; 4]> {
        let n = self.n_numbers();
        let n_row = n / 3;
        let mut colors = vec![0.0; n];
        for (column, light) in self.lights.iter().enumerate() {
            let light = &all[*light as usize];
            for (channel, value) in light.rgb.iter().enumerate() {
                if light.power > 0.0 {
                    colors[channel * n_row + column] = value * scale;
                }
            }
        }
        let mut radiance = vec![[0.0; 4]; self.numbers.len() / n.max(1)];
        radiance
            .par_chunks_mut(CHUNK)
            .zip(self.numbers.par_chunks(n.max(1) * CHUNK))
            .for_each(|(radiance, numbers)| {
                for (radiance, numbers) in radiance.iter_mut().zip(numbers.chunks_exact(n)) {
                    let rows = numbers.chunks_exact(n_row).zip(colors.chunks_exact(n_row));
                    for (sum, (numbers, colors)) in radiance.iter_mut().zip(rows) {
                        let mut sums = [0.0; LANES];
                        let eights = numbers.as_chunks::<LANES>().0.iter();
                        for (numbers, colors) in eights.zip(colors.as_chunks::<LANES>().0) {
                            for lane in 0..LANES {
                                sums[lane] += whole(numbers[lane]) * colors[lane];
                            }
                        }
                        *sum = sums.iter().sum();
                    }
                }
            });
        radiance
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::halves::half;
    use super::*;

    fn light(rgb: [f32; 3]) -> LightRecord {
        LightRecord {
            rgb,
            power: rgb[0].max(rgb[1]).max(rgb[2]),
            ..bytemuck::Zeroable::zeroed()
        }
    }

    #[test]
    fn lights_add_up_in_their_colors() {
        // Three of four lights, at two places, of which one is shaded later.
        let lights = [3, 0, 1];
        let all = [[1.0; 3]; 4].map(light);
        let mut kept = Kept::new(&lights, &all, 2).expect("few bytes");
        let n = n_numbers(3);
        let found = |place: usize| -> Vec<u16> {
            (0..n).map(|ix| half((ix + 100 * place) as f32)).collect()
        };
        let [red, green, white] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0; 3]];
        let all = [red, green, white, white].map(light);
        kept.take(&all, &[1], &found(1));
        assert!(!kept.serves(&all));
        kept.take(&all, &[0], &found(0));
        kept.is_taken(&all);
        assert!(
            !kept.serves(&all),
            "nothing was found of the light of index 2"
        );
        let all = [red, green, [0.0; 3], [2.0; 3]].map(light);
        assert!(kept.serves(&all));
        let radiance = kept.at(&all, 4.0);
        // Columns 0, 1, 2 are the lights 3, 0, 1; rows are eight long.
        assert_eq!(
            radiance[0],
            [4.0 * (0.0 + 1.0), 4.0 * (16.0 + 10.0), 4.0 * 32.0, 0.0]
        );
        assert_eq!(radiance[1][0], 4.0 * (200.0 + 101.0));
        // What is black keeps what it had.
        let without = [[0.0; 3], green, [0.0; 3], [2.0; 3]].map(light);
        kept.take(&without, &[0, 1], &vec![0; 2 * n]);
        kept.is_taken(&without);
        assert_eq!(kept.at(&all, 4.0)[0], [4.0, 0.0, 0.0, 0.0]);
        kept.outdate();
        assert!(!kept.serves(&all));
    }

    #[test]
    fn places_with_other_paint_are_taken_anew() {
        let all = [light([1.0; 3])];
        let mut kept = Kept::new(&[0], &all, 2).expect("few bytes");
        let n = n_numbers(1);
        let found = |value: f32| vec![half(value); n];
        kept.take(&all, &[0, 1], &[found(1.0), found(2.0)].concat());
        kept.is_taken(&all);
        assert!(kept.serves(&all) && kept.is_whole());
        kept.take_bounced(&[0, 1], Some(&[[0.0; 4], [4.0; 4]]), [8.0; 3]);
        kept.repaint();
        assert!(!kept.serves(&all), "the other paint is not in it");
        assert!(kept.is_whole());
        kept.take(&all, &[1], &found(16.0));
        kept.take_bounced(&[1], Some(&[[5.0; 4]]), [8.0; 3]);
        kept.is_taken(&all);
        assert!(kept.serves(&all));
        let at: Vec<f32> = kept.at(&all, 1.0).iter().map(|at| at[0]).collect();
        assert_eq!(at, [1.0, 16.0]);
        assert_eq!(kept.bounced(), (&[[0.0; 4], [5.0; 4]][..], [8.0; 3]));
        // Of no painted point any more.
        kept.take_bounced(&[1], None, [8.0; 3]);
        assert!(kept.bounced().0.is_empty());
        // Of another fibre all are.
        kept.outdate();
        assert!(!kept.is_whole());
    }

    #[test]
    fn too_much_is_not_kept() {
        let all = [light([1.0; 3])];
        assert!(Kept::new(&[0; 1000], &all, 100_000).is_none());
    }
}
