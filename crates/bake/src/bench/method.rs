//! The ways to integrate a light over the fibre that are compared.

use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

use strandlight_formats::TableFile;
use strandlight_runtime::probe::Scheme;
use strandlight_runtime::tables::{BUNDLED, ShadingTables, TablesError};
use strandlight_scattering::closed_form::{
    DirectionInFrame, Fibre, LightInFrame, inclination, lag_between, longitudinal, paper,
    table_cell,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe, ParamError};

use super::brute_force::BruteForce;
use crate::progress::Progress;
use crate::tables::bake_c_and_h;

/// Why methods cannot be prepared.
#[derive(Debug, thiserror::Error)]
pub enum MethodError {
    /// The tables that the program carries cannot be read.
    #[error(transparent)]
    Format(#[from] strandlight_formats::Error),
    /// Tables cannot be used for shading.
    #[error(transparent)]
    Tables(#[from] TablesError),
}

/// A way to evaluate Eq 11.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Xu's scheme with `segments` of the outer integral, as published: Schlick's Fresnel term.
    Paper {
        /// m, 2..=64.
        segments: u32,
    },
    /// The same with the dielectric term in TT and TRT.
    PaperDielectric {
        /// m, 2..=64.
        segments: u32,
    },
    /// The exact model by a tensor rule in single precision ([`BruteForce`]).
    BruteForce {
        /// Nodes in theta_i.
        n_theta: u32,
        /// Nodes in h, even.
        n_h: u32,
    },
}

impl Method {
    /// What `bench single` compares, base of the ratios included.
    pub fn all() -> Vec<Method> {
        let mut methods: Vec<Method> = [2, 3, 4, 6, 8, 12]
            .map(|segments| Method::Paper { segments })
            .to_vec();
        methods.push(Method::PaperDielectric { segments: 4 });
        methods.extend(
            [(3, 8), (4, 16), (5, 32), (6, 64), (8, 128), (12, 256)]
                .map(|(n_theta, n_h)| Method::BruteForce { n_theta, n_h }),
        );
        methods
    }

    /// The method that costs are compared with: the paper's default.
    pub const BASE: Method = Method::Paper { segments: 4 };

    /// The kind of method; a curve in plots.
    pub const fn family(self) -> &'static str {
        match self {
            Method::Paper { .. } => "paper",
            Method::PaperDielectric { .. } => "paper, dielectric",
            Method::BruteForce { .. } => "quadrature",
        }
    }

    /// What tells it from others of its family.
    pub fn setting(self) -> String {
        match self {
            Method::Paper { segments } | Method::PaperDielectric { segments } => {
                format!("m={segments}")
            }
            Method::BruteForce { n_theta, n_h } => format!("{n_theta}x{n_h}"),
        }
    }

    /// Evaluations of an inner integral for R, TT, TRT where no early out happens.
    pub const fn nodes(self) -> [u32; 3] {
        match self {
            Method::Paper { segments } | Method::PaperDielectric { segments } => [segments - 1; 3],
            Method::BruteForce { n_theta, .. } => [n_theta; 3],
        }
    }

    /// The shader of the method, if it has one.
    pub const fn scheme(self) -> Option<Scheme> {
        match self {
            Method::Paper { .. } | Method::PaperDielectric { .. } => Some(Scheme::Paper),
            Method::BruteForce { .. } => None,
        }
    }
}

/// Tables of both Fresnel terms.
#[derive(Clone, Debug)]
pub struct MethodTables {
    dielectric: Arc<ShadingTables>,
    schlick: Arc<ShadingTables>,
}

impl MethodTables {
    /// The bundled tables, and Schlick's baked now (some 0.1 s of one core).
    ///
    /// # Errors
    /// The bundled tables cannot be read.
    pub fn new() -> Result<MethodTables, MethodError> {
        let bundled = TableFile::from_bytes(BUNDLED)?;
        let schlick = bake_c_and_h(Fresnel::Schlick, &Progress::silent());
        Ok(MethodTables {
            dielectric: Arc::new(ShadingTables::from_file(&bundled)?),
            schlick: Arc::new(ShadingTables::from_file(&schlick)?),
        })
    }

    /// What `method` looks up.
    pub fn of(&self, method: Method) -> &ShadingTables {
        match method {
            Method::Paper { .. } => &self.schlick,
            Method::PaperDielectric { .. } | Method::BruteForce { .. } => &self.dielectric,
        }
    }
}

/// A method with all it needs but the fibre.
#[derive(Clone, Debug)]
pub struct Prepared {
    method: Method,
    tables: MethodTables,
    rule: BruteForce,
}

/// A method with all it needs for one fibre.
#[derive(Clone, Debug)]
pub struct OnFibre<'a> {
    prepared: &'a Prepared,
    fibre: Fibre,
}

impl Prepared {
    /// Prepares `method`.
    pub fn new(method: Method, tables: &MethodTables) -> Prepared {
        let (n_theta, n_h) = match method {
            Method::BruteForce { n_theta, n_h } => (n_theta, n_h),
            _ => (1, 2),
        };
        Prepared {
            method,
            tables: tables.clone(),
            rule: BruteForce::new(n_theta, n_h),
        }
    }

