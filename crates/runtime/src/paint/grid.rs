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

    /// Points of cells whose ball, `margin` larger than the cell, meets the cone from `apex` along
    /// the unit vector `axis` that is `slope` wide at distance 1.
    pub fn in_cone(
        &self,
        [apex, axis]: [Vec3; 2],
        slope: f32,
        margin: f32,
        mut see: impl FnMut(u32),
    ) {
        let radius = 0.5 * 3f32.sqrt() * self.side + margin;
        for cell in 0..self.starts.len().saturating_sub(1) {
            let points = self.points_of(cell);
            if points.is_empty() {
                continue;
            }
            let row = cell as u32;
            let place = UVec3::new(
                row % self.dims.x,
                row / self.dims.x % self.dims.y,
                row / (self.dims.x * self.dims.y),
            );
            let centre = self.low + (place.as_vec3() + 0.5) * self.side;
            let from = centre - apex;
            let along = from.dot(axis);
            let across = (from - along * axis).length();
            // The cone is as wide as the far side of the ball has it.
            if along > -radius && across <= slope * (along + radius) + radius {
                points.iter().for_each(|&ix| see(ix));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_near_is_seen_once() {
        let points: Vec<[f32; 4]> = (0..4000)
            .map(|ix| {
                let t = ix as f32;
                [(0.7 * t).sin() * 9.0, (1.3 * t).cos() * 3.0, 0.002 * t, 0.0]
            })
            .collect();
        let grid = PointGrid::new(&points);
        for centre in [Vec3::ZERO, Vec3::new(8.0, -2.0, 4.0), Vec3::splat(40.0)] {
            let mut seen = vec![0; points.len()];
            grid.near(centre, 2.5, |ix| seen[ix as usize] += 1);
            for (point, &seen) in points.iter().zip(&seen) {
                let is_near = Vec3::from_slice(point).distance(centre) <= 2.5;
                assert!(seen <= 1 && (seen == 1 || !is_near));
            }
        }
        let (apex, axis) = (Vec3::new(0.0, 0.0, 50.0), Vec3::new(0.1, 0.0, -1.0));
        let (axis, slope) = (axis.normalize(), 0.02);
        let mut seen = vec![0; points.len()];
        grid.in_cone([apex, axis], slope, 0.0, |ix| seen[ix as usize] += 1);
        let mut inside = 0;
        for (point, &seen) in points.iter().zip(&seen) {
            let from = Vec3::from_slice(point) - apex;
            let along = from.dot(axis);
            let is_inside = (from - along * axis).length() <= slope * along;
            assert!(seen <= 1 && (seen == 1 || !is_inside));
            inside += usize::from(is_inside);
        }
        assert!(inside > 10, "{inside}");
    }

    #[test]
    fn one_point_and_none_are_grids() {
        PointGrid::new(&[]).near(Vec3::ZERO, 1.0, |_| unreachable!());
        let mut seen = 0;
        PointGrid::new(&[[1.0, 2.0, 3.0, 0.0]]).near(Vec3::ZERO, 9.0, |_| seen += 1);
        assert_eq!(seen, 1);
    }
}
