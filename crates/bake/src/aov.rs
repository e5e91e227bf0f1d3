//! Pictures of parts of a scene's light, which add up to the picture of all of it: by term of
//! scattering, by mode, by light.
//!
//! Every layer is a picture of its own, of the same strands, shadow maps and samples, and with the
//! same light counted as negligible; only what shines or scatters differs. So sums of layers are
//! the whole picture but for rounding. Where there are layers of single modes multiple scattering is
//! by the closed form, not by tables, which is slower.
//!
//! Data layers, which are not light and do not add up, go into the same file. All layers are declared
//! in [`LAYERS`], with their channels.

use std::sync::atomic::{AtomicUsize, Ordering};

use strandlight_formats::{Background, Scattering};
use strandlight_scattering::Lobe;
use strandlight_scene::layers::{
    BACKGROUND, COVERAGE, Content, LAYERS, Layer, PICTURE, PROXIES, Split, TOTAL,
};
use strandlight_scene::provenance::Provenance;
use strandlight_scene::proxy::Proxy;
use strandlight_scene::stats::{FrameStats, Observer};
use strandlight_scene::{
    Backend, GroupFault, Picture, PreparedScene, RenderError, SceneError, Stats, memory,
};

use strandlight_cpu as cpu;
use strandlight_images::exr_file::{encode, floats};

/// Most bytes of all layers.
pub const MAX_BYTES: u64 = 2 << 30;

/// Lights that share a layer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// The layer is called `light.NAME`.
    pub name: String,
    /// Places in the light set.
    pub lights: Vec<usize>,
}

/// What is drawn for one layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Spec {
    /// Its declaration.
    pub layer: &'static Layer,
    /// Which member it is, where that is of a family.
    pub part: String,
    /// Terms of scattering.
    pub scattering: Scattering,
    /// Modes of the hair.
    pub modes: Vec<Lobe>,
    /// Lights that shine; all that do in the scene if absent.
    pub lights: Option<Vec<usize>>,
}

impl Spec {
    /// Its name.
    pub fn name(&self) -> String {
        self.layer.name_of(&self.part)
    }
}

/// The layers that `splits` asks for of `scene`, whose lights are those of its light set, in order.
///
/// # Errors
/// A group that names a light which is not there or in another group.
pub fn specs(
    scene: &PreparedScene,
    splits: &[Split],
    groups: &[Group],
) -> Result<Vec<Spec>, SceneError> {
    let all = scene.scattering();
    let modes = scene.hair.modes().to_vec();
    let is_on = |ix: &usize| scene.lights[*ix].rgb.iter().any(|&x| x > 0.0);
    let on: Vec<usize> = (0..scene.lights.len()).filter(is_on).collect();
    if splits.contains(&Split::Lights) {
        check_groups(scene.lights.len(), groups)?;
    }
    let is_drawn = |term: &Scattering| all == Scattering::Total || all == *term;
    let mut specs: Vec<Spec> = Vec::new();
    let mut add = |layer, part: &str, scattering, modes: &[Lobe], lights| {
        let spec = Spec {
            layer,
            part: part.to_owned(),
            scattering,
            modes: modes.to_vec(),
            lights,
        };
        // Of two splits both may have it.
        if !specs.contains(&spec) {
            specs.push(spec);
        }
    };
    for &split in splits {
        for layer in LAYERS.iter().filter(|layer| layer.is_written_with(split)) {
            match layer.content {
                Content::Term(term) if is_drawn(&term) => add(layer, "", term, &modes, None),
                Content::Mode(term) if is_drawn(&term) => {
                    for mode in &modes {
                        add(layer, mode.name(), term, std::slice::from_ref(mode), None);
                    }
                }
                Content::Light if groups.is_empty() => {
                    for &ix in &on {
                        add(layer, &format!("{ix:03}"), all, &modes, Some(vec![ix]));
                    }
                }
                Content::Group => {
                    for group in groups {
                        add(layer, &group.name, all, &modes, Some(group.lights.clone()));
                    }
                }
                Content::Rest if !groups.is_empty() => {
                    let is_in = |ix: &usize| groups.iter().any(|group| group.lights.contains(ix));
                    let rest: Vec<usize> = on.iter().copied().filter(|ix| !is_in(ix)).collect();
                    if !rest.is_empty() {
                        add(layer, "", all, &modes, Some(rest));
                    }
                }
                _ => (),
            }
        }
    }
    Ok(specs)
}

