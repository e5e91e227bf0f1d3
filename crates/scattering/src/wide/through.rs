//! Where TT takes its light from, eight directions at a time. Twin: `closed_form/through.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{THROUGH_LEAST, THROUGH_PHI, THROUGH_THETA};

use super::math::exp;

/// Eight of [`crate::closed_form::through_kernel`], for one eye.
#[inline(always)]
pub fn through_kernel<S: Simd>(towards: [f32x8<S>; 3], eye: [f32; 3]) -> f32x8<S> {
    let [u_i, v_i, w_i] = towards;
    let [u_o, v_o, w_o] = eye;
    let simd = u_i.token();
    let one = f32x8::splat(simd, 1.0);
    let cosines = ((one - u_i * u_i) * (1.0 - u_o * u_o)).max(1e-12).sqrt();
    let off_cone = one - cosines + u_i * u_o;
    let off_line = ((v_i * v_o + w_i * w_o) / cosines + 1.0).max(0.0);
    let exponent = off_cone * (1.0 / (THROUGH_THETA * THROUGH_THETA))
        + off_line * (1.0 / (THROUGH_PHI * THROUGH_PHI));
    exp(-exponent) + THROUGH_LEAST
}

#[cfg(test)]
mod tests {
    use crate::closed_form;
    use crate::random::SplitMix64;
    use crate::wide::{LANES, dispatch, levels};

    use super::*;

    #[test]
    fn the_kernel_is_that_of_its_scalar_twin() {
        let mut random = SplitMix64(7);
        let mut direction = || {
            let u = random.uniform(-1.0, 1.0);
            let phi = random.uniform(0.0, std::f64::consts::TAU);
            let cos = (1.0 - u * u).sqrt();
            [u, cos * phi.cos(), cos * phi.sin()].map(|x| x as f32)
        };
        for (name, level) in levels() {
            for _ in 0..200 {
                let eye = direction();
                let towards: [[f32; 3]; LANES] = std::array::from_fn(|_| direction());
                let found: [f32; LANES] = dispatch!(level, simd => {
                    let [x, y, z] = [0, 1, 2].map(|axis: usize| towards.map(|d| d[axis]));
                    let x = f32x8::simd_from(simd, x);
                    let y = f32x8::simd_from(simd, y);
                    let z = f32x8::simd_from(simd, z);
                    through_kernel([x, y, z], eye).into()
                });
                for (found, towards) in found.into_iter().zip(towards) {
                    let exact = closed_form::through_kernel(towards, eye);
                    assert!((found - exact).abs() < 1e-5, "{name}: {found} {exact}");
                }
            }
        }
    }
}
