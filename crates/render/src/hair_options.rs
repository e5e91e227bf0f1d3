//! What hair in a host's render pass is made for.

/// What the host's render pass is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HairOptions {
    /// Format of the colour attachment; linear radiance is written, so a float format keeps
    /// highlights.
    pub color_format: wgpu::TextureFormat,
    /// Format of the depth attachment, which hair is tested against and written to.
    pub depth_format: wgpu::TextureFormat,
    /// Samples of a pixel in both attachments: 1 or 4. Strands thinner than a pixel cover some of
    /// them: 4 are smoother.
    pub sample_count: u32,
    /// Depth is 1 at the near plane and 0 at the far plane, cleared to 0 and compared by `Greater`;
    /// else it is 0 at the near plane and compared by `Less`.
    pub reverse_z: bool,
}

impl Default for HairOptions {
    /// `Rgba16Float`, `Depth32Float`, 4 samples, 0 at the near plane.
    fn default() -> HairOptions {
        HairOptions {
            color_format: wgpu::TextureFormat::Rgba16Float,
            depth_format: wgpu::TextureFormat::Depth32Float,
            sample_count: 4,
            reverse_z: false,
        }
    }
}
