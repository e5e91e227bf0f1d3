//! What of a picture is shown in place of its colours: exposure in false colours, what is clipped, data of
//! the strands, errors, and parts of the light.

use std::sync::mpsc::{Receiver, TryRecvError, channel};

use strandlight_cpu::{DisplayPixels, coverage, data_layers, levels, transmittance_seen};
use strandlight_reference::converge::Converged;
use strandlight_scattering::random::SplitMix64;
use strandlight_scene::camera::Camera;
use strandlight_scene::layers::{self, Data, Layer};
use strandlight_scene::{DisplayTransform, Picture, PreparedScene, RenderError, tone};

use crate::apart::apart;
use crate::interactive::new_version;
use crate::light_layer::LightLayer;

/// What is shown of a picture in place of its colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inspection {
    /// Luminance in stops from middle grey, as colours: see [`BANDS`].
    FalseColor,
    /// Red where a channel is as bright as the screen can show, blue where all are black; the rest grey.
    Clipping,
    /// Share of the pixel that hair covers.
    Coverage,
    /// Depth of the nearest strand, the nearest white.
    Depth,
    /// Its direction, x, y and z as red, green and blue.
    Tangent,
    /// The way along it, dark at the root.
    RootDistance,
    /// A colour for each strand.
    Strands,
    /// Expected error on the way to ground truth over radiance, 20 % white.
    Error,
    /// A part of the light alone, as the picture is graded.
    Layer(LightLayer),
    /// Share of the lights' power that reaches the strand unblocked.
    Transmittance,
}

/// Luminances up to a number of stops from middle grey (0.18), and their colour.
pub const BANDS: [(f32, [u8; 3]); 10] = [
    (-8.0, [30, 0, 50]),
    (-5.5, [40, 40, 200]),
    (-3.0, [20, 130, 190]),
    (-1.0, [20, 140, 90]),
    (-0.5, [90, 110, 100]),
    (0.5, [150, 150, 150]),
    (2.0, [150, 190, 60]),
    (3.5, [240, 220, 60]),
    (5.0, [240, 140, 40]),
    (f32::INFINITY, [220, 40, 40]),
];

/// Grey that bands are counted from.
const MIDDLE_GREY: f32 = 0.18;

/// Levels from which on a screen shows nothing brighter: those that round to 255.
const CLIPPED: f32 = 254.5 / 255.0;
/// And nothing darker.
const BLACK: f32 = 0.5 / 255.0;

/// Where no strand is, in pictures whose strands may be black.
const NO_HAIR: [u8; 3] = [24, 28, 48];

/// Relative error that is white.
const WORST_ERROR: f32 = 0.2;

impl Inspection {
    /// What is made of the picture and of the strands, with what menus call it. Parts of the light are
    /// [`LightLayer::ALL`].
    pub const ALL: [(Inspection, &str); 8] = [
        (Inspection::FalseColor, "False colour"),
        (Inspection::Clipping, "Clipping"),
        (Inspection::Coverage, "Coverage"),
        (Inspection::Depth, "Depth"),
        (Inspection::Tangent, "Tangent"),
        (Inspection::RootDistance, "Root distance"),
        (Inspection::Strands, "Strands"),
        (Inspection::Error, "Error"),
    ];

    /// What menus call it.
    pub fn name(self) -> String {
        match self {
            Inspection::Layer(layer) => layer.name(),
            Inspection::Transmittance => "Transmittance".to_owned(),
            _ => {
                let found = Inspection::ALL.iter().find(|(other, _)| *other == self);
                found.map_or("", |(_, name)| name).to_owned()
            }
        }
    }

    /// What is drawn apart from the picture, a thread of its own working on it: parts of the light, and how much
    /// of it arrives.
    pub fn of_arriving_light() -> impl Iterator<Item = Inspection> {
        let layers = LightLayer::ALL.into_iter().map(Inspection::Layer);
        layers.chain([Inspection::Transmittance])
    }

    /// Is it among those, or the layer of a light?
    pub fn is_drawn_apart(self) -> bool {
        matches!(self, Inspection::Layer(_) | Inspection::Transmittance)
    }

    /// Is it of the light, and not of the strands alone? Then pixels have values: see
    /// [`Viewer::readout`](crate::Viewer::readout).
    pub fn is_of_light(self) -> bool {
        matches!(
            self,
            Inspection::FalseColor
                | Inspection::Clipping
                | Inspection::Error
                | Inspection::Layer(_)
        )
    }
}

