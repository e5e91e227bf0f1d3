//! The scattering model over arrays.

use numpy::{PyArrayDyn, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;
use serde_json::{Value, json};
use strandlight_bake::probe::{Evaluator, Method, Request};
use strandlight_scattering::closed_form::paper::MAX_SEGMENTS;

use crate::arrays::{fresh, values};
use crate::fault::{Fault, Outcome};
use crate::tables::Tables;
use crate::work;

/// Queries that are made at a time.
const BATCH: usize = 1 << 14;

/// A key of a query with a value for each query: its path, whether its values are whole numbers,
/// and `(n, 1)` or, where a value is a colour, `(n, 3)` of them.
type Column<'py> = (Vec<String>, bool, PyReadonlyArray2<'py, f64>);

/// A column without Python.
struct Values<'a> {
    path: &'a [String],
    is_whole: bool,
    width: usize,
    data: &'a [f64],
}

impl Values<'_> {
    /// Puts the value of query `ix` into `query`.
    fn put(&self, query: &mut Value, ix: usize) {
        let row = &self.data[ix * self.width..(ix + 1) * self.width];
        let number = |x: f64| match self.is_whole {
            true => json!(x as i64),
            // Not a number is `null`; the reader says what it wants instead.
            false => json!(x),
        };
        let value = match row {
            [x] => number(*x),
            row => row.iter().copied().map(number).collect(),
        };
        let (mut at, mut missing) = (query, false);
        for key in self.path {
            match at {
                Value::Object(object) => at = object.entry(key).or_insert(json!({})),
                _ => {
                    missing = true;
                    break;
                }
            }
        }
        if !missing {
            *at = value;
        }
    }
}

/// Answers `n` queries: `query` in JSON, with the values of `columns` in their places.
#[pyfunction]
#[allow(
    clippy::too_many_arguments,
    reason = "Python's keywords, which the package gives by position"
)]
pub fn probe<'py>(
    py: Python<'py>,
    query: &str,
    columns: Vec<Column<'_>>,
    n: usize,
    method: &str,
    segments: u32,
    tables: PyRef<'_, Tables>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let make = || -> Outcome<_> {
        let method = match method {
            "runtime" => Method::Runtime,
            "reference" => Method::Reference,
            "paper" if (2..=MAX_SEGMENTS).contains(&segments) => Method::Paper(segments),
            "paper" => {
                let what = format!("segments is {segments}, must be in 2..={MAX_SEGMENTS}");
                return Err(Fault::value(what));
            }
            _ => {
                let what = format!("method is {method:?}, must be runtime, reference or paper");
                return Err(Fault::value(what));
            }
        };
        let query: Value =
            serde_json::from_str(query).map_err(|error| Fault::value(error.to_string()))?;
        let mut all = Vec::with_capacity(columns.len());
        for (path, is_whole, array) in &columns {
            let width = array.as_array().shape()[1];
            let data = values(array)?;
            if data.len() != n * width || width == 0 {
                return Err(Fault::value(format!(
                    "{} has too few values",
                    path.join(".")
                )));
            }
            let is_whole = *is_whole;
            all.push(Values {
                path,
                is_whole,
                width,
                data,
            });
        }
        Ok((method, query, all))
    };
    let (method, query, columns) = make().map_err(|fault| fault.raise(py))?;
    let file = tables.0.clone();
    let answers = work::run(py, progress, |watch| {
        let evaluator = Evaluator::new(method, &file)?;
        let mut answers: Vec<f64> = Vec::new();
        for start in (0..n).step_by(BATCH) {
            let range = start..n.min(start + BATCH);
            let requests = range.clone().into_par_iter().map(|ix| {
                let mut query = query.clone();
                columns.iter().for_each(|column| column.put(&mut query, ix));
                Request::from_value(&query)
            });
            let requests: Vec<Result<Request, String>> = requests.collect();
            // A wrong value ends it all before anything is computed.
            for (request, ix) in requests.iter().zip(range.clone()) {
                if let Err(error) = request {
                    return Err(of_query(error, ix, n));
                }
            }
            // The exact model takes so long that one waits for single answers.
            let step = match method {
                Method::Reference => 64,
                _ => BATCH,
            };
            let mut done = start;
            for some in requests.chunks(step) {
                for (ix, answer) in (done..).zip(evaluator.answer(some)?) {
                    let answer = answer.map_err(|error| of_query(&error, ix, n))?;
                    answers.extend(answer.values());
                }
                done += some.len();
                watch.reach(done as f64 / n as f64);
            }
        }
        Ok(answers)
    })?;
    let width = answers.len().checked_div(n);
    let width = width.unwrap_or_else(|| width_of(&query));
    fresh(py, answers, &[n, width])
}

/// How many numbers answer each query, where there is none to tell: one of what no absorption enters.
fn width_of(query: &Value) -> usize {
    let is_number = matches!(query["q"].as_str(), Some("table_C" | "table_H"));
    if is_number || query["mode"] == "R" {
        1
    } else {
        3
    }
}

/// What is wrong with query `ix` of `n`.
fn of_query(error: &str, ix: usize, n: usize) -> Fault {
    Fault::value(match n {
        1 => error.to_owned(),
        _ => format!("query {ix}: {error}"),
    })
}
