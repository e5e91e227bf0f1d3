//! Numbers as people type them: `1,6`, `1.6mm`, `2*0.8`, `(20+3)/2`.

use std::iter::Peekable;
use std::str::Chars;

/// Units by name, and how many of the first of their kind one is.
const UNITS: [&[(&str, f64)]; 5] = [
    &[
        ("cm", 1.0),
        ("mm", 0.1),
        ("µm", 1e-4),
        ("μm", 1e-4),
        ("um", 1e-4),
        ("m", 100.0),
        ("in", 2.54),
        ("ft", 30.48),
    ],
    &[
        ("°", 1.0),
        ("deg", 1.0),
        ("rad", 180.0 / std::f64::consts::PI),
    ],
    &[("s", 1.0), ("ms", 1e-3), ("min", 60.0)],
    &[("stops", 1.0), ("stop", 1.0), ("EV", 1.0)],
    &[("px", 1.0)],
];

/// The number that `text` says, in `unit`: its own units are converted, plain numbers are taken in
/// `unit`.
///
/// # Errors
/// What is wrong, in words that can follow the text.
pub fn parse(text: &str, unit: &str) -> Result<f64, String> {
    let unit = unit.trim();
    let mut reader = Reader {
        rest: text.trim().chars().peekable(),
        unit,
    };
    let value = reader.sum(0)?;
    reader.skip();
    match reader.rest.peek() {
        Some(&left) => Err(format!("`{left}` is not expected")),
        None if !value.is_finite() => Err("is not a finite number".to_owned()),
        None => Ok(value),
    }
}

struct Reader<'a> {
    rest: Peekable<Chars<'a>>,
    unit: &'a str,
}

