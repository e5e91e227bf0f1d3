//! What stands behind the hair in a picture.

use strandlight_scene::PreparedScene;
use strandlight_scene::background::background_at;
use strandlight_scene::camera::view_uniform;

/// What a film is composited over, and whether proxies are among what it shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Backdrop {
    /// Radiance behind each pixel; none where the picture is transparent.
    pub(crate) behind: Vec<Option<[f32; 3]>>,
    /// Does the scene have proxies?
    pub(super) has_proxies: bool,
}

impl Backdrop {
    /// That of `scene` as its camera sees it in a picture of `size`.
    pub fn of(scene: &PreparedScene, size: [u32; 2]) -> Backdrop {
        let [width, height] = size;
        let view = view_uniform(&scene.camera, &scene.strands, size, 1.0);
        let at = |x: u32, y: u32| [x as f32 + 0.5, y as f32 + 0.5];
        let behind = (0..height)
            .flat_map(|y| (0..width).map(move |x| at(x, y)))
            .map(|at| background_at(scene, &view, at));
        Backdrop {
            behind: behind.collect(),
            has_proxies: !scene.proxies.is_empty(),
        }
    }
}
