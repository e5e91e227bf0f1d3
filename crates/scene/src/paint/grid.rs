//! Points sorted into the cells of a uniform grid.

use glam::{UVec3, Vec3};

/// Cells along the longest side: some ten points a cell of a groom of half a million.
const CELLS: f32 = 64.0;

/// A grid around points, which it knows by their index.
#[derive(Clone, Debug, Default)]
pub(super) struct PointGrid {
    low: Vec3,
    /// Side of a cell, > 0.
    side: f32,
    dims: UVec3,
    /// First entry of each cell in `order`, and the end.
    starts: Vec<u32>,
    /// Indices of points, cell by cell, each cell in ascending order.
    order: Vec<u32>,
}

impl PointGrid {
    /// A grid of `points` (x, y, z and anything).
    pub fn new(points: &[[f32; 4]]) -> PointGrid {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for point in points {
            low = low.min(Vec3::from_slice(point));
            high = high.max(Vec3::from_slice(point));
        }
        if points.is_empty() {
            return PointGrid::default();
        }
        let side = ((high - low).max_element() / CELLS).max(1e-6);
        let dims = ((high - low) / side).as_uvec3() + 1;
        let mut grid = PointGrid {
            low,
            side,
            dims,
            starts: vec![0; (dims.x * dims.y * dims.z) as usize + 1],
            order: vec![0; points.len()],
        };
        // A counting sort: how many a cell, where each starts, then each point to its place.
        let cells: Vec<u32> = points
            .iter()
            .map(|point| grid.cell(grid.place(Vec3::from_slice(point))) as u32)
            .collect();
        for &cell in &cells {
            grid.starts[cell as usize + 1] += 1;
        }
        for cell in 1..grid.starts.len() {
            grid.starts[cell] += grid.starts[cell - 1];
        }
        let mut next = grid.starts.clone();
        for (ix, &cell) in cells.iter().enumerate() {
            let at = &mut next[cell as usize];
            grid.order[*at as usize] = ix as u32;
            *at += 1;
        }
        grid
    }

    /// The cell that holds `position`, or the nearest one.
    fn place(&self, position: Vec3) -> UVec3 {
        // A cast of a number below zero, or of none, is 0.
        ((position - self.low) / self.side)
            .as_uvec3()
            .min(self.dims - 1)
    }

    fn cell(&self, place: UVec3) -> usize {
        (place.x + self.dims.x * (place.y + self.dims.y * place.z)) as usize
    }

