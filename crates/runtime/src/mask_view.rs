//! The mask over the picture: hair that is protected from brushes, tinted.
//!
//! A layer of its own, so that it lies over what either renderer draws and is in no picture that is saved. Which point of
//! the groom a pixel shows depends on the view alone and is found once for each; a stroke then tints pixels by what
//! they show.

#[cfg(not(target_arch = "wasm32"))]
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use strandlight_cpu::{DisplayPixels, coverage, data_layers};
use strandlight_scene::layers::{self, Data, Layer};
use strandlight_scene::paint::{Picker, PointMask};
use strandlight_scene::{PreparedScene, RenderError};

use crate::interactive::new_version;

/// Of protected hair, sRGB: a blue that no hair has of itself.
const TINT: [f32; 3] = [30.0, 110.0, 255.0];
/// How much of the picture it hides where hair is protected wholly.
const OPACITY: f32 = 0.65;

/// What a pixel shows: a point of the groom, the share of the way to the next, and how much of the pixel is hair.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SeenPoint {
    point: u32,
    fraction: f32,
    coverage: f32,
}

/// What the pixels of a picture show of the strands, as data layers have it.
struct SeenStrands {
    size: [u32; 2],
    /// Number of the strand in the groom, -1 for none.
    strands: Vec<f32>,
    /// Share of its length from the root.
    along: Vec<f32>,
    coverage: Vec<f32>,
}

impl SeenStrands {
    fn of(scene: &PreparedScene, size: [u32; 2]) -> Result<SeenStrands, RenderError> {
        let wanted = [Data::StrandId, Data::RootDistance];
        let found = layers::data_layers().filter(|(_, data)| wanted.contains(data));
        let found: Vec<&Layer> = found.map(|(layer, _)| layer).collect();
        let layers = data_layers(scene, &scene.camera, size, &found)?;
        let mut channels = layers.into_iter().map(|(_, values)| values);
        let mut next = || channels.next().unwrap_or_default();
        let (strands, along) = (next(), next());
        let [coverage, _] = coverage(scene, &scene.camera, size)?;
        Ok(SeenStrands {
            size,
            strands,
            along,
            coverage,
        })
    }

    /// By point; `offsets` are the first points of the groom's strands.
    fn points(&self, offsets: &[u32], picker: &Picker) -> Vec<Option<SeenPoint>> {
        let pixels = self.strands.iter().zip(&self.along).zip(&self.coverage);
        let point = |((&strand, &along), &coverage): ((&f32, &f32), &f32)| {
            // None is -1.
            let first = *offsets.get((strand >= 0.0).then_some(strand as usize)?)?;
            let (point, fraction) = picker.at_share(first, along)?;
            Some(SeenPoint {
                point,
                fraction,
                coverage: coverage.clamp(0.0, 1.0),
            })
        };
        pixels.map(point).collect()
    }
}

/// Pixels over the picture: sRGB times alpha.
struct Overlay {
    pixels: Vec<[u8; 4]>,
    size: [u32; 2],
    version: u64,
}

/// The mask as it is shown.
#[derive(Default)]
pub struct MaskView {
    is_wanted: bool,
    /// What the pixels of the picture of that number show, and its size.
    seen: Option<(u64, [u32; 2], Vec<Option<SeenPoint>>)>,
    #[cfg(not(target_arch = "wasm32"))]
    asked: Option<(u64, Receiver<Result<SeenStrands, RenderError>>)>,
    /// Of `seen` and the mask, unless that has changed since.
    overlay: Option<Overlay>,
    is_outdated: bool,
}

impl MaskView {
    /// Is it shown?
    pub fn is_wanted(&self) -> bool {
        self.is_wanted
    }

    /// Shows it or not.
    pub fn set_wanted(&mut self, is_wanted: bool) {
        if is_wanted != self.is_wanted {
            *self = MaskView {
                is_wanted,
                ..MaskView::default()
            };
        }
    }

    /// The mask is another one.
    pub fn set_outdated(&mut self) {
        self.is_outdated = true;
    }

    /// Is what pixels show on its way?
    #[cfg(not(target_arch = "wasm32"))]
    pub fn is_working(&self) -> bool {
        self.is_wanted && self.asked.is_some()
    }

    /// Has it to be found what the picture of that number shows? One thread looks at a time.
    pub fn wants(&self, number: u64) -> bool {
        #[cfg(not(target_arch = "wasm32"))]
        let is_free = self.asked.is_none();
        #[cfg(target_arch = "wasm32")]
        let is_free = true;
        let is_known = self.seen.as_ref().is_some_and(|(of, ..)| *of == number);
        self.is_wanted && is_free && !is_known
    }

