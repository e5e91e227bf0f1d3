//! Answers queries by the chosen method.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use rayon::prelude::*;
use strandlight_formats::TableFile;
use strandlight_scattering::closed_form::paper::{
    PublishedAverages, global_scattering, global_scattering_mode, local_scattering,
};
use strandlight_scattering::closed_form::{DEFAULT_SEGMENTS, DirectionInFrame, Fibre};
use strandlight_scattering::dual_scattering::{AverageTable, event_separated, published};
use strandlight_scattering::fresnel::{Fresnel, UnknownFresnel};
use strandlight_scattering::{HairBits, HairParams, Lobe, Model};
use strandlight_scene::material::{HairMaterial, LobeTables};
use strandlight_scene::optics::Optics;
use strandlight_scene::probe::{MODE_ALL, Query, evaluate};
use strandlight_scene::tables::{ShadingTables, ShadingTablesError, is_lean};

use super::answer::Answer;
use super::per_fibre::PerFibre;
use super::reference::Reference;
use super::request::Request;

/// Ways to evaluate the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// What the renderer computes, on the CPU.
    Runtime,
    /// Double-precision quadrature of the exact model.
    Reference,
    /// Xu's scheme as published, with so many segments of the outer integral, 2 to
    /// [`MAX_SEGMENTS`](strandlight_scattering::closed_form::paper::MAX_SEGMENTS).
    Paper(u32),
}

/// The shading functions on another device: an answer to each query, in order.
pub type Device = Box<dyn Fn(&[Query], &[Optics]) -> Result<Vec<[f32; 4]>, String> + Send + Sync>;

