//! The scattering function of painted fibres.

use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe, Model};
use crate::quadrature::GaussLegendre;

use super::layered::{LayeredTrt, Place};
use super::{
    Bcsdf, BcsdfError, BcsdfView, Form, Longitudinal, MASS_MIN, N_PLACES, Trt, angles,
    longitudinal, place_of,
};

/// Fibres of one eta and w_c whose absorption, widths and shifts differ from point to point, each
/// of which can be evaluated and sampled as a [`Bcsdf`].
///
/// S is that of a [`Bcsdf`] of the point's own fibre but for TRT's absorption, which is
/// interpolated (error 1e-3 of its peak). The sampler draws theta_i by M_t alone, so its weights go
/// up to 4 near grazing.
#[derive(Clone, Debug)]
pub struct PaintedBcsdf {
    fresnel: Fresnel,
    enabled: [bool; 3],
    trt: Option<LayeredTrt>,
    /// At `N_PLACES` inclinations theta_o over +-pi/2: albedo over the mass of M_t, per lobe,
    /// without absorption and the logarithm of what absorption 1 leaves. Lobes are drawn by it; any
    /// numbers would be right.
    kept: Vec<[[f64; 2]; 3]>,
}

impl PaintedBcsdf {
    /// The tables of the `modes` of fibres of the eta and w_c of `hair`. Takes about 2 s, with the
    /// narrowest caustics half a minute.
    ///
    /// # Errors
    /// As [`Bcsdf::new`]; model `energy`; TRT of fibres that are not round.
    pub fn new(hair: &HairParams, fresnel: Fresnel, modes: &[Lobe]) -> Result<Self, BcsdfError> {
        if hair.model == Model::Energy {
            return Err(BcsdfError::PaintedEnergy);
        }
        if modes.contains(&Lobe::Trt) && hair.eccentricity != 1.0 {
            let eccentricity = hair.eccentricity;
            return Err(BcsdfError::PaintedEccentric { eccentricity });
        }
        let clear = HairParams {
            sigma_a: [0.0, 1.0, 1.0],
            ..*hair
        };
        let bcsdf = Bcsdf::new(&clear, fresnel, modes)?;
        let rule = GaussLegendre::new(6);
        let kept = (0..N_PLACES).map(|ix| {
            let theta_o = std::f64::consts::PI * (ix as f64 / (N_PLACES - 1) as f64 - 0.5);
            Lobe::ALL.map(|lobe| {
                let [clear, at_1, ..] = bcsdf.mean_weight(lobe, theta_o, &rule);
                [clear, (at_1.max(1e-30) / clear.max(1e-30)).ln()]
            })
        });
        let kept = kept.collect();
        let has_trt = bcsdf.trt.is_some();
        Ok(PaintedBcsdf {
            fresnel,
            enabled: bcsdf.enabled,
            trt: has_trt.then(|| LayeredTrt::new(hair, fresnel)),
            kept,
        })
    }

    /// A fibre of `hair`, which must have the eta and w_c of these tables and be valid, seen from
    /// the unit vector `omega_o` in its frame (u along the fibre).
    pub fn view(&self, hair: &HairParams, omega_o: [f64; 3]) -> BcsdfView<'_> {
        let (theta_o, phi_o) = angles(omega_o);
        let longitudinal = Lobe::ALL.map(|lobe| longitudinal(hair, lobe, theta_o));
        let kept = self.kept[place_of(theta_o).0];
        let mut scale = [0.0; 3];
        let mut shares: [f64; 3] = std::array::from_fn(|l| {
            let mass = longitudinal[l].mass;
            if !self.enabled[l] || mass < MASS_MIN {
                return 0.0;
            }
            scale[l] = 1.0 / mass;
            let [clear, slope] = kept[l];
            let mean: f64 = hair.sigma_a.iter().map(|sigma| (sigma * slope).exp()).sum();
            // Never none: black fibres still send a little by each lobe.
            mass * clear * (mean / 3.0).max(1e-6)
        });
        let total = shares[0] + shares[1] + shares[2];
        if total > 0.0 {
            shares = shares.map(|share| share / total);
        }
        let trt = self.trt.as_ref();
        BcsdfView {
            hair: *hair,
            fresnel: self.fresnel,
            trt: trt.map(|trt| Trt::Layered(trt, hair.sigma_a.map(Place::of))),
            theta_o,
            phi_o,
            longitudinal: longitudinal.map(Longitudinal::Gaussian),
            shares,
            density_scale: std::array::from_fn(|l| shares[l] * scale[l]),
            form: Form::Plain,
        }
    }
}
