//! Directions in the frame of a fibre and the angles between them. Twin: `shaders/lib/frame.wgsl`.
//!
//! Frame (u, v, w), u the tangent from root to tip; a direction is
//! (sin theta, cos theta cos phi, cos theta sin phi).

/// Keeps 1 / cos(theta_d) finite at grazing angles; the outer integrand is 0 there.
pub(crate) const COS_THETA_D_MIN: f32 = 1e-6;

/// A direction away from the fibre.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct DirectionInFrame {
    /// Inclination to the normal plane, -pi/2..=pi/2.
    pub theta: f32,
    /// Cosine of the inclination, 0..=1.
    pub cos_theta: f32,
    /// Cosine of the azimuth; 1 where the azimuth has no meaning.
    pub cos_phi: f32,
    /// Sine of the azimuth.
    pub sin_phi: f32,
}

/// A spherical Gaussian light of amplitude 1.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LightInFrame {
    /// Where its centre lies.
    pub direction: DirectionInFrame,
    /// Xu's bandwidth lambda_j, 0.001..=10.
    pub lambda: f32,
}

crate::mirrors! {
    DirectionInFrame as "DirectionInFrame" in "lib/frame" { theta, cos_theta, cos_phi, sin_phi }
    LightInFrame as "LightInFrame" in "lib/frame" { direction, lambda }
}

impl DirectionInFrame {
    /// From inclination and azimuth in radians.
    pub fn from_angles(theta: f32, phi: f32) -> DirectionInFrame {
        DirectionInFrame {
            theta,
            cos_theta: theta.cos().max(0.0),
            cos_phi: phi.cos(),
            sin_phi: phi.sin(),
        }
    }

    /// From the components along (u, v, w) of a vector of any length but 0.
    pub fn from_vector(vector: [f32; 3]) -> DirectionInFrame {
        let [u, v, w] = vector;
        let radius = (v * v + w * w).sqrt();
        let theta = u.atan2(radius);
        if radius < 1e-12 {
            return DirectionInFrame {
                theta,
                cos_theta: 0.0,
                cos_phi: 1.0,
                sin_phi: 0.0,
            };
        }
        DirectionInFrame {
            theta,
            cos_theta: radius / (u * u + radius * radius).sqrt(),
            cos_phi: v / radius,
            sin_phi: w / radius,
        }
    }
}

impl LightInFrame {
    /// From inclination and azimuth in radians.
    pub fn from_angles(theta: f32, phi: f32, lambda: f32) -> LightInFrame {
        LightInFrame {
            direction: DirectionInFrame::from_angles(theta, phi),
            lambda,
        }
    }

    /// From the components along (u, v, w) of a vector of any length but 0.
    pub fn from_vector(vector: [f32; 3], lambda: f32) -> LightInFrame {
        LightInFrame {
            direction: DirectionInFrame::from_vector(vector),
            lambda,
        }
    }
}

/// The difference angle theta_d = (theta_o - theta_i) / 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inclination {
    /// theta_d, -pi/2..=pi/2.
    pub theta_d: f32,
    /// Its sine.
    pub sin_theta_d: f32,
    /// Its cosine, at least 1e-4.
    pub cos_theta_d: f32,
}

/// The azimuth between view and light, phi_o - phi_j, folded to 0..=pi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lag {
    /// Sine of half of it, 0..=1.
    pub sin_half: f32,
    /// Cosine of half of it, 0..=1.
    pub cos_half: f32,
    /// cos(phi_o + phi_j), for elliptic fibres.
    pub cos_sum: f32,
    /// cos(2 phi_o), for elliptic fibres.
    pub cos_view: f32,
}

/// The inclination with this theta_d.
pub fn inclination(theta_d: f32) -> Inclination {
    Inclination {
        theta_d,
        sin_theta_d: theta_d.sin(),
        cos_theta_d: theta_d.cos().max(COS_THETA_D_MIN),
    }
}

/// The lag between two azimuths given as (cos, sin); half angles from the chord, so that nearly
/// equal and nearly opposite azimuths keep their digits.
pub fn lag_between(cos_o: f32, sin_o: f32, cos_j: f32, sin_j: f32) -> Lag {
    let d_c = cos_o - cos_j;
    let d_s = sin_o - sin_j;
    let s_c = cos_o + cos_j;
    let s_s = sin_o + sin_j;
    let sin_half = (0.5 * (d_c * d_c + d_s * d_s).sqrt()).min(1.0);
    let cos_half = (0.5 * (s_c * s_c + s_s * s_s).sqrt()).min(1.0);
    Lag {
        sin_half,
        cos_half,
        cos_sum: cos_o * cos_j - sin_o * sin_j,
        cos_view: cos_o * cos_o - sin_o * sin_o,
    }
}
