//! Seeded draws that lean on the extremes, and the corners of every range.

use std::f64::consts::{FRAC_PI_2, PI};

use strandlight_scattering::{HairParams, Lobe, Parameter, PerLobe};

use strandlight_scattering::random::SplitMix64;

use super::point::{Group, Light, Point, inclination, single};

/// Range of eta.
pub const ETA: [f64; 2] = Parameter::Eta.range();
/// Range of the eccentricity.
pub const ECCENTRICITY: [f64; 2] = Parameter::Eccentricity.range();
/// Range of Xu's beta: 0.1 to 40 degrees, the latter taken as a standard deviation.
pub const BETA: [f64; 2] = [0.1 * PI / 180.0, 0.987];
/// Range of w_c.
pub const CAUSTIC_WIDTH: [f64; 2] = [0.01, 1.0];
/// Range of lambda and lambda'.
pub const LAMBDA: [f64; 2] = [0.001, 10.0];
/// A light this wide in azimuth is constant: cos(theta) of light or node is 0.
pub const LAMBDA_P_CONSTANT: f64 = 1000.0;
/// Largest shift alpha, 15 degrees.
pub const SHIFT: f64 = 15.0 * PI / 180.0;
/// Largest sigma_a.
pub const SIGMA_A: f64 = Parameter::SigmaA.range()[1];
/// Points that share a fibre in a random draw.
pub const POINTS_PER_HAIR: usize = 48;

/// Random numbers: one stream a work item, so that threads do not matter.
#[derive(Clone, Debug)]
pub struct Random(SplitMix64);

impl Random {
    /// Stream `stream` of `purpose` of `seed`.
    pub fn new(seed: u64, purpose: u64, stream: u64) -> Random {
        Random(SplitMix64::of_item(seed, (purpose << 32) | stream))
    }

    /// Uniform in `low..high`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0.uniform(low, high)
    }

    /// Logarithmically uniform in `low..high`, both above 0.
    pub fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0.log_uniform(low, high)
    }

    /// True with probability `share`.
    pub fn chance(&mut self, share: f64) -> bool {
        self.uniform(0.0, 1.0) < share
    }

    /// One of `values`.
    pub fn pick<T: Copy>(&mut self, values: &[T]) -> T {
        values[(self.0.next_u64() % values.len() as u64) as usize]
    }
}

/// A fibre anywhere in the ranges, often at their ends.
pub fn hair(random: &mut Random) -> HairParams {
    let eta = match random.pick(&[0, 1, 2, 3]) {
        0 => random.pick(&[ETA[0], 1.01, 1.2, 1.55, 2.0, ETA[1]]),
        1 => 1.0 + random.log_uniform(1.0001e-4, 2.0),
        2 => random.uniform(1.4, 1.7),
        _ => random.uniform(ETA[0], ETA[1]),
    };
    let sigma_a = |random: &mut Random| match random.pick(&[0, 1, 2, 3]) {
        0 => random.pick(&[0.0, 0.0, 5.0, SIGMA_A]),
        _ => random.log_uniform(1e-3, SIGMA_A),
    };
    let width = |random: &mut Random| match random.pick(&[0, 1, 2, 3]) {
        0 => random.pick(&BETA),
        _ => random.log_uniform(BETA[0], BETA[1]),
    };
    let shift = |random: &mut Random| match random.pick(&[0, 1, 2, 3]) {
        0 => random.pick(&[-SHIFT, 0.0, SHIFT]),
        _ => random.uniform(-SHIFT, SHIFT),
    };
    let caustic_width = if random.chance(0.2) {
        random.pick(&CAUSTIC_WIDTH)
    } else {
        random.log_uniform(CAUSTIC_WIDTH[0], CAUSTIC_WIDTH[1])
    };
    let eccentricity = match random.pick(&[0, 1, 2, 3]) {
        0 => random.pick(&[ECCENTRICITY[0], 0.8, 1.25, ECCENTRICITY[1]]),
        1 => random.log_uniform(ECCENTRICITY[0], ECCENTRICITY[1]),
        _ => 1.0,
    };
    // Rounded, so that f32 and f64 see the same fibre; the ends themselves may round outwards.
    HairParams {
        eta: single(eta).clamp(ETA[0], ETA[1]),
        sigma_a: [(); 3].map(|()| single(sigma_a(random))),
        shift: per_lobe(|| single(shift(random))),
        width: per_lobe(|| single(width(random))),
        caustic_width: single(caustic_width).clamp(CAUSTIC_WIDTH[0], CAUSTIC_WIDTH[1]),
        eccentricity: single(eccentricity),
        ..HairParams::default()
    }
}

