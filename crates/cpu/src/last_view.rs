//! The last picture as seen from elsewhere: what a screen shows until the view that was asked for has a picture of its own.
//!
//! Every pixel is moved by its depth, the mean over what it shows. What comes into view is not there yet: narrow
//! gaps are filled from about them, wider ones stay open.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scene::camera::{ViewUniform, screen_position};

/// Rows of the picture that are made at a time.
const BAND: usize = 32;

/// A pixel that lies deeper than the nearest one at its place by more than this share of the depths of the scene is hidden.
const HIDDEN: f32 = 0.04;

/// Where less than this share of a pixel has come, there is a gap.
const GAP: f32 = 0.25;

/// Widest gap along a row or a column that is filled, px.
const MAX_GAP: usize = 4;

/// A picture without what is behind it, and how deep it is.
pub(super) struct LastView {
    pub view: ViewUniform,
    /// rgb times the view's radiance scale, and coverage; row by row.
    pub rgba: Vec<[f32; 4]>,
    /// Along the line of sight, cm; anything where nothing is seen.
    pub depth: Vec<f32>,
}

/// Where a pixel is seen from elsewhere.
#[derive(Clone, Copy)]
struct Moved {
    /// px; outside of the picture where it is not seen.
    at: [f32; 2],
    /// cm
    depth: f32,
}

impl Moved {
    const NOWHERE: Moved = Moved {
        at: [f32::NEG_INFINITY; 2],
        depth: 0.0,
    };

    /// The four pixels about it, as column and row, and its share of each.
    fn shares(self) -> [([i32; 2], f32); 4] {
        let [x, y] = self.at.map(|at| at - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (fx, fy) = (x - left, y - top);
        let (left, top) = (left as i32, top as i32);
        [
            ([left, top], (1.0 - fx) * (1.0 - fy)),
            ([left + 1, top], fx * (1.0 - fy)),
            ([left, top + 1], (1.0 - fx) * fy),
            ([left + 1, top + 1], fx * fy),
        ]
    }
}

impl LastView {
    /// The picture as `view` sees it: of the same size, rgb times its radiance scale, and coverage.
    pub fn seen_from(&self, view: &ViewUniform) -> Vec<[f32; 4]> {
        let width = view.size[0] as usize;
        let scale = view.radiance_scale / self.view.radiance_scale;
        let mut moved = vec![Moved::NOWHERE; self.rgba.len()];
        // Of each row, where its pixels go: from row to row.
        let ranges: Vec<[f32; 2]> = moved
            .par_chunks_mut(width)
            .enumerate()
            .map(|(y, row)| self.move_row(view, y, row))
            .collect();
        let mut found = vec![[0.0; 4]; self.rgba.len()];
        let mut nearest = vec![f32::INFINITY; self.rgba.len()];
        found
            .par_chunks_mut(BAND * width)
            .zip(nearest.par_chunks_mut(BAND * width))
            .enumerate()
            .for_each(|(band, (found, nearest))| {
                let first = band * BAND;
                let end = first + found.len() / width;
                let rows = (0..ranges.len()).filter(|row| {
                    let [low, high] = ranges[*row];
                    high > first as f32 - 1.0 && low < end as f32 + 1.0
                });
                let pixels = rows.flat_map(|row| row * width..(row + 1) * width);
                let pixels: Vec<usize> = pixels
                    .filter(|ix| {
                        let [x, y] = moved[*ix].at;
                        x > -1.0
                            && x < width as f32 + 1.0
                            && y > first as f32 - 1.0
                            && y < end as f32 + 1.0
                    })
                    .collect();
                let place = |[x, y]: [i32; 2]| {
                    let is_in =
                        (0..width as i32).contains(&x) && (first as i32..end as i32).contains(&y);
                    is_in.then(|| x as usize + width * (y as usize - first))
                };
                for &ix in &pixels {
                    for (at, share) in moved[ix].shares() {
                        // Hardly anything of a pixel hides nothing.
                        if let Some(place) = place(at).filter(|_| share >= GAP) {
                            nearest[place] = nearest[place].min(moved[ix].depth);
                        }
                    }
                }
                let reach = HIDDEN * (view.far - view.near);
                let mut sums = vec![0.0; found.len()];
                for &ix in &pixels {
                    for (at, share) in moved[ix].shares() {
                        let Some(place) = place(at) else {
                            continue;
                        };
                        if moved[ix].depth <= nearest[place] + reach {
                            sums[place] += share;
                            for (sum, value) in found[place].iter_mut().zip(self.rgba[ix]) {
                                *sum += share * value;
                            }
                        }
                    }
                }
                for ((found, nearest), sum) in found.iter_mut().zip(nearest).zip(sums) {
                    let [r, g, b, coverage] = found.map(|value| value / sum.max(GAP));
                    *found = [scale * r, scale * g, scale * b, coverage.min(1.0)];
                    if sum < GAP {
                        *nearest = f32::INFINITY;
                    }
                }
            });
        fill(&mut found, &nearest, width);
        found
    }

