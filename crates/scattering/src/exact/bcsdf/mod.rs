//! The exact scattering function at a point, and sampling it: what a path tracer needs.
//!
//! - [`Bcsdf::new`]: the tables of one fibre.
//! - [`Bcsdf::view`]: the fibre seen from one direction; [`BcsdfView::evaluate`],
//!   [`BcsdfView::sample`].
//! - [`PaintedBcsdf`]: the tables of fibres whose absorption, widths and shifts differ from point
//!   to point; [`PaintedBcsdf::view`].
//!
//! `S(omega_i, omega_o) = sum_t M_t(theta_i) N_t(phi; theta_d) / cos^2 theta_d`, the S that
//! [`super::single()`] integrates against `cos(theta_i) d omega_i`. R and TT are in closed form,
//! TRT, blurred by w_c, comes from a table. Reciprocal: S is the same with the directions swapped.
//!
//! **Energy.** M_t has unit mass in theta_i, N_t at most 1 over all modes, but the factor
//! `cos^2 theta_i / cos^2 theta_d` of far-field scattering is not 1 where M_t is wide or shifted:
//! the albedo of a fibre without absorption exceeds 1 at some inclinations (numbers beside
//! [`Bcsdf::albedo`]). Orders p >= 3 are left out, 0.7 % at normal incidence and eta 1.55.
//!
//! **[`Model::Energy`]**: `S = sum_t M_t(theta_i) N_t(phi; theta_o) / cos theta_i` with M_t of
//! [`FisherLobe`], all orders p >= 3 in TRT. M_t cos(theta_i) has unit mass whatever theta_o, and N_t is
//! the same for all theta_i, so that the albedo seen from theta_o is the sum of the masses of N_t there:
//! 1 of a fibre without absorption. With N_t at theta_d it would be 0.72 to 1.04 at the default widths
//! and shifts, since modes of different widths and shifts see it at different places. The price is
//! reciprocity.

mod elliptic;
mod layered;
mod painted;
mod table;
#[cfg(test)]
mod tests;
mod truncated;

pub use painted::PaintedBcsdf;

use std::f64::consts::{FRAC_PI_2, PI};

use super::fibre::FibreSection;
use super::fisher::FisherLobe;
use crate::circular_gaussian::{sharpness, wrap};
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe, Model, ParamError};
use crate::quadrature::GaussLegendre;
use elliptic::EllipticTrt;
use layered::{LayeredTrt, Place as LayerPlace};
use table::{BlurredTrt, Energies};
use truncated::{Truncated, sample_circular};

/// Why there is no [`Bcsdf`] of a fibre.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BcsdfError {
    /// A parameter outside its range.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// TRT of an elliptic fibre depends on both azimuths (Xu 2011 Eq 24), which is not tabulated
    /// for all absorptions.
    #[error("eccentricity {eccentricity}: only circular fibres (1) can be painted with TRT")]
    PaintedEccentric {
        /// The eccentricity asked for.
        eccentricity: f64,
    },
    /// Paint is not offered with [`Model::Energy`].
    #[error("painted fibres take model \"marschner\" alone, not \"energy\"")]
    PaintedEnergy,
}

/// A fibre whose scattering can be evaluated and sampled.
#[derive(Clone, Debug)]
pub struct Bcsdf {
    hair: HairParams,
    fresnel: Fresnel,
    /// Which modes take part, in the order of [`Lobe::ALL`].
    enabled: [bool; 3],
    trt: Option<TrtTable>,
    energies: Energies,
    /// At `N_PLACES` inclinations theta_o over +-pi/2; none of model `energy`.
    places: Vec<Place>,
}

/// N_TRT of one fibre.
#[derive(Clone, Debug)]
enum TrtTable {
    /// A round one.
    Round(BlurredTrt),
    /// An elliptic one.
    Elliptic(EllipticTrt),
}

/// What the sampler knows of one inclination theta_o.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Albedo over the mass of M_t, mean of the channels, per lobe: modes are drawn by it. Any
    /// positive numbers would be right.
    kept: [f64; 3],
    /// Mean of `cos^2 theta_i / cos^2 theta_d` under M_t, per lobe: part of the density.
    factor: [f64; 3],
    /// Greatest `cos^2 theta_i / cos^2 theta_d` of any theta_i; rises with |theta_o| from 1 to 4.
    factor_max: f64,
}

