//! Means of the samples and the background behind them. Twin of `shaders/pass/composite.wgsl`.

use rayon::prelude::*;
use strandlight_scene::PreparedScene;
use strandlight_scene::background::background_at;
use strandlight_scene::camera::ViewUniform;

/// Turns sums of `samples` samples into the picture.
pub(super) fn composite(
    scene: &PreparedScene,
    view: &ViewUniform,
    samples: u32,
    picture: &mut [[f32; 4]],
) {
    let width = view.size[0] as usize;
    picture
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                let [r, g, b, a] = pixel.map(|sum| sum / samples as f32);
                let mut rgb = [r, g, b].map(|x| x / view.radiance_scale);
                let mut alpha = a;
                let at = [x as f32 + 0.5, y as f32 + 0.5];
                if let Some(behind) = background_at(scene, view, at) {
                    for (channel, behind) in rgb.iter_mut().zip(behind) {
                        *channel += (1.0 - alpha) * behind;
                    }
                    alpha = 1.0;
                }
                *pixel = [rgb[0], rgb[1], rgb[2], alpha];
            }
        });
}
