//! Growing the layered style: hair with a side parting that lies on head and shoulders.
//!
//! As in [`growth`](super::growth) a strand marches along a field of directions, and strands draw
//! towards guides; here there are guides of two sizes, locks and the wisps within them, and what
//! the hair slides along is the [`bust`](super::bust).

use std::f32::consts::TAU;

use glam::Vec3;
use rayon::prelude::*;

use super::bust::{Field, distance, field, normal};
use super::noise::{Noise, Purpose};
use super::scalp::{HEAD_RADII, even_direction, smooth};
use super::shape::{Curl, displace, resample};

/// Steps a path is marched in before it is resampled.
const STEPS: usize = 110;
/// Locks of a head, and strands of a wisp.
const LOCKS: u32 = 300;
const STRANDS_PER_WISP: u32 = 14;
/// `unit.x` of the parting.
const PARTING: f32 = 0.30;
/// Lengths from the root, cm: of hair from the nape, and how much longer it is from the crown.
const LENGTH: f32 = 23.0;
const LONGER: f32 = 13.0;
/// Share of strands that stand out, and of short new ones at the hairline.
const FLYAWAYS: f32 = 0.035;
/// Thickness at the tip over that at the root.
const TIP: f32 = 0.3;

/// Where a strand starts.
#[derive(Clone, Copy)]
struct Root {
    position: Vec3,
    normal: Vec3,
    /// On the unit sphere.
    unit: Vec3,
    /// How far above the hairline, in units of `unit.y`.
    inside: f32,
}

/// Grows the strands of one groom.
pub struct Layered {
    noise: Noise,
    field: &'static Field,
    roots: Vec<Root>,
    /// Of each strand.
    lock_of: Vec<u32>,
    wisp_of: Vec<u32>,
    /// By lock and by wisp; the first roots are an even spread.
    lock_paths: Vec<Vec<Vec3>>,
    wisp_paths: Vec<Vec<Vec3>>,
}

/// Lowest `unit.y` at which hair grows, by how far `unit` faces forwards: 1 the face, -1 the nape.
fn hairline(unit: Vec3) -> f32 {
    /// Pairs of both, falling: forehead, temple, in front of the ear, over it, behind it, nape.
    const LINE: [(f32, f32); 8] = [
        (1.0, 0.56),
        (0.86, 0.58),
        (0.66, 0.42),
        (0.44, 0.02),
        (0.28, -0.06),
        (0.0, 0.16),
        (-0.5, -0.16),
        (-1.0, -0.46),
    ];
    let front = unit.z / unit.x.hypot(unit.z).max(1e-6);
    let after = LINE
        .iter()
        .position(|(at, _)| *at <= front)
        .unwrap_or(7)
        .max(1);
    let ((a, low), (b, high)) = (LINE[after], LINE[after - 1]);
    low + (high - low) * ((front - a) / (b - a)).clamp(0.0, 1.0)
}

impl Layered {
    pub fn new(strands: u32, noise: Noise) -> Self {
        let field = field();
        let n_wisps = (strands / STRANDS_PER_WISP).clamp(1, 6000);
        let n_locks = LOCKS.min(n_wisps);
        let mut layered = Layered {
            noise,
            field,
            roots: roots(strands, noise),
            lock_of: Vec::new(),
            wisp_of: Vec::new(),
            lock_paths: Vec::new(),
            wisp_paths: Vec::new(),
        };
        layered.lock_of = layered.nearest_of(n_locks);
        layered.wisp_of = layered.nearest_of(n_wisps);
        let lock_paths = (0..n_locks).into_par_iter();
        layered.lock_paths = lock_paths.map(|ix| layered.path(ix)).collect();
        layered.wisp_paths = (0..n_wisps)
            .into_par_iter()
            .map(|ix| {
                let mut path = layered.path(ix);
                layered.draw_to(
                    &mut path,
                    &layered.lock_paths[layered.lock_of[ix as usize] as usize],
                    0.8,
                    0.12,
                );
                path
            })
            .collect();
        layered
    }

    /// For every strand, which of the first `n` roots on its side of the parting is nearest.
    fn nearest_of(&self, n: u32) -> Vec<u32> {
        let guides = &self.roots[..n as usize];
        let nearest = |root: &Root| {
            let distance = |guide: &Root| {
                let apart = side(guide.unit) != side(root.unit);
                guide.position.distance_squared(root.position) + if apart { 1e3 } else { 0.0 }
            };
            let guides = (0..n).zip(guides);
            let best = guides.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
            best.map_or(0, |(ix, _)| ix)
        };
        self.roots.par_iter().map(nearest).collect()
    }