/// Inclinations in the sampler's table: between them the mean factor is within 1e-4, but for
/// inclinations within a width of M_t of the fibre's own direction.
const N_PLACES: usize = 1025;

/// Smaller masses of M_t inside +-pi/2 count as none: they would not divide.
const MASS_MIN: f64 = 1e-250;

/// The scattering function and the sampler's density for one pair of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattered {
    /// S, per channel, 1/sr, without `cos theta_i`.
    pub s: [f64; 3],
    /// Density with which [`BcsdfView::sample`] draws this omega_i, per solid angle.
    pub pdf: f64,
}

/// A direction towards the light drawn for a direction to the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Unit vector in the fibre's frame.
    pub omega_i: [f64; 3],
    /// `S cos(theta_i) / pdf`, per channel.
    pub weight: [f64; 3],
    /// Density per solid angle.
    pub pdf: f64,
}

impl Bcsdf {
    /// The scattering function of the `modes` of a fibre of `hair`; a mode named twice counts
    /// once. Takes about 0.1 s, up to 2 s for the narrowest caustics; of an elliptic fibre with TRT 0.6 s, up to
    /// a minute.
    ///
    /// # Errors
    /// A parameter outside its range.
    pub fn new(hair: &HairParams, fresnel: Fresnel, modes: &[Lobe]) -> Result<Self, BcsdfError> {
        hair.validate()?;
        let enabled = Lobe::ALL.map(|lobe| modes.contains(&lobe));
        let has_trt = enabled[Lobe::Trt as usize];
        let mut bcsdf = Bcsdf {
            hair: *hair,
            fresnel,
            enabled,
            trt: has_trt.then(|| match hair.eccentricity == 1.0 {
                true => TrtTable::Round(BlurredTrt::new(hair, fresnel)),
                false => TrtTable::Elliptic(EllipticTrt::new(hair, fresnel)),
            }),
            energies: Energies::new(hair, fresnel),
            places: Vec::new(),
        };
        if hair.model == Model::Energy {
            return Ok(bcsdf);
        }
        let rule = GaussLegendre::new(6);
        bcsdf.places = (0..N_PLACES)
            .map(|ix| {
                let theta_o = -FRAC_PI_2 + PI * ix as f64 / (N_PLACES - 1) as f64;
                let means = Lobe::ALL.map(|lobe| bcsdf.mean_weight(lobe, theta_o, &rule));
                Place {
                    kept: means.map(|[r, g, b, _]| (r + g + b) / 3.0),
                    factor: means.map(|mean| mean[3]),
                    factor_max: greatest_factor(theta_o),
                }
            })
            .collect();
        Ok(bcsdf)
    }

    /// The parameters.
    pub fn hair(&self) -> &HairParams {
        &self.hair
    }

    /// Albedo of `lobe` over the mass of its M_t within +-pi/2, per channel, and the mean factor
    /// `cos^2 theta_i / cos^2 theta_d`.
    fn mean_weight(&self, lobe: Lobe, theta_o: f64, rule: &GaussLegendre) -> [f64; 4] {
        longitudinal(&self.hair, lobe, theta_o).average(rule, |theta_i| {
            let theta_d = 0.5 * (theta_o - theta_i);
            let factor = cosine_ratio(theta_i, theta_d);
            let [r, g, b] = self.energies.at(lobe, theta_d).map(|e| factor * e);
            [r, g, b, factor]
        })
    }

