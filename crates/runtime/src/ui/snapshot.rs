//! The picture as it is on screen, as a PNG.

use crate::interactive::Display;
use crate::viewer::Viewer;
use strandlight_render::gpu::{Context, GpuError};
use strandlight_scene::png_file;

/// Bytes of a row of a copy are a multiple of this.
const ROW: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

/// A picture that cannot be saved.
#[derive(Debug, thiserror::Error)]
pub enum SnapshotError {
    /// The device does not give it back.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The encoder failed.
    #[error(transparent)]
    Png(#[from] png::EncodingError),
    /// Its file cannot be written.
    #[cfg(not(target_arch = "wasm32"))]
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: std::path::PathBuf,
        /// What the system answered.
        source: std::io::Error,
    },
    /// The device does not give it back to the page.
    #[cfg(target_arch = "wasm32")]
    #[error(transparent)]
    Buffer(#[from] wgpu::BufferAsyncError),
    /// Nor does it show its memory.
    #[cfg(target_arch = "wasm32")]
    #[error(transparent)]
    Memory(#[from] wgpu::MapRangeError),
    /// The browser does not take it.
    #[cfg(target_arch = "wasm32")]
    #[error(transparent)]
    Web(#[from] crate::page::WebError),
}

/// A PNG of what `viewer` displays.
///
/// # Errors
/// What the device or the encoder says.
#[cfg(not(target_arch = "wasm32"))]
pub fn png(viewer: &Viewer) -> Result<Vec<u8>, SnapshotError> {
    match (viewer.display(), viewer.renderer().device()) {
        (Display::Texture(view), Some(context)) => {
            let size = view.texture().size();
            let bytes = context.read_buffer("snapshot", &copy_of(context, view))?;
            Ok(encode_rows(size, &bytes)?)
        }
        (display, _) => Ok(encode_pixels(display)?),
    }
}

/// What `viewer` displays, sRGB times alpha, and its size.
///
/// # Errors
/// What the device says.
#[cfg(not(target_arch = "wasm32"))]
pub fn pixels(viewer: &Viewer) -> Result<([u32; 2], Vec<[u8; 4]>), SnapshotError> {
    match (viewer.display(), viewer.renderer().device()) {
        (Display::Texture(view), Some(context)) => {
            let size = view.texture().size();
            let bytes = context.read_buffer("snapshot", &copy_of(context, view))?;
            let rows = bytes.chunks_exact(bytes_per_row(size) as usize);
            let pixels = rows.flat_map(|row| row[..4 * size.width as usize].as_chunks::<4>().0);
            Ok(([size.width, size.height], pixels.copied().collect()))
        }
        (Display::Pixels(shown), _) => Ok((shown.size, shown.pixels.to_vec())),
        (Display::Texture(_), None) => Ok(([0, 0], Vec::new())),
    }
}

/// The same in a page, which does not wait for a device: there is none then.
///
/// # Errors
/// None.
#[cfg(target_arch = "wasm32")]
pub fn pixels(viewer: &Viewer) -> Result<([u32; 2], Vec<[u8; 4]>), SnapshotError> {
    match viewer.display() {
        Display::Pixels(shown) => Ok((shown.size, shown.pixels.to_vec())),
        Display::Texture(_) => Ok(([0, 0], Vec::new())),
    }
}

/// As `png`, without waiting: `done` is called when the picture is there.
#[cfg(target_arch = "wasm32")]
pub fn png_later(viewer: &Viewer, done: impl FnOnce(Result<Vec<u8>, SnapshotError>) + 'static) {
    let (view, context) = match (viewer.display(), viewer.renderer().device()) {
        (Display::Texture(view), Some(context)) => (view, context),
        (display, _) => return done(encode_pixels(display).map_err(SnapshotError::from)),
    };
    let size = view.texture().size();
    let buffer = copy_of(context, view);
    let of_callback = buffer.clone();
    buffer.map_async(wgpu::MapMode::Read, .., move |mapped| {
        let png = mapped.map_err(SnapshotError::from).and_then(|()| {
            let bytes = of_callback.get_mapped_range(..)?;
            Ok(encode_rows(size, &bytes)?)
        });
        done(png);
    });
}

/// A buffer that the device copies `view` (`rgba8unorm`) to, its rows of [`bytes_per_row`].
fn copy_of(context: &Context, view: &wgpu::TextureView) -> wgpu::Buffer {
    let texture = view.texture();
    let size = texture.size();
    let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("snapshot"),
        size: u64::from(bytes_per_row(size)) * u64::from(size.height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = context.device.create_command_encoder(&Default::default());
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(bytes_per_row(size)),
        rows_per_image: None,
    };
    let target = wgpu::TexelCopyBufferInfo {
        buffer: &buffer,
        layout,
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), target, size);
    context.queue.submit([encoder.finish()]);
    buffer
}

fn bytes_per_row(size: wgpu::Extent3d) -> u32 {
    (4 * size.width).next_multiple_of(ROW)
}

/// The PNG of a picture in memory.
fn encode_pixels(display: Display<'_>) -> Result<Vec<u8>, png::EncodingError> {
    let (pixels, [width, height]) = match display {
        Display::Pixels(shown) => (shown.pixels, shown.size),
        Display::Texture(_) => (&[][..], [0, 0]),
    };
    let pixels: Vec<[u8; 4]> = pixels.iter().map(straight).collect();
    png_file::encode([width, height], &pixels, &[])
}

/// The PNG of texels in rows of [`bytes_per_row`].
fn encode_rows(size: wgpu::Extent3d, bytes: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let pixels: Vec<[u8; 4]> = (bytes.chunks_exact(bytes_per_row(size) as usize))
        .flat_map(|row| row[..4 * size.width as usize].as_chunks::<4>().0)
        .map(straight)
        .collect();
    png_file::encode([size.width, size.height], &pixels, &[])
}

/// Colour divided by alpha, as PNG has it.
fn straight(&[r, g, b, a]: &[u8; 4]) -> [u8; 4] {
    let divided = |x: u8| match a {
        0 => 0,
        _ => ((u32::from(x) * 255 + u32::from(a) / 2) / u32::from(a)).min(255) as u8,
    };
    [divided(r), divided(g), divided(b), a]
}

#[cfg(test)]
mod tests {
    use super::straight;

    #[test]
    fn colour_is_divided_by_alpha() {
        assert_eq!(straight(&[10, 20, 30, 255]), [10, 20, 30, 255]);
        assert_eq!(straight(&[10, 64, 128, 128]), [20, 128, 255, 128]);
        assert_eq!(straight(&[10, 20, 30, 0]), [0, 0, 0, 0]);
    }
}
