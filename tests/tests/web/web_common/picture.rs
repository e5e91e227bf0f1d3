//! Pictures of pages, what in them is the viewer's picture, and what that should be.

use std::path::Path;

use strandlight_cpu::CpuRenderer;
use strandlight_formats::Scene;
use strandlight_render::ProgressiveRenderer;
use strandlight_scene::{Backend, PreparedScene};
use strandlight_tests::render_common;

/// 8-bit colours, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    pub width: usize,
    pub height: usize,
    pub rgb: Vec<[u8; 3]>,
}

impl Pixels {
    /// Decodes a PNG.
    pub fn from_png(bytes: &[u8]) -> Pixels {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
            .read_info()
            .expect("a PNG");
        let mut buffer = vec![0; reader.output_buffer_size().expect("a small picture")];
        let info = reader.next_frame(&mut buffer).expect("a PNG");
        let channels = info.color_type.samples();
        Pixels {
            width: info.width as usize,
            height: info.height as usize,
            rgb: buffer[..info.buffer_size()]
                .chunks_exact(channels)
                .map(|texel| [texel[0], texel[1], texel[2]])
                .collect(),
        }
    }

    /// The smallest rectangle with all pixels of about `color`: x, y, width, height.
    pub fn extent(&self, color: [u8; 3]) -> Option<[usize; 4]> {
        let near = |texel: &[u8; 3]| (0..3).all(|c| texel[c].abs_diff(color[c]) <= 1);
        let found = (0..self.rgb.len()).filter(|&ix| near(&self.rgb[ix]));
        let mut extent: Option<[usize; 4]> = None;
        for ix in found {
            let (x, y) = (ix % self.width, ix / self.width);
            let [left, top, right, bottom] = extent.unwrap_or([x, y, x, y]);
            extent = Some([left.min(x), top.min(y), right.max(x), bottom.max(y)]);
        }
        extent.map(|[left, top, right, bottom]| [left, top, right - left + 1, bottom - top + 1])
    }

    /// A rectangle of it.
    pub fn part(&self, [x, y, width, height]: [usize; 4]) -> Pixels {
        let rows = (y..y + height).map(|y| &self.rgb[y * self.width + x..][..width]);
        Pixels {
            width,
            height,
            rgb: rows.flatten().copied().collect(),
        }
    }

    /// Share of pixels further than 8 levels from `color` in a channel.
    pub fn share_unlike(&self, color: [u8; 3]) -> f64 {
        let unlike = |texel: &&[u8; 3]| (0..3).any(|c| texel[c].abs_diff(color[c]) > 8);
        self.rgb.iter().filter(unlike).count() as f64 / self.rgb.len() as f64
    }

    /// Mean absolute difference in levels of 255.
    pub fn difference(&self, other: &Pixels) -> f64 {
        assert_eq!((self.width, self.height), (other.width, other.height));
        let pairs = self.rgb.iter().flatten().zip(other.rgb.iter().flatten());
        let sum: f64 = pairs.map(|(&a, &b)| f64::from(a.abs_diff(b))).sum();
        sum / (3 * self.rgb.len()) as f64
    }
}

/// Keeps a picture under `name` for people to see, where they ask for it.
pub fn keep(name: &str, png: &[u8]) {
    if let Some(folder) = std::env::var_os("STRANDLIGHT_PICTURES") {
        let path = Path::new(&folder).join(format!("{name}.png"));
        std::fs::write(path, png).expect("the folder can be written");
    }
}

/// What the native renderer draws of the page's scene.
pub fn native(folder: &Path, size: [usize; 2]) -> Pixels {
    let mut scene = Scene::read(folder.join("scene.toml")).expect("a scene");
    scene.render.size = size.map(|side| side as u32);
    let prepared = PreparedScene::load(&scene).expect("all files");
    let context = render_common::context();
    let mut renderer = ProgressiveRenderer::new(&context, prepared.clone()).expect("a renderer");
    renderer.draw_by_list().expect("a renderer");
    let (picture, _) = renderer
        .render_to_image(&prepared.camera, scene.render.size, 1)
        .expect("a picture");
    let texels = picture.to_srgb8(prepared.exposure, &prepared.display);
    Pixels {
        width: size[0],
        height: size[1],
        rgb: texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
    }
}

/// What the CPU renderer draws of the page's scene without a browser.
pub fn native_on_cpu(folder: &Path, size: [usize; 2]) -> Pixels {
    let scene = Scene::read(folder.join("scene.toml")).expect("a scene");
    let prepared = PreparedScene::load(&scene).expect("all files");
    let (exposure, display) = (prepared.exposure, prepared.display.clone());
    let (picture, _) = CpuRenderer::new(prepared)
        .render(size.map(|side| side as u32), 1, &|_| ())
        .expect("a picture");
    let texels = picture.to_srgb8(exposure, &display);
    Pixels {
        width: size[0],
        height: size[1],
        rgb: texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
    }
}