    /// `Int S cos(theta_i) d omega_i`, per channel, seen from inclination `theta_o`: what a fibre
    /// in an environment of radiance 1 sends out. By quadrature, error 1e-4; some 0.1 ms.
    ///
    /// Not bounded by 1 (see the module): without absorption, at eta 1.55 and the default widths
    /// and shifts, it rises from 0.90 at -0.5 over 0.955 at 0 to 1.05 at 1.0, and to 1.6 within
    /// 0.02 of the fibre's own direction, where nothing is seen; its mean over the projected
    /// sphere is 0.939. Narrow lobes come to 1.09, unshifted ones stay below 0.973 up to 1.4.
    ///
    /// Of model `energy` it is the sum of the masses of N_t: 1 everywhere without absorption. Of an elliptic
    /// fibre with TRT it is the mean over all azimuths; [`Bcsdf::albedo_from`] has each.
    pub fn albedo(&self, theta_o: f64) -> [f64; 3] {
        let rule = GaussLegendre::new(6);
        let mut total = [0.0; 3];
        for lobe in Lobe::ALL {
            if !self.enabled[lobe as usize] {
                continue;
            }
            if self.hair.model == Model::Energy {
                let kept = self.energies.at(lobe, theta_o);
                for c in 0..3 {
                    total[c] += kept[c];
                }
            } else {
                let mass = longitudinal(&self.hair, lobe, theta_o).mass;
                let mean = self.mean_weight(lobe, theta_o, &rule);
                for c in 0..3 {
                    total[c] += mass * mean[c];
                }
            }
        }
        total
    }

    /// [`Bcsdf::albedo`] seen from the azimuth `phi_o` (0 along v), which matters for elliptic fibres with
    /// TRT. TRT's part is within 2 % at eccentricity 0.85, 6 % at 1.25 and 14 % at 2; its mean is exact.
    pub fn albedo_from(&self, theta_o: f64, phi_o: f64) -> [f64; 3] {
        let mut total = self.albedo(theta_o);
        if let Some(TrtTable::Elliptic(table)) = &self.trt {
            let m = longitudinal(&self.hair, Lobe::Trt, theta_o);
            let swing = m.average(&GaussLegendre::new(6), |theta_i| {
                let theta_d = 0.5 * (theta_o - theta_i);
                let factor = cosine_ratio(theta_i, theta_d);
                table.energy_swing(theta_d, phi_o).map(|e| factor * e)
            });
            for (total, swing) in total.iter_mut().zip(swing) {
                *total += m.mass * swing;
            }
        }
        total
    }

    /// Whether it looks another when it is turned about its axis: elliptic, with TRT.
    pub fn has_roll(&self) -> bool {
        matches!(self.trt, Some(TrtTable::Elliptic(_)))
    }

    /// The fibre seen from the unit vector `omega_o` in its frame (u along the fibre, phi 0 along v).
    pub fn view(&self, omega_o: [f64; 3]) -> BcsdfView<'_> {
        let (theta_o, phi_o) = angles(omega_o);
        if self.hair.model == Model::Energy {
            return self.view_energy(theta_o, phi_o);
        }
        let longitudinal = Lobe::ALL.map(|lobe| longitudinal(&self.hair, lobe, theta_o));
        let (ix, t) = place_of(theta_o);
        let (before, after) = (&self.places[ix], &self.places[ix + 1]);
        let between = |a: [f64; 3], b: [f64; 3], l: usize| (1.0 - t) * a[l] + t * b[l];
        let mut scale = [0.0; 3];
        let mut shares: [f64; 3] = std::array::from_fn(|l| {
            let mass = longitudinal[l].mass;
            let factor = between(before.factor, after.factor, l);
            if !self.enabled[l] || mass < MASS_MIN || factor <= 0.0 {
                return 0.0;
            }
            scale[l] = 1.0 / (mass * factor);
            mass * between(before.kept, after.kept, l)
        });
        let total = shares[0] + shares[1] + shares[2];
        if total > 0.0 {
            shares = shares.map(|share| share / total);
        }
        BcsdfView {
            hair: self.hair,
            fresnel: self.fresnel,
            trt: self.trt.as_ref().map(|trt| Trt::of(trt, phi_o)),
            theta_o,
            phi_o,
            longitudinal: longitudinal.map(Longitudinal::Gaussian),
            shares,
            density_scale: std::array::from_fn(|l| shares[l] * scale[l]),
            form: Form::Kept(before.factor_max.max(after.factor_max)),
        }
    }

    /// [`Bcsdf::view`] of model `energy`: modes are drawn by their albedo, which is exact.
    fn view_energy(&self, theta_o: f64, phi_o: f64) -> BcsdfView<'_> {
        let hair = &self.hair;
        let kept = |lobe| {
            let [r, g, b] = self.energies.at(lobe, theta_o);
            (r + g + b) / 3.0
        };
        // A fibre that keeps nothing still has directions.
        let mut shares = Lobe::ALL.map(|lobe| match self.enabled[lobe as usize] {
            true => f64::max(kept(lobe), 1e-12),
            false => 0.0,
        });
        let total: f64 = shares.iter().sum();
        if total > 0.0 {
            shares = shares.map(|share| share / total);
        }
        let further = self.energies.further_at(theta_o);
        let [r, g, b] = further;
        let even = ((r + g + b) / 3.0 / kept(Lobe::Trt).max(1e-12)).clamp(0.0, 1.0);
        let lobes = Lobe::ALL.map(|lobe| {
            let mean = 2.0 * hair.shift.get(lobe) - theta_o;
            FisherLobe::new(mean, 2.0 * hair.width.get(lobe))
        });
        BcsdfView {
            hair: *hair,
            fresnel: self.fresnel,
            trt: self.trt.as_ref().map(|trt| Trt::of(trt, phi_o)),
            theta_o,
            phi_o,
            longitudinal: lobes.map(Longitudinal::Fisher),
            shares,
            density_scale: shares,
            form: Form::Energy(Further {
                kept: further,
                even,
            }),
        }
    }
}

