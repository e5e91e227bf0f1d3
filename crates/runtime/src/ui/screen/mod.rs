//! What is presented to the window: drawn by a device, or in memory where there is no GPU.

#[cfg(target_arch = "wasm32")]
mod canvas;
mod device;
mod memory;
mod painted;
mod painter;
#[cfg(not(target_arch = "wasm32"))]
mod surface;

use std::sync::Arc;

use winit::dpi::PhysicalSize;
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window;

use crate::choice::{BackendChoice, Chosen, CpuReason};
use crate::interactive::Display;
use device::DeviceScreen;
use memory::MemoryScreen;
use strandlight_render::gpu::{Context, GpuError};

pub use painted::Painted;

/// A window's surface and what paints egui's shapes on it.
pub enum Screen {
    /// On the GPU.
    Device(Box<DeviceScreen>),
    /// On the CPU.
    Memory(Box<MemoryScreen>),
}

impl Screen {
    /// Opens the screen of `window` for the renderer that `choice` asks for: in memory unless a GPU
    /// draws.
    ///
    /// # Errors
    /// No surface, no adapter or no device, and nothing to present memory with either.
    pub async fn open(
        window: Arc<Window>,
        display: Option<OwnedDisplayHandle>,
        choice: BackendChoice,
    ) -> Result<Screen, GpuError> {
        // A canvas that was asked for WebGPU shows nothing else any more.
        #[cfg(target_arch = "wasm32")]
        if choice == BackendChoice::Auto && !crate::page::has_webgpu().await {
            let reason = CpuReason::Failed("this browser offers no WebGPU here".to_owned());
            return Screen::in_memory(&window, reason);
        }
        if choice == BackendChoice::Cpu
            && let Ok(screen) = Screen::in_memory(&window, CpuReason::Asked)
        {
            return Ok(screen);
        }
        let opened = DeviceScreen::open(window.clone(), display).await;
        let reason = match &opened {
            _ if choice == BackendChoice::Gpu => None,
            Ok(screen) if screen.context().is_software() => {
                Some(CpuReason::Software(screen.context().adapter_name.clone()))
            }
            Ok(_) => None,
            Err(error) => Some(CpuReason::Failed(error.to_string())),
        };
        if let Some(reason) = reason
            && let Ok(screen) = Screen::in_memory(&window, reason)
        {
            return Ok(screen);
        }
        Ok(Screen::Device(Box::new(opened?)))
    }

    fn in_memory(window: &Arc<Window>, reason: CpuReason) -> Result<Screen, GpuError> {
        let screen = MemoryScreen::open(window.clone(), reason);
        let screen = screen.map_err(|error| GpuError::NoAdapter(error.to_string().into()))?;
        Ok(Screen::Memory(Box::new(screen)))
    }

    /// The renderer of its pictures, `choice` being that of [`Screen::open`].
    ///
    /// # Errors
    /// None: the device is there if it was asked for.
    pub fn chosen(&self, choice: BackendChoice) -> Result<Chosen, GpuError> {
        match self {
            Screen::Device(screen) => choice.decide(|| Ok(screen.context().clone())),
            Screen::Memory(screen) => Ok(Chosen::Cpu(screen.reason().clone())),
        }
    }

    /// The device, if there is one.
    pub fn context(&self) -> Option<&Context> {
        match self {
            Screen::Device(screen) => Some(screen.context()),
            Screen::Memory(_) => None,
        }
    }

    /// Lets callbacks of the device run; its first error since the last call.
    ///
    /// # Errors
    /// As [`Context::check`].
    pub fn check(&self) -> Result<(), GpuError> {
        let Some(context) = self.context() else {
            return Ok(());
        };
        let _ = context.device.poll(wgpu::PollType::Poll);
        context.check("window")
    }

    /// Longest side of a texture.
    pub fn max_texture_side(&self) -> u32 {
        match self {
            Screen::Device(screen) => screen.max_texture_side(),
            Screen::Memory(_) => memory::MAX_SIDE,
        }
    }

    /// Takes up the window's new size. A window without area keeps the old surface.
    pub fn resize(&mut self, size: PhysicalSize<u32>) {
        match self {
            Screen::Device(screen) => screen.resize(size),
            // Looks at the size when it paints.
            Screen::Memory(_) => {}
        }
    }

    /// The texture that egui draws the picture by.
    pub fn picture(&mut self, display: Display<'_>) -> egui::TextureId {
        match self {
            Screen::Device(screen) => screen.picture(display),
            Screen::Memory(screen) => screen.picture(display),
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
        match self {
            Screen::Device(screen) => screen.paint(egui, shapes, pixels_per_point, textures),
            Screen::Memory(screen) => screen.paint(egui, shapes, pixels_per_point, textures),
        }
    }
}