/// Linear radiance times alpha, and alpha, with what it is shown with: exposure in stops and display
/// transform.
pub struct Radiance<'a> {
    /// The picture.
    pub picture: &'a Picture,
    /// The grade.
    pub grade: (f32, &'a DisplayTransform),
    /// On its way to ground truth, where it is.
    pub converged: Option<&'a Converged>,
}

/// Pixels of an [`Inspection`].
#[derive(Default)]
pub struct Inspected {
    pixels: Vec<[u8; 4]>,
    size: [u32; 2],
    version: u64,
}

impl Inspected {
    /// Rows of pixels from the top.
    pub fn new(pixels: Vec<[u8; 4]>, size: [u32; 2]) -> Inspected {
        Inspected {
            pixels,
            size,
            version: new_version(),
        }
    }

    /// The picture; none before there is one.
    pub fn display(&self) -> Option<DisplayPixels<'_>> {
        (!self.pixels.is_empty()).then_some(DisplayPixels {
            pixels: &self.pixels,
            size: self.size,
            version: self.version,
        })
    }
}

/// An [`Inspection`] at work.
pub struct Inspector {
    /// What is shown.
    pub inspection: Inspection,
    /// Its pixels.
    pub inspected: Inspected,
    /// What `inspected` is of.
    pub of: Option<InspectedState>,
    /// The radiance that is shown, over what is behind it.
    pub picture: Option<Picture>,
    /// What is drawn apart.
    pub apart: Apart,
}

/// What is drawn apart from the picture.
#[derive(Default)]
pub struct Apart {
    /// What was last drawn, of the picture of that number, and where it comes from.
    asked: Option<(OfPicture, Receiver<Result<Drawn, RenderError>>)>,
    /// It is on its way.
    is_drawing: bool,
    /// What came of it.
    drawn: Option<(OfPicture, Drawn)>,
}

/// What is inspected, and the number of the picture.
pub type OfPicture = (Inspection, u64);

/// Linear radiance over black, or a share of each pixel's light.
pub enum Drawn {
    /// Of a [`LightLayer`].
    Light(Picture),
    /// Of [`Inspection::Transmittance`].
    Shares(Vec<Option<f32>>),
}

impl Apart {
    /// Is it on its way?
    pub fn is_drawing(&self) -> bool {
        self.is_drawing
    }

    /// Takes up what has been drawn. Answers an error once.
    ///
    /// # Errors
    /// What could not be drawn.
    pub fn take(&mut self) -> Result<(), RenderError> {
        if let (true, Some((of, answer))) = (self.is_drawing, &self.asked) {
            match answer.try_recv() {
                Ok(drawn) => {
                    self.is_drawing = false;
                    self.drawn = Some((*of, drawn?));
                }
                Err(TryRecvError::Disconnected) => self.is_drawing = false,
                Err(TryRecvError::Empty) => {}
            }
        }
        Ok(())
    }

    /// What was drawn of that picture; of another nothing.
    pub fn of(&self, wanted: OfPicture) -> Option<&Drawn> {
        let drawn = self.drawn.as_ref();
        drawn
            .filter(|(of, _)| *of == wanted)
            .map(|(_, drawn)| drawn)
    }

    /// Has it to be drawn? One thread draws at a time, and what failed is not tried again.
    pub fn wants(&self, wanted: OfPicture) -> bool {
        !self.is_drawing && self.asked.as_ref().is_none_or(|(of, _)| *of != wanted)
    }

    /// Starts to draw what is `wanted` of `scene`.
    pub fn start(&mut self, wanted: OfPicture, scene: PreparedScene, size: [u32; 2]) {
        let (tell, answer) = channel();
        (self.asked, self.is_drawing) = (Some((wanted, answer)), true);
        std::thread::spawn(move || {
            // Nobody listens any more where the picture alone is shown by now.
            let _ = tell.send(apart(|| drawn_apart(wanted.0, scene, size)));
        });
    }
}

fn drawn_apart(
    inspection: Inspection,
    scene: PreparedScene,
    size: [u32; 2],
) -> Result<Drawn, RenderError> {
    let Inspection::Layer(layer) = inspection else {
        let shares = transmittance_seen(&scene, &scene.camera, size)?;
        return Ok(Drawn::Shares(shares));
    };
    let mut picture = layer.draw(scene, size)?;
    // Over black, as what is inspected is opaque.
    picture.rgba.iter_mut().for_each(|rgba| rgba[3] = 1.0);
    Ok(Drawn::Light(picture))
}