/// M_t as a function of theta_i, seen from one inclination.
#[derive(Clone, Copy, Debug)]
enum Longitudinal {
    /// M_t.
    Gaussian(Truncated),
    /// `M_t cos(theta_i)`.
    Fisher(FisherLobe),
}

impl Longitudinal {
    fn density(&self, theta_i: f64) -> f64 {
        match self {
            Longitudinal::Gaussian(m) => m.density(theta_i),
            Longitudinal::Fisher(m) => m.density(theta_i),
        }
    }

    fn sample(&self, uniform: &mut impl FnMut() -> f64) -> f64 {
        match self {
            Longitudinal::Gaussian(m) => m.sample(uniform),
            Longitudinal::Fisher(m) => m.sample(uniform),
        }
    }
}

/// How theta_i is drawn, and what stands beside M_t N_t in S.
#[derive(Clone, Copy, Debug)]
enum Form {
    /// By M_t, kept by `cos^2 theta_i / cos^2 theta_d` over this bound of it.
    Kept(f64),
    /// By M_t alone.
    Plain,
    /// By `M_t cos(theta_i)`, model `energy`.
    Energy(Further),
}

/// The orders beyond TRT, at one inclination.
#[derive(Clone, Copy, Debug)]
struct Further {
    /// Their mass, per channel.
    kept: [f64; 3],
    /// The share of TRT's azimuths that are drawn evenly, for them.
    even: f64,
}

/// M_t as a function of theta_i, seen from inclination `theta_o`.
fn longitudinal(hair: &HairParams, lobe: Lobe, theta_o: f64) -> Truncated {
    let mean = 2.0 * hair.shift.get(lobe) - theta_o;
    let width = 2.0 * hair.width.get(lobe);
    Truncated::new(mean, width, -FRAC_PI_2, FRAC_PI_2)
}

/// The place at or before `theta_o`, and the share of the way to the next.
fn place_of(theta_o: f64) -> (usize, f64) {
    let x = (theta_o / PI + 0.5).clamp(0.0, 1.0) * (N_PLACES - 1) as f64;
    let ix = (x as usize).min(N_PLACES - 2);
    (ix, x - ix as f64)
}

