//! Meshes as proxies: against the ellipsoid that they are like, from the file to the picture.

use std::path::Path;
use std::sync::Arc;

use glam::{Quat, Vec3};
use strandlight_cpu::CpuRenderer;
use strandlight_formats::{BakedFile, ProxySection, Scene};
use strandlight_runtime::Session;
use strandlight_scene::mesh::{MeshProxy, MeshShape};
use strandlight_scene::proxy::Proxy;
use strandlight_scene::{Backend, Picture, PreparedScene};
use strandlight_tests::render_common::wig_scene;
use strandlight_tests::scenes::{curtain, ellipsoid, key_and_sky, write_small_scene};

const SIZE: [u32; 2] = [120, 90];

fn with(scene: &PreparedScene, proxies: Vec<Proxy>) -> PreparedScene {
    let mut scene = scene.clone();
    scene.proxies = proxies;
    scene
}

/// The hair of a wig on an ellipsoid, and on one of triangles.
fn on_heads() -> [PreparedScene; 2] {
    let scene = wig_scene(300);
    let radii = 0.7 * scene.strands.radius * Vec3::new(0.8, 1.0, 0.9);
    let centre = scene.strands.centre;
    let albedo = [0.5, 0.4, 0.3];
    let exact = Proxy::Ellipsoid {
        centre,
        radii,
        turn: Quat::IDENTITY,
        albedo,
    };
    let mesh = Proxy::Mesh(MeshProxy {
        shape: Arc::new(MeshShape::new(ellipsoid(radii.into(), 64))),
        offset: centre,
        albedo,
    });
    [exact, mesh].map(|proxy| with(&scene, vec![proxy]))
}

fn drawn(mut renderer: CpuRenderer) -> Picture {
    let (picture, _) = renderer.render(SIZE, 16, &|_| ()).expect("a picture");
    picture
}

/// Mean difference over the mean, and the root of that of squares over that of squares.
fn difference(found: &Picture, wanted: &Picture) -> [f64; 2] {
    let (mut sum, mut square, mut all, mut squares) = (0.0, 0.0, 0.0, 0.0);
    for (a, b) in found.rgba.iter().zip(&wanted.rgba) {
        for (a, b) in a.iter().zip(b).take(3) {
            let (a, b) = (f64::from(*a), f64::from(*b));
            sum += a - b;
            square += (a - b).powi(2);
            all += b;
            squares += b * b;
        }
    }
    [sum / all, (square / squares).sqrt()]
}

#[test]
fn a_head_of_triangles_looks_like_the_ellipsoid() {
    let [exact, mesh] = on_heads();
    let bald = with(&exact, Vec::new());
    // By the list, and by samples as the GPU has them.
    for renderer in [CpuRenderer::new, CpuRenderer::by_samples] {
        let [wanted, found, bald] = [&exact, &mesh, &bald].map(|of| drawn(renderer(of.clone())));
        let [bias, error] = difference(&found, &wanted);
        let [_, without] = difference(&bald, &wanted);
        println!("bias {bias:.5}, relative RMSE {error:.5}, without a head {without:.3}");
        assert!(bias.abs() < 0.003, "{bias}");
        assert!(error < 0.03 && without > 10.0 * error, "{error} {without}");
    }
}

#[test]
fn pictures_with_a_mesh_do_not_depend_on_the_threads() {
    let [_, mesh] = on_heads();
    let on = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
        let pool = pool.expect("threads");
        pool.install(|| drawn(CpuRenderer::new(mesh.clone())))
    };
    assert!(on(1) == on(3));
}

/// A scene on disk whose hair stands on `mesh`, and its file.
fn scene_on(folder: &Path, mesh: &str) -> Scene {
    let hair = curtain(60, 8, 0.2, 5.0);
    let path = write_small_scene(folder, &hair, key_and_sky(), |scene| {
        scene.proxies = vec![ProxySection::mesh(mesh)];
    });
    Scene::read(&path).expect("valid")
}

#[test]
fn meshes_are_read_from_their_files_and_what_is_none_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = scene_on(folder.path(), "head.mesh");
    let missing = PreparedScene::load(&scene).expect_err("no such file");
    let missing = missing.to_string();
    assert!(
        missing.contains("proxy[0].mesh") && missing.contains("head.mesh"),
        "{missing}"
    );
    let path = folder.path().join("head.mesh");
    std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("writable");
    let obj = PreparedScene::load(&scene)
        .expect_err("an OBJ file")
        .to_string();
    assert!(obj.contains("strandlight mesh import"), "{obj}");
    ellipsoid([1.0; 3], 8).write(&path).expect("writable");
    let loaded = PreparedScene::load(&scene).expect("all is there");
    assert!(matches!(&loaded.proxies[..], [Proxy::Mesh(mesh)] if mesh.offset == Vec3::ZERO));
}

/// A mesh that is moved in a document shadows other hair; put back, it is as before.
#[test]
fn an_edit_of_a_mesh_draws_another_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = scene_on(folder.path(), "head.mesh");
    let of_hair = PreparedScene::load(&Scene {
        proxies: Vec::new(),
        ..scene.clone()
    });
    let of_hair = of_hair.expect("valid");
    let radii = 0.3 * of_hair.strands.radius * Vec3::ONE;
    let head = folder.path().join("head.mesh");
    ellipsoid(radii.into(), 24).write(&head).expect("writable");
    let path = folder.path().join("on-head.toml");
    let text = scene.to_toml_string().expect("valid");
    std::fs::write(&path, text).expect("writable");
    let session = Session::open(&path).expect("valid");
    let open = |session: Session| {
        strandlight_runtime::Viewer::on(session, |scene| Ok(Box::new(CpuRenderer::new(scene))))
            .expect("a scene that can be drawn")
    };
    let mut viewer = open(session);
    let first = viewer.frame(SIZE, 4).expect("a picture").0;
    let up = 0.5 * f64::from(of_hair.strands.radius);
    viewer
        .edit("move", |scene| {
            if let ProxySection::Mesh { offset, .. } = &mut scene.proxies[0] {
                *offset = [0.0, up, up];
            }
        })
        .expect("valid");
    let moved = viewer.frame(SIZE, 4).expect("a picture").0;
    assert!(moved != first);
    let fresh = open(viewer.session().clone())
        .frame(SIZE, 4)
        .expect("a picture")
        .0;
    assert!(moved == fresh);
}
