//! The ways to integrate a light over the fibre that are compared.

use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

use rayon::prelude::*;
use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, TableFile};
use strandlight_render::probe::Scheme;
use strandlight_scattering::axis::Axis;
use strandlight_scattering::c_integrals::BernsteinRule;
use strandlight_scattering::closed_form::{
    DEFAULT_NODES, DirectionInFrame, ENERGY_NODES, Fibre, GAUSS_HERMITE, LN_CULL, LightInFrame,
    Reflectance, Shading, Tables, azimuthal_elliptic_of_two, azimuthal_r, azimuthal_trt,
    azimuthal_tt, elliptic_lag, erf_pair, fisher_lobe, fisher_rule, inclination, lag_between,
    longitudinal, node_count, outer_node, outer_rule, pack_nodes, paper, sample_lobes,
    single_scattering, single_scattering_mode, table_cell,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::lobes::{DEFAULT_LOBE_TEXELS, LobeTable, LobeTexture, slice};
use strandlight_scattering::table_layout::{C_CHANNELS, C_COLUMNS, C_ROWS};
use strandlight_scattering::{HairParams, Lobe, Model, ParamError};
use strandlight_scene::optics::Optics;
use strandlight_scene::tables::{ShadingTables, ShadingTablesError, lobe_table};

use super::brute_force::BruteForce;

/// Why methods cannot be prepared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MethodError {
    /// The tables that the program carries cannot be read.
    #[error(transparent)]
    Format(#[from] strandlight_formats::Error),
    /// Tables cannot be used for shading.
    #[error(transparent)]
    Tables(#[from] ShadingTablesError),
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
    /// The renderer's scheme with at most these nodes of R, TT, TRT.
    Runtime {
        /// 1..=8 each.
        nodes: [u32; 3],
    },
    /// The renderer's scheme with its default nodes on a table C of another size.
    TableC {
        /// Texels over kappa and over |cos(phi/2)|.
        size: [u32; 2],
    },
    /// The renderer's scheme with its default nodes on lobe textures of another size.
    LobeTexels {
        /// Texels over theta_d, at least 2.
        count: u32,
    },
    /// The exact model by a tensor rule in single precision ([`BruteForce`]).
    BruteForce {
        /// Nodes in theta_i.
        n_theta: u32,
        /// Nodes in h, even.
        n_h: u32,
    },
}

/// Node budgets of the renderer's scheme, the default among them.
const RUNTIME_NODES: [[u32; 3]; 8] = [
    [1, 1, 1],
    [2, 1, 2],
    [2, 2, 2],
    [2, 2, 3],
    DEFAULT_RUNTIME,
    [4, 2, 4],
    [5, 3, 5],
    [8, 8, 8],
];
/// The renderer's own.
const DEFAULT_RUNTIME: [u32; 3] = [3, 2, 3];
const _: () = assert!(pack_nodes(DEFAULT_RUNTIME) == DEFAULT_NODES);
const _: () = assert!(pack_nodes([3, 3, 3]) == ENERGY_NODES);
/// Sizes of the table C, the default 64 x 128 among them.
const TABLE_C_SIZES: [[u32; 2]; 5] = [[8, 16], [16, 32], [32, 64], [64, 128], [128, 256]];
/// Sizes of the lobe textures, the default among them.
const LOBE_TEXELS: [u32; 6] = [12, 24, 48, 96, 192, DEFAULT_LOBE_TEXELS as u32];

impl Method {
    /// What `bench single` compares, base of the ratios included.
    pub fn all() -> Vec<Method> {
        let mut methods: Vec<Method> = [2, 3, 4, 6, 8, 12]
            .map(|segments| Method::Paper { segments })
            .to_vec();
        methods.push(Method::PaperDielectric { segments: 4 });
        methods.extend(RUNTIME_NODES.map(|nodes| Method::Runtime { nodes }));
        methods.extend(TABLE_C_SIZES.map(|size| Method::TableC { size }));
        methods.extend(LOBE_TEXELS.map(|count| Method::LobeTexels { count }));
        methods.extend(
            [(3, 8), (4, 16), (5, 32), (6, 64), (8, 128), (12, 256)]
                .map(|(n_theta, n_h)| Method::BruteForce { n_theta, n_h }),
        );
        methods
    }

    /// Those that fibres of `model` have: of `energy` the renderer's scheme alone.
    pub fn all_of(model: Model) -> Vec<Method> {
        match model {
            Model::Marschner => Method::all(),
            Model::Energy => [
                [1, 1, 1],
                [2, 2, 2],
                [3, 2, 3],
                [3, 3, 3],
                [4, 4, 4],
                [8, 8, 8],
            ]
            .map(|nodes| Method::Runtime { nodes })
            .to_vec(),
        }
    }

    /// The method that costs are compared with: the paper's default, or where that is none the
    /// renderer's.
    pub const fn base_of(model: Model) -> Method {
        match model {
            Model::Marschner => Method::BASE,
            Model::Energy => Method::Runtime { nodes: [3, 3, 3] },
        }
    }

    /// The method that costs are compared with: the paper's default.
    pub const BASE: Method = Method::Paper { segments: 4 };
    /// What the renderer does.
    pub(crate) const DEFAULT: Method = Method::Runtime {
        nodes: DEFAULT_RUNTIME,
    };

    /// The kind of method; a curve in plots.
    pub const fn family(self) -> &'static str {
        match self {
            Method::Paper { .. } => "paper",
            Method::PaperDielectric { .. } => "paper, dielectric",
            Method::Runtime { .. } => "runtime",
            Method::TableC { .. } => "runtime, table C",
            Method::LobeTexels { .. } => "runtime, lobe texels",
            Method::BruteForce { .. } => "quadrature",
        }
    }

    /// What tells it from others of its family.
    pub fn setting(self) -> String {
        match self {
            Method::Paper { segments } | Method::PaperDielectric { segments } => {
                format!("m={segments}")
            }
            Method::Runtime {
                nodes: [r, tt, trt],
            } => format!("{r}+{tt}+{trt}"),
            Method::TableC {
                size: [rows, columns],
            } => format!("{rows}x{columns}"),
            Method::LobeTexels { count } => count.to_string(),
            Method::BruteForce { n_theta, n_h } => format!("{n_theta}x{n_h}"),
        }
    }

    /// Evaluations of an inner integral for R, TT, TRT where nothing is left out.
    pub const fn nodes(self) -> [u32; 3] {
        match self {
            Method::Paper { segments } | Method::PaperDielectric { segments } => [segments - 1; 3],
            Method::Runtime { nodes } => nodes,
            Method::TableC { .. } | Method::LobeTexels { .. } => DEFAULT_RUNTIME,
            Method::BruteForce { n_theta, .. } => [n_theta; 3],
        }
    }

    /// Filtered fetches of 16 bytes a light and point where nothing is left out.
    pub const fn fetches(self) -> u32 {
        let [r, tt, trt] = self.nodes();
        match self {
            Method::Paper { .. } | Method::PaperDielectric { .. } => r + tt + trt,
            // A texel of lobes has 32 bytes.
            Method::Runtime { .. } | Method::TableC { .. } | Method::LobeTexels { .. } => {
                r + 2 * tt + 2 * trt
            }
            Method::BruteForce { .. } => 0,
        }
    }

    /// Texels of its lobe textures, if it has any.
    const fn lobe_texels(self) -> Option<u32> {
        match self {
            Method::Runtime { .. } | Method::TableC { .. } => Some(DEFAULT_LOBE_TEXELS as u32),
            Method::LobeTexels { count } => Some(count),
            _ => None,
        }
    }

    /// Bytes of the table that is of another size than usual.
    pub(crate) const fn table_bytes(self) -> Option<u32> {
        match self {
            Method::TableC {
                size: [rows, columns],
            } => Some(16 * rows * columns),
            // TT and TRT.
            Method::LobeTexels { count } => Some(2 * 32 * count),
            _ => None,
        }
    }

    /// The shader that is timed for the method, if there is one; that of other table sizes takes
    /// what the default sizes take.
    pub const fn scheme(self) -> Option<Scheme> {
        match self {
            Method::Paper { .. } | Method::PaperDielectric { .. } => Some(Scheme::Paper),
            Method::Runtime { .. } => Some(Scheme::Lobes),
            Method::TableC { .. } | Method::LobeTexels { .. } | Method::BruteForce { .. } => None,
        }
    }
}

/// The tables of all methods.
#[derive(Clone, Debug)]
pub struct MethodTables {
    dielectric: Arc<ShadingTables>,
    schlick: Arc<ShadingTables>,
    /// The dielectric ones with `C` of these sizes.
    sized: Vec<([u32; 2], Arc<ShadingTables>)>,
    lobes: Arc<[LobeTable; 2]>,
}

impl MethodTables {
    /// The bundled tables, and what is compared with them; `schlick` holds C and H with Schlick's
    /// Fresnel term.
    ///
    /// # Errors
    /// The bundled tables cannot be read; `schlick` lacks a table.
    pub fn new(schlick: &TableFile) -> Result<MethodTables, MethodError> {
        let bundled = TableFile::from_bytes(DEFAULT_TABLES)?;
        let sized = TABLE_C_SIZES
            .into_iter()
            .map(|size| {
                let tables = ShadingTables::from_file(&with_c_of(&bundled, size))?;
                Ok((size, Arc::new(tables)))
            })
            .collect::<Result<_, ShadingTablesError>>()?;
        let lobes = [
            lobe_table(&bundled, Lobe::Tt)?,
            lobe_table(&bundled, Lobe::Trt)?,
        ];
        Ok(MethodTables {
            dielectric: Arc::new(ShadingTables::from_file(&bundled)?),
            schlick: Arc::new(ShadingTables::from_file(schlick)?),
            sized,
            lobes: Arc::new(lobes),
        })
    }

    /// What `method` looks up.
    pub fn of(&self, method: Method) -> &Arc<ShadingTables> {
        match method {
            Method::Paper { .. } => &self.schlick,
            Method::TableC { size } => {
                let sized = self.sized.iter().find(|(other, _)| *other == size);
                sized.map_or(&self.dielectric, |(_, tables)| tables)
            }
            _ => &self.dielectric,
        }
    }
}

/// `file` with a table `C` of `size` texels on the default axes.
fn with_c_of(file: &TableFile, [rows, columns]: [u32; 2]) -> TableFile {
    let rule = BernsteinRule::default();
    let row_axis = Axis {
        count: rows,
        ..C_ROWS
    };
    let column_axis = Axis {
        count: columns,
        ..C_COLUMNS
    };
    let data: Vec<f32> = (0..rows)
        .into_par_iter()
        .flat_map_iter(|row| {
            let kappa = row_axis.value_at(row);
            let rule = &rule;
            (0..columns).flat_map(move |column| {
                let [_, shares @ ..] = rule.shares(kappa, column_axis.value_at(column));
                shares.map(|share| share as f32)
            })
        })
        .collect();
    let mut file = file.clone();
    for table in file.tables.iter_mut().filter(|table| table.name == "C") {
        for (axis, count) in table.axes.iter_mut().zip([rows, columns]) {
            axis.count = count;
        }
        table.channels = C_CHANNELS.map(str::to_owned).to_vec();
        table.data = data.clone();
    }
    file
}

/// A method with all it needs but the fibre.
#[derive(Clone, Debug)]
pub struct Prepared {
    method: Method,
    tables: Arc<ShadingTables>,
    lobes: Arc<[LobeTable; 2]>,
    rule: BruteForce,
}

/// A method with all it needs for one fibre.
#[derive(Clone, Debug)]
pub struct OnFibre<'a> {
    prepared: &'a Prepared,
    optics: Optics,
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
            tables: tables.of(method).clone(),
            lobes: tables.lobes.clone(),
            rule: BruteForce::new(n_theta, n_h),
        }
    }

    /// What it prepares.
    pub fn method(&self) -> Method {
        self.method
    }

    /// What it looks up.
    pub fn tables(&self) -> &ShadingTables {
        &self.tables
    }

    /// The method for this fibre: what an edit of its parameters costs is spent here.
    ///
    /// # Errors
    /// A parameter outside its range.
    pub fn on_fibre(&self, hair: &HairParams) -> Result<OnFibre<'_>, ParamError> {
        let fibre = |segments| Fibre::new(hair, &Lobe::ALL, segments);
        let optics = match self.method {
            Method::Paper { segments } | Method::PaperDielectric { segments } => {
                Optics::paper(fibre(segments)?)
            }
            Method::BruteForce { .. } => Optics::paper(fibre(2)?),
            Method::Runtime { .. } | Method::TableC { .. } | Method::LobeTexels { .. } => {
                let n_texels = self.method.lobe_texels().unwrap_or(2) as usize;
                let fibre = fibre(2)?.with_nodes(self.method.nodes());
                let [tt, trt] = slice([&self.lobes[0], &self.lobes[1]], hair, n_texels);
                Optics {
                    fibre,
                    reflectance: Reflectance::new(Fresnel::Dielectric, hair.eta),
                    tt,
                    trt,
                    ..Optics::paper(fibre)
                }
            }
        };
        Ok(OnFibre {
            prepared: self,
            optics,
        })
    }
}

