//! The gamuts of ACES 2, hue by hue, and the compression of colours from what AP1 reaches into what
//! the display shows.

use glam::{DVec3, FloatExt};

use super::appearance::{Appearance, C_Z, GREY_J, J_WHITE, Jmh, degrees, hue_at};
use super::bisection::bisected;

/// How wide the boundaries below and above the cusp are blended, as a share of the cusp's M.
const BLEND: f64 = 0.12;

/// By how much the cusp is moved out, since the blend cuts it off.
const CUSP_GAIN: f64 = 1.0 + 0.27 * BLEND;

/// How flat the lines of compression are.
const FOCUS_DISTANCE: f64 = 1.35;

/// Share of M at the boundary that is left alone, at least.
const THRESHOLD: f64 = 0.75;

/// Exponent of the boundary below the cusp.
const LOWER_GAMMA: f64 = 1.14;

/// Exponents of the boundary above the cusp are within these.
const UPPER_GAMMAS: [f64; 2] = [0.4, 5.0];

/// The gamuts at a hue.
#[derive(Clone, Copy, Debug)]
pub struct HueGamut {
    /// Largest M in AP1 at the lightness of white.
    pub reach_m: f64,
    /// J and M of the display's most colourful colour.
    cusp_j: f64,
    cusp_m: f64,
    /// 1 / exponent of the display's boundary above the cusp.
    upper_gamma_inv: f64,
}

/// A line of compression, `J = j_axis + slope M`.
struct Line {
    j_axis: f64,
    slope: f64,
}

impl HueGamut {
    /// J of the line along which J stays as it is.
    fn focus_j(&self) -> f64 {
        self.cusp_j
            .lerp(GREY_J, (1.3 - self.cusp_j / J_WHITE).min(1.0))
    }

    /// By what slopes are divided for colours of this J: lines get flatter towards white.
    fn gain(&self, j: f64) -> f64 {
        let flat_from = self.cusp_j.lerp(J_WHITE, 0.3);
        let gain = J_WHITE * FOCUS_DISTANCE;
        if j <= flat_from {
            return gain;
        }
        let decades = ((J_WHITE - flat_from) / (J_WHITE - j).max(1e-4)).log10();
        gain * (1.0 + decades * decades)
    }

    /// The line through (`j`, `m`). Its slope is
    /// `(j_axis - focus_j) / (focus_j gain)` times `j_axis`, or times `J_WHITE - j_axis` for colours lighter
    /// than the focus, which makes `j_axis` the root of a quadratic equation.
    fn line(&self, j: f64, m: f64, gain: f64) -> Line {
        let focus = self.focus_j();
        let m = m / gain;
        let a = m / focus;
        let j_axis = if j < focus {
            let b = 1.0 - m;
            2.0 * j / (b + (b * b + 4.0 * a * j).sqrt())
        } else {
            let b = 1.0 + m + J_WHITE * a;
            let c = J_WHITE * m + j;
            2.0 * c / (b + (b * b - 4.0 * a * c).sqrt())
        };
        let factor = if j_axis < focus {
            j_axis
        } else {
            J_WHITE - j_axis
        };
        Line {
            j_axis,
            slope: factor * (j_axis - focus) / (focus * gain),
        }
    }

    /// M at which `line` leaves the display's gamut; `through_cusp` is `j_axis` of the line through
    /// the cusp.
    fn boundary(&self, line: &Line, through_cusp: f64) -> f64 {
        let lower = crossing(
            line,
            1.0 / LOWER_GAMMA,
            [self.cusp_j, self.cusp_m],
            through_cusp,
        );
        let from_white = Line {
            j_axis: J_WHITE - line.j_axis,
            slope: -line.slope,
        };
        let upper = crossing(
            &from_white,
            self.upper_gamma_inv,
            [J_WHITE - self.cusp_j, self.cusp_m],
            J_WHITE - through_cusp,
        );
        // A smooth minimum.
        let width = BLEND * self.cusp_m;
        let near = (1.0 - (lower - upper).abs() / width).max(0.0);
        lower.min(upper) - near.powi(3) * width / 6.0
    }

    /// `color`, of this hue, where the display can show it or nearly: along its line, M in AP1 is
    /// compressed to M in the display's gamut.
    pub fn compressed(&self, color: Jmh) -> Jmh {
        let Jmh { j, m, hue } = color;
        if m <= 0.0 || j > J_WHITE {
            return Jmh { m: 0.0, ..color };
        }
        let gain = self.gain(j);
        let line = self.line(j, m, gain);
        let through_cusp = self.line(self.cusp_j, self.cusp_m, gain).j_axis;
        let boundary = self.boundary(&line, through_cusp);
        if boundary <= 0.0 {
            return Jmh { m: 0.0, ..color };
        }
        let reach = crossing(&line, 1.0 / C_Z, [J_WHITE, self.reach_m], J_WHITE);
        let m = compressed_m(m, boundary, reach);
        Jmh {
            j: line.j_axis + m * line.slope,
            m,
            hue,
        }
    }
}

/// M at which a line meets the curve `J = corner_j (M / corner_m)^gamma`, about: where it would meet the
/// straight line to the corner, if it began at the `j_axis` that is as much of `reference` on that line
/// as on the curve. Right for the line that begins at `reference`, where that meets the corner.
fn crossing(line: &Line, gamma_inv: f64, [corner_j, corner_m]: [f64; 2], reference: f64) -> f64 {
    let moved = reference * (line.j_axis / reference).powf(gamma_inv);
    moved * corner_m / (corner_j - line.slope * corner_m)
}

