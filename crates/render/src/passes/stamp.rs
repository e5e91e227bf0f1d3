//! Where passes note their time.

/// Where the passes of one slice note when they began and ended; nowhere if the device has no
/// time stamps or all places are taken.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stamp<'a> {
    pub(super) set: Option<&'a wgpu::QuerySet>,
    pub(super) begin: Option<u32>,
    pub(super) end: Option<u32>,
}

impl<'a> Stamp<'a> {
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

    pub fn of_compute(self) -> Option<wgpu::ComputePassTimestampWrites<'a>> {
        Some(wgpu::ComputePassTimestampWrites {
            query_set: self.set?,
            beginning_of_pass_write_index: self.begin,
            end_of_pass_write_index: self.end,
        })
    }

    pub fn of_render(self) -> Option<wgpu::RenderPassTimestampWrites<'a>> {
        Some(wgpu::RenderPassTimestampWrites {
            query_set: self.set?,
            beginning_of_pass_write_index: self.begin,
            end_of_pass_write_index: self.end,
        })
    }
}