    /// Starts to find what the picture of `scene`, which has that number, shows.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn start(&mut self, number: u64, scene: PreparedScene, size: [u32; 2]) {
        let (tell, answer) = channel();
        self.asked = Some((number, answer));
        std::thread::spawn(move || {
            // Nobody listens any more where the mask is no longer shown.
            let _ = tell.send(crate::apart::apart(|| SeenStrands::of(&scene, size)));
        });
    }

    /// Takes up what was found.
    ///
    /// # Errors
    /// What could not be drawn.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn take(&mut self, offsets: &[u32], picker: &Picker) -> Result<(), RenderError> {
        let Some((number, answer)) = &self.asked else {
            return Ok(());
        };
        match answer.try_recv() {
            Ok(seen) => {
                let (number, seen) = (*number, seen);
                self.asked = None;
                self.found(number, &seen?, offsets, picker);
            }
            Err(TryRecvError::Disconnected) => self.asked = None,
            Err(TryRecvError::Empty) => {}
        }
        Ok(())
    }

    /// A page has one thread: finds it at once.
    ///
    /// # Errors
    /// What could not be drawn.
    #[cfg(target_arch = "wasm32")]
    pub fn find(
        &mut self,
        number: u64,
        scene: &PreparedScene,
        size: [u32; 2],
        offsets: &[u32],
        picker: &Picker,
    ) -> Result<(), RenderError> {
        let seen = SeenStrands::of(scene, size)?;
        self.found(number, &seen, offsets, picker);
        Ok(())
    }

    fn found(&mut self, number: u64, seen: &SeenStrands, offsets: &[u32], picker: &Picker) {
        let points = seen.points(offsets, picker);
        self.seen = Some((number, seen.size, points));
        self.overlay = None;
    }

    /// Tints the pixels of the picture of that number by `mask`, where that or the picture changed.
    pub fn tint(&mut self, number: u64, mask: Option<&PointMask>) {
        let Some((_, size, points)) = self.seen.as_ref().filter(|(of, ..)| *of == number) else {
            self.overlay = None;
            return;
        };
        if self.overlay.is_some() && !std::mem::take(&mut self.is_outdated) {
            return;
        }
        self.is_outdated = false;
        let tints = points
            .iter()
            .map(|seen| seen.map_or([0; 4], |seen| tint(seen, mask)));
        self.overlay = Some(Overlay {
            pixels: tints.collect(),
            size: *size,
            version: new_version(),
        });
    }

    /// What lies over the picture; none while it is not known what that shows.
    pub fn display(&self) -> Option<DisplayPixels<'_>> {
        let overlay = self.overlay.as_ref()?;
        Some(DisplayPixels {
            pixels: &overlay.pixels,
            size: overlay.size,
            version: overlay.version,
        })
    }
}

/// The tint of a pixel, times its alpha.
fn tint(seen: SeenPoint, mask: Option<&PointMask>) -> [u8; 4] {
    let at = |point: u32| mask.and_then(|mask| mask.points.get(point as usize).copied());
    let from = at(seen.point).unwrap_or(0.0);
    let to = at(seen.point + 1).unwrap_or(from);
    let mask = match seen.fraction > 0.0 {
        true => from + seen.fraction * (to - from),
        false => from,
    };
    let alpha = OPACITY * mask * seen.coverage;
    let [r, g, b] = TINT.map(|level| (alpha * level).round() as u8);
    [r, g, b, (alpha * 255.0).round() as u8]
}

#[cfg(test)]
mod tests {
    use strandlight_scene::strands::Strands;

    use super::*;

    #[test]
    fn pixels_are_tinted_by_the_mask_of_what_they_show() {
        let points = [[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0]];
        let offsets = [0, 2, 4];
        let strands = Strands::new(&points, &offsets, |_, _| 0.01, false).expect("strands");
        let picker = Picker::new(&strands);
        let seen = SeenStrands {
            size: [5, 1],
            strands: vec![-1.0, 0.0, 1.0, 1.0, 7.0],
            along: vec![0.0, 0.0, 0.5, 1.0, 0.0],
            coverage: vec![0.0, 1.0, 1.0, 0.5, 1.0],
        };
        let mut view = MaskView::default();
        assert!(!view.wants(3));
        view.set_wanted(true);
        assert!(view.wants(3));
        view.found(3, &seen, &offsets, &picker);
        assert!(!view.wants(3) && view.wants(4));
        let mask = PointMask {
            points: vec![0.0, 1.0, 0.0, 1.0],
        };
        view.tint(3, Some(&mask));
        let display = view.display().expect("an overlay");
        let alphas: Vec<u8> = display.pixels.iter().map(|pixel| pixel[3]).collect();
        // Nothing, a root, half way, a tip that covers half its pixel, no strand of that number.
        assert_eq!(alphas, [0, 0, 83, 83, 0]);
        assert!(
            display
                .pixels
                .iter()
                .all(|[r, g, b, a]| r.max(g).max(b) <= a)
        );
        let version = display.version;
        view.tint(3, Some(&mask));
        assert_eq!(view.display().map(|it| it.version), Some(version));
        view.set_outdated();
        view.tint(3, None);
        let display = view.display().expect("an overlay");
        assert!(display.version != version && display.pixels.iter().all(|it| *it == [0; 4]));
        // Of another picture nothing is known.
        view.tint(4, Some(&mask));
        assert!(view.display().is_none());
    }
}