/// Where N_TRT comes from.
#[derive(Clone, Copy, Debug)]
enum Trt<'a> {
    /// The table of the one fibre.
    Alike(&'a BlurredTrt),
    /// A place in that of all absorptions.
    Layered(&'a LayeredTrt, [LayerPlace; 3]),
    /// The table of the one elliptic fibre, and phi_o.
    Elliptic(&'a EllipticTrt, f64),
}

impl<'a> Trt<'a> {
    fn of(table: &'a TrtTable, phi_o: f64) -> Self {
        match table {
            TrtTable::Round(table) => Trt::Alike(table),
            TrtTable::Elliptic(table) => Trt::Elliptic(table, phi_o),
        }
    }

    /// `[N_TRT rgb, density]`.
    fn at(&self, theta_d: f64, phi: f64) -> [f64; 4] {
        match self {
            Trt::Alike(table) => table.at(theta_d, phi),
            Trt::Layered(table, places) => table.at(theta_d, phi, places),
            Trt::Elliptic(table, phi_o) => table.at(theta_d, phi, *phi_o),
        }
    }
}

/// A [`Bcsdf`], or a fibre of a [`PaintedBcsdf`], seen from one direction.
#[derive(Clone, Debug)]
pub struct BcsdfView<'a> {
    hair: HairParams,
    fresnel: Fresnel,
    trt: Option<Trt<'a>>,
    theta_o: f64,
    phi_o: f64,
    longitudinal: [Longitudinal; 3],
    /// Probability of each lobe; all 0 where nothing is scattered.
    shares: [f64; 3],
    /// Share over the mass of what theta_i is drawn by.
    density_scale: [f64; 3],
    form: Form,
}

impl BcsdfView<'_> {
    /// S and the sampler's density towards the unit vector `omega_i`.
    pub fn evaluate(&self, omega_i: [f64; 3]) -> Scattered {
        let (theta_i, phi_i) = angles(omega_i);
        let theta_d = 0.5 * (self.theta_o - theta_i);
        let at = self.azimuthal_inclination(theta_i);
        let (sum, density) = self.at_angles(theta_i, at, wrap(self.phi_o - phi_i));
        let inverse = match self.form {
            Form::Kept(_) | Form::Plain => 1.0 / square(theta_d.cos().max(COS_MIN)),
            Form::Energy(_) => 1.0 / square(theta_i.cos().max(COS_MIN)),
        };
        Scattered {
            s: sum.map(|x| x * inverse),
            pdf: self.per_solid_angle(density, theta_i, theta_d),
        }
    }

    /// Where N_t is taken: theta_d, of model `energy` theta_o.
    fn azimuthal_inclination(&self, theta_i: f64) -> f64 {
        match self.form {
            Form::Kept(_) | Form::Plain => 0.5 * (self.theta_o - theta_i),
            Form::Energy(_) => self.theta_o,
        }
    }

    /// `density` of [`BcsdfView::at_angles`] per solid angle.
    fn per_solid_angle(&self, density: f64, theta_i: f64, theta_d: f64) -> f64 {
        match self.form {
            Form::Kept(_) => density * theta_i.cos().max(0.0) / square(theta_d.cos().max(COS_MIN)),
            Form::Plain | Form::Energy(_) => density / theta_i.cos().max(COS_MIN),
        }
    }

    /// Draws a direction towards the light; `None` where the fibre scatters nothing. `uniform`
    /// gives independent numbers in 0..1.
    ///
    /// A lobe by its albedo; theta_i by its M_t, kept with a probability proportional to
    /// `cos^2 theta_i / cos^2 theta_d` (of painted fibres always); the azimuth by the path through
    /// an even h (for R more often a grazing one), with a circular Gaussian of width w_c added for
    /// TRT, and of an elliptic fibre the path is one of an index as near azimuths have it. Of model `energy` theta_i by `M_t cos(theta_i)`, nothing being turned down, and TRT's azimuth
    /// with the probability of its further orders anywhere. The density is that of all lobes together, so
    /// `weight * pdf = S cos(theta_i)`, and weights stay near the albedo.
    pub fn sample(&self, uniform: &mut impl FnMut() -> f64) -> Option<Sample> {
        let mut pick = uniform();
        let lobe = Lobe::ALL.into_iter().find(|&lobe| {
            let share = self.shares[lobe as usize];
            let found = pick < share;
            pick -= share;
            found
        });
        // Rounding may leave nothing for the last; then any lobe with a share will do.
        let lobe = lobe.or_else(|| {
            let mut all = Lobe::ALL.into_iter();
            all.find(|&lobe| self.shares[lobe as usize] > 0.0)
        })?;
        // More than a fifth are kept at any theta_o; the count ends what rounding might not.
        let (mut theta_i, mut theta_d) = (0.0, 0.0);
        for _ in 0..1000 {
            theta_i = self.longitudinal[lobe as usize].sample(uniform);
            theta_d = 0.5 * (self.theta_o - theta_i);
            match self.form {
                Form::Kept(most) if uniform() * most > cosine_ratio(theta_i, theta_d) => {}
                _ => break,
            }
        }
        let hair = &self.hair;
        let at = self.azimuthal_inclination(theta_i);
        let eta = match (lobe, &self.trt) {
            (Lobe::Trt, Some(Trt::Elliptic(table, phi_o))) => table.sample_eta(*phi_o, uniform),
            _ => hair.eta,
        };
        let section = FibreSection::of(hair, eta, at, self.fresnel);
        let gamma = if lobe == Lobe::R && uniform() < GRAZING_SHARE {
            grazing_angle(uniform)
        } else {
            (2.0 * uniform() - 1.0).asin()
        };
        let mut phi = section.exit_azimuth(lobe, gamma);
        if lobe == Lobe::Trt {
            phi += sample_circular(sharpness(hair.caustic_width), uniform);
            if let Form::Energy(further) = &self.form
                && uniform() < further.even
            {
                phi = 2.0 * PI * uniform();
            }
        }
        let (sum, density) = self.at_angles(theta_i, at, wrap(phi));
        if !(density > 0.0 && density.is_finite()) {
            return None;
        }
        // S cos(theta_i) d omega_i = sum cos^2(theta_i)/cos^2(theta_d) d theta_i d phi_i; the
        // density has the same factor, or none.
        let factor = match self.form {
            Form::Kept(_) | Form::Energy(_) => 1.0,
            Form::Plain => cosine_ratio(theta_i, theta_d),
        };
        let (sin, cos) = theta_i.sin_cos();
        let (sin_phi, cos_phi) = (self.phi_o - phi).sin_cos();
        Some(Sample {
            omega_i: [sin, cos * cos_phi, cos * sin_phi],
            weight: sum.map(|x| x / density * factor),
            pdf: self.per_solid_angle(density, theta_i, theta_d),
        })
    }

    /// `sum_t M_t N_t`, and the sampler's density over theta_i and phi_i, both without their
    /// factor `cos^2 theta_i / cos^2 theta_d`; of model `energy` the sum times `cos(theta_i)`, and the whole
    /// density. `theta_d` is [`BcsdfView::azimuthal_inclination`].
    fn at_angles(&self, theta_i: f64, theta_d: f64, phi: f64) -> ([f64; 3], f64) {
        let (mut sum, mut density) = ([0.0; 3], 0.0);
        let mut section = None;
        for lobe in Lobe::ALL {
            let l = lobe as usize;
            if self.shares[l] <= 0.0 {
                continue;
            }
            let m = self.longitudinal[l].density(theta_i);
            if m == 0.0 {
                continue;
            }
            let [r, g, b, even] = match (lobe, &self.trt) {
                (Lobe::Trt, Some(table)) => self.with_further(table.at(theta_d, phi)),
                (Lobe::Trt, None) => continue,
                _ => {
                    let hair = &self.hair;
                    let section = section.get_or_insert_with(|| {
                        FibreSection::of(hair, hair.eta, theta_d, self.fresnel)
                    });
                    azimuthal_closed(section, lobe, phi)
                }
            };
            for (total, n) in sum.iter_mut().zip([r, g, b]) {
                *total += m * n;
            }
            density += self.density_scale[l] * m * even;
        }
        (sum, density)
    }

    /// TRT and its density with the orders beyond it.
    fn with_further(&self, [r, g, b, density]: [f64; 4]) -> [f64; 4] {
        match &self.form {
            Form::Kept(_) | Form::Plain => [r, g, b, density],
            Form::Energy(further) => {
                let even = 1.0 / (2.0 * PI);
                let [more_r, more_g, more_b] = further.kept.map(|kept| even * kept);
                let density = (1.0 - further.even) * density + further.even * even;
                [r + more_r, g + more_g, b + more_b, density]
            }
        }
    }
}

