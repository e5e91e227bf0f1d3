//! The renderer as a state machine: its finished picture is the renderer's.

mod render_common;

use std::time::Duration;

use render_common::{context, picture_rmse, wig_scene};
use strandlight_runtime::{Live, Renderer};

const SIZE: [u32; 2] = [120, 90];

#[test]
fn the_finished_picture_is_the_renderers() {
    let context = context();
    let mut scene = wig_scene(300);
    scene.size = SIZE;
    let renderer = Renderer::new(&context, &scene).unwrap();
    let (expected, _) = renderer.render(&scene.camera, SIZE, 16).unwrap();
    let mut live = Live::new(&context, scene.clone()).unwrap();
    let picture = live.finish(16).unwrap();
    let error = picture_rmse(&picture, &expected);
    println!("{error:.2e}");
    assert!(error < 1e-5, "{error}");
}

#[test]
fn a_window_without_extent_draws_nothing() {
    let context = context();
    let mut live = Live::new(&context, wig_scene(20)).unwrap();
    live.set_size([0, 0]).unwrap();
    assert!(live.advance(Duration::ZERO).unwrap().is_done);
    live.set_size([30, 20]).unwrap();
    let progress = live.advance(Duration::from_secs(60)).unwrap();
    assert!(progress.is_done && progress.samples == live.scene().samples);
}
