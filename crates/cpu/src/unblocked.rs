//! What of shadow maps is lit at visible points, and so the shares of the lights that reach them straight.
//!
//! The maps are those of [`super::shadow_map`]; but each is one thread's own, every point is projected
//! once, and runs of segments that are above nothing that is looked up are not drawn. Strands side by side are drawn one after the
//! other, on fine maps block after block, and texels side by side lie together, so that most of the memory that is touched is in a
//! cache.

mod map;
mod strips;

use std::cmp::Reverse;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use rayon::prelude::*;
use strandlight_scene::beside::{self, Beside};
use strandlight_scene::progress::Deadline;
use strandlight_scene::shadow_maps::{N_PLACES, NO_SLOT, ShadowView};
use strandlight_scene::strands::Strands;

use map::{Found, Work};
pub(super) use strips::StripOrder;
use strips::Strips;

/// Maps at work at a time have at most this many bytes together, or there is one.
const MAX_MAP_BYTES: usize = 256 << 20;

/// How long maps are worked on at a time.
const STEP: Duration = Duration::from_millis(3);

/// Bytes that a map at work needs for each point of the hair, about.
const BYTES_PER_POINT: usize = 13;

/// Answers of maps at visible points, or at all points.
#[derive(Clone, Debug, Default)]
pub(super) struct Unblocked {
    /// `[map][point]`: which of [`N_PLACES`] about the point are lit, a bit each from the root on.
    lit: Vec<Vec<u8>>,
    /// By slot, the maps of a light.
    maps_of: Vec<Range<usize>>,
    is_everywhere: bool,
    /// Texels of strands drawn into all maps.
    pub n_texels: u64,
}

/// A visible point.
#[derive(Clone, Copy, Debug)]
pub(super) struct VisiblePoint {
    /// Its place among the visible points.
    pub place: usize,
    /// Its index in [`Strands::points`].
    pub point: usize,
}

impl Unblocked {
    /// Do they serve any view?
    pub fn is_everywhere(&self) -> bool {
        self.is_everywhere
    }

    /// Bytes of the answers of `n_maps` maps at `n_points` points.
    pub fn bytes_of(n_maps: usize, n_points: usize) -> usize {
        n_maps * n_points
    }

    /// The share of a slot at a visible point, 0..=1.
    pub fn share(&self, slot: u32, at: VisiblePoint) -> f32 {
        let Range { start, end } = self.maps_of[slot as usize];
        self.share_of(start as u32..end as u32, at)
    }

    /// The share that some maps, at least one, have lit about a visible point, 0..=1.
    #[inline(always)]
    pub fn share_of(&self, maps: impl ExactSizeIterator<Item = u32>, at: VisiblePoint) -> f32 {
        let n_places = N_PLACES as usize * maps.len();
        let n_lit: u32 = maps.map(|map| self.answer(map, at).count_ones()).sum();
        n_lit as f32 / n_places as f32
    }

    /// The answer of every map at a visible point, 0..=1; 0 of those that are not drawn yet.
    pub fn answers(&self, at: VisiblePoint) -> impl Iterator<Item = f32> {
        let ix = self.index(at);
        let maps = self.lit.iter();
        maps.map(move |lit| {
            let n_lit = lit.get(ix).map_or(0, |lit| lit.count_ones());
            n_lit as f32 * (1.0 / N_PLACES as f32)
        })
    }

    /// Which places about a visible point a map has lit, a bit each from the root on.
    #[inline(always)]
    pub fn answer(&self, map: u32, at: VisiblePoint) -> u8 {
        self.lit[map as usize][self.index(at)]
    }

    fn index(&self, at: VisiblePoint) -> usize {
        if self.is_everywhere {
            at.point
        } else {
            at.place
        }
    }

    /// Bytes of the answers.
    pub fn bytes(&self) -> u64 {
        self.lit.iter().map(|lit| lit.len() as u64).sum()
    }
}

/// Answers that are being found, a few maps at a time.
pub(super) struct Casting {
    views: Vec<ShadowView>,
    /// By view: does a first picture need it?
    are_first: Vec<bool>,
    /// Views in the order in which they are taken up: fine ones first, so that no thread ends long after the others, then those that a
    /// first picture needs.
    order: Vec<u32>,
    /// Of them, how many are taken up.
    n_taken: usize,
    /// By view.
    is_done: Vec<bool>,
    n_done: usize,
    strips: Strips,
    /// Of [`Strips::seen`], once they were asked for.
    places: Option<beside::Places>,
    /// Maps at work, and what those to come are made in.
    works: Vec<Work>,
    found: Unblocked,
}

