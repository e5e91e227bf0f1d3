//! Where passes note their time.

/// Where the passes of one slice note when they began and ended; nowhere if the device has no
/// time stamps or all places are taken.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stamp {
    pub(super) set: Option<wgpu::QuerySet>,
    pub(super) begin: Option<u32>,
    pub(super) end: Option<u32>,
}

impl Stamp {
    /// For the first of several passes.
    pub fn first(self) -> Self {
        Stamp { end: None, ..self }
    }

    /// For the last of several passes.
    pub fn last(self) -> Self {
        Stamp {
            begin: None,
            ..self
        }
    }

    pub fn compute_writes(&self) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        Some(wgpu::ComputePassTimestampWrites {
            query_set: self.set.as_ref()?,
            beginning_of_pass_write_index: self.begin,
            end_of_pass_write_index: self.end,
        })
    }

    pub fn render_writes(&self) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        Some(wgpu::RenderPassTimestampWrites {
            query_set: self.set.as_ref()?,
            beginning_of_pass_write_index: self.begin,
            end_of_pass_write_index: self.end,
        })
    }
}