/// Share of R's paths that are drawn by [`grazing_angle`]: about what Schlick's fifth power adds
/// to the reflection of a fibre of eta 1.55.
const GRAZING_SHARE: f64 = 0.4;

/// An offset angle gamma whose cosine c has the density `42 c (1 - c)^5`: the second least of
/// seven even numbers. Fresnel's term would else give grazing paths 13 times the mean weight.
fn grazing_angle(uniform: &mut impl FnMut() -> f64) -> f64 {
    let (mut least, mut second) = (1.0f64, 1.0f64);
    for _ in 0..7 {
        let u = uniform();
        second = second.min(u.max(least));
        least = least.min(u);
    }
    let gamma = second.acos();
    if uniform() < 0.5 { -gamma } else { gamma }
}

/// Density of R's paths over that of an even h, at `cos gamma`.
fn grazing_ratio(cos_gamma: f64) -> f64 {
    let sin = (1.0 - cos_gamma * cos_gamma).max(0.0).sqrt();
    1.0 - GRAZING_SHARE + GRAZING_SHARE * 42.0 * (1.0 - cos_gamma).powi(5) * sin
}

/// `[N_t rgb, density of the sampler's azimuth]` of R or TT by its single root, at `phi` within
/// +-pi; the density is `1/2 |d phi / dh|^(-1)`, for R times [`grazing_ratio`].
fn azimuthal_closed(section: &FibreSection, lobe: Lobe, phi: f64) -> [f64; 4] {
    let (sin_half, cos_half) = (0.5 * phi).sin_cos();
    let (h, cos_gamma, even) = match lobe {
        // phi = -2 gamma
        Lobe::R => (-sin_half, cos_half, 0.25 * cos_half),
        _ => {
            // h = cos(phi/2) / sqrt(1 + a^2 - 2 a sin(phi/2)), a = 1/eta_eff, odd around pi.
            let a = 1.0 / section.eta_eff;
            let sin_half_abs = sin_half.abs();
            if sin_half_abs <= a {
                return [0.0; 4];
            }
            // (1 - a)^2 + 2 a (1 - sin), with 1 - sin formed from the cosine.
            let one_minus = cos_half * cos_half / (1.0 + sin_half_abs);
            let square_sum = square(1.0 - a) + 2.0 * a * one_minus;
            let h = (cos_half / square_sum.sqrt()).clamp(-1.0, 1.0);
            // cos gamma = (sin(phi/2) - a) / root, cos gamma_t = (1 - a sin(phi/2)) / root:
            // |d phi / d gamma| = 2 (1 - a cos gamma / cos gamma_t) = 2 root^2 / (1 - a sin).
            let cos_gamma = (sin_half_abs - a) / square_sum.sqrt();
            let slope = 2.0 * square_sum / (1.0 - a * sin_half_abs);
            (h, cos_gamma, 0.5 * cos_gamma / slope)
        }
    };
    let [r, g, b] = section.attenuation(lobe, h, cos_gamma);
    let density = match lobe {
        Lobe::R => even * grazing_ratio(cos_gamma),
        _ => even,
    };
    [even * r, even * g, even * b, density]
}

