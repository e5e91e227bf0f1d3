//! The environment map behind the hair, on the device only while it is seen.

use std::sync::Arc;

use super::resources::{compute, module_with, texture};
use crate::gpu::Context;
use strandlight_formats::{Background, Panorama};
use strandlight_scene::panorama::TurnedPanorama;
use strandlight_scene::{PreparedScene, RenderError};

/// A map that the adapter has no texture for.
#[derive(Debug, thiserror::Error)]
#[error("the panorama is {width} texels wide; textures are at most {most} on this adapter")]
struct TooWide {
    width: u32,
    most: u32,
}

/// The map and the pipeline that shows it.
pub(crate) struct Behind {
    /// Whose texels are on the device.
    pub(super) map: Arc<Panorama>,
    pub(super) texels: wgpu::TextureView,
    pub(super) composite: wgpu::ComputePipeline,
}

/// The map that `scene` shows behind its hair.
pub(super) fn seen(scene: &PreparedScene) -> Option<&TurnedPanorama> {
    let panorama = scene.panorama.as_ref()?;
    (scene.background == Background::Panorama).then_some(panorama)
}

impl Behind {
    /// What `scene` needs: as much of it as was there `before`, and nothing where no map is seen.
    ///
    /// # Errors
    /// A map wider than the adapter's textures.
    pub fn renewed(
        before: Option<Behind>,
        context: &Context,
        scene: &PreparedScene,
    ) -> Result<Option<Behind>, RenderError> {
        let Some(TurnedPanorama { map, .. }) = seen(scene) else {
            return Ok(None);
        };
        let pipeline = match before {
            Some(before) if Arc::ptr_eq(&before.map, map) => return Ok(Some(before)),
            before => before.map(|before| before.composite),
        };
        let composite = match pipeline {
            Some(composite) => composite,
            None => {
                let module = module_with(context, "pass/composite", &["PANORAMA"])?;
                compute(context, &module, "composite")
            }
        };
        Ok(Some(Behind {
            map: map.clone(),
            texels: upload(context, map)?,
            composite,
        }))
    }

    /// Bytes of the map on the device.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.map.texels()) as u64
    }
}

fn upload(context: &Context, map: &Panorama) -> Result<wgpu::TextureView, RenderError> {
    let (width, height) = (map.width(), map.height());
    let most = context.device.limits().max_texture_dimension_2d;
    if width > most {
        return Err(RenderError::Gpu(TooWide { width, most }.into()));
    }
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let format = wgpu::TextureFormat::Rgb9e5Ufloat;
    let view = texture(context, "panorama", [width, height], 1, format, usage);
    context.write_texture(
        view.texture().as_image_copy(),
        bytemuck::cast_slice(map.texels()),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * width),
            rows_per_image: None,
        },
        view.texture().size(),
    );
    Ok(view)
}
