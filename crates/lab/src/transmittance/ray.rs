//! Ray shooting: what lies between a point and directions of a light's lobe, by actual crossings.

use glam::Vec3;
use strandlight_scattering::closed_form::{P_1, P_2, ShadowRecord};
use strandlight_scene::strands::Strands;

use strandlight_reference::rays::{Rays, Start};

/// What rays of a lobe found; means over them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Transmitted {
    /// T: share of rays without a crossing.
    pub unblocked: f64,
    /// T_f per channel: mean of the product of a_f over a ray's crossings.
    pub forward: [f64; 3],
}

/// T and T_f at `point` of the strands by rays along `directions`; `a_f(sin_theta)` is what a fibre
/// passes on at that sine of the light's inclination.
pub fn ray_shares(
    rays: &Rays,
    strands: &Strands,
    point: u32,
    directions: &[[f32; 3]],
    a_f: impl Fn(f32) -> [f32; 3],
) -> Transmitted {
    let start = Start::vertex(strands, point);
    let mut sum = Transmitted::default();
    for &direction in directions {
        let (mut n, mut product) = (0, [1.0_f64; 3]);
        rays.crossings(&start, Vec3::from(direction), |crossing| {
            n += 1;
            let passed = a_f(sin_theta(strands, crossing.segment, direction));
            for (product, passed) in product.iter_mut().zip(passed) {
                *product *= f64::from(passed);
            }
        });
        sum.unblocked += f64::from(u8::from(n == 0));
        for (sum, product) in sum.forward.iter_mut().zip(product) {
            *sum += product;
        }
    }
    let n = directions.len().max(1) as f64;
    Transmitted {
        unblocked: sum.unblocked / n,
        forward: sum.forward.map(|x| x / n),
    }
}

/// The record of the rays' crossings: with n of them, `E (1-p)^n` stands for `E exp(-p tau)`, which
/// is its mean over Poisson's n.
pub fn ray_record(
    rays: &Rays,
    strands: &Strands,
    point: u32,
    directions: &[[f32; 3]],
) -> ShadowRecord {
    let start = Start::vertex(strands, point);
    let mut shares = [0.0_f64; 3];
    let (mut crossed, mut sin_2) = (0.0_f64, 0.0_f64);
    for &direction in directions {
        let mut n = 0;
        rays.crossings(&start, Vec3::from(direction), |crossing| {
            n += 1;
            sin_2 += f64::from(sin_theta(strands, crossing.segment, direction).powi(2));
        });
        crossed += f64::from(n);
        for (sum, share) in shares.iter_mut().zip(shares_of_count(n)) {
            *sum += share;
        }
    }
    let n = directions.len().max(1) as f64;
    ShadowRecord {
        shares: shares.map(|sum| (sum / n) as f32),
        sin_theta: (sin_2 / crossed.max(1.0)).sqrt() as f32,
    }
}

/// `(1 - p)^n` at a record's exponents.
pub(super) fn shares_of_count(n: i32) -> [f64; 3] {
    [1.0, P_1, P_2].map(|p| (1.0 - f64::from(p)).powi(n))
}

/// Sine of the inclination of `direction` to a segment; positive towards its tip.
pub(super) fn sin_theta(strands: &Strands, segment: u32, direction: [f32; 3]) -> f32 {
    let first = strands.segments[segment as usize] as usize;
    let [a, b] = [first, first + 1].map(|ix| Vec3::from_slice(&strands.points[ix]));
    (b - a).normalize_or_zero().dot(Vec3::from(direction))
}
