//! Answers queries by the chosen method.

use rayon::prelude::*;
use strandlight_formats::TableFile;
use strandlight_runtime::probe::{GpuProbe, MODE_ALL, Query, evaluate};
use strandlight_runtime::tables::{BUNDLED, ShadingTables};
use strandlight_scattering::closed_form::{DEFAULT_SEGMENTS, DirectionInFrame, Fibre};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe};

use super::reference::Reference;
use super::request::Request;
use super::{Answer, Failure, Method};

/// A method ready to answer.
pub struct Evaluator {
    backend: Backend,
    fresnel: Fresnel,
    segments: u32,
}

enum Backend {
    Cpu(ShadingTables),
    Gpu(Box<GpuProbe>),
    Reference(Reference),
}

type Answers = Vec<Result<serde_json::Value, String>>;

impl Evaluator {
    /// Prepares `method`; tables that shading cannot read and a missing adapter are failures.
    pub fn new(method: Method, segments: u32, file: &TableFile) -> Result<Evaluator, Failure> {
        let tables = ShadingTables::from_file(file).map_err(Failure::input)?;
        let fresnel = Fresnel::from_name(&file.fresnel)
            .ok_or_else(|| Failure::Input(format!("fresnel {:?} is unknown", file.fresnel)))?;
        let backend = match method {
            Method::Runtime | Method::Paper => Backend::Cpu(tables),
            Method::Gpu => Backend::Gpu(Box::new(GpuProbe::new(&tables).map_err(Failure::input)?)),
            Method::Reference => Backend::Reference(Reference::new()),
        };
        let segments = if method == Method::Paper {
            segments
        } else {
            DEFAULT_SEGMENTS
        };
        Ok(Evaluator {
            backend,
            fresnel,
            segments,
        })
    }

    /// An answer to each request, in order.
    pub fn answer(&self, requests: &[Result<Request, String>]) -> Result<Answers, Failure> {
        if let Backend::Reference(reference) = &self.backend {
            let answer = |request: &Result<Request, String>| {
                reference
                    .answer(request.as_ref().map_err(String::clone)?, self.fresnel)
                    .finite()
            };
            return Ok(requests.par_iter().map(answer).collect());
        }
        let queries: Vec<Result<Query, String>> = requests
            .iter()
            .map(|request| self.query(request.as_ref().map_err(String::clone)?))
            .collect();
        let valid: Vec<Query> = queries.iter().flatten().copied().collect();
        let values: Vec<[f32; 4]> = match &self.backend {
            Backend::Gpu(probe) => probe.evaluate(&valid, &[]).map_err(Failure::input)?,
            Backend::Cpu(tables) => {
                let view = tables.view();
                valid
                    .iter()
                    .map(|query| evaluate(query, &view, &[]))
                    .collect()
            }
            Backend::Reference(_) => Vec::new(),
        };
        let mut values = values.into_iter();
        let answers = requests.iter().zip(queries).map(|(request, query)| {
            query?;
            // One value for each valid query, in order.
            let value = values.next().ok_or("no value came back")?;
            shape(request.as_ref().map_err(String::clone)?, value).finite()
        });
        Ok(answers.collect())
    }

    /// The request as the shading functions take it.
    fn query(&self, request: &Request) -> Result<Query, String> {
        let fibre = |hair: &HairParams| {
            Fibre::new(hair, &Lobe::ALL, self.segments).map_err(|error| error.to_string())
        };
        Ok(match request {
            Request::TableC { k, lambda, phi } => Query::table_c(*k, *lambda as f32, *phi as f32),
            Request::TableH {
                lobe,
                eta,
                theta_d,
                fresnel,
                ..
            } => {
                if fresnel.is_some_and(|fresnel| fresnel != self.fresnel) {
                    return Err(format!("the tables hold fresnel {}", self.fresnel.name()));
                }
                Query::table_h(lobe.p(), *eta as f32, *theta_d as f32)
            }
            Request::Azimuthal {
                lobe,
                lambda,
                dphi,
                theta_d,
                hair,
            } => {
                let (lambda, theta_d) = (*lambda as f32, *theta_d as f32);
                Query::azimuthal(lobe.p(), lambda, wrap(*dphi), theta_d, fibre(hair)?).by_paper()
            }
            Request::Single {
                lobe,
                light,
                view,
                hair,
            } => Query::single(
                lobe.map_or(MODE_ALL, Lobe::p),
                DirectionInFrame::from_angles(light.theta as f32, wrap(light.phi)),
                light.lambda as f32,
                DirectionInFrame::from_angles(view.theta as f32, wrap(view.phi)),
                fibre(hair)?,
            )
            .by_paper(),
        })
    }
}

/// `angle` in single precision, wrapped first so that large angles keep their digits.
fn wrap(angle: f64) -> f32 {
    strandlight_scattering::circular_gaussian::wrap(angle) as f32
}

/// The components of `value` that answer `request`.
fn shape(request: &Request, value: [f32; 4]) -> Answer {
    let [r, g, b, _] = value.map(f64::from);
    match request {
        Request::TableC { .. }
        | Request::Azimuthal { lobe: Lobe::R, .. }
        | Request::Single {
            lobe: Some(Lobe::R),
            ..
        } => Answer::Number(r),
        Request::TableH { k, .. } => Answer::Number(f64::from(value[*k as usize / 2 % 4])),
        Request::Azimuthal { .. } | Request::Single { .. } => Answer::Rgb([r, g, b]),
    }
}

/// The bundled tables.
pub fn default_tables() -> Result<TableFile, Failure> {
    TableFile::from_bytes(BUNDLED).map_err(Failure::input)
}