impl Casting {
    /// Of the maps of `views`, those of a slot one after the other, of which `are_first` are found first, at `visible` points of strands in this order; at
    /// all points where there are none given.
    pub fn new(
        (views, are_first): (Vec<ShadowView>, Vec<bool>),
        (strands, strip_order): (&Strands, &Arc<StripOrder>),
        visible: Option<&[u32]>,
    ) -> Casting {
        let mut maps_of = Vec::new();
        for (ix, view) in views.iter().enumerate() {
            if view.shadow_index != NO_SLOT {
                let slot = view.shadow_index as usize;
                maps_of.resize(maps_of.len().max(slot + 1), ix..ix);
                maps_of[slot].end = ix + 1;
            }
        }
        let all: Vec<u32>;
        let looked_up = match visible {
            Some(visible) => visible,
            None => {
                all = (0..strands.points.len() as u32).collect();
                &all
            }
        };
        let n_views = views.len();
        let mut order: Vec<u32> = (0..n_views as u32).collect();
        order.sort_by_key(|&ix| {
            let ix = ix as usize;
            (Reverse(views[ix].side), !are_first[ix])
        });
        Casting {
            strips: Strips::new(strip_order, strands, looked_up),
            views,
            are_first,
            order,
            n_taken: 0,
            is_done: vec![false; n_views],
            n_done: 0,
            places: None,
            works: Vec::new(),
            found: Unblocked {
                lit: vec![Vec::new(); n_views],
                maps_of,
                is_everywhere: visible.is_none(),
                n_texels: 0,
            },
        }
    }

    /// Works some milliseconds on as many maps as there are threads; answers whether all are done.
    pub fn step(&mut self, beside: &Beside) -> bool {
        let strips = &self.strips;
        let Some(places) = &self.places else {
            let position = |ix: usize| strips.position(&strips.seen[ix]);
            self.places = Some(beside.places(strips.seen.len(), position));
            return self.views.is_empty();
        };
        let views = &self.views[..];
        let of_points = BYTES_PER_POINT * strips.order.points[0].len();
        let bytes = |ix: u32| 4 * (views[ix as usize].side as usize).pow(2) + of_points;
        // Those at work first, also where there were more threads before. Whatever they take up later is not larger.
        self.works.sort_by_key(|work| work.view.is_none());
        let under_way = self.works.iter().map_while(|work| work.view);
        let to_come = self.order[self.n_taken..].iter().copied();
        let mut sum = 0;
        let fits = |ix: &u32| {
            sum += bytes(*ix);
            sum <= MAX_MAP_BYTES
        };
        let n = under_way.chain(to_come).take_while(fits).count();
        let n = n.clamp(1, rayon::current_num_threads());
        self.works
            .resize_with(n.max(self.works.len()), Work::default);
        let n_taken = AtomicUsize::new(self.n_taken);
        let take = || {
            let next = self.order.get(n_taken.fetch_add(1, Ordering::Relaxed));
            next.copied()
        };
        let deadline = Deadline::after(STEP);
        let found: Vec<Found> = self.works[..n]
            .par_iter_mut()
            .flat_map_iter(|work| work.step(views, strips, (beside, places), (&take, deadline)))
            .collect();
        self.n_taken = n_taken.into_inner().min(self.order.len());
        self.n_done += found.len();
        for Found {
            view,
            lit,
            n_texels,
        } in found
        {
            self.found.lit[view as usize] = lit;
            self.is_done[view as usize] = true;
            self.found.n_texels += n_texels;
        }
        self.n_done == self.views.len()
    }

    /// What the maps say that a first picture needs, and by map whether it is one of these; none before all of them are found.
    pub fn maps_for_first(&self) -> Option<(&Unblocked, &[bool])> {
        let mut views = self.are_first.iter().zip(&self.is_done);
        let is_found = views.all(|(is_first, is_done)| *is_done || !is_first);
        is_found.then_some((&self.found, &self.are_first[..]))
    }

    /// What is found so far.
    pub fn found(&self) -> &Unblocked {
        &self.found
    }

    /// Share of the maps that are done.
    pub fn share_done(&self) -> f64 {
        self.n_done as f64 / self.views.len().max(1) as f64
    }

