//! Single and multiple scattering in closed form, in single precision: what the renderer evaluates.
//!
//! - [`Fibre`]: the parameters of one fibre, laid out as the shaders' uniform of the same name.
//! - [`Tables`]: a view of the baked tables C and H, with the sampling the shaders do.
//! - [`single_scattering()`]: the integral of one spherical Gaussian light over the fibre's
//!   scattering function (Eq 11), as the sum over the enabled modes.
//! - [`global_scattering()`], [`local_scattering()`], [`direct_local_scattering()`]: multiple
//!   scattering under such a light (Eq 27, 29), the latter two on the averages that
//!   [`pack_averages`] lays out.
//! - [`painted_shading`], [`painted_averages()`]: what takes the place of lobes and averages where
//!   the hair is painted and each point has its own fibre.
//! - [`paper::single_scattering()`]: the integral of one spherical Gaussian light over the fibre's
//!   scattering function (Eq 11), as the sum over the enabled modes, by the scheme as published.
//!
//! Every file here has a twin in `shaders/lib` with the same stem, the same function names and
//! the same order of operations; tests compare the two point by point. So arithmetic is written
//! for that pair, not for Rust idiom.

mod averages;
mod azimuthal;
mod azimuthal_r;
mod circular_gaussian;
mod constants;
mod eccentric;
mod fibre;
mod fisher;
mod frame;
mod global_scattering;
mod hair_layers;
mod half_circle;
mod irradiance;
mod lobes;
mod local_scattering;
mod longitudinal;
mod mean_cosine;
mod multiple_scattering;
mod outer_integral;
mod paint;
mod painted_averages;
mod painted_lobes;
pub mod paper;
mod single_scattering;
mod special;
mod tables;
mod through;
mod transmittance;
mod width_profile;

pub use averages::{
    AverageTexel, Averages, LocalAverages, SampleAverages, pack_averages, sample_averages,
};
pub use azimuthal::{azimuthal_trt, azimuthal_tt};
pub use azimuthal_r::{Reflectance, azimuthal_r};
pub use circular_gaussian::{c_0, lobe_integral, product_integral};
pub use eccentric::{ETA_STAR_MAX, ETA_STAR_MIN, EllipticLag, elliptic_lag};
pub use fibre::{
    ALL_MODES, DEFAULT_NODES, DEFAULT_SEGMENTS, ELLIPTIC, ENERGY_NODES, Fibre, MODE_R, MODE_TRT,
    MODE_TT, MODEL_ENERGY, N_FURTHER, pack_nodes,
};
pub use fisher::{
    FisherLobe, fisher_density, fisher_lobe, fisher_place, fisher_rule, forward_share,
    further_orders, further_place,
};
pub use frame::{DirectionInFrame, Inclination, Lag, LightInFrame, inclination, lag_between};
pub use global_scattering::{global_scattering, global_scattering_mode, half_circle_elliptic};
pub use hair_layers::{
    AxisDensities, HairLayers, NO_LAYERS, axis_densities, local_density, plain_layers,
};
pub use half_circle::{
    half_circle, half_circle_basis, half_circle_r, half_circle_trt, half_circle_tt,
};
pub use irradiance::{Irradiance, blurred_ramp, irradiance};
pub use lobes::{
    EVEN_TEXELS, LobeDecode, LobeView, Lobes, N_LOBE_NUMBERS, SampleLobes, lobe_place, sample_lobes,
};
pub(crate) use local_scattering::local_rule;
pub use local_scattering::{direct_local_scattering, local_scattering};
pub use longitudinal::{Longitudinal, longitudinal};
pub use mean_cosine::mean_cosine;
pub use multiple_scattering::{
    DENSITY_BACK, DENSITY_FORWARD, ForwardLight, ForwardTable, N_FORWARD, TERM_GLOBAL, TERM_LOCAL,
    TERM_SINGLE, forward_light, forward_table, global_density, sample_forward,
};
pub use outer_integral::{
    GAUSS_HERMITE, LN_CULL, MAX_NODES, NodePlace, OuterNode, OuterRule, node_constants, node_count,
    node_extent, node_place, outer_node, outer_rule,
};
pub use paint::{
    PaintTexel, PaintedHair, PaintedViews, PointPaint, pack_paint, painted_averages, painted_fibre,
    painted_shading, unpack_paint,
};
pub use painted_averages::{
    AverageRow, N_AVERAGE_COLUMNS, PaintedAverages, PaintedAveragesView, PaintedPointAverages,
    average_row, painted_layers, painted_place, sample_averages as sample_painted_averages,
    sample_painted_forward,
};
pub use painted_lobes::{
    LAYER_MIDDLE, LobeLayer, PaintedDecode, PaintedPointLobes, PaintedView, PointLobes, lobe_layer,
    sample_painted_lobes,
};
pub use single_scattering::{
    Shading, azimuthal_elliptic, azimuthal_elliptic_of_two, shadowed_single_scattering,
    single_scattering, single_scattering_mode,
};
pub use special::{ErfPair, bessel_i0e, bessel_i0e_fast, bessel_i1e, erf_pair};
pub use tables::{
    Cell, PackedShares, TableAxes, TableAxis, Tables, c_from_b, pack_shares, sample_c, sample_h,
    table_cell,
};
pub use through::{THROUGH_LEAST, THROUGH_PHI, THROUGH_THETA, through_kernel};
pub(crate) use transmittance::{HALF_BIAS, LEAST_HALF, MOST_HALF};
pub use transmittance::{
    LEAST_SHARE, P_1, P_2, PackedRecord, RECORD_SCALE, ShadowRecord, add_to_record, depth_of_share,
    forward_events, pack_record, pass_through, shares_of_ray, transmitted, unpack_record,
};
pub use width_profile::WidthProfile;