    fn points_of(&self, cell: usize) -> &[u32] {
        &self.order[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Points in cells that the ball of `radius` around `centre` touches, and perhaps others.
    pub fn near(&self, centre: Vec3, radius: f32, mut see: impl FnMut(u32)) {
        if self.order.is_empty() {
            return;
        }
        let first = self.place(centre - radius);
        let last = self.place(centre + radius);
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    let cell = self.cell(UVec3::new(x, y, z));
                    self.points_of(cell).iter().for_each(|&ix| see(ix));
                }
            }
        }
    }

    /// Points within `margin` of the cone from `apex` along the unit vector `axis` that is `slope`
    /// wide at distance 1, and perhaps others near it. Looks at few cells beside these: slab by
    /// slab across the axis that the cone runs along most.
    pub fn in_cone(
        &self,
        [apex, axis]: [Vec3; 2],
        slope: f32,
        margin: f32,
        mut see: impl FnMut(u32),
    ) {
        let size = axis.abs();
        let (major, length) = match size.max_element() {
            most if size.x >= most => (0, size.x),
            most if size.y >= most => (1, size.y),
            most => (2, most),
        };
        // Wider than it is long: no picture is taken so.
        let slope = slope.min(0.5 * length);
        let minors = [(major + 1) % 3, (major + 2) % 3];
        let dims = self.dims.to_array();
        for slab in 0..dims[major] {
            let near = self.low[major] + slab as f32 * self.side - apex[major];
            let [near, far] = match axis[major] < 0.0 {
                true => [-near - self.side, -near],
                false => [near, near + self.side],
            };
            // How far along the cone a point of the slab is at most, and how far off the axis.
            let most = (far + margin) / (length - slope);
            let off = slope * most.max(0.0) + margin;
            let along = [(near - off) / length, (far + off) / length];
            if along[1] < -margin {
                continue;
            }
            let mut first = [0; 3];
            let mut last = [0; 3];
            (first[major], last[major]) = (slab, slab);
            let mut is_there = true;
            for minor in minors {
                let at = along.map(|t| apex[minor] + t * axis[minor] - self.low[minor]);
                let low = (at[0].min(at[1]) - off) / self.side;
                let high = (at[0].max(at[1]) + off) / self.side;
                is_there &= high >= 0.0 && low <= dims[minor] as f32;
                // A cast of a number below zero, or of none, is 0.
                first[minor] = (low as u32).min(dims[minor] - 1);
                last[minor] = (high as u32).min(dims[minor] - 1);
            }
            if !is_there {
                continue;
            }
            for z in first[2]..=last[2] {
                for y in first[1]..=last[1] {
                    for x in first[0]..=last[0] {
                        let cell = self.cell(UVec3::new(x, y, z));
                        self.points_of(cell).iter().for_each(|&ix| see(ix));
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> Vec<[f32; 4]> {
        let place = |t: f32| [(0.7 * t).sin() * 9.0, (1.3 * t).cos() * 3.0, 0.002 * t, 0.0];
        (0..4000).map(|ix| place(ix as f32)).collect()
    }

    #[test]
    fn every_point_near_is_seen_once() {
        let points = points();
        let grid = PointGrid::new(&points);
        for centre in [Vec3::ZERO, Vec3::new(8.0, -2.0, 4.0), Vec3::splat(40.0)] {
            let mut seen = vec![0; points.len()];
            grid.near(centre, 2.5, |ix| seen[ix as usize] += 1);
            for (point, &seen) in points.iter().zip(&seen) {
                let is_near = Vec3::from_slice(point).distance(centre) <= 2.5;
                assert!(seen <= 1 && (seen == 1 || !is_near));
            }
        }
    }

    #[test]
    fn every_point_in_a_cone_is_seen_once() {
        let points = points();
        let grid = PointGrid::new(&points);
        let mut inside = 0;
        for (apex, axis) in [
            ([0.0, 0.0, 50.0], [0.1, 0.0, -1.0]),
            ([40.0, 3.0, 2.0], [-1.0, -0.1, 0.05]),
            ([-2.0, -30.0, 4.0], [0.1, 1.0, 0.02]),
            // From within, and past everything.
            ([1.0, 0.5, 4.0], [0.7, 0.6, 0.5]),
            ([20.0, 20.0, 20.0], [1.0, 0.0, 0.0]),
        ] {
            let (apex, axis) = (Vec3::from(apex), Vec3::from(axis).normalize());
            for (slope, margin) in [(0.02, 0.0), (0.01, 0.7), (0.2, 0.1)] {
                let mut seen = vec![0; points.len()];
                grid.in_cone([apex, axis], slope, margin, |ix| seen[ix as usize] += 1);
                for (point, &seen) in points.iter().zip(&seen) {
                    let from = Vec3::from_slice(point) - apex;
                    let along = from.dot(axis);
                    let across = (from - along * axis).length();
                    let is_inside = along >= 0.0 && across <= slope * along + margin;
                    assert!(seen <= 1 && (seen == 1 || !is_inside), "{apex} {axis}");
                    inside += usize::from(is_inside);
                }
            }
        }
        assert!(inside > 100, "{inside}");
    }

    #[test]
    fn one_point_and_none_are_grids() {
        PointGrid::new(&[]).near(Vec3::ZERO, 1.0, |_| unreachable!());
        let mut seen = 0;
        PointGrid::new(&[[1.0, 2.0, 3.0, 0.0]]).near(Vec3::ZERO, 9.0, |_| seen += 1);
        assert_eq!(seen, 1);
    }
}
