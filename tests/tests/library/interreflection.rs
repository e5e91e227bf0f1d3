//! Light between proxies: what rays from their places meet, against closed forms.

use std::sync::Arc;

use glam::{Quat, Vec3};
use strandlight_scene::PreparedScene;
use strandlight_scene::beside::Surface;
use strandlight_scene::bounce::Bounce;
use strandlight_scene::interreflection::{MetSurface, SurfaceRays};
use strandlight_scene::mesh::{MeshProxy, MeshShape};
use strandlight_scene::proxy::Proxy;
use strandlight_tests::render_common::wig_scene;
use strandlight_tests::scenes::ellipsoid;

const RADIUS: f32 = 5.0;

fn centre() -> Vec3 {
    Vec3::new(1.0, 8.0, -2.0)
}

fn sphere() -> Proxy {
    Proxy::Ellipsoid {
        centre: centre(),
        radii: Vec3::splat(RADIUS),
        turn: Quat::IDENTITY,
        albedo: [0.5; 3],
    }
}

fn mesh() -> Proxy {
    Proxy::Mesh(MeshProxy {
        shape: Arc::new(MeshShape::new(ellipsoid([RADIUS; 3], 48))),
        offset: centre(),
        albedo: [0.5; 3],
    })
}

fn ground(albedo: f32) -> Proxy {
    Proxy::Ground {
        height: 0.0,
        albedo: [albedo; 3],
    }
}

fn scene(proxies: Vec<Proxy>) -> PreparedScene {
    let mut scene = wig_scene(2);
    scene.proxies = proxies;
    scene
}

/// By place what share of an even sky its rays meet, of the first proxy and of all others.
fn shares(scene: &PreparedScene) -> Vec<(Surface, [f32; 2])> {
    let bounce = Bounce::new(scene).unwrap();
    let rays = SurfaceRays::new(&bounce, usize::MAX);
    let (places, met) = rays.all_met(&bounce);
    assert_eq!(places.len(), rays.surfaces.len());
    let share = |(surface, place): (
        &Surface,
        &strandlight_scene::interreflection::ReflectingSurface,
    )| {
        let met = &met[place.first as usize..][..place.n as usize];
        let of = |is_wanted: &dyn Fn(&MetSurface) -> bool| {
            met.iter().filter(|met| is_wanted(met)).count() as f32 * rays.weight()
        };
        let is_high = |met: &MetSurface| rays.surfaces[met.surface as usize].position.y > 0.5;
        (*surface, [of(&|met| !is_high(met)), of(&is_high)])
    };
    rays.surfaces.iter().zip(&places).map(share).collect()
}

/// Of the ground below a sphere, and of the sphere above a ground.
#[test]
fn rays_meet_what_closed_forms_say() {
    for head in [sphere(), mesh()] {
        let (mut n, mut error, mut most) = ([0.0; 2], [0.0; 2], [0.0_f32; 2]);
        for (surface, [of_ground, of_sphere]) in shares(&scene(vec![head, ground(0.5)])) {
            let is_ground = surface.position.y < 0.5;
            let (found, expected) = match is_ground {
                true => {
                    let way = centre() - surface.position;
                    let sin = RADIUS / way.length();
                    assert_eq!(of_ground, 0.0);
                    (of_sphere, way.normalize().y * sin * sin)
                }
                // The half of the sky below, tilted.
                false => {
                    // Of triangles one ray may meet those beside its corner.
                    assert!(of_sphere < 0.03, "{of_sphere}");
                    (of_ground, (1.0 - surface.normal.y) / 2.0)
                }
            };
            let which = usize::from(is_ground);
            n[which] += 1.0;
            error[which] += (found - expected) * (found - expected);
            most[which] = most[which].max((found - expected).abs());
        }
        let rms = [0, 1].map(|which| (error[which] / n[which]).sqrt());
        println!("RMS error {rms:.4?}, at most {most:.4?}");
        assert!(n[0] > 1000.0 && n[1] > 1000.0);
        assert!(rms[0] < 0.02 && rms[1] < 0.02, "{rms:?}");
        assert!(most[0] < 0.08 && most[1] < 0.08, "{most:?}");
    }
}

#[test]
fn what_sends_nothing_back_is_not_looked_for() {
    let black = scene(vec![sphere(), ground(0.0)]);
    assert!(black.has_bounce() && !black.has_interreflection());
    assert!(!scene(vec![sphere()]).has_interreflection());
    let skipped = "light between proxies: only one sends light back";
    assert!(black.skipped().iter().any(|what| what == skipped));
    let both = scene(vec![sphere(), ground(0.5)]);
    assert!(both.has_interreflection());
    assert!(!both.skipped().iter().any(|what| what == skipped));
    for (_, shares) in shares(&black) {
        assert_eq!(shares, [0.0; 2]);
    }
}
