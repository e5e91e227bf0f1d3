//! The points that a picture shows.

use strandlight_scene::strands::Strands;

use super::list::VisibilityList;

/// Share of all weight that the points which are shaded first have.
const FIRST_SHARE: f64 = 0.99;

/// Both ends of every segment in a visibility list: what has to be lit and shaded.
#[derive(Clone, Debug, Default)]
pub(super) struct VisiblePoints {
    /// Indices of [`Strands::points`], growing.
    pub points: Vec<u32>,
    /// Places in `points`: first, growing, those that make up nearly all of the picture; then the rest.
    pub order: Vec<u32>,
    /// How many of `order` are the first.
    pub n_first: usize,
}

impl VisiblePoints {
    /// Those of `list`, whose entries then have the place of their first point among these; that of
    /// the second is the next.
    pub fn number(list: &mut VisibilityList, strands: &Strands) -> VisiblePoints {
        let mut weights = vec![-1.0_f32; strands.points.len()];
        for entry in list.tiles.iter().flat_map(|tile| &tile.entries) {
            let (first, t) = (entry.first as usize, entry.t());
            for (point, share) in [(first, 1.0 - t), (first + 1, t)] {
                weights[point] = weights[point].max(0.0) + share * entry.weight;
            }
        }
        let mut points = Vec::new();
        let mut places = vec![0_u32; strands.points.len()];
        for (point, _) in weights.iter().enumerate().filter(|(_, w)| **w >= 0.0) {
            places[point] = points.len() as u32;
            points.push(point as u32);
        }
        for entry in list.tiles.iter_mut().flat_map(|tile| &mut tile.entries) {
            entry.first = places[entry.first as usize];
        }
        let weight_of = |place: &u32| weights[points[*place as usize] as usize];
        let all = 0..points.len() as u32;
        let least = least_of_first(all.clone().map(|place| weight_of(&place)).collect());
        let (mut order, rest): (Vec<u32>, Vec<u32>) =
            all.partition(|place| weight_of(place) >= least);
        let n_first = order.len();
        order.extend(rest);
        VisiblePoints {
            points,
            order,
            n_first,
        }
    }

    /// Gives the points that are not among the first what those before them have.
    pub fn fill<T: Copy>(&self, radiance: &mut [T]) {
        let mut last = match self.order.first() {
            Some(&first) if self.n_first > 0 && !radiance.is_empty() => radiance[first as usize],
            _ => return,
        };
        let mut first = self.order[..self.n_first].iter().peekable();
        for (place, radiance) in (0..).zip(radiance) {
            if first.next_if_eq(&&place).is_some() {
                last = *radiance;
            } else {
                *radiance = last;
            }
        }
    }
}

/// The least weight of those that add up to [`FIRST_SHARE`] of all.
fn least_of_first(mut weights: Vec<f32>) -> f32 {
    weights.sort_unstable_by(|a, b| b.total_cmp(a));
    let all: f64 = weights.iter().map(|w| f64::from(*w)).sum();
    let mut sum = 0.0;
    for weight in weights {
        sum += f64::from(weight);
        if sum >= FIRST_SHARE * all {
            return weight;
        }
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_have_nearly_all_of_the_weight() {
        let least = least_of_first(vec![0.5, 0.001, 0.3, 0.195, 0.002, 0.002]);
        assert_eq!(least, 0.195);
        assert_eq!(least_of_first(Vec::new()), 0.0);
    }

    #[test]
    fn the_rest_have_what_their_neighbours_have() {
        let visible = VisiblePoints {
            points: vec![0, 1, 5, 7, 8],
            order: vec![1, 3, 0, 2, 4],
            n_first: 2,
        };
        let mut radiance = [0.0, 1.0, 0.0, 3.0, 0.0].map(|x| [x; 4]);
        visible.fill(&mut radiance);
        assert_eq!(radiance.map(|x| x[0]), [1.0, 1.0, 1.0, 3.0, 3.0]);
    }
}
