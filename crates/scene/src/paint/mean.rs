//! Paint that a brush takes from the hair: what blur and smear lay on.

use glam::Vec3;

use super::PaintedPoint;

/// Way in radii of the brush over which smear keeps 1/e of what it took up.
const SMEAR_RADII: f32 = 2.0;

/// Mean of weighted points: of absorption, dyes counting by their weights, and of the logarithms of
/// factors.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mean {
    sigma_a: [f64; 3],
    weight: f64,
    width: f64,
    shift: f64,
    total: f64,
}

impl Mean {
    /// Counts `point` with a share > 0.
    pub fn add(&mut self, point: &PaintedPoint, share: f32) {
        let share = f64::from(share);
        let weight = share * f64::from(point.weight);
        for (sum, sigma_a) in self.sigma_a.iter_mut().zip(point.sigma_a) {
            *sum += weight * f64::from(sigma_a);
        }
        self.weight += weight;
        self.width += share * f64::from(point.width_scale).ln();
        self.shift += share * f64::from(point.shift_scale).ln();
        self.total += share;
    }

    /// [`None`] of nothing.
    pub fn point(&self) -> Option<PaintedPoint> {
        if self.total <= 0.0 {
            return None;
        }
        let weight = self.weight;
        let sigma_a = self.sigma_a.map(|sum| match weight > 0.0 {
            true => (sum / weight) as f32,
            false => 0.0,
        });
        let factor = |sum: f64| (sum / self.total).exp() as f32;
        let mean = PaintedPoint {
            sigma_a,
            weight: (weight / self.total) as f32,
            width_scale: factor(self.width),
            shift_scale: factor(self.shift),
            around: None,
        };
        Some(mean.clamped())
    }
}

/// What a smearing brush carries, and where it took it up last.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Smear {
    carried: Option<(PaintedPoint, Vec3)>,
}

impl Smear {
    /// What the brush lays on at `centre`, where the paint is `there` on the mean: what it has carried
    /// along, of which it loses more and more on its way.
    pub fn carry(&mut self, there: PaintedPoint, centre: Vec3, radius_cm: f32) -> PaintedPoint {
        let carried = match self.carried {
            Some((carried, from)) => {
                let way = from.distance(centre) / (SMEAR_RADII * radius_cm);
                there.towards(&carried, (-way).exp())
            }
            None => there,
        };
        self.carried = Some((carried, centre));
        carried
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_those_of_absorption_and_of_factors() {
        assert_eq!(Mean::default().point(), None);
        let red = PaintedPoint {
            sigma_a: [0.0, 3.0, 3.0],
            weight: 1.0,
            width_scale: 4.0,
            shift_scale: 1.0,
            ..PaintedPoint::NONE
        };
        let mut mean = Mean::default();
        mean.add(&red, 0.5);
        assert_eq!(mean.point(), Some(red));
        mean.add(&PaintedPoint::NONE, 1.5);
        let found = mean.point().expect("points");
        assert_eq!((found.sigma_a, found.weight), (red.sigma_a, 0.25));
        assert!((found.width_scale - 2f32.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn smear_loses_what_it_carries() {
        let red = PaintedPoint {
            sigma_a: [0.0, 3.0, 3.0],
            weight: 1.0,
            ..PaintedPoint::NONE
        };
        let bare = PaintedPoint::NONE;
        let mut smear = Smear::default();
        assert_eq!(smear.carry(red, Vec3::ZERO, 1.0), red);
        let near = smear.carry(bare, Vec3::X, 1.0);
        assert!((near.weight - (-0.5f32).exp()).abs() < 1e-6);
        let far = smear.carry(bare, 3.0 * Vec3::X, 1.0);
        assert!((far.weight - (-1.5f32).exp()).abs() < 1e-6);
        assert_eq!(far.sigma_a, red.sigma_a);
    }
}