/// Why queries cannot be answered at all.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProbeError {
    /// Tables that shading cannot read.
    #[error(transparent)]
    Tables(#[from] ShadingTablesError),
    /// Tables of a Fresnel term that is not known.
    #[error(transparent)]
    Fresnel(#[from] UnknownFresnel),
    /// The device, in its own words.
    #[error("{0}")]
    Device(String),
    /// The device left queries unanswered.
    #[error("{asked} queries were evaluated and {came} values came back")]
    Unanswered {
        /// Queries.
        asked: usize,
        /// Values.
        came: usize,
    },
}

/// A method ready to answer.
pub struct Evaluator {
    backend: Backend,
    fresnel: Fresnel,
    /// The file has no H tables.
    is_lean: bool,
    scheme: Scheme,
    averages: PerFibre<AverageTable>,
    published: PerFibre<PublishedAverages>,
}

enum Backend {
    Cpu(ShadingTables),
    Device(Device),
    Reference(Reference),
}

/// The scheme of single scattering, with what it needs.
enum Scheme {
    /// The renderer's. A file without lobes answers what needs none.
    Lobes(Result<Arc<LobeTables>, String>),
    /// Xu's, with so many segments.
    Paper(u32),
}

/// Fibres of the requests answered at a time: as many elliptic ones, eight rows of lobes each, fit a
/// texture and some 100 MiB.
const MAX_FIBRES: usize = 512;
/// Most requests answered at a time.
const MAX_REQUESTS: usize = 1 << 14;

type Answers = Vec<Result<Answer, String>>;
/// Answers, each under the place of its request.
type PlacedAnswers = Vec<(usize, Result<Answer, String>)>;

/// What is left to do for a request.
enum Work<'a> {
    /// Nothing: this is the answer.
    Answered(Result<Answer, String>),
    /// The shading functions must be asked.
    Shade(&'a Request),
}

impl Evaluator {
    /// Prepares `method` with the tables of `file`.
    ///
    /// # Errors
    /// Tables that shading cannot read.
    pub fn new(method: Method, file: &TableFile) -> Result<Evaluator, ProbeError> {
        let (backend, scheme) = match method {
            Method::Runtime => {
                let tables = ShadingTables::whole_or_lean(file)?;
                (Backend::Cpu(tables), lobes_of(file))
            }
            Method::Paper(segments) => {
                let tables = ShadingTables::from_file(file)?;
                (Backend::Cpu(tables), Scheme::Paper(segments))
            }
            Method::Reference => (Backend::Reference(Reference::new()), lobes_of(file)),
        };
        Evaluator::of(backend, file, scheme)
    }

    /// Prepares what the renderer computes, on the device that `open` makes of the tables.
    ///
    /// # Errors
    /// Tables that shading cannot read; what `open` says.
    pub fn on_device(
        file: &TableFile,
        open: impl FnOnce(&ShadingTables) -> Result<Device, String>,
    ) -> Result<Evaluator, ProbeError> {
        let tables = ShadingTables::whole_or_lean(file)?;
        let device = open(&tables).map_err(ProbeError::Device)?;
        Evaluator::of(Backend::Device(device), file, lobes_of(file))
    }

    fn of(backend: Backend, file: &TableFile, scheme: Scheme) -> Result<Evaluator, ProbeError> {
        Ok(Evaluator {
            backend,
            fresnel: file.fresnel.parse()?,
            is_lean: is_lean(file),
            scheme,
            averages: PerFibre::default(),
            published: PerFibre::default(),
        })
    }

    /// An answer to each request, in order. Requests that are errors already stay so.
    ///
    /// # Errors
    /// What the device says, if there is one.
    pub fn answer(&self, requests: &[Result<Request, String>]) -> Result<Answers, ProbeError> {
        if let Backend::Reference(reference) = &self.backend {
            let answer = |request: &Result<Request, String>| {
                reference
                    .answer(request.as_ref().map_err(String::clone)?, self.fresnel)
                    .finite()
            };
            return Ok(requests.par_iter().map(answer).collect());
        }
        let mut answers = Vec::with_capacity(requests.len());
        let mut rest = requests;
        while !rest.is_empty() {
            let (some, others) = rest.split_at(batch_length(rest));
            answers.extend(self.answer_some(some)?);
            rest = others;
        }
        Ok(answers)
    }

    /// An answer to each of some requests of at most [`MAX_FIBRES`] fibres.
    ///
    /// Some are bad, some are answered at once, the rest goes to the shading functions in one
    /// batch: what goes there takes its place among the requests with it.
    fn answer_some(&self, requests: &[Result<Request, String>]) -> Result<Answers, ProbeError> {
        let work: Vec<Work<'_>> = requests
            .par_iter()
            .map(|request| match request {
                Err(error) => Work::Answered(Err(error.clone())),
                Ok(request) => match self.beyond_paper(request) {
                    Some(fault) => Work::Answered(Err(fault.to_owned())),
                    None => match self.apart(request) {
                        Some(answer) => Work::Answered(answer.finite()),
                        None => Work::Shade(request),
                    },
                },
            })
            .collect();
        let mut shaded = Vec::new();
        for (ix, work) in work.iter().enumerate() {
            if let Work::Shade(request) = work {
                shaded.push((ix, *request));
            }
        }
        let mut values: HashMap<usize, _> = self.shade(&shaded)?.into_iter().collect();
        let answers = work.into_iter().enumerate().map(|(ix, work)| match work {
            Work::Answered(answer) => answer,
            Work::Shade(_) => values
                .remove(&ix)
                .unwrap_or_else(|| Err("no value came back".to_owned())),
        });
        Ok(answers.collect())
    }

    /// What `request` asks the paper's scheme for that it does not have.
    fn beyond_paper(&self, request: &Request) -> Option<&'static str> {
        let hair = match self.scheme {
            Scheme::Paper(_) => request.hair()?,
            Scheme::Lobes(_) => return None,
        };
        if hair.model != Model::Marschner {
            return Some("hair.model: the paper's scheme has \"marschner\" alone");
        }
        let is_scaled = hair.intensity != HairParams::default().intensity;
        is_scaled.then_some("hair.intensity: the paper's scheme has none, each must be 1")
    }

    /// What the shading functions answer to requests, each under the place that came with it.
    fn shade(&self, requests: &[(usize, &Request)]) -> Result<PlacedAnswers, ProbeError> {
        let fibres = self.fibres(requests.iter().map(|(_, request)| *request));
        let mut answers = Vec::with_capacity(requests.len());
        // What the functions are asked, and in the same order by whom.
        let (mut queries, mut asked) = (Vec::new(), Vec::new());
        for &(ix, request) in requests {
            match self.query(request, &fibres) {
                Err(error) => answers.push((ix, Err(error))),
                Ok(query) => {
                    queries.push(query);
                    asked.push((ix, request));
                }
            }
        }
        let optics = &fibres.optics;
        let values: Vec<[f32; 4]> = match &self.backend {
            Backend::Device(device) => device(&queries, optics).map_err(ProbeError::Device)?,
            Backend::Cpu(tables) => {
                let view = tables.view();
                let answer = |query| evaluate(query, &view, optics);
                queries.par_iter().map(answer).collect()
            }
            Backend::Reference(_) => Vec::new(),
        };
        if values.len() != asked.len() {
            let (asked, came) = (asked.len(), values.len());
            return Err(ProbeError::Unanswered { asked, came });
        }
        let shaped = |((ix, request), value)| (ix, shape(request, value).finite());
        answers.extend(asked.into_iter().zip(values).map(shaped));
        Ok(answers)
    }

    /// The answer on the CPU to what the renderer does not evaluate, if `request` is that: all
    /// averages of the renderer's table of 128 inclinations; by the paper's scheme Eq 33 with
    /// Zinke's approximations, and multiple scattering.
    fn apart(&self, request: &Request) -> Option<Answer> {
        let Backend::Cpu(tables) = &self.backend else {
            return None;
        };
        match (request, &self.scheme) {
            (
                Request::Average {
                    name,
                    theta_d,
                    hair,
                },
                scheme,
            ) => Some(Answer::Rgb(match scheme {
                Scheme::Lobes(_) => {
                    let table = self
                        .averages
                        .of(hair, || AverageTable::new(hair, self.fresnel));
                    table.get(*name, *theta_d as f32).map(f64::from)
                }
                Scheme::Paper(_) => {
                    let event = event_separated(*theta_d, hair, self.fresnel);
                    name.of(&event, &published(&event))
                }
            })),
            (
                Request::Global {
                    lobe,
                    forward,
                    view,
                    hair,
                },
                Scheme::Paper(segments),
            ) => {
                let fibre = Fibre::new(hair, &Lobe::ALL, *segments).ok()?;
                let [light, view] = [(forward.theta, forward.phi), (view.theta, view.phi)]
                    .map(|(theta, phi)| in_frame(theta, phi));
                let sigma_f = forward.sigma_f as f32;
                let tables = tables.view();
                let value = match lobe {
                    Some(lobe) => {
                        let mode = lobe.p();
                        global_scattering_mode(mode, &light, &view, sigma_f, &fibre, &tables)
                    }
                    None => global_scattering(&light, &view, sigma_f, &fibre, &tables),
                };
                let [r, g, b] = value;
                Some(shape(request, [r, g, b, 0.0]))
            }
            (
                Request::Local {
                    forward,
                    view,
                    hair,
                },
                Scheme::Paper(segments),
            ) => {
                let averages = self
                    .published
                    .of(hair, || PublishedAverages::new(hair, self.fresnel));
                let [light, view] = [(forward.theta, forward.phi), (view.theta, view.phi)]
                    .map(|(theta, phi)| in_frame(theta, phi));
                let sigma_f = forward.sigma_f as f32;
                let value = local_scattering(&light, &view, sigma_f, &averages, *segments);
                Some(Answer::Rgb(value.map(f64::from)))
            }
            _ => None,
        }
    }

    /// The optics of every fibre among `requests`, each once.
    fn fibres<'a>(&self, requests: impl Iterator<Item = &'a Request> + Clone) -> Fibres {
        let mut places = HashMap::new();
        let mut hairs: Vec<HairParams> = Vec::new();
        for hair in requests.clone().filter_map(Request::hair) {
            places.entry(hair.bits()).or_insert_with(|| {
                hairs.push(*hair);
                hairs.len() - 1
            });
        }
        let is_multiple = requests.clone().any(Request::needs_averages);
        let made: Vec<Result<Optics, String>> = hairs
            .par_iter()
            .map(|hair| self.optics(hair, is_multiple))
            .collect();
        // What failed is never asked for again, so that places stay.
        let failures = made.iter().map(|made| made.as_ref().err().cloned());
        Fibres {
            places,
            failures: failures.collect(),
            optics: made
                .into_iter()
                .map(|made| made.unwrap_or_else(|_| Optics::paper(bytemuck::Zeroable::zeroed())))
                .collect(),
        }
    }

    /// What shading with `hair` reads, with the averages if `is_multiple`.
    fn optics(&self, hair: &HairParams, is_multiple: bool) -> Result<Optics, String> {
        let modes = &Lobe::ALL;
        match &self.scheme {
            Scheme::Paper(segments) => Fibre::new(hair, modes, *segments)
                .map(Optics::paper)
                .map_err(|error| error.to_string()),
            Scheme::Lobes(lobes) => {
                let lobes = Arc::clone(lobes.as_ref().map_err(String::clone)?);
                HairMaterial::new(lobes, self.fresnel, hair, modes, DEFAULT_SEGMENTS)
                    .map(|mut textures| {
                        textures.enable_multiple(is_multiple);
                        textures.optics().clone()
                    })
                    .map_err(|error| error.to_string())
            }
        }
    }

    /// The request as the shading functions take it.
    fn query(&self, request: &Request, fibres: &Fibres) -> Result<Query, String> {
        let query = match request {
            Request::TableC { k, lambda, phi } => Query::table_c(*k, *lambda as f32, wrap(*phi)),
            Request::TableH {
                lobe,
                eta,
                theta_d,
                fresnel,
                ..
            } => {
                if let Some(fresnel) = fresnel.filter(|fresnel| *fresnel != self.fresnel) {
                    return Err(format!(
                        "fresnel is {}, must be {}, as the tables are: bake others and give --tables",
                        fresnel.name(),
                        self.fresnel.name()
                    ));
                }
                if self.is_lean {
                    return Err("the tables are lean and hold no H".to_owned());
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
                let (place, fibre) = fibres.of(hair)?;
                Query::azimuthal(lobe.p(), lambda, wrap(*dphi), theta_d, fibre).with_optics(place)
            }
            Request::Single {
                lobe,
                light,
                view,
                hair,
            } => {
                let (place, fibre) = fibres.of(hair)?;
                Query::single(
                    lobe.map_or(MODE_ALL, Lobe::p),
                    in_frame(light.theta, light.phi),
                    light.lambda as f32,
                    in_frame(view.theta, view.phi),
                    fibre,
                )
                .with_optics(place)
            }
            Request::Global {
                lobe,
                forward,
                view,
                hair,
            } => {
                let (place, fibre) = fibres.of(hair)?;
                Query::global(
                    lobe.map_or(MODE_ALL, Lobe::p),
                    in_frame(forward.theta, forward.phi),
                    forward.sigma_f as f32,
                    in_frame(view.theta, view.phi),
                    fibre,
                )
                .with_optics(place)
            }
            Request::Local {
                forward,
                view,
                hair,
            } => {
                let (place, fibre) = fibres.of(hair)?;
                Query::local(
                    in_frame(forward.theta, forward.phi),
                    forward.sigma_f as f32,
                    in_frame(view.theta, view.phi),
                    fibre,
                )
                .with_optics(place)
            }
            Request::Average {
                name,
                theta_d,
                hair,
            } => {
                let (place, fibre) = fibres.of(hair)?;
                Query::average(*name, *theta_d as f32, fibre)
                    .ok_or_else(|| {
                        format!("the shaders do not sample the average {}", name.name())
                    })?
                    .with_optics(place)
            }
        };
        Ok(match self.scheme {
            Scheme::Lobes(_) => query,
            Scheme::Paper(_) => query.by_paper(),
        })
    }
}

