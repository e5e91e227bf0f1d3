//! The profile of strands that are wider than a pixel, on the device.

use super::resources::uniform;
use crate::gpu::Context;
use strandlight_scattering::closed_form::WidthProfile;

/// Turns it on in shading and in drawing.
pub(super) const FEATURE: &str = "WIDE";

/// Binding in the shading pass.
const BINDING: u32 = 25;

/// The profile of a scene, where a view shows such strands.
#[derive(Default)]
pub(super) struct Profile {
    now: Option<WidthProfile>,
    /// Made when there is first one.
    buffer: Option<wgpu::Buffer>,
}

impl Profile {
    /// Takes another one, or none.
    pub fn set(&mut self, context: &Context, profile: Option<WidthProfile>) {
        if let Some(new) = profile.filter(|_| profile != self.now) {
            match &self.buffer {
                Some(buffer) => context.write(buffer, 0, bytemuck::bytes_of(&new)),
                None => self.buffer = Some(uniform(context, "profile", &new)),
            }
        }
        self.now = profile;
    }

    /// The one that was set.
    pub fn now(&self) -> Option<WidthProfile> {
        self.now
    }

    /// Is there one?
    pub fn is_there(&self) -> bool {
        self.now.is_some()
    }

    /// Its binding, if there is one.
    pub fn binding(&self) -> Option<(u32, wgpu::BindingResource<'_>)> {
        let buffer = self.buffer.as_ref().filter(|_| self.is_there());
        buffer.map(|buffer| (BINDING, buffer.as_entire_binding()))
    }
}
