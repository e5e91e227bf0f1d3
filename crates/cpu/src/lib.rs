//! The renderer on the CPU, by the closed forms of the shaders in `shaders/lib`.
//!
//! [`CpuRenderer`] draws from a visibility list: it shades only points that the picture shows, and eight
//! lights at a time. The files named after a pass in `shaders/pass` repeat its arithmetic, for pictures
//! with samples ([`render`]) and for tests. Rayon shares out the work; results do not depend on how.
//!
//! ```
//! use strandlight_formats::{BakedFile, Groom, LightSet, Scene, SrbfLight, ToneMap};
//! use strandlight_cpu::CpuRenderer;
//! use strandlight_scene::{Backend, PreparedScene};
//!
//! // Files: one strand of 10 cm, and light from above.
//! let folder = std::env::temp_dir().join(format!("strandlight-cpu-{}", std::process::id()));
//! std::fs::create_dir_all(&folder)?;
//! let groom = Groom {
//!     points: vec![[0.0, 0.0, 0.0], [0.0, 10.0, 0.0]],
//!     strand_offsets: vec![0, 2],
//!     ..Groom::default()
//! };
//! groom.write(&folder.join("strand.groom"))?;
//! let light = SrbfLight { direction: [0.0, 1.0, 0.0], lambda: 0.5, rgb: [1.0; 3] };
//! let lights = LightSet { lights: vec![light], ..LightSet::default() };
//! lights.write(&folder.join("sky.lights"))?;
//!
//! let mut scene = Scene::new("strand.groom", "sky.lights");
//! scene.folder = folder.clone();
//! let scene = PreparedScene::load(&scene)?;
//! let mut renderer = CpuRenderer::new(scene);
//! // Of visibility lists, which have no samples, a picture has one.
//! let (picture, _) = renderer.render([16, 16], 1, &|_share_done| ())?;
//! assert_eq!((picture.width, picture.height), (16, 16));
//! let png = picture.to_png(0.0, &ToneMap::Filmic.into())?;
//! assert!(png.starts_with(b"\x89PNG"));
//! std::fs::remove_dir_all(folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod along_segments;
mod arriving;
mod axis_shares;
#[cfg(not(target_arch = "wasm32"))]
mod background;
mod bounce;
mod composite;
mod data_layers;
mod draft_multiple;
mod edited_scene;
mod fade;
mod frame;
mod halves;
mod interactive;
mod interreflection;
mod last_view;
mod light_reaching;
mod list;
mod pieces;
mod project;
mod proxies;
mod proxy_light;
mod radiance;
mod raster;
mod renderer;
mod sampled;
mod scene_tables;
mod screen_point;
mod shade;
mod shade_wide;
mod shadow_map;
mod stats_name;
mod through_shares;
mod transmittance;
mod triangles;
mod unblocked;
mod visible;
mod voxelise;

#[cfg(not(target_arch = "wasm32"))]
pub use background::BackgroundRenderer;
pub use data_layers::{coverage, data_layers};
pub use interactive::{DisplayPixels, InteractiveRenderer, levels};
pub use light_reaching::transmittance_seen;
pub use renderer::CpuRenderer;
pub use sampled::{PointShadows, ShadowSource, point_radiance, render};
pub use shade::record_at_point;
pub use shadow_map::shadow_maps;
pub use transmittance::{Shadows, transmittance};
pub use voxelise::voxelise;
