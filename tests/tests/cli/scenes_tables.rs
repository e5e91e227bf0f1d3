//! Tables of multiple scattering against the closed form, at the visible points of every scene that
//! `strandlight scenes` writes.

use strandlight_cpu::CpuRenderer;
use strandlight_formats::{Background, Scattering, Scene};
use strandlight_scene::{Backend, Picture, PreparedScene};
use strandlight_tests::render_common::relative_rmse;
use strandlight_tests::{assert_done, strandlight};

const SIZE: [u32; 2] = [90, 60];

fn drawn(scene: PreparedScene) -> Picture {
    let mut renderer = CpuRenderer::new(scene);
    let (picture, _) = renderer.render(SIZE, 1, &|_| ()).expect("a picture");
    picture
}

fn colours(picture: &Picture) -> Vec<f32> {
    let rgb = picture.rgba.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]);
    rgb.collect()
}

/// A pixel is the weighted mean of the visible points in it, so what pictures of a layer differ by is what the
/// tables err by at these points, each counted by what is seen of it.
#[test]
fn slow_tables_are_within_1_percent_at_the_visible_points_of_every_scene() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let args = ["scenes", "--scale", "0.02", "-o", "scenes"];
    assert_done(strandlight().current_dir(at).args(args));
    for paper in strandlight_bake::scenes::SCENES {
        let file = at.join("scenes").join(format!("{}.toml", paper.name));
        let mut scene = PreparedScene::load(&Scene::read(&file).expect("valid")).expect("a scene");
        // The hair alone: what is beside it would count as right.
        scene.background = Background::None;
        for proxy in &mut scene.proxies {
            *proxy.albedo_mut() = [0.0; 3];
        }
        let mut layers = [Scattering::Global, Scattering::Local].map(|layer| {
            scene.set_scattering(layer);
            [false, true].map(|modes_add_up| {
                scene.modes_add_up = modes_add_up;
                assert_eq!(scene.multiple().is_none(), modes_add_up, "{}", paper.name);
                colours(&drawn(scene.clone()))
            })
        });
        let [global, local] = &mut layers;
        for ix in 0..2 {
            let both = global[ix].iter_mut().zip(&local[ix]);
            both.for_each(|(sum, local)| *sum += local);
        }
        let [by_tables, by_closed_form] = global;
        let error = relative_rmse(by_tables, by_closed_form);
        let of_local = relative_rmse(&local[0], &local[1]);
        println!(
            "{}: {:.3} %, local alone {:.3} %",
            paper.name,
            100.0 * error,
            100.0 * of_local
        );
        // Equal pictures would mean that one way drew both.
        assert!(error > 1e-6, "{}: no difference", paper.name);
        assert!(error < 0.01, "{}: {error}", paper.name);
    }
}
