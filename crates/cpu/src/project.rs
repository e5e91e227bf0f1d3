//! Edges of the ribbons on the screen. Twin of `shaders/pass/project.wgsl`.

use rayon::prelude::*;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::strands::Strands;

use super::screen_point::{ScreenPoint, screen_point};

/// A point of a strand on the screen.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Projected {
    /// Left edge x, y, right edge x, y in 1/256 px.
    pub edges: [i32; 4],
    /// 0..1 between the near and far planes.
    pub depth: f32,
    /// Coverage of the ribbon; below zero: not drawn.
    pub coverage: f32,
}

/// Largest screen coordinate in 1/256 px; f32 holds it exactly.
const MAX_SCREEN: f32 = 8_388_608.0;

/// Projects every point.
pub(super) fn project(view: &ViewUniform, strands: &Strands) -> Vec<Projected> {
    strands
        .points
        .par_iter()
        .zip(&strands.tangents)
        .map(|(point, tangent)| project_point(view, point, tangent))
        .collect()
}

fn project_point(view: &ViewUniform, point: &[f32; 4], tangent: &[f32; 4]) -> Projected {
    let ScreenPoint {
        at: [x, y],
        along,
        half_width: half,
        depth,
        coverage,
        ..
    } = screen_point(view, point, tangent);
    if coverage < 0.0 {
        return Projected {
            coverage,
            ..Projected::default()
        };
    }
    let across = [-along[1], along[0]];
    let snap = |x: f32| (x * 256.0).round_ties_even().clamp(-MAX_SCREEN, MAX_SCREEN) as i32;
    Projected {
        edges: [
            snap(x + half * across[0]),
            snap(y + half * across[1]),
            snap(x - half * across[0]),
            snap(y - half * across[1]),
        ],
        depth,
        coverage,
    }
}