/// Cosines are not taken for smaller than this when they divide: directions along the fibre.
const COS_MIN: f64 = 1e-9;

/// `cos^2 theta_i / cos^2 theta_d`, at most 4: both vanish together.
fn cosine_ratio(theta_i: f64, theta_d: f64) -> f64 {
    square(theta_i.cos().max(0.0) / theta_d.cos().max(COS_MIN))
}

/// The greatest [`cosine_ratio`] over theta_i at `theta_o`, where
/// `tan theta_i + 1/2 tan theta_d = 0`.
fn greatest_factor(theta_o: f64) -> f64 {
    let theta_o = theta_o.abs();
    if theta_o >= FRAC_PI_2 - 1e-6 {
        return 4.0;
    }
    let (mut low, mut high) = (-FRAC_PI_2, 0.0f64);
    for _ in 0..50 {
        let theta_i = 0.5 * (low + high);
        if theta_i.tan() + 0.5 * (0.5 * (theta_o - theta_i)).tan() < 0.0 {
            low = theta_i;
        } else {
            high = theta_i;
        }
    }
    let theta_i = 0.5 * (low + high);
    cosine_ratio(theta_i, 0.5 * (theta_o - theta_i))
}

/// Inclination and azimuth of a unit vector in the fibre's frame.
fn angles([u, v, w]: [f64; 3]) -> (f64, f64) {
    (u.atan2((v * v + w * w).sqrt()), w.atan2(v))
}

fn square(x: f64) -> f64 {
    x * x
}
