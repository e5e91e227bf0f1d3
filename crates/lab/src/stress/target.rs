//! What is under test: a scheme on the CPU and, where there is an adapter, on it.

use std::sync::Arc;

use rayon::prelude::*;
use strandlight_render::gpu::GpuError;
use strandlight_render::probe::{GpuProbe, Query, Scheme, evaluate};
use strandlight_scattering::closed_form::{DEFAULT_SEGMENTS, Fibre};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe, ParamError};
use strandlight_scene::material::{EditError, HairMaterial, LobeTables};
use strandlight_scene::optics::Optics;
use strandlight_scene::tables::ShadingTables;

use super::point::{Evaluation, Group};

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
            Scheme::Lobes => self.material(hair)?.optics().clone(),
        };
        Ok(Prepared { optics })
    }

    /// The Rust functions at points of a prepared fibre; R repeats its one value.
    pub fn at(&self, prepared: &Prepared, points: &[impl Evaluation]) -> Vec<[f32; 3]> {
        let view = self.tables.view();
        let optics = std::slice::from_ref(&prepared.optics);
        let answer = |point| {
            rgb(evaluate(
                &self.query(point, &prepared.optics, 0),
                &view,
                optics,
            ))
        };
        points.iter().map(answer).collect()
    }

    /// The Rust functions at the points of a group.
    pub fn cpu<P: Evaluation>(&self, group: &Group<P>) -> Result<Vec<[f32; 3]>, StressError> {
        Ok(self.at(&self.prepare_for::<P>(&group.hair)?, &group.points))
    }

    /// The WGSL functions at the points of all groups, or `None` without an adapter.
    pub fn gpu<P: Evaluation>(
        &self,
        groups: &[Group<P>],
    ) -> Result<Option<Vec<Vec<[f32; 3]>>>, StressError> {
        let Some(probe) = &self.probe else {
            return Ok(None);
        };
        let prepare = |group: &Group<P>| Ok(self.prepare_for::<P>(&group.hair)?.optics);
        let optics: Vec<Optics> = groups
            .par_iter()
            .map(prepare)
            .collect::<Result<_, StressError>>()?;
        let mut all = Vec::new();
        for (ix, (group, optics)) in groups.iter().zip(&optics).enumerate() {
            let query = |point| self.query(point, optics, ix as u32);
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

    /// What depends on the fibre alone, for evaluations of this kind.
    fn prepare_for<P: Evaluation>(&self, hair: &HairParams) -> Result<Prepared, StressError> {
        match P::NEEDS_MULTIPLE {
            true => self.prepare_multiple(hair),
            false => self.prepare(hair),
        }
    }

    /// What depends on the fibre alone, the averages of multiple scattering too.
    fn prepare_multiple(&self, hair: &HairParams) -> Result<Prepared, StressError> {
        let mut material = self.material(hair)?;
        material.enable_multiple(true);
        let optics = material.optics().clone();
        Ok(Prepared { optics })
    }

    fn material(&self, hair: &HairParams) -> Result<HairMaterial, StressError> {
        let lobes = Arc::clone(&self.lobes);
        let (modes, m) = (&Lobe::ALL, DEFAULT_SEGMENTS);
        Ok(HairMaterial::new(lobes, self.fresnel, hair, modes, m)?)
    }

    /// A point as the probe takes it, of the fibre whose `optics` are at this place.
    fn query(&self, point: &impl Evaluation, optics: &Optics, place: u32) -> Query {
        let query = point.probe(optics.fibre).with_optics(place);
        match self.scheme {
            Scheme::Lobes => query,
            Scheme::Paper => query.by_paper(),
        }
    }
}

fn rgb([r, g, b, _]: [f32; 4]) -> [f32; 3] {
    [r, g, b]
}
