//! Small pictures of the states of a document, for its history.

use egui::{Color32, ColorImage, TextureHandle, TextureOptions};

/// Width and height, pixels.
pub const SIZE: [usize; 2] = [72, 48];

/// Most pictures that are kept, 14 KB each: the oldest goes first.
const MOST: usize = 128;

/// Pictures by the number of the state that they show.
#[derive(Default)]
pub struct Thumbnails {
    pictures: Vec<(u64, TextureHandle)>,
}

impl std::fmt::Debug for Thumbnails {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let states = self.pictures.iter().map(|(state, _)| state);
        f.debug_list().entries(states).finish()
    }
}

impl Thumbnails {
    /// That of a state.
    pub fn of(&self, state: u64) -> Option<&TextureHandle> {
        let found = self.pictures.iter().find(|(of, _)| *of == state);
        found.map(|(_, picture)| picture)
    }

    /// Keeps a picture of a state, of rows of sRGB times alpha; nothing where it has no pixels.
    pub fn keep(&mut self, egui: &egui::Context, state: u64, size: [u32; 2], pixels: &[[u8; 4]]) {
        let Some(small) = reduced(size, pixels) else {
            return;
        };
        let image = ColorImage::new(SIZE, small);
        let texture = egui.load_texture("thumbnail", image, TextureOptions::LINEAR);
        self.pictures.retain(|(of, _)| *of != state);
        if self.pictures.len() == MOST {
            drop(self.pictures.remove(0));
        }
        self.pictures.push((state, texture));
    }

    /// Forgets the pictures of states that can no longer be gone to.
    pub fn retain(&mut self, is_there: impl Fn(u64) -> bool) {
        self.pictures.retain(|(state, _)| is_there(*state));
    }

    /// Forgets all of them, which were on a device that is lost.
    pub fn forget(&mut self) {
        self.pictures.clear();
    }
}

/// The middle of a picture in [`SIZE`]: means of the pixels in it.
fn reduced(size: [u32; 2], pixels: &[[u8; 4]]) -> Option<Vec<Color32>> {
    let [width, height] = size.map(|side| side as usize);
    if width == 0 || height == 0 || pixels.len() != width * height {
        return None;
    }
    // As much of it as has the shape of a thumbnail.
    let share = f64::min(
        width as f64 / SIZE[0] as f64,
        height as f64 / SIZE[1] as f64,
    );
    let left = 0.5 * (width as f64 - share * SIZE[0] as f64);
    let top = 0.5 * (height as f64 - share * SIZE[1] as f64);
    // The pixels of one of the thumbnail's, at least one.
    let span = |at: usize, first: f64, side: usize| {
        let start = ((first + share * at as f64) as usize).min(side - 1);
        let end = (first + share * (at + 1) as f64) as usize;
        start..end.clamp(start + 1, side)
    };
    let pixel = |ix: usize| {
        let (columns, rows) = (
            span(ix % SIZE[0], left, width),
            span(ix / SIZE[0], top, height),
        );
        let mut sum = [0u64; 4];
        let n = (columns.len() * rows.len()) as u64;
        for row in rows {
            for rgba in &pixels[row * width..][columns.clone()] {
                for (sum, value) in sum.iter_mut().zip(rgba) {
                    *sum += u64::from(*value);
                }
            }
        }
        let [r, g, b, a] = sum.map(|sum| ((sum + n / 2) / n) as u8);
        Color32::from_rgba_premultiplied(r, g, b, a)
    };
    Some((0..SIZE[0] * SIZE[1]).map(pixel).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thumbnails_are_means_of_the_middle() {
        // Twice as wide as a thumbnail: its middle half is white, the rest black.
        let size = [4 * SIZE[0] as u32, 2 * SIZE[1] as u32];
        let white = |ix: usize| {
            let x = ix % size[0] as usize;
            (SIZE[0]..3 * SIZE[0]).contains(&x)
        };
        let n = (size[0] * size[1]) as usize;
        let pixels: Vec<[u8; 4]> = (0..n)
            .map(|ix| if white(ix) { [255; 4] } else { [0, 0, 0, 255] })
            .collect();
        let small = reduced(size, &pixels).expect("pixels");
        assert!(small.iter().all(|pixel| *pixel == Color32::WHITE));
        // Stripes of a pixel become grey.
        let stripes: Vec<[u8; 4]> = (0..n).map(|ix| [255 * (ix % 2) as u8; 4]).collect();
        let small = reduced(size, &stripes).expect("pixels");
        assert!(small.iter().all(|pixel| pixel.r() == 128));
        // Of any size, down to a pixel.
        assert_eq!(
            reduced([1, 1], &[[9; 4]]).expect("a pixel").len(),
            SIZE[0] * SIZE[1]
        );
        assert!(reduced([0, 3], &[]).is_none() && reduced([2, 2], &[[0; 4]]).is_none());
    }

    #[test]
    fn as_many_are_kept_as_there_is_room_for() {
        let egui = egui::Context::default();
        let mut thumbnails = Thumbnails::default();
        for state in 0..2 * MOST as u64 {
            thumbnails.keep(&egui, state, [1, 1], &[[255; 4]]);
            thumbnails.keep(&egui, state, [1, 1], &[[0; 4]]);
        }
        assert_eq!(thumbnails.pictures.len(), MOST);
        assert!(thumbnails.of(0).is_none() && thumbnails.of(2 * MOST as u64 - 1).is_some());
        thumbnails.retain(|state| state == 2 * MOST as u64 - 2);
        assert_eq!(thumbnails.pictures.len(), 1);
        thumbnails.forget();
        assert!(thumbnails.of(2 * MOST as u64 - 2).is_none());
    }
}