pub(crate) use averages::LAST_INCLINATION;
pub(crate) use constants::SQRT_PI;
#[cfg(test)]
pub(crate) use eccentric::lobes_at_azimuth;
pub(crate) use eccentric::{
    AZIMUTH_BLUR, AZIMUTH_BUMP, AZIMUTH_REACH, AZIMUTH_SHEAR, AZIMUTH_SHEAR_MAX, AZIMUTH_SIDE,
    AZIMUTH_STRETCH, AZIMUTH_STRETCHED, AZIMUTH_TILT, AZIMUTHS, eta_at,
};
pub(crate) use fisher::{FISHER_CLAMP, FISHER_SPREAD, INVERSE_FISHER_CLAMP};
pub(crate) use frame::COS_THETA_D_MIN;
#[cfg(test)]
pub(crate) use hair_layers::layers_of;
pub(crate) use local_scattering::{LOCAL_NODES, SHARE_MIN};
pub(crate) use mean_cosine::{HUMLICEK_ABOVE, HUMLICEK_BELOW, MEAN_COSINE_MIN};
pub(crate) use multiple_scattering::{
    BETWEEN_LAYERS_SHARE, DENSITY_BLOCKED, DENSITY_OPEN, LAST_FORWARD, LEAST_LOST,
};
pub(crate) use outer_integral::{
    CLAMP, COSINE_SHARPNESS, HALF_PI_SQUARED, INVERSE_CLAMP, MIDDLE, MIDDLE_END, NARROW,
    NARROW_END, VIEW_PULL,
};
pub(crate) use tables::{
    PACKED_ONE, SPACING_CONCAVE, SPACING_INVERSE_SQRT, SPACING_LOG, SPACING_RECIPROCAL,
    SPACING_ROOT_SQUARE,
};

use crate::layout::Layout;

/// The structs here that shaders mirror.
#[doc(hidden)]
pub fn layouts() -> Vec<Layout> {
    [
        azimuthal_r::LAYOUTS,
        fibre::LAYOUTS,
        frame::LAYOUTS,
        hair_layers::LAYOUTS,
        lobes::LAYOUTS,
        paint::LAYOUTS,
        painted_averages::LAYOUTS,
        painted_lobes::LAYOUTS,
        tables::LAYOUTS,
        width_profile::LAYOUTS,
        crate::multiple_tables::LAYOUTS,
    ]
    .concat()
}
