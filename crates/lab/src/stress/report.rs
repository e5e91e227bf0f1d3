//! What a stress run found: checks, their worst cases, and how they are printed.

use serde_json::{Value, json};

/// Why checks of the adapter were not run.
pub(super) const NO_ADAPTER: &str = "no adapter";

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Every value was within the bound.
    Passed,
    /// Some value was not.
    Failed,
    /// Measured only; nothing is promised.
    Reported,
    /// Not run, for the reason in the note.
    NotRun,
}

impl Status {
    /// The word in table and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Status::Passed => "ok",
            Status::Failed => "FAILED",
            Status::Reported => "reported",
            Status::NotRun => "not run",
        }
    }
}

/// The worst case of a check.
#[derive(Clone, Debug, PartialEq)]
pub struct Worst {
    /// The error in the check's unit; infinite where a value is not finite.
    pub error: f64,
    /// What was found.
    pub found: Value,
    /// What it should have been.
    pub expected: Value,
    /// All inputs: a query of `strandlight probe` where there is one.
    pub inputs: Value,
}

/// One named check.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// Name, unique within the report.
    pub name: String,
    /// `cpu`, `gpu`, `cpu, gpu`, or `-`.
    pub backend: &'static str,
    /// How it ended.
    pub status: Status,
    /// Number of values compared.
    pub n_values: u64,
    /// Largest error accepted; absent where nothing is promised.
    pub bound: Option<f64>,
    /// Median, 90th, 99th percentile of the error, where it is measured.
    pub percentiles: Option<[f64; 3]>,
    /// The worst case, where any value was compared.
    pub worst: Option<Worst>,
    /// What the error is, or why the check was not run.
    pub note: String,
}

impl Check {
    /// A check that was not run.
    pub(crate) fn not_run(name: &str, backend: &'static str, why: &str) -> Check {
        Check {
            name: name.to_owned(),
            backend,
            status: Status::NotRun,
            n_values: 0,
            bound: None,
            percentiles: None,
            worst: None,
            note: why.to_owned(),
        }
    }
}

/// What a run found.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// The scheme under test.
    pub scheme: &'static str,
    /// Name of the adapter, if one took part.
    pub adapter: Option<String>,
    /// Size of the run.
    pub n: u64,
    /// Seed of the run.
    pub seed: u64,
    /// All checks, in order.
    pub checks: Vec<Check>,
}

impl Report {
    /// Did no check fail?
    pub fn passed(&self) -> bool {
        !self.failed().any(|_| true)
    }

    /// The checks that failed.
    pub fn failed(&self) -> impl Iterator<Item = &Check> {
        self.checks
            .iter()
            .filter(|check| check.status == Status::Failed)
    }

    /// The report as a JSON document.
    pub fn to_json(&self) -> Value {
        let checks: Vec<Value> = self.checks.iter().map(check_json).collect();
        json!({
            "scheme": self.scheme,
            "adapter": self.adapter,
            "n": self.n,
            "seed": self.seed,
            "passed": self.passed(),
            "checks": checks,
        })
    }

    /// The report as lines: a table, then the worst case of each check.
    pub fn to_lines(&self) -> Vec<String> {
        let mut lines = vec![format!(
            "{:<34} {:<8} {:>9} {:>9} {:>9} {:>9} {:>9}  verdict",
            "check", "backend", "values", "median", "99 %", "worst", "bound"
        )];
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |x| format!("{x:.2e}"));
        for check in &self.checks {
            lines.push(format!(
                "{:<34} {:<8} {:>9} {:>9} {:>9} {:>9} {:>9}  {}",
                check.name,
                check.backend,
                check.n_values,
                number(check.percentiles.map(|p| p[0])),
                number(check.percentiles.map(|p| p[2])),
                number(check.worst.as_ref().map(|worst| worst.error)),
                number(check.bound),
                check.status.name(),
            ));
        }
        lines.push(String::new());
        for check in &self.checks {
            lines.push(format!(
                "{} ({}): {}",
                check.name, check.backend, check.note
            ));
            if let Some(worst) = check.worst.as_ref().filter(|worst| worst.error > 0.0) {
                lines.push(format!(
                    "  worst {:.3e}: {} instead of {} at {}",
                    worst.error, worst.found, worst.expected, worst.inputs
                ));
            }
        }
        lines
    }
}