/// Refuses groups of lights that are not there or in another group.
fn check_groups(n_lights: usize, groups: &[Group]) -> Result<(), SceneError> {
    let mut taken = vec![false; n_lights];
    for (ix, Group { name, lights }) in groups.iter().enumerate() {
        if groups[..ix].iter().any(|group| group.name == *name) {
            return Err(SceneError::GroupTwice(name.clone()));
        }
        let refused = |light, fault| SceneError::Group {
            group: name.clone(),
            light,
            fault,
        };
        for &ix in lights {
            match taken.get_mut(ix) {
                None => return Err(refused(ix, GroupFault::Missing)),
                Some(true) => return Err(refused(ix, GroupFault::Shared)),
                Some(taken) => *taken = true,
            }
        }
    }
    Ok(())
}

/// Refuses layers that would not fit in memory.
///
/// # Errors
/// [`RenderError::TooLarge`].
pub(crate) fn check_memory(n_layers: usize, [width, height]: [u32; 2]) -> Result<(), RenderError> {
    // Total, background and coverage besides; as much again while they are encoded.
    let a_layer = 12 * u64::from(width) * u64::from(height);
    let bytes = 2 * a_layer * (n_layers as u64 + 4);
    let limit = memory::available_bytes()
        .unwrap_or(MAX_BYTES)
        .min(MAX_BYTES);
    if bytes > limit {
        return Err(RenderError::TooLarge {
            what: "layers (ask for fewer, for groups of lights or a smaller --size)".to_owned(),
            bytes,
            limit,
        });
    }
    Ok(())
}

/// Draws the picture of `spec` before `background`; `whole` is the scene with all its light.
fn draw(
    backend: &mut dyn Backend,
    whole: &PreparedScene,
    spec: &Spec,
    background: Background,
    frame: ([u32; 2], u32, Observer),
) -> Result<(Picture, Stats), RenderError> {
    backend.set_hair(whole.hair.hair(), &spec.modes)?;
    backend.set_scattering(spec.scattering);
    let colors: Vec<[f32; 3]> = whole.lights.iter().map(|light| light.rgb).collect();
    backend.set_light_colors(&masked(&colors, spec))?;
    draw_over(backend, whole, background, frame)
}

/// Draws the last picture again over another background; its light is kept.
fn draw_over(
    backend: &mut dyn Backend,
    whole: &PreparedScene,
    background: Background,
    (size, samples, observer): ([u32; 2], u32, Observer),
) -> Result<(Picture, Stats), RenderError> {
    backend.set_grade(whole.exposure, whole.display.clone(), background);
    backend.render(size, samples, observer)
}

/// The scene that layers of light, `specs`, are drawn of: its shadow maps and negligible power stay those of all its
/// lights. Without layers of single modes its picture is that of the scene itself, which takes less.
pub fn measured(scene: &PreparedScene, specs: &[Spec]) -> PreparedScene {
    let mut scene = scene.clone();
    if !specs.is_empty() {
        scene.reference_amplitudes = Some(scene.lights.iter().map(|light| light.rgb).collect());
    }
    scene.modes_add_up = specs.iter().any(|spec| spec.modes != scene.hair.modes());
    scene
}

/// Amplitudes, black where a light does not shine for `spec`.
fn masked(colors: &[[f32; 3]], spec: &Spec) -> Vec<[f32; 3]> {
    let shines = |ix: &usize| {
        spec.lights
            .as_ref()
            .is_none_or(|lights| lights.contains(ix))
    };
    let lights = colors.iter().enumerate();
    lights
        .map(|(ix, &rgb)| if shines(&ix) { rgb } else { [0.0; 3] })
        .collect()
}

/// A layer of light.
#[derive(Clone, Debug)]
pub struct LightLayer {
    /// Its name.
    pub name: String,
    /// Its channels: name and values.
    pub channels: Vec<(String, Vec<f32>)>,
}

impl LightLayer {
    /// The member `part` of `layer`, with the values of its channels.
    fn new(layer: &Layer, part: &str, planes: Vec<Vec<f32>>) -> LightLayer {
        LightLayer {
            name: layer.name_of(part),
            channels: layer.channels_of(part).into_iter().zip(planes).collect(),
        }
    }
}