/// M after a compression by Reinhard's curve that takes `reach` to `boundary` and leaves small M
/// alone.
pub fn compressed_m(m: f64, boundary: f64, reach: f64) -> f64 {
    let share = (boundary / reach).max(THRESHOLD);
    let from = share * boundary;
    if m <= from || share >= 1.0 {
        return m;
    }
    let (above, to, reach) = (m - from, boundary - from, reach - from);
    let scale = reach / (reach / to - 1.0);
    from + scale * above / (scale + above)
}

/// [`HueGamut`]s by hue.
pub struct Gamut {
    /// Behind their hues, 0 to 360 degrees: every degree, and where the display's gamut has corners.
    hues: Vec<(f64, HueGamut)>,
}

impl Gamut {
    pub fn new(scene: &Appearance, display: &Appearance) -> Gamut {
        let corners = corners(display);
        let mut angles: Vec<f64> = (0..=360).map(f64::from).collect();
        angles.extend(corners.map(|(angle, _)| angle));
        angles.sort_by(f64::total_cmp);
        let at = |angle: f64| {
            let (cusp_j, cusp_m) = cusp(display, &corners, angle);
            let mut gamut = HueGamut {
                reach_m: reach_m(scene, angle),
                cusp_j,
                cusp_m: cusp_m * CUSP_GAIN,
                upper_gamma_inv: 1.0,
            };
            gamut.upper_gamma_inv = 1.0 / upper_gamma(display, gamut, angle);
            (angle, gamut)
        };
        Gamut {
            hues: angles.into_iter().map(at).collect(),
        }
    }

    /// At an angle, 0..=360 degrees.
    pub fn at(&self, angle: f64) -> HueGamut {
        let above = self.hues.partition_point(|(it, _)| *it <= angle);
        let above = above.clamp(1, self.hues.len() - 1);
        let [(low, a), (high, b)] = [self.hues[above - 1], self.hues[above]];
        let t = (angle - low) / (high - low);
        HueGamut {
            reach_m: a.reach_m.lerp(b.reach_m, t),
            cusp_j: a.cusp_j.lerp(b.cusp_j, t),
            cusp_m: a.cusp_m.lerp(b.cusp_m, t),
            upper_gamma_inv: a.upper_gamma_inv.lerp(b.upper_gamma_inv, t),
        }
    }
}

/// Red, yellow, green, cyan, blue and magenta with their angles.
fn corners(display: &Appearance) -> [(f64, DVec3); 6] {
    [
        [1, 0, 0],
        [1, 1, 0],
        [0, 1, 0],
        [0, 1, 1],
        [0, 0, 1],
        [1, 0, 1],
    ]
    .map(|rgb| {
        let rgb = DVec3::from(rgb.map(f64::from));
        (degrees(display.look(rgb).1.hue), rgb)
    })
}

/// J and M of the most colourful colour of a hue: on an edge of the display's cube that touches
/// neither black nor white.
fn cusp(display: &Appearance, corners: &[(f64, DVec3); 6], angle: f64) -> (f64, f64) {
    let turned = |to: f64, from: f64| (to - from).rem_euclid(360.0);
    let edges = (0..6).map(|ix| (corners[ix], corners[(ix + 1) % 6]));
    let edge = edges
        .into_iter()
        .find(|((from, _), (to, _))| turned(angle, *from) < turned(*to, *from));
    let ((first, from), (_, to)) = edge.expect("hues go around once");
    let wanted = turned(angle, first);
    let share = bisected(0.0, 1.0, 1e-7, |share| {
        let hue = display.look(from.lerp(to, share)).1.hue;
        // Next to the first corner, the angle may lie before it.
        let passed = turned(degrees(hue), first);
        passed < 270.0 && passed > wanted
    });
    let look = display.look(from.lerp(to, share)).1;
    (look.j, look.m)
}

/// M at which colours as light as white leave AP1: a channel falls below 0.
fn reach_m(scene: &Appearance, angle: f64) -> f64 {
    let hue = hue_at(angle);
    bisected(0.0, 1300.0, 1e-2, |m| {
        let rgb = scene.rgb(Jmh { j: J_WHITE, m, hue });
        rgb.min_element() < 0.0
    })
}

/// The smallest exponent with which the boundary above the cusp is outside of the display's gamut
/// on each of five lines.
fn upper_gamma(display: &Appearance, gamut: HueGamut, angle: f64) -> f64 {
    let hue = hue_at(angle);
    let lines = [0.01, 0.1, 0.5, 0.8, 0.99].map(|share| {
        let j = gamut.cusp_j.lerp(J_WHITE, share);
        let gain = gamut.gain(j);
        let through_cusp = gamut.line(gamut.cusp_j, gamut.cusp_m, gain).j_axis;
        (gamut.line(j, gamut.cusp_m, gain), through_cusp)
    });
    let is_outside = |gamma: f64| {
        let tried = HueGamut {
            upper_gamma_inv: 1.0 / gamma,
            ..gamut
        };
        lines.iter().all(|(line, through_cusp)| {
            let m = tried.boundary(line, *through_cusp);
            let j = line.j_axis + line.slope * m;
            display.rgb(Jmh { j, m, hue }).max_element() > 1.0
        })
    };
    bisected(UPPER_GAMMAS[0], UPPER_GAMMAS[1], 1e-5, is_outside)
}
