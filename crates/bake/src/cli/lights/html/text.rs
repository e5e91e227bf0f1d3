//! Numbers in a page.

/// A fraction as a percentage, three digits or more.
pub fn percent(x: f64) -> String {
    let x = 100.0 * x;
    match x.abs() {
        0.0 => "0 %".to_owned(),
        ..0.01 => format!("{x:.1e} %"),
        ..0.1 => format!("{x:.4} %"),
        ..1.0 => format!("{x:.3} %"),
        ..10.0 => format!("{x:.2} %"),
        _ => format!("{x:.1} %"),
    }
}

/// A limit, as a percentage with the digits that it was given with.
pub fn limit(x: f64) -> String {
    // 0.07 * 100 has a tail of digits.
    format!("{} %", (1e12 * x).round() / 1e10)
}

/// An angle in radians, as degrees.
pub fn degrees(x: f64) -> String {
    let x = x.to_degrees();
    let digits = if x.abs() < 10.0 { 2 } else { 1 };
    format!("{x:.digits$}\u{b0}")
}

/// A number of four digits.
pub fn number(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        0.001..10.0 => format!("{x:.3}"),
        10.0..1000.0 => format!("{x:.1}"),
        1000.0..1e6 => format!("{x:.0}"),
        _ => format!("{x:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_digits() {
        for (x, wanted) in [
            (0.0, "0 %"),
            (1.0, "100.0 %"),
            (0.0512, "5.12 %"),
            (0.00512, "0.512 %"),
            (0.0005, "0.0500 %"),
            (2e-6, "2.0e-4 %"),
        ] {
            assert_eq!(percent(x), wanted);
        }
        for (x, wanted) in [
            (0.0, "0"),
            (1.0, "1.000"),
            (123.45, "123.5"),
            (54321.0, "54321"),
            (2e-5, "2.000e-5"),
        ] {
            assert_eq!(number(x), wanted);
        }
        assert_eq!(limit(0.005), "0.5 %");
        assert_eq!(limit(0.07), "7 %");
        assert_eq!(degrees(0.005), "0.29\u{b0}");
    }
}