fn check_json(check: &Check) -> Value {
    json!({
        "check": check.name,
        "backend": check.backend,
        "status": check.status.name(),
        "values": check.n_values,
        "bound": check.bound,
        "percentiles": check.percentiles.map(|[p50, p90, p99]| {
            json!({ "50": finite(p50), "90": finite(p90), "99": finite(p99) })
        }),
        "worst": check.worst.as_ref().map(|worst| json!({
            "error": finite(worst.error),
            "found": worst.found,
            "expected": worst.expected,
            "inputs": worst.inputs,
        })),
        "note": check.note,
    })
}

/// A number as JSON can say it: `"inf"` and `"NaN"` as strings.
pub fn finite(value: f64) -> Value {
    if value.is_finite() {
        json!(value)
    } else {
        json!(value.to_string())
    }
}

/// Collects the errors of one check.
#[derive(Clone, Debug)]
pub struct Tally {
    n_values: u64,
    worst: Option<Worst>,
    errors: Option<Vec<f64>>,
}

impl Tally {
    /// Keeps the worst case only.
    pub fn new() -> Tally {
        Tally {
            n_values: 0,
            worst: None,
            errors: None,
        }
    }

    /// Keeps every error too, for percentiles.
    pub fn with_percentiles() -> Tally {
        Tally {
            errors: Some(Vec::new()),
            ..Tally::new()
        }
    }

    /// One compared value; `worst` is asked for found, expected and inputs if this is the worst
    /// so far. NaN counts as infinite.
    pub fn see(&mut self, error: f64, worst: impl FnOnce() -> [Value; 3]) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        self.n_values += 1;
        if let Some(errors) = &mut self.errors {
            errors.push(error);
        }
        if self.worst.as_ref().is_none_or(|w| error > w.error) {
            let [found, expected, inputs] = worst();
            self.worst = Some(Worst {
                error,
                found,
                expected,
                inputs,
            });
        }
    }

    /// Was nothing compared yet?
    pub fn is_empty(&self) -> bool {
        self.n_values == 0
    }

    /// Adds what another tally saw, after what this one did.
    pub fn merge(mut self, other: Tally) -> Tally {
        self.n_values += other.n_values;
        if let (Some(errors), Some(more)) = (&mut self.errors, other.errors) {
            errors.extend(more);
        }
        let here = self.worst.as_ref().map_or(-1.0, |worst| worst.error);
        if other.worst.as_ref().is_some_and(|w| w.error > here) {
            self.worst = other.worst;
        }
        self
    }

    /// The check, held to `bound` or merely reported. Nothing seen is a failure: a check that
    /// compares nothing must not pass.
    pub fn check(self, name: &str, backend: &'static str, bound: Option<f64>, note: &str) -> Check {
        let worst = self.worst.as_ref().map_or(f64::INFINITY, |w| w.error);
        let status = match bound {
            None => Status::Reported,
            Some(bound) if self.n_values > 0 && worst <= bound => Status::Passed,
            Some(_) => Status::Failed,
        };
        let percentiles = self.errors.filter(|e| !e.is_empty()).map(|mut errors| {
            errors.sort_by(f64::total_cmp);
            let at = |share: f64| errors[((errors.len() - 1) as f64 * share).round() as usize];
            [at(0.5), at(0.9), at(0.99)]
        });
        Check {
            name: name.to_owned(),
            backend,
            status,
            n_values: self.n_values,
            bound,
            percentiles,
            worst: self.worst,
            note: note.to_owned(),
        }
    }
}

/// The tallies of many work items, in their order, merged place by place.
pub fn merge<const N: usize>(all: Vec<[Tally; N]>) -> [Tally; N] {
    let mut all = all.into_iter();
    let first = all.next().unwrap_or_else(|| [(); N].map(|()| Tally::new()));
    all.fold(first, |sum, more| {
        let mut more = more.into_iter();
        // Both have N.
        sum.map(|tally| match more.next() {
            Some(other) => tally.merge(other),
            None => tally,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nothing() -> [Value; 3] {
        [Value::Null, Value::Null, Value::Null]
    }

    #[test]
    fn a_check_fails_on_nan_on_nothing_and_above_its_bound() {
        let check = |tally: Tally| tally.check("x", "cpu", Some(0.5), "").status;
        assert_eq!(check(Tally::new()), Status::Failed);
        for (error, expected) in [
            (0.5, Status::Passed),
            (0.51, Status::Failed),
            (f64::NAN, Status::Failed),
        ] {
            let mut tally = Tally::new();
            tally.see(error, nothing);
            assert_eq!(check(tally.clone()), expected);
            let mut good = Tally::new();
            good.see(0.0, nothing);
            assert_eq!(check(good.clone().merge(tally.clone())), expected);
            assert_eq!(check(tally.merge(good)), expected);
        }
    }
}
