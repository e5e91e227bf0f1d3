//! Growing one strand: the direction fields of the styles, clumps, curls.

use std::f32::consts::TAU;

use glam::Vec3;

use super::noise::{Noise, Purpose};
use super::scalp::{HEAD_RADII, Root, push_out, roots, smooth};
use super::shape::{Curl, displace, resample};
use super::spec::{GrowSpec, Style};

/// Steps a path is marched in before it is resampled.
const STEPS: usize = 96;
/// Strands that share a clump, on average.
const STRANDS_PER_CLUMP: u32 = 45;
/// Where the ponytail is tied.
const TIE: Vec3 = Vec3::new(0.0, 4.5, -11.2);
/// `unit.x` of the parting, a little to one side.
const PARTING: f32 = 0.06;
/// Height at which the bob ends, and the fringe, cm.
const BOB_HEIGHT: f32 = -9.0;
const FRINGE_HEIGHT: f32 = 3.2;

/// Numbers that make a style.
#[derive(Clone, Copy)]
pub struct Habit {
    /// Mean length, cm.
    length: f32,
    /// Largest relative deviation of a clump's length, and of a strand's within its clump.
    length_noise: [f32; 2],
    /// Radius, wavelength (cm) and flatness of the curl; see [`Curl`].
    curl: [f32; 3],
    curl_from: f32,
    /// Largest difference of a clump's phase from its neighbours', in turns, and relative
    /// deviation of its wavelength.
    phase_noise: f32,
    wavelength_noise: f32,
    /// How far strands are drawn to their clump's guide at the tip, 0..=1.
    clump: f32,
    /// Free wander of a strand at the tip, cm.
    wander: f32,
    /// Thickness of the layer of hair on the crown, cm.
    volume: f32,
    /// Part of a strand's direction that is resampled from the field each cm.
    turn: f32,
}

impl Habit {
    /// That of `style`; the layered one grows by [`layered`](super::layered).
    pub fn of(style: Style) -> Option<Habit> {
        Some(match style {
            Style::Straight => Habit {
                length: 40.0,
                length_noise: [0.08, 0.05],
                curl: [0.06, 14.0, 0.6],
                curl_from: 0.7,
                phase_noise: 0.5,
                wavelength_noise: 0.20,
                clump: 0.55,
                wander: 0.35,
                volume: 1.3,
                turn: 0.30,
            },
            Style::Wavy => Habit {
                length: 38.0,
                length_noise: [0.12, 0.08],
                curl: [0.8, 9.0, 0.4],
                curl_from: 0.45,
                phase_noise: 0.16,
                wavelength_noise: 0.10,
                clump: 0.72,
                wander: 0.5,
                volume: 1.8,
                turn: 0.26,
            },
            Style::Curly => Habit {
                length: 32.0,
                length_noise: [0.2, 0.1],
                curl: [0.85, 3.0, 0.9],
                curl_from: 0.25,
                phase_noise: 0.5,
                wavelength_noise: 0.25,
                clump: 0.82,
                wander: 0.9,
                volume: 2.6,
                turn: 0.17,
            },
            Style::Ponytail => Habit {
                length: 34.0,
                length_noise: [0.12, 0.08],
                curl: [0.25, 13.0, 0.5],
                curl_from: 0.8,
                phase_noise: 0.15,
                wavelength_noise: 0.10,
                clump: 0.35,
                wander: 0.3,
                volume: 0.5,
                turn: 0.3,
            },
            Style::Bob => Habit {
                length: 26.0,
                length_noise: [0.0, 0.015],
                curl: [0.05, 12.0, 0.6],
                curl_from: 0.7,
                phase_noise: 0.5,
                wavelength_noise: 0.20,
                clump: 0.45,
                wander: 0.2,
                volume: 1.5,
                turn: 0.32,
            },
            Style::Layered => return None,
        })
    }
}

/// Grows the strands of one groom.
pub struct Grower {
    style: Style,
    habit: Habit,
    noise: Noise,
    roots: Vec<Root>,
    n_clumps: u32,
    clump_paths: Vec<Vec<Vec3>>,
}

