//! What the sections of a scene must be beyond the range of each value.

use strandlight_scattering::Model;

use crate::error::{Error, Result};
use crate::light_set::MAX_LIGHTS;
use crate::params;
use crate::scene::{Background, CameraSection, Scene};
use crate::scene_hair::HairSection;
use crate::scene_lights::{LightsSection, MAX_ADDED_LIGHTS};
use crate::scene_motion::MotionSection;
use crate::scene_proxy::{MAX_PROXIES, ProxySection};
use crate::scene_variation::VariationSection;

impl HairSection {
    pub(crate) fn validate(&self) -> Result<()> {
        if let (Some(_), Some(melanin)) = (self.reflectance, self.melanin) {
            let range = "absent where hair.reflectance is given";
            return Err(Error::value("hair.melanin", format!("{melanin:?}"), range));
        }
        params::HAIR.validate(self)?;
        if self.model == Model::Energy && self.eccentricity != 1.0 {
            let range = "1 with hair.model = \"energy\"";
            return Err(Error::value("hair.eccentricity", self.eccentricity, range));
        }
        Ok(())
    }
}

impl VariationSection {
    /// Fibres that vary are shaded as painted ones are, which are round and of model `marschner`.
    pub(crate) fn validate(&self, hair: &HairSection) -> Result<()> {
        params::VARIATION.validate(self)?;
        let range = if hair.model == Model::Energy {
            "0 with hair.model = \"energy\""
        } else if hair.eccentricity != 1.0 {
            "0 where hair.eccentricity is not 1"
        } else {
            return Ok(());
        };
        let mut amounts = self.fibre_amounts().into_iter();
        match amounts.find(|&(_, amount)| amount > 0.0) {
            Some((key, amount)) => Err(Error::value(format!("variation.{key}"), amount, range)),
            None => Ok(()),
        }
    }
}

impl LightsSection {
    pub(crate) fn validate(&self) -> Result<()> {
        params::LIGHTS.validate(self)?;
        for (at, own) in self.adjust.iter().enumerate() {
            let ix = own.light;
            if ix as usize >= MAX_LIGHTS || self.adjust[..at].iter().any(|it| it.light == ix) {
                let range = format!("lights of the set, 0..={}, each once", MAX_LIGHTS - 1);
                return Err(Error::value("lights.adjust", ix, range));
            }
        }
        self.adjust.iter().try_for_each(|own| {
            let name = |key: &str| format!("lights.adjust of light {}: {key}", own.light);
            params::ADJUST.validate_as(own, name)
        })?;
        if self.added.len() > MAX_ADDED_LIGHTS {
            let most = format!("at most {MAX_ADDED_LIGHTS}");
            return Err(Error::value("lights.added", self.added.len(), most));
        }
        let mut added = self.added.iter().enumerate();
        added.try_for_each(|(ix, own)| {
            params::ADDED.validate_as(own, |key| format!("lights.added[{ix}].{key}"))
        })
    }
}

impl CameraSection {
    pub(crate) fn validate(&self) -> Result<()> {
        params::CAMERA.validate(self)?;
        let forward: [f64; 3] = std::array::from_fn(|axis| self.target[axis] - self.position[axis]);
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let ([fx, fy, fz], [ux, uy, uz]) = (forward, self.up);
        let cross = [fy * uz - fz * uy, fz * ux - fx * uz, fx * uy - fy * ux];
        if length(forward) < 1e-6 {
            let range = "away from camera.position";
            return Err(Error::value(
                "camera.target",
                format!("{:?}", self.target),
                range,
            ));
        }
        if length(cross) <= 1e-6 * length(forward) * length(self.up) {
            let range = "a direction that is not along the line of sight";
            return Err(Error::value("camera.up", format!("{:?}", self.up), range));
        }
        Ok(())
    }
}

impl MotionSection {
    pub(crate) fn validate(&self) -> Result<()> {
        if let Some(wind) = &self.wind {
            params::WIND.validate(wind)?;
        }
        if self.wind.is_some() != self.frames.is_empty() {
            let found = if self.wind.is_some() {
                "with both wind and frames"
            } else {
                "without wind and without frames"
            };
            return Err(Error::value("motion", found, "with one of them"));
        }
        if self.fps.is_some() && self.frames.is_empty() {
            return Err(Error::value("motion.fps", "set", "absent without frames"));
        }
        params::MOTION.validate(self)
    }
}

impl ProxySection {
    /// Checks the values of `[[proxy]]` number `ix`, from 0.
    pub(crate) fn validate(&self, ix: usize) -> Result<()> {
        let name = |key: &str| format!("proxy[{ix}].{key}");
        self.section().validate_as(self, name)
    }
}

/// Checks that there is a panorama where it is to be seen.
pub(crate) fn background(scene: &Scene) -> Result<()> {
    if scene.render.background == Background::Panorama && scene.lights.panorama.is_none() {
        let range = "a .panorama file where render.background is \"panorama\"";
        return Err(Error::value("lights.panorama", "absent", range));
    }
    Ok(())
}

/// Checks all proxies of a scene.
pub(crate) fn proxies(proxies: &[ProxySection]) -> Result<()> {
    if proxies.len() > MAX_PROXIES {
        let most = format!("at most {MAX_PROXIES}");
        return Err(Error::value("proxy", proxies.len(), most));
    }
    let mut proxies = proxies.iter().enumerate();
    proxies.try_for_each(|(ix, proxy)| proxy.validate(ix))
}
