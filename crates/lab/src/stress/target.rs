//! What is under test: a scheme on the CPU and, where there is an adapter, on it.

use std::sync::Arc;

use rayon::prelude::*;
use strandlight_render::gpu::GpuError;
use strandlight_render::probe::{GpuProbe, Query, Scheme, evaluate};
use strandlight_scattering::closed_form::{DEFAULT_SEGMENTS, DirectionInFrame, Fibre};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe, ParamError};
use strandlight_scene::material::{EditError, HairMaterial, LobeTables};
use strandlight_scene::optics::Optics;
use strandlight_scene::tables::ShadingTables;

use super::multiple_point::{self, Points};
use super::point::{Group, Point};

/// Why a run could not go on; a failed check is not among these.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StressError {
    /// The harness drew a fibre that the API refuses: its ranges and the API's differ.
    #[error("a drawn fibre is refused: {0}")]
    Hair(#[from] ParamError),
    /// The tables lack lobes.
    #[error(transparent)]
    Lobes(#[from] EditError),
    /// The adapter failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// A fibre ready for evaluations on the CPU.
pub struct Prepared {
    optics: Optics,
}

/// A scheme of single scattering with its tables.
pub struct Target<'a> {
    scheme: Scheme,
    tables: &'a ShadingTables,
    lobes: Arc<LobeTables>,
    fresnel: Fresnel,
    probe: Option<GpuProbe>,
}

impl<'a> Target<'a> {
    /// `scheme` on these tables, which hold the term `fresnel`; `lobes` may be empty for
    /// [`Scheme::Paper`]. `probe` evaluates the same on the adapter.
    pub fn new(
        scheme: Scheme,
        tables: &'a ShadingTables,
        lobes: Arc<LobeTables>,
        fresnel: Fresnel,
        probe: Option<GpuProbe>,
    ) -> Self {
        Target {
            scheme,
            tables,
            lobes,
            fresnel,
            probe,
        }
    }

    /// The Fresnel term of the tables.
    pub fn fresnel(&self) -> Fresnel {
        self.fresnel
    }

    /// Name of the scheme, as `strandlight probe --method` has it.
    pub fn scheme(&self) -> &'static str {
        match self.scheme {
            Scheme::Lobes => "runtime",
            Scheme::Paper => "paper",
        }
    }

    /// Does the scheme have nodes of the outer integral to choose?
    pub(crate) fn has_nodes(&self) -> bool {
        self.scheme == Scheme::Lobes
    }

    /// Name of the adapter, if there is one.
    pub fn adapter(&self) -> Option<&str> {
        self.probe
            .as_ref()
            .map(|probe| probe.context().adapter_name.as_str())
    }

    /// What depends on the fibre alone, with at most `nodes` nodes of the outer integral for each
    /// mode. The paper's scheme has none.
    pub(crate) fn prepare_with_nodes(
        &self,
        hair: &HairParams,
        nodes: u32,
    ) -> Result<Prepared, StressError> {
        let mut prepared = self.prepare(hair)?;
        prepared.optics.fibre = prepared.optics.fibre.with_nodes([nodes; 3]);
        Ok(prepared)
    }

    /// What depends on the fibre alone.
    pub fn prepare(&self, hair: &HairParams) -> Result<Prepared, StressError> {
        let optics = match self.scheme {
            Scheme::Paper => Optics::paper(Fibre::new(hair, &Lobe::ALL, DEFAULT_SEGMENTS)?),
            Scheme::Lobes => {
                let lobes = Arc::clone(&self.lobes);
                let (modes, m) = (&Lobe::ALL, DEFAULT_SEGMENTS);
                let textures = HairMaterial::new(lobes, self.fresnel, hair, modes, m)?;
                textures.optics().clone()
            }
        };
        Ok(Prepared { optics })
    }

    /// The Rust functions at points of a prepared fibre; R repeats its one value.
    pub fn at(&self, prepared: &Prepared, points: &[Point]) -> Vec<[f32; 3]> {
        let view = self.tables.view();
        let optics = std::slice::from_ref(&prepared.optics);
        let answer = |point| {
            rgb(evaluate(
                &self.query(point, prepared.optics.fibre, 0),
                &view,
                optics,
            ))
        };
        points.iter().map(answer).collect()
    }

    /// The Rust functions at the points of a group.
    pub fn cpu(&self, group: &Group) -> Result<Vec<[f32; 3]>, StressError> {
        Ok(self.at(&self.prepare(&group.hair)?, &group.points))
    }

    /// The WGSL functions at the points of all groups, or `None` without an adapter.
    pub fn gpu(&self, groups: &[Group]) -> Result<Option<Vec<Vec<[f32; 3]>>>, StressError> {
        let Some(probe) = &self.probe else {
            return Ok(None);
        };
        let prepare = |group: &Group| Ok(self.prepare(&group.hair)?.optics);
        let optics: Vec<Optics> = groups
            .par_iter()
            .map(prepare)
            .collect::<Result<_, StressError>>()?;
        let mut all = Vec::new();
        for (ix, (group, optics)) in groups.iter().zip(&optics).enumerate() {
            let query = |point| self.query(point, optics.fibre, ix as u32);
            all.extend(group.points.iter().map(query));
        }
        let mut answers = probe.evaluate(&all, &optics)?.into_iter().map(rgb);
        Ok(Some(
            groups
                .iter()
                .map(|group| answers.by_ref().take(group.points.len()).collect())
                .collect(),
        ))
    }

    /// The optics of a fibre with the averages of multiple scattering.
    fn multiple_optics(&self, hair: &HairParams) -> Result<Optics, StressError> {
        let lobes = Arc::clone(&self.lobes);
        let (modes, m) = (&Lobe::ALL, DEFAULT_SEGMENTS);
        let mut textures = HairMaterial::new(lobes, self.fresnel, hair, modes, m)?;
        textures.enable_multiple(true);
        Ok(textures.optics().clone())
    }

    /// The Rust functions of multiple scattering at the points of a fibre.
    pub(super) fn multiple_cpu(
        &self,
        (hair, points): &Points,
    ) -> Result<Vec<[f32; 3]>, StressError> {
        let view = self.tables.view();
        let optics = [self.multiple_optics(hair)?];
        let answer = |query| rgb(evaluate(&query, &view, &optics));
        let queries = points.iter().map(|point| point.query(optics[0].fibre, 0));
        Ok(queries.map(answer).collect())
    }

    /// The WGSL functions at the points of all fibres, or `None` without an adapter.
    pub(super) fn multiple_gpu(
        &self,
        groups: &[Points],
    ) -> Result<Option<Vec<Vec<[f32; 3]>>>, StressError> {
        let Some(probe) = &self.probe else {
            return Ok(None);
        };
        let optics: Vec<Optics> = groups
            .par_iter()
            .map(|(hair, _)| self.multiple_optics(hair))
            .collect::<Result<_, StressError>>()?;
        let queries = groups.iter().zip(&optics).enumerate();
        let queries: Vec<Query> = queries
            .flat_map(|(ix, ((_, points), optics))| {
                let query =
                    move |point: &multiple_point::Point| point.query(optics.fibre, ix as u32);
                points.iter().map(query)
            })
            .collect();
        let mut answers = probe.evaluate(&queries, &optics)?.into_iter().map(rgb);
        Ok(Some(
            groups
                .iter()
                .map(|(_, points)| answers.by_ref().take(points.len()).collect())
                .collect(),
        ))
    }

    /// A point as the probe takes it, of the fibre whose optics are at place `optics`.
    fn query(&self, point: &Point, fibre: Fibre, optics: u32) -> Query {
        let query = query(point, fibre).with_optics(optics);
        match self.scheme {
            Scheme::Lobes => query,
            Scheme::Paper => query.by_paper(),
        }
    }
}

fn rgb([r, g, b, _]: [f32; 4]) -> [f32; 3] {
    [r, g, b]
}

fn query(point: &Point, fibre: Fibre) -> Query {
    let direction = |theta: f64, phi: f64| DirectionInFrame::from_angles(theta as f32, phi as f32);
    match *point {
        Point::Azimuthal {
            lobe,
            lambda_p,
            dphi,
            theta_d,
        } => Query::azimuthal(
            lobe.p(),
            lambda_p as f32,
            dphi as f32,
            theta_d as f32,
            fibre,
        ),
        Point::Single {
            lobe,
            light,
            theta_o,
            phi_o,
        } => Query::single(
            lobe.p(),
            direction(light.theta, light.phi),
            light.lambda as f32,
            direction(theta_o, phi_o),
            fibre,
        ),
    }
}
