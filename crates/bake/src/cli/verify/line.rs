//! A check of a file, as it is printed.

use serde_json::{Value, json};
use strandlight_formats::counted;

/// One check of one file, for people and for programs.
pub struct Line {
    pub passed: bool,
    pub text: String,
    pub json: Value,
}

impl Line {
    /// A check whose error is one number.
    pub fn measured(name: &str, error: f64, tolerance: f64, note: &str) -> Line {
        let passed = error <= tolerance;
        Line {
            passed,
            text: format!("{name}: {error:.2e}, tolerance {tolerance:.2e}{note}"),
            json: json!({
                "check": name,
                "passed": passed,
                "tolerance": tolerance,
                "worst": { "error": error },
            }),
        }
    }

    /// A check that holds or does not; `entry` says where it fails.
    pub fn held(name: &str, n_values: usize, failed: Option<String>) -> Line {
        let passed = failed.is_none();
        let text = match &failed {
            None => format!("{name}: {}", counted(n_values, "value", "values")),
            Some(entry) => format!("{name}: {entry}"),
        };
        Line {
            passed,
            text,
            json: json!({
                "check": name,
                "passed": passed,
                "values": n_values,
                "worst": failed.map(|entry| json!({ "entry": entry })),
            }),
        }
    }

    pub fn print(&self) -> String {
        let word = if self.passed { "ok" } else { "FAILED" };
        format!("{word} {}", self.text)
    }
}
