//! Edges of the ribbons on the screen. Twin of `shaders/pass/project.wgsl`.

use rayon::prelude::*;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::strands::Strands;

use super::screen_point::{ScreenPoint, edges_at, screen_point};

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

/// Projects every point, for ribbons at least `least_width` px wide.
pub(super) fn project(view: &ViewUniform, strands: &Strands, least_width: f32) -> Vec<Projected> {
    strands
        .points
        .par_iter()
        .zip(&strands.tangents)
        .map(|(point, tangent)| project_point(&screen_point(view, point, tangent, least_width)))
        .collect()
}

fn project_point(point: &ScreenPoint) -> Projected {
    if point.coverage < 0.0 {
        return Projected {
            coverage: point.coverage,
            ..Projected::default()
        };
    }
    Projected {
        edges: edges_at(point),
        depth: point.depth,
        coverage: point.coverage,
    }
}