impl Reader<'_> {
    fn skip(&mut self) {
        while self.rest.next_if(|c| c.is_whitespace()).is_some() {}
    }

    fn take(&mut self, wanted: &[char]) -> Option<char> {
        self.skip();
        self.rest.next_if(|c| wanted.contains(c))
    }

    /// Terms, in so many brackets.
    fn sum(&mut self, depth: u32) -> Result<f64, String> {
        let mut value = self.product(depth)?;
        while let Some(sign) = self.take(&['+', '-', '\u{2212}']) {
            let other = self.product(depth)?;
            value += if sign == '+' { other } else { -other };
        }
        Ok(value)
    }

    fn product(&mut self, depth: u32) -> Result<f64, String> {
        let mut value = self.factor(depth)?;
        while let Some(sign) = self.take(&['*', '/', '×', ':']) {
            let other = self.factor(depth)?;
            value = match sign {
                '*' | '×' => value * other,
                _ if other == 0.0 => return Err("divides by zero".to_owned()),
                _ => value / other,
            };
        }
        Ok(value)
    }

    fn factor(&mut self, depth: u32) -> Result<f64, String> {
        // Signs and brackets of a page of them are no number that somebody typed.
        if depth > 32 {
            return Err("is too deep".to_owned());
        }
        if let Some(sign) = self.take(&['+', '-', '\u{2212}']) {
            let value = self.factor(depth + 1)?;
            return Ok(if sign == '+' { value } else { -value });
        }
        if self.take(&['(']).is_some() {
            let value = self.sum(depth + 1)?;
            return match self.take(&[')']) {
                Some(_) => Ok(value),
                None => Err("lacks a `)`".to_owned()),
            };
        }
        self.number()
    }

    /// Digits with a point or comma, an exponent, and a unit.
    fn number(&mut self) -> Result<f64, String> {
        self.skip();
        let mut digits = String::new();
        while let Some(c) = self
            .rest
            .next_if(|c| c.is_ascii_digit() || ".,".contains(*c))
        {
            digits.push(c);
        }
        let marks = digits.chars().filter(|c| ".,".contains(*c)).count();
        if marks > 1 {
            return Err(format!("`{digits}` has more than one decimal point"));
        }
        let mut number = digits.replace(',', ".");
        if !number.contains(|c: char| c.is_ascii_digit()) {
            return Err(match self.rest.peek() {
                Some(c) => format!("`{c}` is no number"),
                None => "lacks a number".to_owned(),
            });
        }
        // An exponent, unless a unit begins like one.
        let mut ahead = self.rest.clone();
        if ahead.next_if(|c| "eE".contains(*c)).is_some() {
            let sign = ahead.next_if(|c| "+-".contains(*c));
            if ahead.peek().is_some_and(char::is_ascii_digit) {
                number.push('e');
                number.extend(sign);
                self.rest = ahead;
                while let Some(c) = self.rest.next_if(char::is_ascii_digit) {
                    number.push(c);
                }
            }
        }
        let value: f64 = number
            .parse()
            .map_err(|_| format!("`{number}` is no number"))?;
        Ok(value * self.unit()?)
    }

    /// The factor of a unit after a number; 1 where there is none.
    fn unit(&mut self) -> Result<f64, String> {
        self.skip();
        let is_of_unit = |c: &char| c.is_alphabetic() || "°%".contains(*c);
        let mut name = String::new();
        while let Some(c) = self.rest.next_if(is_of_unit) {
            name.push(c);
        }
        if name.is_empty() || name == self.unit {
            return Ok(1.0);
        }
        if name == "%" {
            return Ok(0.01);
        }
        let of_kind = |name: &str| {
            let units = UNITS.iter();
            let mut found =
                units.filter_map(|kind| Some((kind, kind.iter().find(|(n, _)| *n == name)?.1)));
            found.next()
        };
        let (Some((kind, factor)), own) = (of_kind(&name), of_kind(self.unit)) else {
            return Err(format!("`{name}` is no unit"));
        };
        match own {
            Some((of_own, own)) if std::ptr::eq(kind, of_own) => Ok(factor / own),
            Some(_) => Err(format!("`{name}` cannot be converted to {}", self.unit)),
            None => Err(format!("`{name}`: this number has no unit")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_people_type_them() {
        for (text, unit, wanted) in [
            ("1.6", "", 1.6),
            ("1,6", "", 1.6),
            (" -1,6 ", " °", -1.6),
            ("2*0.8", "", 1.6),
            ("(20+3)/2", "", 11.5),
            ("2+3*4", "", 14.0),
            ("10 - 2 - 3", "", 5.0),
            ("-(2)*-3", "", 6.0),
            ("1.6mm", " cm", 0.16),
            ("80µm", " cm", 0.008),
            ("80 um", " µm", 80.0),
            ("0.008 cm", " µm", 80.0),
            ("1in + 1", " cm", 3.54),
            ("90deg", "°", 90.0),
            ("50%", "", 0.5),
            ("500 ms", " s", 0.5),
            ("1e-3", "", 1e-3),
            (".5", "", 0.5),
            ("5.", "", 5.0),
            ("\u{2212}3", "", -3.0),
        ] {
            let read = parse(text, unit).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert!(
                (read - wanted).abs() < 1e-9 * wanted.abs().max(1.0),
                "{text}: {read}"
            );
        }
    }

    #[test]
    fn what_is_no_number_says_why() {
        for (text, unit, needle) in [
            ("", "", "lacks a number"),
            ("abc", "", "`a`"),
            ("1,234.5", "", "more than one"),
            ("2*", "", "lacks a number"),
            ("(2", "", "`)`"),
            ("2)", "", "`)`"),
            ("1/0", "", "zero"),
            ("1.6mm", "", "no unit"),
            ("1.6mm", "°", "cannot be converted"),
            ("1.6 bananas", " cm", "`bananas` is no unit"),
            ("1e999", "", "finite"),
        ] {
            let error = parse(text, unit).expect_err(text);
            assert!(error.contains(needle), "{text}: {error}");
        }
        for deep in ["(".repeat(100_000), "-".repeat(100_000)] {
            assert!(parse(&deep, "").is_err());
        }
    }
}