/// The pixels of what was drawn apart, with exposure in stops and display transform.
pub fn of_drawn(drawn: &Drawn, (exposure, display): (f32, &DisplayTransform)) -> Vec<[u8; 4]> {
    match drawn {
        Drawn::Light(picture) => {
            let mut pixels = Vec::new();
            levels(picture, (exposure.exp2(), display), &mut pixels);
            pixels
        }
        // Half the light is half the level.
        Drawn::Shares(shares) => shares
            .iter()
            .map(|share| share.map_or(opaque(NO_HAIR), grey))
            .collect(),
    }
}

/// A picture: number, exposure and display transform, and samples of ground truth.
pub type InspectedState = (u64, (f32, DisplayTransform), u32);

/// `inspection` of light; of an error none where there is nothing that tells it.
pub fn of_light(inspection: Inspection, radiance: &Radiance) -> Option<Vec<[u8; 4]>> {
    let Radiance {
        picture,
        grade: (exposure, display),
        converged,
    } = *radiance;
    let scale = exposure.exp2();
    let pixels = picture.rgba.iter();
    Some(match inspection {
        Inspection::FalseColor => pixels
            .map(|&[r, g, b, _]| opaque(band(scale * luminance([r, g, b]))))
            .collect(),
        Inspection::Clipping => pixels
            .map(|&rgba| opaque(clipping(display.graded(rgba, scale))))
            .collect(),
        Inspection::Error => {
            let converged = converged?;
            let mean = pixels.clone().map(|&[r, g, b, _]| luminance([r, g, b]));
            let floor = 0.1 * mean.sum::<f32>() / picture.rgba.len().max(1) as f32;
            let errors = converged.error.iter().zip(pixels);
            errors
                .map(|(&error, &[r, g, b, _])| {
                    let share = luminance(error) / (luminance([r, g, b]) + floor).max(1e-12);
                    grey((share / WORST_ERROR).sqrt())
                })
                .collect()
        }
        _ => return None,
    })
}

/// `inspection` of the strands of `scene` as `camera` sees them.
///
/// # Errors
/// A size out of range.
pub fn of_strands(
    inspection: Inspection,
    scene: &PreparedScene,
    camera: &Camera,
    size: [u32; 2],
) -> Result<Vec<[u8; 4]>, RenderError> {
    // In the order of the table; one drawing of the strands has all of them.
    let channels = |wanted: &[Data]| {
        let layers = layers::data_layers().filter(|(_, data)| wanted.contains(data));
        let layers: Vec<&Layer> = layers.map(|(layer, _)| layer).collect();
        let found = data_layers(scene, camera, size, &layers)?;
        Ok::<Vec<Vec<f32>>, RenderError>(found.into_iter().map(|(_, values)| values).collect())
    };
    let n_pixels = (size[0] * size[1]) as usize;
    let one = |data: Data| {
        let first = channels(&[data])?.into_iter().next();
        Ok::<Vec<f32>, RenderError>(first.unwrap_or_else(|| vec![0.0; n_pixels]))
    };
    Ok(match inspection {
        Inspection::Coverage => {
            let [of_hair, _] = coverage(scene, camera, size)?;
            of_hair.into_iter().map(grey).collect()
        }
        Inspection::Depth => {
            let depths = one(Data::Depth)?;
            let seen = || depths.iter().copied().filter(|&depth| depth > 0.0);
            let [near, far] = [
                seen().fold(f32::INFINITY, f32::min),
                seen().fold(0.0, f32::max),
            ];
            let share = |depth: f32| (far - depth) / (far - near).max(1e-6);
            depths
                .iter()
                // The farthest is seen against nothing.
                .map(|&depth| match depth > 0.0 {
                    true => grey(0.1 + 0.9 * share(depth)),
                    false => grey(0.0),
                })
                .collect()
        }
        Inspection::Tangent => {
            let axes = channels(&[Data::Tangent])?;
            let level = |value: f32| (255.0 * (0.5 + 0.5 * value.clamp(-1.0, 1.0))) as u8;
            (0..n_pixels)
                .map(|pixel| {
                    let along = [0, 1, 2].map(|axis| axes.get(axis).map_or(0.0, |a| a[pixel]));
                    match along == [0.0; 3] {
                        true => grey(0.0),
                        false => opaque(along.map(level)),
                    }
                })
                .collect()
        }
        Inspection::RootDistance => {
            let found = channels(&[Data::StrandId, Data::RootDistance])?;
            let [ids, along] = [0, 1].map(|ix| found.get(ix).map_or(&[][..], Vec::as_slice));
            let shown = along.iter().zip(ids);
            shown
                .map(|(&along, &id)| match id >= 0.0 {
                    true => grey(0.1 + 0.9 * along),
                    false => grey(0.0),
                })
                .collect()
        }
        Inspection::Strands => one(Data::StrandId)?.into_iter().map(strand).collect(),
        Inspection::FalseColor
        | Inspection::Clipping
        | Inspection::Error
        | Inspection::Layer(_)
        | Inspection::Transmittance => Vec::new(),
    })
}