impl Grower {
    pub fn new(spec: &GrowSpec, habit: Habit) -> Self {
        let noise = Noise::new(spec.seed);
        let roots = roots(spec.strands, noise);
        let n_clumps = (spec.strands / STRANDS_PER_CLUMP).clamp(1, 4000);
        let mut grower = Grower {
            style: spec.style,
            habit,
            noise,
            roots,
            n_clumps,
            clump_paths: Vec::new(),
        };
        // The roots are a low-discrepancy sequence: its start is an even spread of clumps.
        grower.clump_paths = (0..n_clumps).map(|ix| grower.path(ix, ix)).collect();
        grower
    }

    /// Fills `points` with strand `strand_ix`.
    pub fn grow(&self, strand_ix: u32, points: &mut [[f32; 3]]) {
        let habit = &self.habit;
        let root = self.roots[strand_ix as usize];
        let clump_ix = self.clump_of(root);
        let flyaway = self.noise.unit(strand_ix, Purpose::Flyaway, 0) < 0.025;

        let mut path = self.path(strand_ix, clump_ix);
        if !flyaway {
            self.draw_to_clump(&mut path, &self.clump_paths[clump_ix as usize], strand_ix);
        }

        let mut strand = vec![Vec3::ZERO; points.len()];
        resample(&path, &mut strand);
        let length: f32 = path.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        let spacing = length / (points.len() - 1) as f32;
        let loose = if flyaway { 2.2 } else { 1.0 };
        let of_clump = |purpose, spread: f32| {
            1.0 + spread * self.noise.signed(clump_ix, purpose, 1)
                + 0.3 * spread * self.noise.signed(strand_ix, purpose, 2)
        };
        let curl = Curl {
            radius: habit.curl[0] * of_clump(Purpose::Amplitude, 0.45),
            wavelength: habit.curl[1] * of_clump(Purpose::Frequency, habit.wavelength_noise),
            flatness: habit.curl[2],
            phase: self.coherent_phase(root)
                + habit.phase_noise * self.noise.signed(clump_ix, Purpose::Phase, 0)
                + 0.06 * self.noise.signed(strand_ix, Purpose::Phase, 1),
            from: habit.curl_from,
        };
        displace(&mut strand, spacing, self.wave_plane(clump_ix), curl, |t| {
            let size = loose * habit.wander * t;
            [0, 1].map(|axis| size * self.noise.curve(strand_ix, Purpose::Wander, axis, t))
        });
        for (point, position) in points.iter_mut().zip(&strand) {
            // Curls must not dip into the head.
            *point = push_out(*position, 0.0).to_array();
        }
        points[0] = root.position.to_array();
    }

    /// The clump whose own root is nearest, on the same side of the parting and of the fringe's
    /// edge if there is one: elsewhere the hair falls another way round the head.
    fn clump_of(&self, root: Root) -> u32 {
        let mut best = (f32::INFINITY, 0);
        for ix in 0..self.n_clumps {
            let other = self.roots[ix as usize];
            let together = (root.unit.x > PARTING) == (other.unit.x > PARTING)
                && self.in_fringe(root) == self.in_fringe(other);
            let apart = if together { 0.0 } else { 1e3 };
            let distance = apart + other.position.distance_squared(root.position);
            if distance < best.0 {
                best = (distance, ix);
            }
        }
        best.1
    }

    /// Phase that neighbours share, so that waves run across the hair: a smooth random function
    /// on the scalp.
    fn coherent_phase(&self, root: Root) -> f32 {
        (0..3).fold(0.0, |sum, ix| {
            let axis = self.noise.vector(u32::MAX - ix, Purpose::Phase);
            let offset = TAU * self.noise.unit(u32::MAX - ix, Purpose::Phase, 3);
            sum + 0.3 * (3.0 * root.unit.dot(axis) + offset).sin()
        })
    }

    /// Direction across the strands of a clump in which their waves swing, alike for all of them.
    fn wave_plane(&self, clump_ix: u32) -> Vec3 {
        let root = self.roots[clump_ix as usize];
        let sideways = Vec3::Y
            .cross(root.normal)
            .try_normalize()
            .unwrap_or(Vec3::X);
        let angle = 0.9 * self.noise.signed(clump_ix, Purpose::Phase, 2);
        sideways * angle.cos() + root.normal * angle.sin()
    }

