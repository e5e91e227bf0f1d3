//! Parts of the light that hair sends to the eye, drawn as pictures of their own.

use strandlight_cpu::CpuRenderer;
use strandlight_formats::{Background, Scattering};
use strandlight_scattering::Lobe;
use strandlight_scene::{Backend, Picture, PreparedScene, RenderError};

/// A part of the light. Pictures of all modes and of local scattering add up to that of the hair, as those of all terms
/// and those of all lights do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightLayer {
    /// Single and global scattering of one mode.
    Mode(Lobe),
    /// One term; [`Scattering::Total`] is all light.
    Term(Scattering),
    /// Global and local scattering.
    Multiple,
    /// One light, by its number.
    Light(u32),
}

impl LightLayer {
    /// All that every scene has.
    pub const ALL: [LightLayer; 7] = [
        LightLayer::Mode(Lobe::R),
        LightLayer::Mode(Lobe::Tt),
        LightLayer::Mode(Lobe::Trt),
        LightLayer::Term(Scattering::Single),
        LightLayer::Multiple,
        LightLayer::Term(Scattering::Global),
        LightLayer::Term(Scattering::Local),
    ];

    /// What menus call it.
    pub fn name(self) -> String {
        let name = match self {
            LightLayer::Mode(mode) => return mode.name().to_owned(),
            LightLayer::Light(ix) => return format!("Light {ix}"),
            LightLayer::Multiple => "Multiple scattering",
            LightLayer::Term(Scattering::Single) => "Single scattering",
            LightLayer::Term(Scattering::Global) => "Global scattering",
            LightLayer::Term(Scattering::Local) => "Local scattering",
            LightLayer::Term(Scattering::Total) => "All light",
        };
        name.to_owned()
    }

    /// Pictures that add up to it, of a scene that draws `all` and `modes`.
    fn parts(self, all: Scattering, modes: &[Lobe]) -> Vec<(Scattering, Vec<Lobe>)> {
        let is_drawn = |term| all == Scattering::Total || all == term;
        let terms = |terms: &[Scattering], modes: &[Lobe]| {
            let drawn = terms.iter().filter(|term| is_drawn(**term));
            drawn.map(|term| (*term, modes.to_vec())).collect()
        };
        use Scattering::{Global, Local, Single, Total};
        match self {
            LightLayer::Mode(mode) if modes.contains(&mode) => terms(&[Single, Global], &[mode]),
            LightLayer::Mode(_) => Vec::new(),
            LightLayer::Term(Total) | LightLayer::Light(_) => vec![(all, modes.to_vec())],
            LightLayer::Term(term) => terms(&[term], modes),
            LightLayer::Multiple => terms(&[Global, Local], modes),
        }
    }

    /// Its picture of `scene`: linear radiance times coverage, over nothing. Proxies hide hair and are black. The CPU
    /// draws it, with the shadow maps and the negligible power of the whole scene.
    ///
    /// # Errors
    /// A size out of range.
    pub fn draw(self, mut scene: PreparedScene, size: [u32; 2]) -> Result<Picture, RenderError> {
        let (all, samples) = (scene.scattering(), scene.samples);
        let (hair, modes) = (*scene.hair.hair(), scene.hair.modes().to_vec());
        let colors: Vec<[f32; 3]> = scene.lights.iter().map(|light| light.rgb).collect();
        scene.background = Background::None;
        for proxy in &mut scene.proxies {
            *proxy.albedo_mut() = [0.0; 3];
        }
        scene.reference_amplitudes = Some(colors.clone());
        scene.modes_add_up = matches!(self, LightLayer::Mode(_));
        let mut renderer = CpuRenderer::new(scene);
        if let LightLayer::Light(wanted) = self {
            let of_one = (0..).zip(&colors);
            let of_one = of_one.map(|(ix, &rgb)| if ix == wanted { rgb } else { [0.0; 3] });
            renderer.set_light_colors(&of_one.collect::<Vec<_>>())?;
        }
        let mut sum = Picture {
            width: size[0],
            height: size[1],
            rgba: vec![[0.0; 4]; size[0] as usize * size[1] as usize],
        };
        for (term, modes) in self.parts(all, &modes) {
            renderer.set_hair(&hair, &modes)?;
            renderer.set_scattering(term);
            let (part, _) = renderer.render(size, samples, &|_| ())?;
            for (sum, [r, g, b, a]) in sum.rgba.iter_mut().zip(part.rgba) {
                // What is covered is the same in all.
                *sum = [sum[0] + r, sum[1] + g, sum[2] + b, a];
            }
        }
        Ok(sum)
    }
}
