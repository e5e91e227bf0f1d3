//! Items drawn by weight.

/// Mean of the channels.
pub(super) fn mean(rgb: [f32; 3]) -> f64 {
    rgb.iter().map(|&x| f64::from(x)).sum::<f64>() / 3.0
}

/// Running sums of `weights`, from which items are drawn in proportion; black ones never.
pub(super) struct Cumulative(Vec<f64>);

impl Cumulative {
    pub fn new(weights: impl Iterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        Cumulative(
            weights
                .map(|weight| {
                    sum += weight;
                    sum
                })
                .collect(),
        )
    }

    pub fn total(&self) -> f64 {
        self.0.last().copied().unwrap_or(0.0)
    }

    /// The first item whose running sum exceeds `u` (0..1) of the total.
    pub fn pick(&self, u: f64) -> usize {
        let target = u * self.total();
        let found = self.0.partition_point(|&sum| sum <= target);
        found.min(self.0.len().saturating_sub(1))
    }
}
