//! Directions in the frame of a fibre. Twin: `shaders/lib/frame.wgsl`.
//!
//! Frame (u, v, w), u the tangent from root to tip; a direction is
//! (sin theta, cos theta cos phi, cos theta sin phi).

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