/// Hair as it grows: the ranges of Marschner's Table 1 and somewhat beyond, circular.
pub fn ordinary_hair(random: &mut Random) -> HairParams {
    let degree = PI / 180.0;
    let shift = -random.uniform(2.0, 8.0) * degree;
    let width = random.uniform(4.0, 12.0) * degree * std::f64::consts::SQRT_2;
    HairParams {
        eta: single(random.uniform(1.3, 1.8)),
        sigma_a: [(); 3].map(|()| single(random.log_uniform(0.01, 5.0))),
        shift: PerLobe {
            r: single(shift),
            tt: single(-0.5 * shift),
            trt: single(-1.5 * shift),
        },
        width: PerLobe {
            r: single(width),
            tt: single(0.5 * width),
            trt: single(2.0 * width),
        },
        caustic_width: single(random.uniform(0.05, 0.4)),
        ..HairParams::default()
    }
}

/// Which fibres, lights and views are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// [`ordinary_hair`], lights of width 0.05 to 2 (or 10), within 78 degrees of the normal plane.
    Ordinary,
    /// Everything the parameters allow.
    Extreme,
}

impl Domain {
    /// The word in the names of checks.
    pub const fn name(self) -> &'static str {
        match self {
            Domain::Ordinary => "hair",
            Domain::Extreme => "extremes",
        }
    }

    /// A circular fibre.
    pub fn hair(self, random: &mut Random) -> HairParams {
        match self {
            Domain::Ordinary => ordinary_hair(random),
            Domain::Extreme => HairParams {
                eccentricity: 1.0,
                ..hair(random)
            },
        }
    }

    /// An inclination.
    pub fn theta(self, random: &mut Random) -> f64 {
        match self {
            Domain::Ordinary => inclination(random.uniform(-0.98, 0.98).asin()),
            Domain::Extreme => theta(random),
        }
    }

    /// A bandwidth, at least `least`.
    pub fn lambda(self, random: &mut Random, least: f64) -> f64 {
        match self {
            Domain::Ordinary => single(random.log_uniform(least.max(0.05), 2.0)),
            Domain::Extreme => single(random.log_uniform(least, LAMBDA[1])),
        }
    }
}

fn per_lobe(mut value: impl FnMut() -> f64) -> PerLobe<f64> {
    PerLobe {
        r: value(),
        tt: value(),
        trt: value(),
    }
}

/// theta_d at which the effective index of `eta` is `eta_eff`, if there is one.
pub fn theta_d_of(eta: f64, eta_eff: f64) -> Option<f64> {
    // eta_eff^2 = 1 + (eta^2 - 1) / cos^2
    let square = (eta * eta - 1.0) / (eta_eff * eta_eff - 1.0);
    (0.0..=1.0).contains(&square).then(|| square.sqrt().acos())
}

/// theta_d: grazing, at eta' = 2 +- 1e-6..1e-1, or anywhere.
pub fn theta_d(random: &mut Random, hair: &HairParams) -> f64 {
    let sign = random.pick(&[-1.0, 1.0]);
    let value = match random.pick(&[0, 1, 2, 3, 4]) {
        0 => {
            let gap = random.log_uniform(1e-6, 1e-1) * random.pick(&[-1.0, 1.0]);
            theta_d_of(hair.eta, 2.0 + gap).unwrap_or_else(|| random.uniform(0.0, 1.5))
        }
        1 => theta(random).abs(),
        _ => random.uniform(0.0, 1.55),
    };
    inclination(sign * value)
}

/// An inclination: at and near the poles, at 0, or anywhere.
pub fn theta(random: &mut Random) -> f64 {
    let sign = random.pick(&[-1.0, 1.0]);
    inclination(
        sign * match random.pick(&[0, 1, 2, 3, 4, 5]) {
            0 => random.pick(&[0.0, FRAC_PI_2]),
            1 => FRAC_PI_2 - random.log_uniform(1e-7, 0.3),
            2 => random.uniform(0.0, FRAC_PI_2),
            _ => random.uniform(0.0, 1.0).asin(),
        },
    )
}

/// An azimuth: at and near 0 and pi, or anywhere.
pub fn phi(random: &mut Random) -> f64 {
    single(match random.pick(&[0, 1, 2, 3, 4]) {
        0 => random.pick(&[0.0, -FRAC_PI_2, PI, -PI]),
        1 => random.pick(&[0.0, PI]) + random.log_uniform(1e-7, 0.3) * random.pick(&[-1.0, 1.0]),
        _ => random.uniform(-PI, PI),
    })
}

/// A bandwidth.
pub fn lambda(random: &mut Random) -> f64 {
    single(if random.chance(0.1) {
        random.pick(&LAMBDA)
    } else {
        random.log_uniform(LAMBDA[0], LAMBDA[1])
    })
}