/// The whole picture and its layers.
#[derive(Clone, Debug)]
pub struct Layers {
    /// The picture over its background.
    pub beauty: Picture,
    /// Share of each pixel that hair covers.
    pub coverage: Vec<f32>,
    /// Layers of light.
    pub layers: Vec<LightLayer>,
    /// Channels of data layers, by their whole names.
    pub data: Vec<(&'static str, Vec<f32>)>,
    /// What each picture took: its name and lines of text, in the order that they were drawn.
    pub stats: Vec<(String, String)>,
    /// [`Stats::samples`] of every picture.
    pub samples: u32,
    /// The same in words.
    pub visibility: String,
}

impl Layers {
    /// Draws the picture of the scene of `backend`, which is [`measured`], its layers of light and
    /// its layers of data, in `size` with `samples` a pixel. Those of data are made on the CPU
    /// whatever draws the light. `observe` receives the progress, 0..=1.
    ///
    /// # Errors
    /// As `check_memory`; whatever the backend answers.
    pub fn draw(
        backend: &mut dyn Backend,
        (specs, data): (&[Spec], &[&Layer]),
        size: [u32; 2],
        samples: u32,
        observe: Observer,
    ) -> Result<Layers, RenderError> {
        check_memory(specs.len() + data.len(), size)?;
        let scene = backend.scene().clone();
        let whole = Spec {
            layer: &TOTAL,
            part: String::new(),
            scattering: scene.scattering(),
            modes: scene.hair.modes().to_vec(),
            lights: None,
        };
        // Proxies are in no layer of the hair.
        let is_black = |proxy: &Proxy| proxy.albedo() == [0.0; 3];
        let has_light_of_proxies = !scene.proxies.iter().all(is_black);
        let has_background = scene.background != Background::None;
        let n_pictures =
            1 + usize::from(has_background) + usize::from(has_light_of_proxies) + specs.len();
        let n_drawn = AtomicUsize::new(0);
        let observe_picture = |share: f64| {
            let n_drawn = n_drawn.load(Ordering::Relaxed) as f64;
            observe((n_drawn + share) / n_pictures as f64);
        };
        let frame = (size, samples, &observe_picture as Observer);
        let draw_over = |backend: &mut dyn Backend, background: Background| {
            let drawn = draw_over(backend, &scene, background, frame)?;
            n_drawn.fetch_add(1, Ordering::Relaxed);
            Ok::<_, RenderError>(drawn)
        };
        let text = |stats: &Stats| FrameStats(stats).to_string();
        // That of the scene as it is.
        let (beauty, of_picture) = draw_over(backend, scene.background)?;
        let mut stats = vec![(PICTURE.name.to_owned(), text(&of_picture))];
        let seen = match scene.background {
            Background::None => beauty.clone(),
            _ => {
                let (seen, of_seen) = draw_over(backend, Background::None)?;
                stats.push(("picture without background".to_owned(), text(&of_seen)));
                seen
            }
        };
        let hair = match has_light_of_proxies {
            false => seen.clone(),
            true => {
                // From here on.
                let mut black = scene.proxies.clone();
                black.iter_mut().for_each(|it| *it.albedo_mut() = [0.0; 3]);
                backend.set_proxies(black);
                let (hair, of_hair) = draw_over(backend, Background::None)?;
                stats.push((whole.name(), text(&of_hair)));
                hair
            }
        };
        let mut coverage: Vec<f32> = hair.rgba.iter().map(|rgba| share(rgba[3])).collect();
        let mut layers = vec![LightLayer::new(&TOTAL, "", planes(&hair).into())];
        if has_background {
            let behind = behind(&beauty, &seen);
            layers.push(LightLayer::new(&BACKGROUND, "", behind.into()));
        }
        if !scene.proxies.is_empty() {
            let [of_hair, of_proxies] = cpu::coverage(&scene, &scene.camera, size)?;
            coverage = of_hair.into_iter().map(share).collect();
            let mut planes = Vec::from(difference(&seen, &hair));
            planes.push(of_proxies.into_iter().map(share).collect());
            layers.push(LightLayer::new(&PROXIES, "", planes));
        }
        for spec in specs {
            let (picture, spec_stats) = draw(backend, &scene, spec, Background::None, frame)?;
            n_drawn.fetch_add(1, Ordering::Relaxed);
            stats.push((spec.name(), text(&spec_stats)));
            layers.push(LightLayer::new(
                spec.layer,
                &spec.part,
                planes(&picture).into(),
            ));
        }
        Ok(Layers {
            beauty,
            coverage,
            layers,
            data: cpu::data_layers(&scene, &scene.camera, size, data)?,
            stats,
            samples: of_picture.samples,
            visibility: of_picture.visibility(),
        })
    }

