//! The window's surface on a device: what is presented to it, and what is done when it or the device is lost.

use std::sync::Arc;

use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use wgpu::CurrentSurfaceTexture as Current;
use winit::dpi::PhysicalSize;
use winit::window::Window;

use super::painted::Painted;
use crate::interactive::Display;
use strandlight_render::gpu::{Context, GpuError};

/// A device, the window's surface on it, and egui's renderer.
pub struct DeviceScreen {
    window: Arc<Window>,
    instance: wgpu::Instance,
    /// The device, which the viewer may draw with too.
    context: Context,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    renderer: Renderer,
    picture: Option<(wgpu::TextureView, egui::TextureId)>,
    /// A picture from memory, by its version.
    uploaded: Option<(u64, wgpu::TextureView)>,
}

impl DeviceScreen {
    /// Opens an adapter that can present to `window`.
    ///
    /// # Errors
    /// No surface, no adapter or no device.
    pub async fn open(
        window: Arc<Window>,
        display: Option<winit::event_loop::OwnedDisplayHandle>,
    ) -> Result<DeviceScreen, GpuError> {
        let descriptor = match display {
            Some(display) => {
                wgpu::InstanceDescriptor::new_with_display_handle_from_env(Box::new(display))
            }
            None => wgpu::InstanceDescriptor::new_without_display_handle_from_env(),
        };
        let instance = wgpu::Instance::new(descriptor);
        let surface = instance
            .create_surface(window.clone())
            .map_err(|error| GpuError::NoAdapter(error.into()))?;
        let context = Context::request(&instance, Some(&surface)).await?;
        let unsuitable = |reason: &str| GpuError::Unsuitable {
            adapter: context.adapter_name.clone(),
            reason: reason.to_owned(),
        };
        let adapter = context.adapter.as_ref();
        let adapter =
            adapter.ok_or_else(|| unsuitable("the adapter was not opened by this program"))?;
        let config = surface
            .get_default_config(adapter, 1, 1)
            .ok_or_else(|| unsuitable("the adapter cannot present to this window"))?;
        let formats = surface.get_capabilities(adapter).formats;
        let format = egui_wgpu::preferred_framebuffer_format(&formats)
            .map_err(|error| unsuitable(&error.to_string()))?;
        let config = wgpu::SurfaceConfiguration {
            format,
            present_mode: wgpu::PresentMode::AutoVsync,
            ..config
        };
        let renderer = Renderer::new(&context.device, format, RendererOptions::default());
        let mut screen = DeviceScreen {
            window,
            instance,
            context,
            surface,
            config,
            renderer,
            picture: None,
            uploaded: None,
        };
        screen.resize(screen.window.inner_size());
        Ok(screen)
    }

    /// The device.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// Longest side of a texture on this device.
    pub fn max_texture_side(&self) -> u32 {
        self.context.device.limits().max_texture_dimension_2d
    }

    /// Takes up the window's new size. A window without area keeps the old surface.
    pub fn resize(&mut self, size: PhysicalSize<u32>) {
        if size.width == 0 || size.height == 0 {
            return;
        }
        let side = self.max_texture_side();
        self.config.width = size.width.min(side);
        self.config.height = size.height.min(side);
        self.surface.configure(&self.context.device, &self.config);
    }

    /// The texture that egui draws the picture by.
    pub fn picture(&mut self, display: Display<'_>) -> egui::TextureId {
        match display {
            Display::Texture(view) => self.show(view),
            Display::Pixels(pixels) => {
                let view = self.upload(&pixels);
                self.show(&view)
            }
        }
    }