/// An inner integral of `lobe` at an extreme place.
pub fn azimuthal(random: &mut Random, lobe: Lobe, hair: &HairParams) -> Point {
    let lambda_p = if random.chance(0.1) {
        LAMBDA_P_CONSTANT
    } else {
        lambda(random)
    };
    Point::Azimuthal {
        lobe,
        lambda_p,
        dphi: phi(random),
        theta_d: theta_d(random, hair),
    }
}

/// Single scattering of `lobe` at an extreme place, mostly one where M_t and light meet.
pub fn single_point(random: &mut Random, lobe: Lobe, hair: &HairParams) -> Point {
    let lambda = lambda(random);
    let (alpha, beta) = (hair.shift.get(lobe), hair.width.get(lobe));
    let reach = (lambda * lambda + 4.0 * beta * beta).sqrt();
    let mut theta_j = theta(random);
    let mut theta_o = theta(random);
    match random.pick(&[0, 1, 2, 3]) {
        0 => {}
        1 => {
            // theta_i near 2 alpha - theta_o at a chosen theta_d.
            let at = theta_d(random, hair);
            theta_j = inclination(alpha - at);
            theta_o = inclination(alpha + at);
        }
        _ => {
            let off = random.uniform(-2.0, 2.0) * reach;
            theta_o = inclination(2.0 * alpha - theta_j + off);
        }
    }
    Point::Single {
        lobe,
        light: Light {
            theta: theta_j,
            phi: phi(random),
            lambda,
        },
        theta_o,
        phi_o: phi(random),
    }
}

/// About `n` points a function (inner integral and single scattering of each mode) in groups.
pub fn extremes(seed: u64, purpose: u64, n: usize) -> Vec<Group> {
    let per_function = POINTS_PER_HAIR / 6;
    (0..n.div_ceil(per_function))
        .map(|stream| {
            let mut random = Random::new(seed, purpose, stream as u64);
            let hair = hair(&mut random);
            let mut points = Vec::with_capacity(POINTS_PER_HAIR);
            for lobe in Lobe::ALL {
                for _ in 0..per_function {
                    points.push(azimuthal(&mut random, lobe, &hair));
                    points.push(single_point(&mut random, lobe, &hair));
                }
            }
            Group { hair, points }
        })
        .collect()
}

/// Every combination of the ends (and a middle) of every range. The shift goes with the
/// width: all-different combinations would be too many to be worth their time.
pub fn corners() -> Vec<Group> {
    let mut groups = Vec::new();
    for eta in [ETA[0], 1.2, 1.55, ETA[1]] {
        for sigma_a in [[0.0, 0.3, 2.0], [SIGMA_A, 10.0, 5.0]] {
            for (width, shift) in [(BETA[0], -SHIFT), (0.17, 0.0), (BETA[1], SHIFT)] {
                for caustic_width in [CAUSTIC_WIDTH[0], 0.15, CAUSTIC_WIDTH[1]] {
                    for eccentricity in [ECCENTRICITY[0], 1.0, ECCENTRICITY[1]] {
                        let hair = HairParams {
                            eta,
                            sigma_a,
                            shift: per_lobe(|| shift),
                            width: per_lobe(|| width),
                            caustic_width,
                            eccentricity,
                            ..HairParams::default()
                        };
                        let points = corner_points(&hair);
                        groups.push(Group { hair, points });
                    }
                }
            }
        }
    }
    groups
}

fn corner_points(hair: &HairParams) -> Vec<Point> {
    let mut points = Vec::new();
    let near = FRAC_PI_2 - 1e-4;
    let thetas = [-FRAC_PI_2, -near, 0.0, 0.9, near, FRAC_PI_2].map(inclination);
    let mut inclinations = vec![0.0, 0.9, near, FRAC_PI_2];
    for gap in [-1e-6, 1e-6, -1e-3, 1e-3, 0.1] {
        inclinations.extend(theta_d_of(hair.eta, 2.0 + gap));
    }
    for lobe in Lobe::ALL {
        for lambda in [LAMBDA[0], 0.2, LAMBDA[1]].map(single) {
            for (theta_j, theta_o) in thetas.iter().flat_map(|&a| thetas.map(|b| (a, b))) {
                for dphi in [0.0, PI].map(single) {
                    let light = Light {
                        theta: theta_j,
                        phi: 0.0,
                        lambda,
                    };
                    points.push(Point::Single {
                        lobe,
                        light,
                        theta_o,
                        phi_o: dphi,
                    });
                }
            }
        }
        for lambda_p in [LAMBDA[0], 0.2, LAMBDA[1], LAMBDA_P_CONSTANT].map(single) {
            for &theta_d in &inclinations {
                for dphi in [0.0, 1.0, PI].map(single) {
                    points.push(Point::Azimuthal {
                        lobe,
                        lambda_p,
                        dphi,
                        theta_d: inclination(theta_d),
                    });
                }
            }
        }
    }
    points
}