    /// What is found.
    pub fn finish(self) -> Unblocked {
        self.found
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use strandlight_formats::SrbfLight;
    use strandlight_scene::shadow_maps::{ShadowPlan, unblocked_share};

    use super::super::shadow_map::{Visibility, draw_maps};
    use super::*;

    /// Strands criss-cross, thick and thin.
    fn strands(n: usize) -> Strands {
        let mut points = Vec::new();
        for ix in 0..n {
            let turn = 2.4 * ix as f32;
            let along = Vec3::new(turn.cos(), turn.sin(), 0.3 * (ix % 3) as f32);
            let middle = Vec3::new((1.7 * turn).sin(), (0.9 * turn).cos(), (1.3 * turn).sin());
            points.extend([-1.0, -0.2, 0.7].map(|t| (middle + along * t).to_array()));
        }
        let offsets: Vec<u32> = (0..=n).map(|ix| 3 * ix as u32).collect();
        Strands::new(
            &points,
            &offsets,
            |strand, _| [0.002, 0.02, 0.2][strand % 3],
            true,
        )
        .expect("valid")
    }

    #[test]
    fn shares_are_those_of_the_maps_at_every_point() {
        let strands = strands(400);
        let lights: Vec<SrbfLight> = (0..6)
            .map(|ix| SrbfLight {
                direction: Vec3::new(ix as f32 - 2.0, 1.0, 0.3).normalize().to_array(),
                lambda: [0.02, 0.3, 0.9][ix % 3],
                rgb: [1.0; 3],
            })
            .collect();
        let plan = ShadowPlan::new(&lights, &strands, 30);
        let mut visibility = Visibility::new(&plan, strands.points.len());
        let n_texels = draw_maps(&strands, &plan.views, &Beside::none(), &mut visibility);
        let words = visibility.shares;
        let visible: Vec<u32> = (0..strands.points.len() as u32).step_by(3).collect();
        let order = Arc::new(StripOrder::new(&strands));
        let find = |visible: Option<&[u32]>| {
            let views = (plan.views.clone(), plan.maps_for_first());
            let mut casting = Casting::new(views, (&strands, &order), visible);
            while !casting.step(&Beside::none()) {}
            casting.finish()
        };
        let (unblocked, everywhere) = (find(Some(&visible)), find(None));
        assert!(unblocked.n_texels <= everywhere.n_texels && everywhere.n_texels <= n_texels);
        // Those of a first picture before the others.
        let views = (plan.views.clone(), plan.maps_for_first());
        let mut casting = Casting::new(views, (&strands, &order), Some(&visible));
        while casting.maps_for_first().is_none() {
            casting.step(&Beside::none());
        }
        let (found, are_first) = casting.maps_for_first().expect("those");
        assert!(are_first.contains(&false));
        for (map, is_first) in are_first.iter().enumerate() {
            assert!(!is_first || found.lit[map] == unblocked.lit[map], "{map}");
        }
        // With fewer threads than it began with, too.
        let pool = |n: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
            pool.expect("threads")
        };
        let views = (plan.views.clone(), plan.maps_for_first());
        let mut casting = Casting::new(views, (&strands, &order), Some(&visible));
        for _ in 0..3 {
            pool(4).install(|| casting.step(&Beside::none()));
        }
        let one = pool(1);
        while !one.install(|| casting.step(&Beside::none())) {}
        assert_eq!(casting.finish().lit, unblocked.lit);
        // Most strands throw no shadow on a corner.
        let is_near = |&point: &u32| strands.points[point as usize][0] > 1.2;
        let near: Vec<u32> = (0..strands.points.len() as u32).filter(is_near).collect();
        let of_corner = find(Some(&near));
        assert!((of_corner.n_texels as f32) < 0.9 * n_texels as f32);
        for (place, &point) in near.iter().enumerate() {
            let at = VisiblePoint {
                place,
                point: point as usize,
            };
            for slot in 0..plan.n_slots {
                assert_eq!(everywhere.share(slot, at), of_corner.share(slot, at));
            }
        }
        let mut darkest = 1.0_f32;
        for slot in 0..plan.n_slots {
            for (place, &point) in visible.iter().enumerate() {
                let at = VisiblePoint {
                    place,
                    point: point as usize,
                };
                let share = unblocked.share(slot, at);
                assert_eq!(everywhere.share(slot, at), share);
                let n_points = strands.points.len();
                let exact = unblocked_share(&words, n_points, slot, false, point as usize);
                // The other is rounded to eight bits.
                assert!(
                    (share - exact).abs() < 0.6 / 255.0,
                    "{slot} {point}: {share} {exact}"
                );
                darkest = darkest.min(share);
            }
        }
        assert!(darkest < 0.1);
    }
}
