//! Bisection.

/// Where in `low..high`, to `tolerance`, `is_beyond` begins to hold.
pub fn bisected(low: f64, high: f64, tolerance: f64, is_beyond: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (low, high);
    while high - low > tolerance {
        let middle = 0.5 * (low + high);
        if is_beyond(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}
