//! Locks: strands whose roots lie together.

use std::collections::HashMap;

use glam::{IVec3, Vec3};
use strandlight_formats::Groom;

use super::random::{Purpose, hash, root, uniform};

/// Roots in space: each lock has a centre, strewn one to a cell of the locks' size, and the roots that
/// lie nearest to it (Worley 1996). So a root's lock depends on its own place alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Locks {
    seed: u32,
    size_cm: f32,
}

/// A lock, named by its cell.
pub(super) type Cell = [i32; 3];

impl Locks {
    pub fn new(seed: u32, size_cm: f64) -> Locks {
        Locks {
            seed,
            size_cm: size_cm as f32,
        }
    }

    /// The random number of a lock.
    pub fn key(&self, cell: Cell) -> u32 {
        let [x, y, z] = cell.map(|x| x as u32);
        hash(&[self.seed, 0x10c0, x, y, z])
    }

    /// Centre of a lock, in cells.
    fn centre(&self, cell: IVec3) -> Vec3 {
        let key = self.key(cell.to_array());
        let within = |ix| uniform(key, Purpose::LockPlace, ix) as f32;
        cell.as_vec3() + Vec3::new(within(0), within(1), within(2))
    }

    /// The lock of a root, and the square of its distance from the centre in cells.
    pub fn of(&self, root: Vec3) -> (Cell, f32) {
        let place = root / self.size_cm;
        let own = place.floor().as_ivec3();
        let (mut nearest, mut least) = (own, f32::INFINITY);
        for ix in 0..27 {
            let offset = IVec3::new(ix % 3 - 1, ix / 3 % 3 - 1, ix / 9 - 1);
            let cell = own.wrapping_add(offset);
            let square = self.centre(cell).distance_squared(place);
            if square < least {
                (nearest, least) = (cell, square);
            }
        }
        (nearest.to_array(), least)
    }

    /// For each strand of `groom` the one in the middle of its lock: that with the root nearest to the
    /// centre, the first of some that are equally near.
    pub fn middle_strands(&self, groom: &Groom) -> Vec<u32> {
        let n_strands = groom.n_strands() as u32;
        let lock = |strand| match root(groom, strand) {
            Some(root) => self.of(root),
            None => ([i32::MAX; 3], 0.0),
        };
        let locks: Vec<(Cell, f32)> = (0..groom.n_strands()).map(lock).collect();
        let mut middle: HashMap<Cell, (f32, u32)> = HashMap::new();
        for (strand, &(cell, square)) in (0..n_strands).zip(&locks) {
            let own = (square, strand);
            let best = middle.entry(cell).or_insert(own);
            if own.0 < best.0 {
                *best = own;
            }
        }
        locks.iter().map(|(cell, _)| middle[cell].1).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Strands of two points that stand on a square of 20 cm.
    fn stubble(side: usize) -> Groom {
        let place = |ix: usize| 20.0 * ix as f32 / side as f32;
        let roots = (0..side * side).map(|ix| [place(ix % side), 0.0, place(ix / side)]);
        let points = roots.flat_map(|root| [root, [root[0], 1.0, root[2]]]);
        Groom {
            points: points.collect(),
            strand_offsets: (0..=side * side).map(|ix| 2 * ix as u32).collect(),
            ..Groom::default()
        }
    }

    #[test]
    fn locks_have_their_size_and_do_not_depend_on_the_order() {
        let groom = stubble(100);
        for size in [1.0, 2.5] {
            let locks = Locks::new(5, size);
            let middle = locks.middle_strands(&groom);
            let mut distinct = middle.clone();
            distinct.sort_unstable();
            distinct.dedup();
            // A plane cuts more of the locks of space than one for each square of their size.
            let per_square = distinct.len() as f64 * size * size / 400.0;
            assert!((0.9..2.0).contains(&per_square), "{size}: {per_square}");
            // A middle strand is that of its own lock, and not far from the others.
            for (strand, &of_lock) in middle.iter().enumerate() {
                assert_eq!(middle[of_lock as usize], of_lock);
                let root = |strand: usize| Vec3::from(groom.points[2 * strand]);
                let distance = root(strand).distance(root(of_lock as usize));
                assert!(f64::from(distance) < 3.0 * size, "{distance}");
            }
            let mut reversed = groom.clone();
            reversed.points = groom.points.chunks(2).rev().flatten().copied().collect();
            let again = locks.middle_strands(&reversed);
            let last = middle.len() - 1;
            for (strand, &of_lock) in middle.iter().enumerate() {
                assert_eq!(again[last - strand] as usize, last - of_lock as usize);
            }
            assert_ne!(Locks::new(6, size).middle_strands(&groom), middle);
        }
    }
}
