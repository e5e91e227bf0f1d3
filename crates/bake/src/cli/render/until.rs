//! Goals of `strandlight render --converge`.

use std::fmt;
use std::time::Duration;
use strandlight_formats::counted;

use strandlight_reference::MAX_TRUTH_SAMPLES;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Until {
    /// At this relative error of means over 4x4 pixels.
    Error(f64),
    /// After so long.
    Time(Duration),
    /// With so many samples of each pixel.
    Samples(u32),
}

/// A goal on the command line: `1%`, `30s`, `5m`, `2h` or a number of samples.
pub fn parse_until(text: &str) -> Result<Until, String> {
    let number = |text: &str| {
        text.parse::<f64>()
            .ok()
            .filter(|x| x.is_finite() && *x > 0.0)
    };
    let parsed = match text.char_indices().last() {
        Some((at, '%')) => {
            let percent = number(&text[..at]).filter(|percent| *percent <= 100.0);
            percent.map(|percent| Until::Error(0.01 * percent))
        }
        Some((at, unit @ ('s' | 'm' | 'h'))) => {
            let unit = match unit {
                's' => 1.0,
                'm' => 60.0,
                _ => 3600.0,
            };
            let seconds = number(&text[..at]).map(|x| x * unit);
            let seconds = seconds.filter(|seconds| *seconds <= 1e7);
            seconds.map(|seconds| Until::Time(Duration::from_secs_f64(seconds)))
        }
        _ => {
            let samples = text.parse().ok();
            let samples = samples.filter(|n| (2..=MAX_TRUTH_SAMPLES).contains(n));
            samples.map(Until::Samples)
        }
    };
    parsed.ok_or_else(|| {
        format!(
            "an error like 1%, a time like 30s, 5m or 2h, or a number of samples, 2..={MAX_TRUTH_SAMPLES}"
        )
    })
}

impl fmt::Display for Until {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Until::Error(error) => write!(f, "{} %", 100.0 * error),
            Until::Time(time) => write!(f, "{} s", time.as_secs_f64()),
            Until::Samples(samples) => f.write_str(&counted(samples, "sample", "samples")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_have_units() {
        assert_eq!(parse_until("1%"), Ok(Until::Error(0.01)));
        assert_eq!(parse_until("0.5%"), Ok(Until::Error(0.005)));
        let seconds = |n| Ok(Until::Time(Duration::from_secs(n)));
        assert_eq!(parse_until("30s"), seconds(30));
        assert_eq!(parse_until("5m"), seconds(300));
        assert_eq!(parse_until("2h"), seconds(7200));
        assert_eq!(parse_until("64"), Ok(Until::Samples(64)));
        for text in [
            "", "%", "s", "0%", "-1%", "101%", "1", "0", "1.5", "é", "infs", "nan%", "1e9h",
        ] {
            assert!(parse_until(text).is_err(), "{text}");
        }
    }
}
