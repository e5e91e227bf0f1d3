//! Means of the samples and the background behind them. Twin of `shaders/pass/composite.wgsl`.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use strandlight_scene::PreparedScene;
use strandlight_scene::background::background_at;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::stats::Observer;

/// Share of a frame's progress that this is taken for: light behind the hair takes long in large pictures.
const SHARE: f64 = 0.1;

/// Tells `observer` of what comes before [`composite`], as a share of the whole.
pub(super) fn before_composite(observer: Observer) -> impl Fn(f64) + Sync {
    move |share| observer((1.0 - SHARE) * share)
}

/// Turns sums of `samples` samples into the picture; `observer` hears of the progress.
pub(super) fn composite(
    scene: &PreparedScene,
    view: &ViewUniform,
    samples: u32,
    picture: &mut [[f32; 4]],
    observer: Observer,
) {
    let [width, height] = view.size.map(|side| side as usize);
    let n_done = AtomicUsize::new(0);
    picture
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                let [r, g, b, a] = pixel.map(|sum| sum / samples as f32);
                let mut rgb = [r, g, b].map(|x| x / view.radiance_scale);
                let mut alpha = a;
                let at = [x as f32 + 0.5, y as f32 + 0.5];
                // Nothing of it is seen through what covers all of the pixel.
                if alpha != 1.0
                    && let Some(behind) = background_at(scene, view, at)
                {
                    for (channel, behind) in rgb.iter_mut().zip(behind) {
                        *channel += (1.0 - alpha) * behind;
                    }
                    alpha = 1.0;
                }
                *pixel = [rgb[0], rgb[1], rgb[2], alpha];
            }
            let done = n_done.fetch_add(1, Ordering::Relaxed) + 1;
            observer(1.0 - SHARE + SHARE * done as f64 / height.max(1) as f64);
        });
}
