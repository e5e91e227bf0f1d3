//! Environment lighting as spherical radial basis functions.
//!
//! The `.lights` file, version 1:
//!
//! | section | content |
//! |---|---|
//! | `META` | record, [`LightSetInfo`] |
//! | `KIND` | 1.1: name of the [`LightKind`], ASCII; `srbf` where there is none |
//! | `LGHT` | of `srbf`: 8 f32 a light: direction, lambda, rgb, zero (two `vec4f` on the GPU) |
//!
//! A further kind has a section of its own instead of `LGHT`, so that readers of version 1.0 refuse
//! its files.

use std::io::{Read, Seek};

use serde::{Deserialize, Serialize};

use crate::baked_file::BakedFile;
use crate::container::{Container, ContainerWriter, Kind, encode_record};
use crate::error::{Error, Result};
use crate::provenance::tool_version;
use crate::validate::in_range;

/// What the lights of a set are: the function of direction that each contributes.
///
/// To add a kind: its variant here, its data in [`LightSet`] (whose `lights` then become an enum
/// over kinds), its section of the file below, and its shading and shadows in the renderers, which
/// today take [`SrbfLight`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum LightKind {
    /// Spherical radial basis functions, isotropic Gaussian lobes on the sphere: [`SrbfLight`].
    #[default]
    Srbf,
}

impl LightKind {
    /// All kinds.
    pub const ALL: [LightKind; 1] = [LightKind::Srbf];

    /// Name in files and listings: `srbf`.
    pub const fn name(self) -> &'static str {
        match self {
            LightKind::Srbf => "srbf",
        }
    }

    /// The kind called `name`.
    ///
    /// # Errors
    /// `Value` naming the kinds that there are.
    fn from_name(name: &[u8]) -> Result<LightKind> {
        let found = LightKind::ALL
            .into_iter()
            .find(|kind| kind.name().as_bytes() == name);
        found.ok_or_else(|| {
            let known = LightKind::ALL.map(LightKind::name).join(", ");
            let range = format!("one that this program knows ({known})");
            let name: String = name.escape_ascii().to_string().chars().take(64).collect();
            Error::value("kind of the lights", name, range)
        })
    }
}

/// One light: `L(omega) = rgb * exp(2 (omega . direction - 1) / lambda^2)` (Xu 2011 Eq 1).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SrbfLight {
    /// Unit vector from the hair to the light, world space.
    pub direction: [f32; 3],
    /// Xu's bandwidth, 0.001..=10.
    pub lambda: f32,
    /// Amplitude, linear Rec.709, not negative.
    pub rgb: [f32; 3],
}

impl SrbfLight {
    /// Checks direction (unit within 1e-4), width and amplitude; NaN is outside every range.
    ///
    /// # Errors
    /// `Value` naming field, value and range.
    pub fn validate(&self) -> Result<()> {
        self.check("light")
    }

    /// As [`SrbfLight::validate`], under the name `key`.
    fn check(&self, key: &str) -> Result<()> {
        let squares = self.direction.map(|x| f64::from(x) * f64::from(x));
        let length = squares.iter().sum::<f64>().sqrt();
        in_range(format!("{key} length of direction"), length, 0.9999, 1.0001)?;
        // The limits as f32 values, so that 0.001f32 itself is inside.
        let (min, max) = (f64::from(0.001f32), 10.0);
        in_range(format!("{key}.lambda"), f64::from(self.lambda), min, max)?;
        for value in self.rgb {
            let max = f64::from(f32::MAX);
            in_range(format!("{key}.rgb"), f64::from(value), 0.0, max)?;
        }
        Ok(())
    }
}

/// A fitted environment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightSet {
    /// Lights by falling energy; 1 to [`MAX_LIGHTS`].
    pub lights: Vec<SrbfLight>,
    /// Where it comes from.
    pub info: LightSetInfo,
}

/// What a light set was fitted to, and how well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightSetInfo {
    /// [`crate::content_hash`] of the map's file; empty if there is none.
    pub map_hash: String,
    /// Width and height of the map in pixels; zero if there is none.
    pub map_size: [u32; 2],
    /// Program that made it.
    pub tool_version: String,
    /// Number of lights asked for.
    pub requested_count: u32,
    /// Seed of the fit.
    pub seed: u64,
    /// Further parameters of the fit as name and value, in order.
    pub parameters: Vec<(String, String)>,
    /// How good the fit is.
    pub report: Option<FitReport>,
}