    /// Fills `points` with strand `ix`.
    pub fn grow(&self, ix: u32, points: &mut [[f32; 3]]) {
        let root = self.roots[ix as usize];
        let (lock, wisp) = (self.lock_of[ix as usize], self.wisp_of[ix as usize]);
        let flyaway = self.noise.unit(ix, Purpose::Flyaway, 0) < FLYAWAYS;
        let mut path = self.path(ix);
        if !flyaway {
            let strength = 0.86 + 0.12 * self.noise.unit(ix, Purpose::Clump, 0);
            self.draw_to(&mut path, &self.wisp_paths[wisp as usize], strength, 0.05);
        }
        let mut strand = vec![Vec3::ZERO; points.len()];
        resample(&path, &mut strand);
        let length: f32 = path.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        let spacing = length / (points.len() - 1) as f32;
        let signed = |of: u32, purpose, dimension| self.noise.signed(of, purpose, dimension);
        let curl = Curl {
            radius: 0.55
                * (1.0 + 0.6 * signed(lock, Purpose::Amplitude, 1))
                * smooth(4.0, 22.0, length),
            wavelength: 10.5
                * (1.0
                    + 0.22 * signed(lock, Purpose::Frequency, 1)
                    + 0.04 * signed(ix, Purpose::Frequency, 2)),
            flatness: 0.45,
            phase: self.shared_phase(root)
                + 0.10 * signed(lock, Purpose::Phase, 0)
                + 0.03 * signed(ix, Purpose::Phase, 1),
            from: 0.55,
        };
        // Wisps part from each other towards their tips, strands from their wisp a little, and
        // flyaways from everything.
        let [of_wisp, of_strand] = if flyaway { [0.4, 1.7] } else { [0.55, 0.16] };
        // Short hair has no room to wander.
        let room = smooth(2.0, 16.0, length);
        let frizz = room * (0.03 + 0.05 * self.noise.unit(ix, Purpose::Disc, 1));
        let plane = Vec3::Y
            .cross(root.normal)
            .try_normalize()
            .unwrap_or(Vec3::X);
        displace(&mut strand, spacing, plane, curl, |t| {
            [0, 1].map(|axis| {
                let crimp =
                    TAU * (self.noise.unit(ix, Purpose::Disc, 2 + axis) + 0.45 * length * t);
                t * room * of_wisp * self.noise.curve(wisp, Purpose::Wander, axis, t)
                    + t * room * of_strand * self.noise.curve(ix, Purpose::Wander, 2 + axis, t)
                    + frizz * smooth(0.1, 0.7, t) * crimp.sin()
            })
        });
        for (point, position) in points.iter_mut().zip(&strand) {
            *point = self.field.push_out(*position, 0.02).to_array();
        }
        points[0] = root.position.to_array();
    }

    /// Thickness along a strand over that at its root.
    pub fn taper(t: f32) -> f32 {
        1.0 - (1.0 - TIP) * t * t
    }

    /// Phase that neighbours share, so that waves run across the hair.
    fn shared_phase(&self, root: Root) -> f32 {
        (0..3).fold(0.0, |sum, ix| {
            let axis = self.noise.vector(u32::MAX - ix, Purpose::Phase);
            let offset = TAU * self.noise.unit(u32::MAX - ix, Purpose::Phase, 3);
            sum + 0.28 * (2.5 * root.unit.dot(axis) + offset).sin()
        })
    }

    /// Blends a path towards a guide, not at all at the root and by `strength` at the tip.
    fn draw_to(&self, path: &mut [Vec3], guide: &[Vec3], strength: f32, from: f32) {
        let last = (path.len() - 1) as f32;
        for (ix, (point, guide)) in path.iter_mut().zip(guide).enumerate() {
            *point = point.lerp(*guide, strength * smooth(from, 0.95, ix as f32 / last));
        }
    }

