//! The points that a picture shows.

use strandlight_scene::strands::Strands;

use super::list::VisibilityList;

/// Both ends of every segment in a visibility list: what has to be lit and shaded.
#[derive(Clone, Debug, Default)]
pub(super) struct VisiblePoints {
    /// Indices of [`Strands::points`], growing.
    pub points: Vec<u32>,
}

impl VisiblePoints {
    /// Those of `list`, whose entries then have the place of their first point among these; that of
    /// the second is the next.
    pub fn number(list: &mut VisibilityList, strands: &Strands) -> VisiblePoints {
        let mut is_visible = vec![false; strands.points.len()];
        for entry in list.tiles.iter().flat_map(|tile| &tile.entries) {
            is_visible[entry.first as usize] = true;
            is_visible[entry.first as usize + 1] = true;
        }
        let mut points = Vec::new();
        let mut places = vec![0_u32; strands.points.len()];
        for (point, _) in is_visible.iter().enumerate().filter(|(_, is)| **is) {
            places[point] = points.len() as u32;
            points.push(point as u32);
        }
        for entry in list.tiles.iter_mut().flat_map(|tile| &mut tile.entries) {
            entry.first = places[entry.first as usize];
        }
        VisiblePoints { points }
    }
}