/// The fibres of some requests.
struct Fibres {
    places: HashMap<HairBits, usize>,
    failures: Vec<Option<String>>,
    optics: Vec<Optics>,
}

impl Fibres {
    /// Place and parameters of `hair`, or why it has no optics.
    fn of(&self, hair: &HairParams) -> Result<(u32, Fibre), String> {
        let place = *self.places.get(&hair.bits()).ok_or("no optics were made")?;
        match &self.failures[place] {
            Some(failure) => Err(failure.clone()),
            None => Ok((place as u32, self.optics[place].fibre)),
        }
    }
}

/// `angle` in single precision, wrapped first so that large angles keep their digits.
fn wrap(angle: f64) -> f32 {
    strandlight_scattering::circular_gaussian::wrap(angle) as f32
}

/// A direction as the closed forms take it.
fn in_frame(theta: f64, phi: f64) -> DirectionInFrame {
    DirectionInFrame::from_angles(theta as f32, wrap(phi))
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
        }
        | Request::Global {
            lobe: Some(Lobe::R),
            ..
        } => Answer::Number(r),
        Request::TableH { k, .. } => Answer::Number(f64::from(value[*k as usize / 2 % 4])),
        Request::Azimuthal { .. }
        | Request::Single { .. }
        | Request::Global { .. }
        | Request::Local { .. }
        | Request::Average { .. } => Answer::Rgb([r, g, b]),
    }
}