    /// A texture with a picture from memory; black and small before there is one.
    fn upload(&mut self, picture: &strandlight_cpu::DisplayPixels<'_>) -> wgpu::TextureView {
        let Context { device, queue, .. } = &self.context;
        let [width, height] = picture.size.map(|side| side.max(1));
        let size = wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        };
        let view = match self.uploaded.take() {
            Some((version, view)) if version == picture.version => {
                self.uploaded = Some((version, view.clone()));
                return view;
            }
            Some((_, view)) if view.texture().size() == size => view,
            _ => {
                let descriptor = wgpu::TextureDescriptor {
                    label: Some("picture"),
                    size,
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format: wgpu::TextureFormat::Rgba8Unorm,
                    usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                    view_formats: &[],
                };
                let texture = device.create_texture(&descriptor);
                texture.create_view(&wgpu::TextureViewDescriptor::default())
            }
        };
        if !picture.pixels.is_empty() {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * width),
                rows_per_image: None,
            };
            let bytes = picture.pixels.as_flattened();
            queue.write_texture(view.texture().as_image_copy(), bytes, layout, size);
        }
        self.uploaded = Some((picture.version, view.clone()));
        view
    }

    fn show(&mut self, view: &wgpu::TextureView) -> egui::TextureId {
        match &mut self.picture {
            Some((known, id)) if known == view => *id,
            Some((known, id)) => {
                self.renderer.update_egui_texture_from_wgpu_texture(
                    &self.context.device,
                    view,
                    wgpu::FilterMode::Nearest,
                    *id,
                );
                *known = view.clone();
                *id
            }
            None => {
                let id = self.renderer.register_native_texture(
                    &self.context.device,
                    view,
                    wgpu::FilterMode::Nearest,
                );
                self.picture = Some((view.clone(), id));
                id
            }
        }
    }

    /// Puts a frame of egui on screen.
    pub fn paint(
        &mut self,
        egui: &egui::Context,
        shapes: Vec<egui::epaint::ClippedShape>,
        pixels_per_point: f32,
        textures: &mut egui::TexturesDelta,
    ) -> Painted {
        let context = &self.context;
        for (id, deltas) in textures.set.drain() {
            for delta in deltas {
                self.renderer
                    .update_texture(&context.device, &context.queue, id, &delta);
            }
        }
        let painted = self.present(egui, shapes, pixels_per_point);
        for id in textures.free.drain() {
            self.renderer.free_texture(&id);
        }
        painted
    }

    fn present(
        &mut self,
        egui: &egui::Context,
        shapes: Vec<egui::epaint::ClippedShape>,
        pixels_per_point: f32,
    ) -> Painted {
        let size = self.window.inner_size();
        if size.width == 0 || size.height == 0 {
            return Painted::Hidden;
        }
        let context = self.context.clone();
        let target = match self.surface.get_current_texture() {
            Current::Success(texture) | Current::Suboptimal(texture) => texture,
            Current::Timeout | Current::Occluded => return Painted::Hidden,
            Current::Outdated | Current::Validation => {
                self.surface.configure(&context.device, &self.config);
                return Painted::Again;
            }
            Current::Lost => {
                if let Ok(surface) = self.instance.create_surface(self.window.clone()) {
                    self.surface = surface;
                    self.surface.configure(&context.device, &self.config);
                }
                return Painted::Again;
            }
        };
        let jobs = egui.tessellate(shapes, pixels_per_point);
        let screen = ScreenDescriptor {
            size_in_pixels: [self.config.width, self.config.height],
            pixels_per_point,
        };
        let mut encoder = context
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                label: Some("window"),
            });
        let mut commands = self.renderer.update_buffers(
            &context.device,
            &context.queue,
            &mut encoder,
            &jobs,
            &screen,
        );
        let view = target.texture.create_view(&Default::default());
        let attachment = wgpu::RenderPassColorAttachment {
            view: &view,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
            depth_slice: None,
        };
        let mut pass = encoder
            .begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("window"),
                color_attachments: &[Some(attachment)],
                ..Default::default()
            })
            .forget_lifetime();
        self.renderer.render(&mut pass, &jobs, &screen);
        drop(pass);
        commands.push(encoder.finish());
        context.queue.submit(commands);
        self.window.pre_present_notify();
        context.queue.present(target);
        Painted::Presented
    }
}
