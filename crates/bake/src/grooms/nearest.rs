//! The nearest of many points.

use glam::Vec3;

/// A k-d tree: the middle of each range splits it, along the axes in turn.
pub struct Nearest {
    nodes: Vec<(Vec3, u32)>,
}

impl Nearest {
    /// A tree over `points`, at most 2^32 of them.
    pub fn new(points: &[Vec3]) -> Self {
        let mut nodes: Vec<(Vec3, u32)> = points.iter().copied().zip(0..).collect();
        split(&mut nodes, 0);
        Nearest { nodes }
    }

    /// The `k` points nearest to `at`, or all if there are fewer: squared distance and index, near to
    /// far; of points at one distance the one of the lower index first.
    pub fn find(&self, at: Vec3, k: usize) -> Vec<(f32, u32)> {
        let mut found = Vec::with_capacity(k + 1);
        if k > 0 {
            search(&self.nodes, 0, at, k, &mut found);
        }
        found
    }
}

fn split(nodes: &mut [(Vec3, u32)], axis: usize) {
    let middle = nodes.len() / 2;
    if nodes.len() < 2 {
        return;
    }
    nodes.select_nth_unstable_by(middle, |(a, a_ix), (b, b_ix)| {
        a[axis].total_cmp(&b[axis]).then(a_ix.cmp(b_ix))
    });
    let (below, above) = nodes.split_at_mut(middle);
    split(below, (axis + 1) % 3);
    split(&mut above[1..], (axis + 1) % 3);
}

fn search(nodes: &[(Vec3, u32)], axis: usize, at: Vec3, k: usize, found: &mut Vec<(f32, u32)>) {
    let middle = nodes.len() / 2;
    let Some(&(point, ix)) = nodes.get(middle) else {
        return;
    };
    let candidate = (point.distance_squared(at), ix);
    let is_before =
        |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).is_lt();
    let place = found.partition_point(|other| is_before(other, &candidate));
    found.insert(place, candidate);
    found.truncate(k);
    let offset = at[axis] - point[axis];
    let (near, far) = match offset < 0.0 {
        true => (&nodes[..middle], &nodes[middle + 1..]),
        false => (&nodes[middle + 1..], &nodes[..middle]),
    };
    search(near, (axis + 1) % 3, at, k, found);
    let is_full = found.len() == k;
    if !is_full || found[k - 1].0 >= offset * offset {
        search(far, (axis + 1) % 3, at, k, found);
    }
}

#[cfg(test)]
mod tests {
    use super::super::noise::{Noise, Purpose};
    use super::*;

    #[test]
    fn the_nearest_are_those_of_a_search_of_all() {
        let noise = Noise::new(1);
        let mut points: Vec<Vec3> = (0..300).map(|ix| noise.vector(ix, Purpose::Disc)).collect();
        points.extend_from_within(..20);
        let tree = Nearest::new(&points);
        for ix in 0..50 {
            let at = 1.5 * noise.vector(ix, Purpose::Wander);
            let mut all: Vec<(f32, u32)> = points
                .iter()
                .map(|point| point.distance_squared(at))
                .zip(0..)
                .collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for k in [0, 1, 7, 400] {
                let n = k.min(all.len());
                assert_eq!(tree.find(at, k), all[..n]);
            }
        }
        assert_eq!(Nearest::new(&[]).find(Vec3::ZERO, 3), []);
    }
}
