//! The mask over the picture: hair that is protected from brushes, tinted.
//!
//! A layer of its own, so that it lies over what either renderer draws and is in no picture that is saved. Which point of
//! the groom a pixel shows depends on the view alone and is found once for each; a stroke then tints pixels by what
//! they show. While the view turns, the tints go where their hair is seen now.

#[cfg(not(target_arch = "wasm32"))]
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use glam::Vec3;
use strandlight_cpu::{DisplayPixels, coverage, data_layers};
use strandlight_scene::Camera;
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
    camera: Camera,
    /// Along the optical axis, cm.
    depth: Vec<f32>,
    /// Number of the strand in the groom, -1 for none.
    strands: Vec<f32>,
    /// Share of its length from the root.
    along: Vec<f32>,
    coverage: Vec<f32>,
}

impl SeenStrands {
    fn of(scene: &PreparedScene, size: [u32; 2]) -> Result<SeenStrands, RenderError> {
        let wanted = [Data::Depth, Data::StrandId, Data::RootDistance];
        let found = layers::data_layers().filter(|(_, data)| wanted.contains(data));
        let found: Vec<&Layer> = found.map(|(layer, _)| layer).collect();
        let layers = data_layers(scene, &scene.camera, size, &found)?;
        let mut channels = layers.into_iter().map(|(_, values)| values);
        let mut next = || channels.next().unwrap_or_default();
        let (depth, strands, along) = (next(), next(), next());
        let [coverage, _] = coverage(scene, &scene.camera, size)?;
        Ok(SeenStrands {
            size,
            camera: scene.camera,
            depth,
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

/// What the pixels of a picture show.
struct Seen {
    /// Of the picture.
    number: u64,
    size: [u32; 2],
    camera: Camera,
    points: Vec<Option<SeenPoint>>,
    /// Along the optical axis, cm.
    depth: Vec<f32>,
}

impl Seen {
    /// Tints of the pixels.
    fn tints(&self, mask: Option<&PointMask>) -> Vec<[u8; 4]> {
        let tints = (self.points.iter()).map(|seen| seen.map_or([0; 4], |seen| tint(seen, mask)));
        tints.collect()
    }

    /// The tints where `camera` sees what they are on, in half as many columns and rows: gaps are narrower there, and it takes a
    /// quarter of the time to show.
    fn tints_from(&self, camera: &Camera, mask: Option<&PointMask>) -> (Vec<[u8; 4]>, [u32; 2]) {
        let size = self.size.map(|side| side.div_ceil(2).max(1));
        let mut tints = vec![[0; 4]; size[0] as usize * size[1] as usize];
        let [width, height] = self.size.map(|side| side as f32);
        let (right, up, forward) = self.camera.axes();
        let [right, up] = [right, up].map(|axis| axis / self.camera.focal_px(height));
        let now = (camera.axes(), camera.focal_px(height));
        let pixels = self.points.iter().zip(&self.depth).enumerate();
        for (ix, (seen, &depth)) in pixels {
            let [x, y] = [ix % self.size[0] as usize, ix / self.size[0] as usize];
            // Every other one, as on a chessboard, is enough for so few.
            let Some(seen) = seen.filter(|_| (x + y).is_multiple_of(2)) else {
                continue;
            };
            let color = tint(seen, mask);
            if color[3] == 0 {
                continue;
            }
            let [x, y] = [x as f32 + 0.5 - 0.5 * width, 0.5 * height - y as f32 - 0.5];
            let place = self.camera.eye + depth * (forward + x * right + y * up);
            let Some([x, y]) = seen_at(place - camera.eye, now) else {
                continue;
            };
            let [column, row] = [0.5 * (x + 0.5 * width), 0.5 * (0.5 * height - y)];
            if column >= 0.0 && row >= 0.0 && column < size[0] as f32 && row < size[1] as f32 {
                let at = row as usize * size[0] as usize + column as usize;
                if let Some(tint) = tints.get_mut(at).filter(|tint| tint[3] < color[3]) {
                    *tint = color;
                }
            }
        }
        (tints, size)
    }
}

/// How far right of the middle of a picture, and how far above it, a place is seen, px; none behind the eye.
fn seen_at(
    from_eye: Vec3,
    ((right, up, forward), focal_px): ((Vec3, Vec3, Vec3), f32),
) -> Option<[f32; 2]> {
    let depth = from_eye.dot(forward);
    (depth > 0.0).then(|| [right, up].map(|axis| focal_px * from_eye.dot(axis) / depth))
}

/// Pixels over the picture: sRGB times alpha.
struct Overlay {
    pixels: Vec<[u8; 4]>,
    size: [u32; 2],
    version: u64,
    /// The view that the tints of another one are shown for.
    turned_to: Option<Camera>,
}

/// The picture that a mask lies over.
#[derive(Clone, Copy)]
pub struct Below {
    /// Another one for every other picture.
    pub number: u64,
    /// Width and height.
    pub size: [u32; 2],
    /// Where it is seen from.
    pub camera: Camera,
    /// Is it on screen?
    pub is_shown: bool,
}

/// The mask as it is shown.
#[derive(Default)]
pub struct MaskView {
    is_wanted: bool,
    seen: Option<Seen>,
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

    /// The hair is elsewhere, or other hair.
    pub fn forget(&mut self) {
        (self.seen, self.overlay) = (None, None);
        // What is on its way is of the hair of before.
        #[cfg(not(target_arch = "wasm32"))]
        {
            self.asked = None;
        }
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
        let is_known = self.seen.as_ref().is_some_and(|seen| seen.number == number);
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
                self.found(number, seen?, offsets, picker);
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
        self.found(number, seen, offsets, picker);
        Ok(())
    }

    fn found(&mut self, number: u64, found: SeenStrands, offsets: &[u32], picker: &Picker) {
        self.seen = Some(Seen {
            number,
            size: found.size,
            camera: found.camera,
            points: found.points(offsets, picker),
            depth: found.depth,
        });
        self.overlay = None;
    }

    /// Tints the pixels of the picture `below` by `mask`, where that or the picture changed. While it is not known what another
    /// view shows, those of the view before go where that sees them.
    pub fn tint(&mut self, below: Below, mask: Option<&PointMask>) {
        let Some(seen) = self.seen.as_ref().filter(|seen| seen.size == below.size) else {
            self.overlay = None;
            return;
        };
        let is_same_view = seen.number == below.number || seen.camera == below.camera;
        let turned_to = match &self.overlay {
            // Until a picture of the view is on screen, that of the view before is.
            Some(overlay) if !below.is_shown => overlay.turned_to,
            _ => (!is_same_view).then_some(below.camera),
        };
        let is_current = |overlay: &Overlay| overlay.turned_to == turned_to;
        let is_outdated = std::mem::take(&mut self.is_outdated);
        if self.overlay.as_ref().is_some_and(is_current) && !is_outdated {
            return;
        }
        let (pixels, size) = match &turned_to {
            Some(camera) => seen.tints_from(camera, mask),
            None => (seen.tints(mask), seen.size),
        };
        self.overlay = Some(Overlay {
            pixels,
            size,
            version: new_version(),
            turned_to,
        });
    }

    /// Is what lies over the picture made for its view? If not, it is moved there from another.
    #[cfg(feature = "ui")]
    pub fn is_of_view(&self) -> bool {
        (self.overlay.as_ref()).is_some_and(|overlay| overlay.turned_to.is_none())
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
        let camera = Camera::framing(Vec3::ZERO, 1.0, 0.5);
        let below = |number| Below {
            number,
            size: [5, 1],
            camera: match number {
                3 => camera,
                _ => Camera::framing(Vec3::X, 1.0, 0.5),
            },
            is_shown: true,
        };
        let seen = SeenStrands {
            size: [5, 1],
            camera,
            depth: vec![1.0; 5],
            strands: vec![-1.0, 0.0, 1.0, 1.0, 7.0],
            along: vec![0.0, 0.0, 0.5, 1.0, 0.0],
            coverage: vec![0.0, 1.0, 1.0, 0.5, 1.0],
        };
        let mut view = MaskView::default();
        assert!(!view.wants(3));
        view.set_wanted(true);
        assert!(view.wants(3));
        view.found(3, seen, &offsets, &picker);
        assert!(!view.wants(3) && view.wants(4));
        let mask = PointMask {
            points: vec![0.0, 1.0, 0.0, 1.0],
        };
        view.tint(below(3), Some(&mask));
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
        view.tint(below(3), Some(&mask));
        assert_eq!(view.display().map(|it| it.version), Some(version));
        view.set_outdated();
        view.tint(below(3), None);
        let display = view.display().expect("an overlay");
        assert!(display.version != version && display.pixels.iter().all(|it| *it == [0; 4]));
        // Of another size nothing is known, nor of other hair.
        view.tint(
            Below {
                size: [4, 1],
                ..below(3)
            },
            Some(&mask),
        );
        assert!(view.display().is_none());
        view.tint(below(4), Some(&mask));
        assert!(view.display().is_some());
        view.forget();
        view.tint(below(4), Some(&mask));
        assert!(view.display().is_none());
    }

    #[test]
    fn tints_go_along_with_the_hair_while_the_view_turns() {
        let size = [40, 30];
        let camera = Camera {
            eye: Vec3::new(0.0, 0.0, 10.0),
            target: Vec3::ZERO,
            up: Vec3::Y,
            fov_y: 0.6,
        };
        // A block of pixels about the middle, on hair at the target.
        let is_in = |ix: usize| (16..24).contains(&(ix % 40)) && (11..19).contains(&(ix / 40));
        let hair = SeenPoint {
            point: 0,
            fraction: 0.0,
            coverage: 1.0,
        };
        let points = (0..1200).map(|ix| is_in(ix).then_some(hair));
        let mut view = MaskView {
            is_wanted: true,
            seen: Some(Seen {
                number: 1,
                size,
                camera,
                points: points.collect(),
                depth: vec![10.0; 1200],
            }),
            ..MaskView::default()
        };
        let mask = PointMask { points: vec![1.0] };
        // Panned so that the target is seen 10 px farther right.
        let cm = 10.0 / (15.0 / 0.3f32.tan()) * 10.0;
        let panned = Camera {
            eye: camera.eye - cm * Vec3::X,
            target: -cm * Vec3::X,
            ..camera
        };
        let below = |number, camera, is_shown| Below {
            number,
            size,
            camera,
            is_shown,
        };
        let columns = |view: &MaskView| {
            let display = view.display().expect("an overlay");
            let width = display.size[0] as usize;
            let tinted = (display.pixels.iter().enumerate()).filter(|(_, tint)| tint[3] > 0);
            let columns: Vec<usize> = tinted.map(|(ix, _)| ix % width).collect();
            let n = columns.len();
            (
                columns.iter().min().copied(),
                columns.iter().max().copied(),
                n,
            )
        };
        view.tint(below(1, camera, true), Some(&mask));
        assert_eq!(columns(&view), (Some(16), Some(23), 64));
        assert!(view.is_of_view());
        // Until the other view is on screen, the mask is where it was.
        view.tint(below(2, panned, false), Some(&mask));
        assert_eq!(columns(&view), (Some(16), Some(23), 64));
        view.tint(below(2, panned, true), Some(&mask));
        assert_eq!(view.display().map(|it| it.size), Some([20, 15]));
        assert_eq!(columns(&view), (Some(13), Some(16), 20));
        assert!(!view.is_of_view());
        // It is made once for each view.
        let version = view.display().map(|it| it.version);
        view.tint(below(3, panned, true), Some(&mask));
        assert_eq!(view.display().map(|it| it.version), version);
        // Another look of the same view has what is known of that.
        view.tint(below(4, camera, true), Some(&mask));
        assert!(view.is_of_view() && columns(&view).2 == 64);
        // What is behind the eye is not seen.
        let away = Camera {
            target: 2.0 * camera.eye,
            ..camera
        };
        view.tint(below(5, away, true), Some(&mask));
        assert_eq!(columns(&view).2, 0);
    }
}