impl OnFibre<'_> {
    /// The same fibre for `other`, if that reads the same lobes: what slicing them costs is saved.
    pub(crate) fn taken_by<'a>(&self, other: &'a Prepared) -> Option<OnFibre<'a>> {
        let same = self.prepared.method.lobe_texels()? == other.method.lobe_texels()?;
        same.then(|| {
            let fibre = self.optics.fibre.with_nodes(other.method.nodes());
            OnFibre {
                prepared: other,
                optics: Optics {
                    fibre,
                    ..self.optics.clone()
                },
            }
        })
    }

    /// The fibre as shaders take it.
    pub fn optics(&self) -> &Optics {
        &self.optics
    }

    /// Eq 11 of one mode, linear RGB.
    pub(crate) fn single_mode(
        &self,
        lobe: Lobe,
        light: &LightInFrame,
        view: &DirectionInFrame,
    ) -> [f32; 3] {
        let mode = lobe.p();
        let tables = self.prepared.tables.view();
        let fibre = &self.optics.fibre;
        match self.prepared.method {
            Method::Paper { .. } | Method::PaperDielectric { .. } => {
                paper::single_scattering_mode(mode, light, view, fibre, &tables)
            }
            Method::Runtime { .. } | Method::TableC { .. } | Method::LobeTexels { .. } => {
                single_scattering_mode(mode, light, view, &self.optics.shading(tables))
            }
            Method::BruteForce { .. } => self.prepared.rule.single_mode(mode, light, view, fibre),
        }
    }

    /// The fibre's parameters.
    pub fn fibre(&self) -> &Fibre {
        &self.optics.fibre
    }

    /// What the method looks up.
    pub fn tables(&self) -> Tables<'_> {
        self.prepared.tables.view()
    }

    /// What shading by the renderer's scheme reads; none of other schemes.
    pub fn shading(&self) -> Option<Shading<'_>> {
        match self.prepared.method {
            Method::Runtime { .. } | Method::TableC { .. } | Method::LobeTexels { .. } => {
                Some(self.optics.shading(self.prepared.tables.view()))
            }
            _ => None,
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
        let tables = self.prepared.tables.view();
        let fibre = &self.optics.fibre;
        match self.prepared.method {
            Method::Paper { .. } | Method::PaperDielectric { .. } => {
                for light in lights {
                    add(paper::single_scattering(light, view, fibre, &tables));
                }
            }
            Method::Runtime { .. } | Method::TableC { .. } | Method::LobeTexels { .. } => {
                let shading = self.optics.shading(tables);
                for light in lights {
                    add(single_scattering(light, view, &shading));
                }
            }
            Method::BruteForce { .. } => {
                for light in lights {
                    for mode in 0..3 {
                        add(self.prepared.rule.single_mode(mode, light, view, fibre));
                    }
                }
            }
        }
        total
    }

    /// Eq 12 of one mode at `dphi` = phi_o - phi_j: the inner integral for a light of sharpness
    /// `kappa` = 2 / lambda'^2, linear RGB.
    pub fn azimuthal(&self, lobe: Lobe, kappa: f32, dphi: f32, theta_d: f32) -> [f32; 3] {
        let at = inclination(theta_d);
        let lag = lag_between(dphi.cos(), dphi.sin(), 1.0, 0.0);
        let tables = &self.prepared.tables.view();
        let fibre = &self.optics.fibre;
        match self.prepared.method {
            Method::Paper { .. } | Method::PaperDielectric { .. } => {
                let row = table_cell(&tables.axes.h_rows, fibre.eta);
                match lobe {
                    Lobe::R => [paper::azimuthal_r(kappa, &lag, &at, fibre, tables); 3],
                    Lobe::Tt => paper::azimuthal_tt(kappa, &lag, &at, fibre, row, tables),
                    Lobe::Trt => paper::azimuthal_trt(kappa, &lag, &at, fibre, row, tables),
                }
            }
            Method::Runtime { .. } | Method::TableC { .. } | Method::LobeTexels { .. } => {
                let optics = &self.optics;
                let cos_theta_d = at.cos_theta_d;
                let sampled =
                    |lobes: &LobeTexture| sample_lobes(&lobes.view(), fibre.eta, cos_theta_d);
                match lobe {
                    Lobe::R => [azimuthal_r(kappa, &lag, &at, &optics.reflectance, tables); 3],
                    Lobe::Tt => azimuthal_tt(kappa, &lag, &sampled(&optics.tt)),
                    Lobe::Trt if fibre.is_elliptic() => {
                        let [view, light] =
                            [dphi, 0.0].map(|phi| DirectionInFrame::from_angles(0.0, phi));
                        let lag = elliptic_lag(&view, &light, &lag);
                        let trt = &optics.trt.view();
                        azimuthal_elliptic_of_two(kappa, &lag, cos_theta_d, fibre, trt)
                    }
                    Lobe::Trt => azimuthal_trt(kappa, &lag, &sampled(&optics.trt)),
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
    /// +-pi/2, in rising order; none where it is left out.
    pub(crate) fn outer_nodes(
        &self,
        lobe: Lobe,
        light: &LightInFrame,
        view: &DirectionInFrame,
    ) -> Vec<f32> {
        let fibre = &self.optics.fibre;
        let mode = lobe.p() as usize;
        let (theta_j, lambda_j) = (light.direction.theta, light.lambda);
        let (alpha, beta) = (fibre.alpha[mode], fibre.beta[mode]);
        match self.prepared.method {
            Method::Paper { segments } | Method::PaperDielectric { segments } => {
                let product = longitudinal(theta_j, lambda_j, view.theta, alpha, beta);
                if product.ln_b < paper::LN_CULL {
                    return Vec::new();
                }
                let low = (-FRAC_PI_2 - product.mean) / product.lambda;
                let high = (FRAC_PI_2 - product.mean) / product.lambda;
                let at = |s| paper::node_position(low, high, segments, s);
                // As there, nodes without weight are not looked at.
                (1..segments)
                    .filter(|&s| {
                        let u = [s - 1, s, s + 1].map(at);
                        let e = u.map(erf_pair);
                        paper::hat_weight(u[0], u[1], u[2], e[0], e[1], e[2]) > 0.0
                    })
                    .map(|s| product.mean + product.lambda * at(s))
                    .collect()
            }
            Method::Runtime { .. } | Method::TableC { .. } | Method::LobeTexels { .. } => {
                let rule = if fibre.is_energy() {
                    let lobe = fisher_lobe(2.0 * alpha - view.theta, 4.0 * beta * beta);
                    fisher_rule(theta_j, lambda_j, &lobe)
                } else {
                    outer_rule(theta_j, lambda_j, view.theta, alpha, beta)
                };
                if rule.ln_bound < LN_CULL {
                    return Vec::new();
                }
                let count = node_count(rule.spread, fibre.node_count(lobe.p()));
                let first = (count * (count - 1) / 2) as usize;
                GAUSS_HERMITE[first..first + count as usize]
                    .iter()
                    .map(|&constants| outer_node(&rule, constants).theta_i)
                    .collect()
            }
            Method::BruteForce { .. } => self.prepared.rule.nodes(lobe.p(), light, view, fibre),
        }
    }
}