    /// What it prepares.
    pub fn method(&self) -> Method {
        self.method
    }

    /// The method for this fibre: what an edit of its parameters costs is spent here.
    ///
    /// # Errors
    /// A parameter outside its range.
    pub fn on_fibre(&self, hair: &HairParams) -> Result<OnFibre<'_>, ParamError> {
        let segments = match self.method {
            Method::Paper { segments } | Method::PaperDielectric { segments } => segments,
            Method::BruteForce { .. } => 2,
        };
        Ok(OnFibre {
            prepared: self,
            fibre: Fibre::new(hair, &Lobe::ALL, segments)?,
        })
    }
}

impl OnFibre<'_> {
    /// The fibre as shaders take it.
    pub fn fibre(&self) -> Fibre {
        self.fibre
    }

    /// Eq 11 of one mode, linear RGB.
    pub fn single_mode(
        &self,
        lobe: Lobe,
        light: &LightInFrame,
        view: &DirectionInFrame,
    ) -> [f32; 3] {
        let mode = lobe.p();
        match self.prepared.method {
            Method::Paper { .. } | Method::PaperDielectric { .. } => {
                let tables = self.prepared.tables.of(self.prepared.method).view();
                paper::single_scattering_mode(mode, light, view, &self.fibre, &tables)
            }
            Method::BruteForce { .. } => {
                self.prepared
                    .rule
                    .single_mode(mode, light, view, &self.fibre)
            }
        }
    }

    /// Eq 12 of one mode at `dphi` = phi_o - phi_j: the inner integral for a light of sharpness
    /// `kappa` = 2 / lambda'^2, linear RGB.
    pub fn azimuthal(&self, lobe: Lobe, kappa: f32, dphi: f32, theta_d: f32) -> [f32; 3] {
        let at = inclination(theta_d);
        let lag = lag_between(dphi.cos(), dphi.sin(), 1.0, 0.0);
        let fibre = &self.fibre;
        match self.prepared.method {
            Method::Paper { .. } | Method::PaperDielectric { .. } => {
                let tables = &self.prepared.tables.of(self.prepared.method).view();
                let row = table_cell(&tables.axes.h_rows, fibre.eta);
                match lobe {
                    Lobe::R => [paper::azimuthal_r(kappa, &lag, &at, fibre, tables); 3],
                    Lobe::Tt => paper::azimuthal_tt(kappa, &lag, &at, fibre, row, tables),
                    Lobe::Trt => paper::azimuthal_trt(kappa, &lag, &at, fibre, row, tables),
                }
            }
            Method::BruteForce { .. } => {
                let (sin_d, cos_d) = (at.sin_theta_d, at.cos_theta_d);
                let rule = &self.prepared.rule;
                rule.azimuthal(lobe.p(), kappa, dphi, sin_d, cos_d, fibre)
            }
        }
    }

    /// Where the outer integral of `lobe` looks at its integrand: inclinations theta_i within
    /// +-pi/2, in rising order.
    pub fn outer_nodes(
        &self,
        lobe: Lobe,
        light: &LightInFrame,
        view: &DirectionInFrame,
    ) -> Vec<f32> {
        let mode = lobe.p() as usize;
        let (alpha, beta) = (self.fibre.alpha[mode], self.fibre.beta[mode]);
        match self.prepared.method {
            Method::Paper { segments } | Method::PaperDielectric { segments } => {
                let theta_j = light.direction.theta;
                let product = longitudinal(theta_j, light.lambda, view.theta, alpha, beta);
                let low = (-FRAC_PI_2 - product.mean) / product.lambda;
                let high = (FRAC_PI_2 - product.mean) / product.lambda;
                (1..segments)
                    .map(|s| paper::node_position(low, high, segments, s))
                    .map(|u| product.mean + product.lambda * u)
                    .collect()
            }
            Method::BruteForce { .. } => {
                self.prepared.rule.nodes(lobe.p(), light, view, &self.fibre)
            }
        }
    }

    /// Sum of Eq 11 over `lights` and the three modes: what a renderer does at a point.
    pub fn lit(&self, lights: &[LightInFrame], view: &DirectionInFrame) -> [f32; 3] {
        let mut total = [0.0f32; 3];
        let mut add = |value: [f32; 3]| {
            for channel in 0..3 {
                total[channel] += value[channel];
            }
        };
        match self.prepared.method {
            Method::Paper { .. } | Method::PaperDielectric { .. } => {
                let tables = self.prepared.tables.of(self.prepared.method).view();
                for light in lights {
                    add(paper::single_scattering(light, view, &self.fibre, &tables));
                }
            }
            Method::BruteForce { .. } => {
                let rule = &self.prepared.rule;
                for light in lights {
                    for mode in 0..3 {
                        add(rule.single_mode(mode, light, view, &self.fibre));
                    }
                }
            }
        }
        total
    }
}