    /// Blends a path towards its clump's guide, not at all at the root and most at the tip.
    fn draw_to_clump(&self, path: &mut [Vec3], guide: &[Vec3], strand_ix: u32) {
        let strength =
            self.habit.clump * (0.75 + 0.25 * self.noise.unit(strand_ix, Purpose::Clump, 0));
        let last = (path.len() - 1) as f32;
        for (ix, (point, guide)) in path.iter_mut().zip(guide).enumerate() {
            let t = ix as f32 / last;
            *point = point.lerp(*guide, strength * smooth(0.02, 0.7, t));
        }
    }

    /// The course of a strand without curls: `STEPS + 1` points.
    fn path(&self, strand_ix: u32, clump_ix: u32) -> Vec<Vec3> {
        let habit = &self.habit;
        let length = habit.length
            * (1.0 + habit.length_noise[0] * self.noise.signed(clump_ix, Purpose::Length, 0))
            * (1.0 + habit.length_noise[1] * self.noise.signed(strand_ix, Purpose::Length, 1));
        match self.style {
            Style::Ponytail => self.tied_path(strand_ix, length),
            _ => self.free_path(strand_ix, length),
        }
    }

    /// Marches along the direction field of a hanging style.
    fn free_path(&self, strand_ix: u32, length: f32) -> Vec<Vec3> {
        let habit = &self.habit;
        let root = self.roots[strand_ix as usize];
        let jitter = self.noise.vector(strand_ix, Purpose::Direction);
        // Hair from higher up lies over hair from lower down.
        let over = 0.15 + 0.85 * smooth(-0.5, 1.0, root.unit.y);
        let shell =
            habit.volume * over * (0.55 + 0.45 * self.noise.unit(strand_ix, Purpose::Shell, 0));
        let fringe = self.in_fringe(root);
        let end_height = if fringe {
            Some(FRINGE_HEIGHT)
        } else {
            (self.style == Style::Bob).then_some(BOB_HEIGHT)
        };
        let end_height = end_height
            .map(|height| height + 0.35 * self.noise.signed(strand_ix, Purpose::Length, 2));

        let step = length / STEPS as f32;
        let comb = self.comb(root, fringe);
        // A fringe lies close to the forehead.
        let (combed, shell) = if fringe {
            (0.1, 0.35 * shell)
        } else {
            (0.9, shell)
        };
        let mut direction = (root.normal + 0.6 * comb + 0.18 * jitter).normalize();
        let mut point = root.position;
        let mut path = Vec::with_capacity(STEPS + 1);
        path.push(point);
        for ix in 0..STEPS {
            let t = ix as f32 / STEPS as f32;
            let height = point.y / HEAD_RADII.y;
            // Combed while on the head, falling below.
            let on_head = smooth(-0.2, 0.7, height);
            // Lifted hair sinks back onto the head under what lies over it.
            let outward = (point / (HEAD_RADII * HEAD_RADII)).normalize();
            let lifted = (point / (HEAD_RADII + Vec3::splat(shell))).length() - 1.0;
            let sink = on_head * smooth(0.0, 0.25, lifted);
            let mut field = combed * on_head * comb + Vec3::new(0.0, -1.0, 0.0) - sink * outward;
            if self.style == Style::Bob {
                let inwards = Vec3::new(-point.x, 0.0, -point.z) / HEAD_RADII.x;
                field += 0.55 * smooth(-2.0, BOB_HEIGHT, point.y) * inwards;
            } else {
                // Long hair spreads a little over the shoulders.
                let outwards = Vec3::new(point.x, 0.0, 0.6 * point.z) / HEAD_RADII.x;
                field += 0.07 * smooth(0.3, 1.0, t) * outwards;
            }
            let turn = 1.0 - (1.0 - habit.turn).powf(step * 1.6);
            direction = direction.lerp(field.normalize(), turn).normalize();
            // The layer swells from the scalp within the first centimetres.
            let layer = shell * smooth(0.0, 5.0, ix as f32 * step);
            let next = push_out(point + direction * step, layer);
            direction = (next - point).try_normalize().unwrap_or(direction);
            let below = end_height.is_some_and(|end| next.y < end);
            point = next;
            path.push(point);
            if below {
                break;
            }
        }
        // Cut strands are as finely sampled as whole ones, so that clumps match point by point.
        if path.len() != STEPS + 1 {
            let mut whole = vec![Vec3::ZERO; STEPS + 1];
            resample(&path, &mut whole);
            return whole;
        }
        path
    }