impl Default for LightSetInfo {
    fn default() -> Self {
        LightSetInfo {
            map_hash: String::new(),
            map_size: [0; 2],
            tool_version: tool_version(),
            requested_count: 0,
            seed: 0,
            parameters: Vec::new(),
            report: None,
        }
    }
}

/// Figures of a fit against its map; see the `lights` command. No times: equal input gives
/// equal files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FitReport {
    /// Solid-angle weighted L2 norm of the difference over that of the map.
    pub rel_l2: f64,
    /// Energy of the lights over that of the map, per channel.
    pub energy_ratio: [f64; 3],
    /// Relative RMSE of the irradiance over directions.
    pub irradiance_error: f64,
    /// Relative RMSE of single-scattering-like responses over random fibres and views.
    pub fibre_error: f64,
}

impl FitReport {
    /// Checks that every figure is a number from 0 on.
    fn validate(&self) -> Result<()> {
        let FitReport {
            rel_l2,
            energy_ratio,
            irradiance_error,
            fibre_error,
        } = *self;
        in_range("report.rel_l2", rel_l2, 0.0, f64::MAX)?;
        for ratio in energy_ratio {
            in_range("report.energy_ratio", ratio, 0.0, f64::MAX)?;
        }
        in_range("report.irradiance_error", irradiance_error, 0.0, f64::MAX)?;
        in_range("report.fibre_error", fibre_error, 0.0, f64::MAX)
    }
}

/// Most lights in a file; fits use tens.
pub const MAX_LIGHTS: usize = 65_536;

const META: [u8; 4] = *b"META";
const KIND: [u8; 4] = *b"KIND";
const LIGHTS: [u8; 4] = *b"LGHT";

impl LightSet {
    /// What the lights are.
    pub const fn kind(&self) -> LightKind {
        LightKind::Srbf
    }

    /// Checks directions (unit within 1e-4), widths, amplitudes, the number of lights, and that
    /// recorded figures are numbers. `strandlight verify` checks the order of the lights too, and
    /// the figures against the map.
    ///
    /// # Errors
    /// `Value` naming the first entry that breaks a promise.
    pub fn validate(&self) -> Result<()> {
        in_range(
            "number of lights",
            self.lights.len() as f64,
            1.0,
            MAX_LIGHTS as f64,
        )?;
        for (ix, light) in self.lights.iter().enumerate() {
            light.check(&format!("lights[{ix}]"))?;
        }
        self.info
            .report
            .as_ref()
            .map_or(Ok(()), FitReport::validate)
    }
}

impl BakedFile for LightSet {
    const KIND: Kind = Kind::Lights;

    fn from_container<R: Read + Seek>(mut file: Container<R>) -> Result<Self> {
        let info: LightSetInfo = file.read_record(META)?;
        let kind = match file.find(KIND, 0) {
            Some(_) => LightKind::from_name(&file.read_array::<u8>(KIND, 0)?)?,
            None => LightKind::default(),
        };
        let lights = match kind {
            LightKind::Srbf => read_srbf(&mut file)?,
        };
        file.check_unread()?;
        let set = LightSet { lights, info };
        set.validate()?;
        Ok(set)
    }

    fn to_bytes(&self) -> Result<Vec<u8>> {
        self.validate()?;
        let floats: Vec<[f32; 8]> = self
            .lights
            .iter()
            .map(|light| {
                let ([x, y, z], [r, g, b]) = (light.direction, light.rgb);
                [x, y, z, light.lambda, r, g, b, 0.0]
            })
            .collect();
        let mut file = ContainerWriter::new(Kind::Lights);
        file.section(META, 0, encode_record(&self.info)?);
        file.section(KIND, 0, self.kind().name().as_bytes());
        file.section(LIGHTS, 0, bytemuck::cast_slice(&floats));
        file.finish()
    }
}

fn read_srbf<R: Read + Seek>(file: &mut Container<R>) -> Result<Vec<SrbfLight>> {
    let floats: Vec<[f32; 8]> = file.read_array(LIGHTS, 0)?;
    if let Some(ix) = floats.iter().position(|light| light[7].to_bits() != 0) {
        return Err(Error::invalid(
            format!("spare float of light {ix} is not zero"),
            file.require(LIGHTS, 0)?.offset + 32 * ix as u64 + 28,
        ));
    }
    let light = |[x, y, z, lambda, r, g, b, _]: [f32; 8]| SrbfLight {
        direction: [x, y, z],
        lambda,
        rgb: [r, g, b],
    };
    Ok(floats.into_iter().map(light).collect())
}