    /// Moves the pixels of a row; the lowest and highest coordinate that they get.
    fn move_row(&self, view: &ViewUniform, y: usize, row: &mut [Moved]) -> [f32; 2] {
        let [width, height] = self.view.size.map(|n| n as f32);
        let [right, up, forward, eye] = [
            self.view.right,
            self.view.up,
            self.view.forward,
            self.view.eye,
        ]
        .map(Vec3::from);
        let per_px = 1.0 / self.view.focal_px;
        let of_row = forward + up * (per_px * (0.5 * height - y as f32 - 0.5));
        let mut range = [f32::INFINITY, f32::NEG_INFINITY];
        for (x, moved) in row.iter_mut().enumerate() {
            let ix = x + y * self.view.size[0] as usize;
            if self.rgba[ix][3] <= 0.0 {
                continue;
            }
            let ray = of_row + right * (per_px * (x as f32 + 0.5 - 0.5 * width));
            let [x, y, depth] = screen_position(view, eye + ray * self.depth[ix]);
            if depth > view.near && x.is_finite() && y.is_finite() {
                let at = [x, y];
                *moved = Moved { at, depth };
                range = [range[0].min(y), range[1].max(y)];
            }
        }
        range
    }
}

/// Fills narrow gaps, where `depth` is infinite, with what is on either side, the deeper of the two: it was hidden by the other.
fn fill(picture: &mut [[f32; 4]], depth: &[f32], width: usize) {
    let height = picture.len() / width.max(1);
    let is_seen = |ix: usize| depth[ix] < f32::INFINITY;
    let filled_by = |x: usize, y: usize| {
        let ix = x + width * y;
        let ways = [(1, x, width), (width, y, height)];
        ways.into_iter().find_map(|(step, at, n)| {
            let before = (1..=MAX_GAP.min(at)).find(|way| is_seen(ix - way * step))?;
            let most = (MAX_GAP + 1 - before).min(n - 1 - at);
            let after = (1..=most).find(|way| is_seen(ix + way * step))?;
            let (before, after) = (ix - before * step, ix + after * step);
            Some(match depth[before] > depth[after] {
                true => before,
                false => after,
            })
        })
    };
    let filled: Vec<(usize, usize)> = (0..height)
        .into_par_iter()
        .flat_map_iter(|y| {
            let gaps = (0..width).filter(move |x| !is_seen(x + width * y));
            gaps.filter_map(move |x| Some((x + width * y, filled_by(x, y)?)))
        })
        .collect();
    for (gap, by) in filled {
        picture[gap] = picture[by];
    }
}

#[cfg(test)]
mod tests {
    use strandlight_scene::camera::{Camera, view_uniform};
    use strandlight_scene::strands::Strands;

    use super::*;

    const SIZE: [u32; 2] = [80, 60];

    fn view(eye: Vec3) -> ViewUniform {
        let points = [[-3.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
        let strands = Strands::new(&points, &[0, 2], |_, _| 0.01, false).expect("valid");
        let camera = Camera {
            eye,
            target: Vec3::new(eye.x, eye.y, 0.0),
            up: Vec3::Y,
            fov_y: 0.5,
        };
        view_uniform(&camera, &strands, SIZE, 1.0)
    }

    /// A wall at z = 0 that is brighter to the right and covers all but the left quarter, and in front of it a red disk.
    fn last_view(eye: Vec3) -> LastView {
        let view = view(eye);
        let [width, height] = SIZE.map(|n| n as usize);
        let mut last = LastView {
            view,
            rgba: vec![[0.0; 4]; width * height],
            depth: vec![0.0; width * height],
        };
        for ix in 0..width * height {
            let (x, y) = ((ix % width) as f32, (ix / width) as f32);
            if (x - 50.0).hypot(y - 30.0) < 8.0 {
                (last.rgba[ix], last.depth[ix]) = ([1.0, 0.0, 0.0, 1.0], eye.z - 2.0);
            } else if x >= 20.0 {
                (last.rgba[ix], last.depth[ix]) = ([0.0, 0.0, 0.01 * x, 1.0], eye.z);
            }
        }
        last
    }

    #[test]
    fn from_where_it_was_it_is_what_it_was() {
        let last = last_view(Vec3::new(0.0, 0.0, 10.0));
        let found = last.seen_from(&last.view);
        for (found, expected) in found.as_flattened().iter().zip(last.rgba.as_flattened()) {
            // Pixels get their places back to 1e-5 px.
            assert!((found - expected).abs() < 1e-3, "{found} {expected}");
        }
    }

    #[test]
    fn pixels_move_by_their_depth() {
        let eye = Vec3::new(0.0, 0.0, 10.0);
        let last = last_view(eye);
        // To the left by ten pixels at the wall's depth, and so by 12.5 at the disk's.
        let aside = 10.0 * 10.0 / last.view.focal_px;
        let found = last.seen_from(&view(eye + Vec3::X * aside));
        let at = |x: usize, y: usize| found[x + y * SIZE[0] as usize];
        assert_eq!(at(9, 5), [0.0; 4]);
        for x in [11, 20, 60] {
            let [_, _, blue, coverage] = at(x, 5);
            assert!((blue - 0.01 * (x as f32 + 10.0)).abs() < 1e-3 && coverage > 0.999);
        }
        // The disk's middle, and the wall where the disk was not before it.
        assert!(at(37, 30)[0] > 0.999 && at(25, 30)[0] == 0.0);
        // What the disk hid of the wall is filled, by what is beside it.
        for x in [46, 47] {
            let [red, _, blue, coverage] = at(x, 30);
            assert!(red < 1e-3 && (blue - 0.58).abs() < 1e-3 && coverage > 0.999);
        }
    }

    #[test]
    fn behind_the_eye_and_without_a_place_nothing_is_seen() {
        let mut last = last_view(Vec3::new(0.0, 0.0, 10.0));
        last.depth.fill(f32::NAN);
        let found = last.seen_from(&last.view);
        assert!(found.iter().all(|pixel| *pixel == [0.0; 4]));
        last.depth.fill(1.0);
        let found = last.seen_from(&view(Vec3::new(0.0, 0.0, 1.0)));
        assert!(found.iter().all(|pixel| *pixel == [0.0; 4]));
    }
}
