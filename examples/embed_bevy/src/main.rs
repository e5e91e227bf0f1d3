//! Hair in a bevy scene, without a window: `cargo run [OUT.png]`.
//!
//! Hair is drawn after bevy's opaque meshes in the same colour and depth: a box stands before it, and
//! another one inside of it.

#[path = "../../../crates/render/examples/wig/mod.rs"]
mod wig;

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use bevy::asset::RenderAssetUsages;
use bevy::camera::{Hdr, RenderTarget};
use bevy::core_pipeline::core_3d::{main_opaque_pass_3d, main_transparent_pass_3d};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::core_pipeline::{Core3d, Core3dSystems};
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::RenderPlugin;
use bevy::render::render_resource::{PollType, RenderPassDescriptor, StoreOp, TextureFormat};
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy::render::view::{ExtractedView, ViewDepthStencilTexture, ViewTarget};
use bevy::window::ExitCondition;
use strandlight_render::{HairOptions, HairRenderer, HairView, PrepareBudget};
use strandlight_scene::PreparedScene;

/// The hair's size in bevy's world: its scene is in centimetres, bevy's in metres.
const METRES: f32 = 0.01;

/// The hair of the render world. It is put on the device when it is first drawn.
#[derive(Resource)]
struct Hair(Mutex<(Option<PreparedScene>, Option<HairRenderer>)>);

/// Draws the hair of the world between bevy's opaque and transparent meshes.
struct HairPlugin;

impl Plugin for HairPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        let scene = wig::wig().expect("hair made by code");
        render_app
            .insert_resource(Hair(Mutex::new((Some(scene), None))))
            .add_systems(
                Core3d,
                draw_hair
                    .in_set(Core3dSystems::MainPass)
                    .after(main_opaque_pass_3d)
                    .before(main_transparent_pass_3d),
            );
    }
}

fn draw_hair(
    view: ViewQuery<(&ExtractedView, &ViewTarget, &ViewDepthStencilTexture)>,
    hair: Res<Hair>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut context: RenderContext,
) {
    let (view, target, depth) = view.into_inner();
    let Ok(mut hair) = hair.0.lock() else {
        return;
    };
    let (scene, renderer) = &mut *hair;
    if let Some(scene) = scene.take() {
        let options = HairOptions {
            color_format: target.main_texture_format(),
            depth_format: depth.texture().format(),
            sample_count: depth.texture().sample_count(),
            reverse_z: true,
        };
        match HairRenderer::new(device.wgpu_device(), &queue, scene, options) {
            Ok(made) => *renderer = Some(made),
            Err(error) => eprintln!("hair: {error}"),
        }
    }
    let Some(renderer) = renderer else {
        return;
    };
    let view_from_world = view.world_from_view.to_matrix().inverse();
    let viewport = view.viewport;
    let hair_view = HairView {
        view_from_scene: (view_from_world * Mat4::from_scale(Vec3::splat(METRES)))
            .to_cols_array_2d(),
        clip_from_view: view.clip_from_view.to_cols_array_2d(),
        origin: [viewport.x, viewport.y],
        size: [viewport.z, viewport.w],
        frame: 0,
    };
    let encoder = context.command_encoder();
    if let Err(error) = renderer.prepare(encoder, &hair_view, PrepareBudget::Complete) {
        eprintln!("hair: {error}");
        return;
    }
    let colors = [Some(target.get_color_attachment())];
    let mut pass = context
        .command_encoder()
        .begin_render_pass(&RenderPassDescriptor {
            label: Some("hair"),
            color_attachments: &colors,
            depth_stencil_attachment: Some(depth.get_attachment(StoreOp::Store)),
            ..default()
        });
    renderer.draw(&mut pass);
}

fn main() -> ExitCode {
    let out = std::env::args()
        .nth(1)
        .unwrap_or("embed_bevy.png".to_owned());
    let is_written = Arc::new(AtomicBool::new(false));
    let mut app = App::new();
    app.add_plugins(
        DefaultPlugins
            .set(WindowPlugin {
                primary_window: None,
                exit_condition: ExitCondition::DontExit,
                ..default()
            })
            .set(RenderPlugin {
                synchronous_pipeline_compilation: true,
                ..default()
            }),
    )
    .add_plugins(HairPlugin)
    .add_systems(Startup, spawn_boxes);
    app.finish();
    app.cleanup();

    let mut image = Image::new_target_texture(480, 360, TextureFormat::Rgba8UnormSrgb, None);
    image.asset_usage = RenderAssetUsages::RENDER_WORLD;
    let world = app.world_mut();
    let target: RenderTarget = world.resource_mut::<Assets<Image>>().add(image).into();
    world.spawn((
        Camera3d::default(),
        Hdr,
        Tonemapping::Reinhard,
        target.clone(),
        Transform::from_xyz(0.07, 0.08, 0.3).looking_at(Vec3::new(0.0, -0.02, 0.0), Vec3::Y),
    ));
    // The picture comes back some frames after it was asked for.
    for frame in 0..60 {
        if frame == 3
            && let Some(image) = target.as_image()
        {
            app.world_mut()
                .spawn(Screenshot::image(image.clone()))
                .observe(save_to_disk(out.clone()))
                .observe({
                    let is_written = Arc::clone(&is_written);
                    move |_: On<ScreenshotCaptured>| is_written.store(true, Ordering::Relaxed)
                });
        }
        app.update();
        let device = app.world().resource::<RenderDevice>().wgpu_device();
        let waited = device.poll(PollType::wait_indefinitely());
        waited.expect("the device works");
        if is_written.load(Ordering::Relaxed) {
            println!("{out}");
            return ExitCode::SUCCESS;
        }
    }
    eprintln!("no picture came back");
    ExitCode::FAILURE
}

fn spawn_boxes(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    for (side, place, color) in [
        (
            0.05,
            Vec3::new(-0.06, -0.03, 0.12),
            Color::srgb(0.8, 0.15, 0.1),
        ),
        (0.13, Vec3::new(0.06, 0.0, 0.0), Color::srgb(0.1, 0.2, 0.8)),
    ] {
        commands.spawn((
            Mesh3d(meshes.add(Cuboid::from_length(side))),
            MeshMaterial3d(materials.add(color)),
            Transform::from_translation(place),
        ));
    }
    commands.spawn((
        DirectionalLight::default(),
        Transform::from_xyz(1.0, 2.0, 2.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
}
