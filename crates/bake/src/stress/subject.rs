//! What is under test: a scheme on the CPU and, where there is an adapter, on it.

use strandlight_runtime::gpu::GpuError;
use strandlight_runtime::probe::{GpuProbe, Query, evaluate};
use strandlight_runtime::tables::ShadingTables;
use strandlight_scattering::closed_form::{DEFAULT_SEGMENTS, DirectionInFrame, Fibre};
use strandlight_scattering::{HairParams, Lobe, ParamError};

use super::point::{Group, Point};

/// Why a run could not go on; a failed check is not among these.
#[derive(Debug, thiserror::Error)]
pub enum StressError {
    /// The harness drew a fibre that the API refuses: its ranges and the API's differ.
    #[error("a drawn fibre is refused: {0}")]
    Hair(#[from] ParamError),
    /// The adapter failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// A fibre ready for evaluations on the CPU.
pub struct Prepared {
    fibre: Fibre,
}

/// A scheme of single scattering with its tables.
pub struct Subject<'a> {
    tables: &'a ShadingTables,
    probe: Option<GpuProbe>,
}

impl<'a> Subject<'a> {
    /// The scheme on these tables; `probe` evaluates the same on the adapter.
    pub fn new(tables: &'a ShadingTables, probe: Option<GpuProbe>) -> Self {
        Subject { tables, probe }
    }

    /// Name of the scheme.
    pub fn scheme(&self) -> &'static str {
        "paper"
    }

    /// Name of the adapter, if there is one.
    pub fn adapter(&self) -> Option<&str> {
        self.probe
            .as_ref()
            .map(|probe| probe.context().adapter_name.as_str())
    }

    /// What depends on the fibre alone.
    pub fn prepare(&self, hair: &HairParams) -> Result<Prepared, StressError> {
        let fibre = Fibre::new(hair, &Lobe::ALL, DEFAULT_SEGMENTS)?;
        Ok(Prepared { fibre })
    }

    /// The Rust functions at points of a prepared fibre; R repeats its one value.
    pub fn at(&self, prepared: &Prepared, points: &[Point]) -> Vec<[f32; 3]> {
        let view = self.tables.view();
        let answer = |point| rgb(evaluate(&query(point, prepared.fibre), &view, &[]));
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
        let mut all = Vec::new();
        for group in groups {
            let fibre = self.prepare(&group.hair)?.fibre;
            all.extend(group.points.iter().map(|point| query(point, fibre)));
        }
        let mut answers = probe.evaluate(&all, &[])?.into_iter().map(rgb);
        Ok(Some(
            groups
                .iter()
                .map(|group| answers.by_ref().take(group.points.len()).collect())
                .collect(),
        ))
    }
}

fn rgb([r, g, b, _]: [f32; 4]) -> [f32; 3] {
    [r, g, b]
}

fn query(point: &Point, fibre: Fibre) -> Query {
    let direction = |theta: f64, phi: f64| DirectionInFrame::from_angles(theta as f32, phi as f32);
    let query = match *point {
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
    };
    query.by_paper()
}
