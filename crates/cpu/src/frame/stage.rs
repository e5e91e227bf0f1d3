//! What can change between two pictures, and what that makes stale.

/// What can change between two pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Edit {
    /// Parameters and modes of the fibre.
    Hair,
    /// The terms that are drawn.
    Terms,
    /// d_f and d_b.
    Densities,
    /// Colours along the strands.
    Paint,
    /// What can be painted: the tables of painted hair.
    PaintKinds,
    /// Where strands are, and how wide.
    Points,
    /// Directions and widths of the lights.
    Lights,
    /// Their amplitudes.
    Colors,
    /// What stands beside the hair.
    Proxies,
    /// Camera and size of the picture.
    View,
    /// What is behind the hair.
    Background,
}

impl Edit {
    /// Is each point as bright beside its neighbours as before, but for what the hair or a light does to all of them?
    pub const fn keeps_shadows(self) -> bool {
        matches!(
            self,
            Edit::Hair | Edit::Terms | Edit::Densities | Edit::Colors
        )
    }
}

/// A part of the work for a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// The shadow volume.
    Voxelise,
    /// Records of the lights in the volume.
    Transmittance,
    /// What each pixel shows.
    List,
    /// Unblocked shares of the lights. They are found at visible points; from the second view on, or where there are
    /// drafts once the picture is complete, at all, and then serve any.
    ShadowMaps,
    /// The share of the light through to the eye.
    ThroughMaps,
    /// What arrives of the lights at the proxies.
    ProxyLight,
    /// What the proxies send back to the hair: what rays meet, and in [`Frame::bounce`](super::state::Frame::bounce) their
    /// light, which is stale whenever that of the proxies is.
    Bounce,
    /// Tables of multiple scattering.
    MultipleTables,
    /// Radiance of the visible points.
    Shade,
}

impl Stage {
    /// All of them, in order.
    pub const ALL: [Stage; 9] = [
        Stage::Voxelise,
        Stage::Transmittance,
        Stage::List,
        Stage::ShadowMaps,
        Stage::ThroughMaps,
        Stage::ProxyLight,
        Stage::Bounce,
        Stage::MultipleTables,
        Stage::Shade,
    ];

    /// The edits that make the stage stale, by way of the stages before it too.
    pub const fn inputs(self) -> &'static [Edit] {
        use Edit::{
            Colors, Densities, Hair, Lights, Paint, PaintKinds, Points, Proxies, Terms, View,
        };
        match self {
            Stage::Voxelise => &[Points],
            Stage::Transmittance | Stage::ProxyLight => &[Points, Lights, Proxies],
            Stage::Bounce => &[Points, Proxies],
            Stage::List => &[Points, Proxies, View],
            Stage::ShadowMaps => &[Points, Lights, Proxies, View],
            Stage::ThroughMaps => &[Points, Proxies, View],
            Stage::MultipleTables => &[Hair, Terms],
            Stage::Shade => &[
                Hair, Terms, Densities, Paint, PaintKinds, Points, Lights, Colors, Proxies, View,
            ],
        }
    }
}