/// How many of the first requests are answered at a time.
fn batch_length(requests: &[Result<Request, String>]) -> usize {
    let mut fibres = HashSet::new();
    let requests = requests.iter().take(MAX_REQUESTS);
    requests
        .take_while(|request| {
            let hair = request.as_ref().ok().and_then(Request::hair);
            hair.is_none_or(|hair| {
                fibres.insert(hair.bits());
                fibres.len() <= MAX_FIBRES
            })
        })
        .count()
}

fn lobes_of(file: &TableFile) -> Scheme {
    let lobes = LobeTables::from_file(file, &Lobe::ALL).map(Arc::new);
    Scheme::Lobes(lobes.map_err(|error| error.to_string()))
}

#[cfg(test)]
mod tests {
    use strandlight_formats::BakedFile;
    use strandlight_scattering::dual_scattering::Average;

    use super::*;

    fn request(eta: f64) -> Result<Request, String> {
        let hair = HairParams {
            eta,
            ..HairParams::default()
        };
        Ok(Request::Average {
            name: Average::AF,
            theta_d: 0.2,
            hair,
        })
    }

    #[test]
    fn azimuths_keep_their_digits() {
        let file = TableFile::from_bytes(strandlight_data::DEFAULT_TABLES).unwrap();
        let evaluator = Evaluator::new(Method::Runtime, &file).unwrap();
        let reference = Evaluator::new(Method::Reference, &file).unwrap();
        let at = |phi| {
            Ok(Request::TableC {
                k: 6,
                lambda: 0.01,
                phi,
            })
        };
        let near = -2.525_621_140_109_55;
        let requests = [at(-999_996.6), at(near)];
        let value = |evaluator: &Evaluator, ix: usize| {
            let answers = evaluator.answer(&requests).unwrap();
            match answers[ix].as_ref().unwrap() {
                Answer::Number(value) => *value,
                Answer::Rgb(_) => f64::NAN,
            }
        };
        let [far, near, exact] = [
            value(&evaluator, 0),
            value(&evaluator, 1),
            value(&reference, 0),
        ];
        assert!((far / near - 1.0).abs() < 1e-5, "{far} {near}");
        assert!((far / exact - 1.0).abs() < 1e-3, "{far} {exact}");
    }

    #[test]
    fn batches_are_of_few_fibres_and_requests() {
        let same = vec![request(1.5); MAX_REQUESTS + 3];
        assert_eq!(batch_length(&same), MAX_REQUESTS);
        assert_eq!(batch_length(&same[..7]), 7);
        let other = |ix: usize| request(1.4 + 1e-4 * ix as f64);
        let others: Vec<_> = (0..MAX_FIBRES + 3).map(other).collect();
        assert_eq!(batch_length(&others), MAX_FIBRES);
        assert_eq!(batch_length(&others[MAX_FIBRES..]), 3);
        let bad = vec![Err("bad".to_owned()); 4];
        assert_eq!(batch_length(&bad), 4);
    }
}