    /// The file's bytes; its header says what the layers were made from.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn encode(self, provenance: &Provenance) -> exr::error::Result<Vec<u8>> {
        let mut channels = Vec::new();
        let mut push = |name: String, values: Vec<f32>| channels.push(floats(name, values));
        for (c, name) in PICTURE.channels.iter().enumerate() {
            let values = self.beauty.rgba.iter().map(|rgba| match c {
                3 => share(rgba[3]),
                _ => rgba[c],
            });
            push((*name).to_owned(), values.collect());
        }
        push(COVERAGE.channels[0].to_owned(), self.coverage);
        for (name, values) in self.data {
            push(name.to_owned(), values);
        }
        for (name, values) in self.layers.into_iter().flat_map(|layer| layer.channels) {
            push(name, values);
        }
        let size = (self.beauty.width as usize, self.beauty.height as usize);
        encode(size, channels, provenance.entries())
    }
}

/// A share of a pixel without what rounding adds to 1: compositors divide by it and by 1 less it.
fn share(x: f32) -> f32 {
    x.clamp(0.0, 1.0)
}

/// What lies behind the hair of `whole`, of which `seen` is the part before it; nothing shines with less
/// than no light, but for rounding.
fn behind(whole: &Picture, seen: &Picture) -> [Vec<f32>; 3] {
    let mut planes = difference(whole, seen);
    for x in planes.iter_mut().flatten() {
        // Not `max`, which makes 0 of NaN.
        if *x < 0.0 {
            *x = 0.0;
        }
    }
    planes
}

/// Red, green and blue of `whole` less those of `part`.
fn difference(whole: &Picture, part: &Picture) -> [Vec<f32>; 3] {
    let of = |c: usize| {
        let pixels = whole.rgba.iter().zip(&part.rgba);
        pixels.map(|(whole, part)| whole[c] - part[c]).collect()
    };
    [0, 1, 2].map(of)
}

/// Red, green and blue of a picture.
fn planes(picture: &Picture) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|c| picture.rgba.iter().map(|rgba| rgba[c]).collect())
}

#[cfg(test)]
mod tests {
    use exr::prelude::{ReadChannels, ReadLayers};

    use super::*;

    fn picture(rgba: Vec<[f32; 4]>) -> Picture {
        Picture {
            width: rgba.len() as u32,
            height: 1,
            rgba,
        }
    }

    #[test]
    fn layers_have_no_rounding_beyond_their_ranges() {
        let whole = picture(vec![[0.5, 0.25, 1.0, 1.000_001], [0.5, f32::NAN, 0.0, 1.0]]);
        let seen = picture(vec![
            [0.500_000_1, 0.125, 1.0, 1.000_001],
            [0.25, 0.0, 0.0, -1e-7],
        ]);
        let [r, g, b] = behind(&whole, &seen);
        assert_eq!([r, b], [vec![0.0, 0.25], vec![0.0, 0.0]]);
        assert!(g[0] == 0.125 && g[1].is_nan());
        let shares = [1.000_001, -1e-7, 0.5].map(share);
        assert_eq!(shares, [1.0, 0.0, 0.5]);
        assert!(share(f32::NAN).is_nan());

        let layers = Layers {
            coverage: vec![1.0, 0.0],
            beauty: whole,
            layers: Vec::new(),
            data: Vec::new(),
            stats: Vec::new(),
            samples: 0,
            visibility: String::new(),
        };
        let bytes = layers.encode(&Provenance::default()).expect("encoded");
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(std::io::Cursor::new(bytes))
            .expect("an OpenEXR file");
        let list = &image.layer_data.channel_data.list;
        let alpha = list.iter().find(|channel| channel.name.eq("A"));
        let alpha: Vec<f32> = alpha.expect("there").sample_data.values_as_f32().collect();
        assert_eq!(alpha, [1.0, 1.0]);
    }
}