    fn in_fringe(&self, root: Root) -> bool {
        self.style == Style::Bob && root.unit.z > 0.35 && root.unit.x.abs() < 0.42
    }

    /// Direction in which the hair is combed at `root`, along the scalp: away from the parting
    /// and back; a fringe forwards.
    fn comb(&self, root: Root, fringe: bool) -> Vec3 {
        let side = smooth(-0.04, 0.04, root.unit.x - PARTING) * 2.0 - 1.0;
        // The parting ends at the crown; behind it the hair radiates from there.
        let parted = smooth(-0.35, 0.1, root.unit.z);
        let sideways = parted * side + (1.0 - parted) * 0.8 * root.unit.x;
        let wish = if fringe {
            Vec3::new(0.25 * side, 0.0, 1.0)
        } else {
            Vec3::new(sideways, 0.0, -0.35 - 0.5 * smooth(0.0, 0.8, root.unit.z))
        };
        wish.reject_from_normalized(root.normal)
            .try_normalize()
            .unwrap_or(Vec3::NEG_Y)
    }

    /// Along the head to the tie, then hanging from it.
    fn tied_path(&self, strand_ix: u32, length: f32) -> Vec<Vec3> {
        let root = self.roots[strand_ix as usize];
        let shell =
            self.habit.volume * (0.35 + 0.65 * self.noise.unit(strand_ix, Purpose::Shell, 0));
        // Place in the bundle: keeps its order from the scalp, so strands do not cross at the tie.
        let angle = root.unit.x.atan2(root.unit.y - 0.3);
        let radius = self.noise.unit(strand_ix, Purpose::Disc, 0).sqrt();
        let disc = [radius * angle.sin(), radius * angle.cos()];
        let tie_unit = (TIE / HEAD_RADII).normalize();

        let mut path = Vec::new();
        for ix in 0..=STEPS / 3 {
            let t = ix as f32 / (STEPS / 3) as f32;
            let unit = slerp(root.unit, tie_unit, t);
            let lift = shell * smooth(0.0, 0.3, t);
            let on_head = unit * (HEAD_RADII + Vec3::splat(lift));
            let at_tie = TIE + 0.75 * Vec3::new(disc[0], disc[1], 0.0);
            path.push(on_head.lerp(at_tie, smooth(0.72, 1.0, t)));
        }
        let scalp_length: f32 = path.windows(2).map(|pair| pair[0].distance(pair[1])).sum();

        // The tail: thrown backwards, bent down by its weight, swelling and tapering again.
        let tail_length = (length + 8.0 - 0.4 * scalp_length).max(12.0);
        let n_tail = STEPS - path.len() + 1;
        let step = tail_length / n_tail as f32;
        let mut axis = TIE;
        let mut direction = Vec3::new(0.0, 0.12, -1.0).normalize();
        for ix in 1..=n_tail {
            let s = ix as f32 * step;
            let t = s / (self.habit.length + 8.0);
            direction = direction
                .lerp(Vec3::NEG_Y, 1.0 - 0.72_f32.powf(step))
                .normalize();
            axis += direction * step;
            let swell = 0.75 + 2.3 * smooth(0.0, 0.4, t) - 1.9 * smooth(0.45, 1.1, t);
            let across = Vec3::X;
            let other = direction.cross(across);
            path.push(axis + swell * (across * disc[0] - other * disc[1]));
        }
        path
    }
}

/// Along the great circle from unit vector `a` to unit vector `b`.
fn slerp(a: Vec3, b: Vec3, t: f32) -> Vec3 {
    let angle = a.dot(b).clamp(-1.0, 1.0).acos();
    let sin = angle.sin();
    if sin < 1e-4 {
        return a.lerp(b, t).try_normalize().unwrap_or(a);
    }
    (a * ((1.0 - t) * angle).sin() + b * (t * angle).sin()) / sin
}