/// Relative luminance of linear Rec.709.
pub fn luminance(rgb: [f32; 3]) -> f32 {
    tone::luminance(rgb.map(f64::from)) as f32
}

/// Stops from middle grey.
pub fn stops(luminance: f32) -> f32 {
    (luminance.max(1e-12) / MIDDLE_GREY).log2()
}

fn band(luminance: f32) -> [u8; 3] {
    let stops = stops(luminance);
    let band = BANDS.iter().find(|(below, _)| stops < *below);
    band.map_or(BANDS[BANDS.len() - 1].1, |(_, rgb)| *rgb)
}

fn clipping([r, g, b, a]: [f32; 4]) -> [u8; 3] {
    let rgb = [r, g, b];
    if a == 0.0 {
        // Nothing is there to be black.
        return [20; 3];
    }
    if rgb.iter().any(|&x| x >= CLIPPED) {
        return [255, 40, 40];
    }
    if rgb.iter().all(|&x| x < BLACK) {
        return [40, 60, 220];
    }
    [(200.0 * luminance(rgb)) as u8 + 20; 3]
}

/// The colour of a strand; black of none.
fn strand(id: f32) -> [u8; 4] {
    if id < 0.0 {
        return grey(0.0);
    }
    let bits = SplitMix64(id as u64).next_u64().to_le_bytes();
    opaque([bits[0], bits[1], bits[2]].map(|x| 64 + x / 4 * 3))
}

fn grey(value: f32) -> [u8; 4] {
    opaque([(255.0 * value.clamp(0.0, 1.0)).round() as u8; 3])
}

fn opaque([r, g, b]: [u8; 3]) -> [u8; 4] {
    [r, g, b, 255]
}

#[cfg(test)]
mod tests {
    use strandlight_scene::tone::ToneMap;

    use super::*;

    #[test]
    fn false_colours_count_stops_from_middle_grey() {
        assert_eq!(stops(0.18), 0.0);
        assert_eq!(band(0.18), [150, 150, 150]);
        assert_eq!(band(0.18 * 4.5), BANDS[7].1);
        assert_eq!(band(0.0), BANDS[0].1);
        assert_eq!(band(f32::MAX), BANDS[9].1);
        assert!(BANDS.is_sorted_by(|a, b| a.0 < b.0));
        // A stop of exposure is a stop.
        let picture = Picture {
            width: 2,
            height: 1,
            rgba: vec![[0.18, 0.18, 0.18, 1.0], [0.0, 0.0, 0.0, 0.0]],
        };
        let radiance = Radiance {
            picture: &picture,
            grade: (3.0, &ToneMap::None.into()),
            converged: None,
        };
        let pixels = of_light(Inspection::FalseColor, &radiance).expect("pixels");
        assert_eq!(pixels, [opaque(BANDS[7].1), opaque(BANDS[0].1)]);
        // 1.44 is more than white.
        let pixels = of_light(Inspection::Clipping, &radiance).expect("pixels");
        assert_eq!(pixels, [[255, 40, 40, 255], [20, 20, 20, 255]]);
        assert_eq!(clipping([0.0, 0.001, 0.0, 1.0]), [40, 60, 220]);
        assert_eq!(of_light(Inspection::Error, &radiance), None);
    }

    #[test]
    fn strands_have_colours_of_their_own() {
        assert_eq!(strand(-1.0), [0, 0, 0, 255]);
        assert_ne!(strand(0.0), strand(1.0));
        assert_eq!(strand(7.0), strand(7.0));
    }
}