    /// The course of strand `ix` by itself: `STEPS + 1` points.
    fn path(&self, ix: u32) -> Vec<Vec3> {
        let root = self.roots[ix as usize];
        let lock = self.lock_of.get(ix as usize).copied().unwrap_or(ix);
        let jitter = self.noise.vector(ix, Purpose::Direction);
        let height = smooth(-0.5, 1.0, root.unit.y);
        // New hair at the hairline is short and soft.
        let new = 0.12
            + 0.88
                * smooth(
                    0.0,
                    0.07,
                    root.inside + 0.02 * self.noise.signed(ix, Purpose::Length, 3),
                );
        let length = new
            * (LENGTH + LONGER * height)
            * (1.0 + 0.10 * self.noise.signed(lock, Purpose::Length, 0))
            * (1.0 - 0.22 * self.noise.unit(ix, Purpose::Length, 1).powi(2));
        // Hair from higher up lies over hair from lower down.
        let shell =
            (0.25 + 1.5 * height) * (0.5 + 0.5 * self.noise.unit(ix, Purpose::Shell, 0)) * new;
        let comb = comb(root);
        let step = length / STEPS as f32;
        let mut direction = (0.75 * root.normal + comb + 0.12 * jitter).normalize();
        let mut point = root.position;
        let mut path = Vec::with_capacity(STEPS + 1);
        path.push(point);
        for n in 0..STEPS {
            let along = n as f32 * step;
            let (distance, out) = self.field.look_up(point).unwrap_or((100.0, Vec3::Y));
            // Combed on the head, falling below its widest place.
            let on_head = smooth(-3.0, 7.0, point.y);
            let lifted = distance - shell;
            let mut wish = 1.05 * on_head * comb + Vec3::NEG_Y
                - 0.8 * on_head * smooth(0.0, 1.5, lifted) * out;
            // Ends turn in a little; on the shoulders hair slides forwards or back.
            let inwards = Vec3::new(-point.x, 0.0, -point.z - 3.0) / HEAD_RADII.x;
            wish += 0.16 * smooth(0.55, 1.0, n as f32 / STEPS as f32) * inwards;
            if distance < 1.5 {
                wish = wish.reject_from_normalized(out)
                    + 0.12 * Vec3::new(0.0, 0.0, side_of_shoulder(root));
            }
            let turn = 1.0 - 0.68_f32.powf(1.5 * step);
            direction = direction
                .lerp(wish.normalize_or(direction), turn)
                .normalize();
            let layer = shell * smooth(0.0, 4.5, along);
            let next = self
                .field
                .push_out(point + direction * step, layer.max(0.03));
            direction = (next - point).try_normalize().unwrap_or(direction);
            point = next;
            path.push(point);
        }
        path
    }
}

/// Is it on the side to which most hair is combed?
fn side(unit: Vec3) -> bool {
    unit.x < PARTING - 0.5 * smooth(0.1, -0.7, unit.z) * PARTING
}

/// Where hair goes that comes to lie on a shoulder.
fn side_of_shoulder(root: Root) -> f32 {
    if root.unit.z > 0.25 { 1.0 } else { -0.6 }
}

/// Direction in which the hair is combed at `root`, along the scalp: away from the parting and
/// back.
fn comb(root: Root) -> Vec3 {
    let away = if side(root.unit) { -1.0 } else { 1.0 };
    let parted = smooth(-0.45, 0.05, root.unit.z);
    let sideways = parted * away + (1.0 - parted) * 0.9 * root.unit.x;
    let back = -0.30 - 0.75 * smooth(0.25, 0.9, root.unit.z);
    Vec3::new(sideways, 0.0, back)
        .reject_from_normalized(root.normal)
        .try_normalize()
        .unwrap_or(Vec3::NEG_Y)
}

/// `count` roots, evenly spread over the scalp for any prefix.
fn roots(count: u32, noise: Noise) -> Vec<Root> {
    let spacing = (5.0 / count as f32).sqrt();
    let mut found = Vec::with_capacity(count as usize);
    let mut ix = 0_u32;
    while found.len() < count as usize {
        let even = even_direction(ix);
        let jitter = [0, 1, 2].map(|axis| noise.signed(ix, Purpose::RootU, axis));
        let unit = (even + 0.35 * spacing * Vec3::from(jitter)).normalize();
        let inside = unit.y - hairline(unit) + 0.025 * noise.signed(ix, Purpose::RootV, 0);
        // Sparser at the hairline.
        let dense = 0.25 + 0.75 * smooth(0.0, 0.06, inside);
        let grows = inside > 0.0 && noise.unit(ix, Purpose::RootV, 1) < dense;
        ix += 1;
        if grows {
            found.push((unit, inside));
        }
    }
    let root = |(unit, inside): (Vec3, f32)| {
        let (position, normal) = on_scalp(unit * HEAD_RADII);
        Root {
            position,
            normal,
            unit,
            inside,
        }
    };
    found.into_par_iter().map(root).collect()
}

/// The place of the surface nearest to `point`, about, and its normal.
fn on_scalp(point: Vec3) -> (Vec3, Vec3) {
    let mut point = point;
    // The distance is too long far from the surface, so not all of it at once.
    for _ in 0..8 {
        point -= 0.8 * distance(point) * normal(point);
    }
    (point, normal(point))
}
