//! What of shadow maps is lit at visible points, and so the shares of the lights that reach them straight.
//!
//! The maps are those of [`super::shadow_map`]; but each is one thread's own, every point is projected
//! once, and what is above nothing that is looked up is not drawn. Strands side by side are drawn one after the other and texels
//! side by side lie together, so that most of the memory that is touched is in a cache.

mod map;
mod strips;

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use strandlight_scene::beside::{self, Beside};
use strandlight_scene::shadow_maps::{N_PLACES, NO_SLOT, ShadowView};
use strandlight_scene::strands::Strands;

use map::Work;
pub(super) use strips::StripOrder;
use strips::{Strips, some_runs};

/// Maps at work at a time have at most this many bytes, or there is one.
const MAX_MAP_BYTES: usize = 256 << 20;

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
        let ix = self.index(at);
        let maps = &self.lit[self.maps_of[slot as usize].clone()];
        let sum: u32 = maps.iter().map(|lit| lit[ix].count_ones()).sum();
        sum as f32 / (N_PLACES as usize * maps.len()) as f32
    }

    /// The answer of every map at a visible point, 0..=1.
    pub fn answers(&self, at: VisiblePoint) -> impl Iterator<Item = f32> {
        let ix = self.index(at);
        let maps = self.lit.iter();
        maps.map(move |lit| lit[ix].count_ones() as f32 * (1.0 / N_PLACES as f32))
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
    /// Views that are done.
    n_done: usize,
    strips: Strips,
    /// Of [`Strips::seen`], once they were asked for.
    places: Option<beside::Places>,
    /// What the maps at work are made in, as many as there are at most.
    works: Vec<Work>,
    /// How far those at work are; they keep in step.
    part: Part,
    found: Unblocked,
}

/// A part of the work on a map.
#[derive(Clone, Copy, Debug)]
enum Part {
    /// Projects the points of the strands.
    Project,
    /// Plans which runs are drawn, and clears the map.
    Prepare,
    /// Draws runs; the next one.
    Cast(usize),
    /// Looks up the visible points; the next one.
    Receive(usize),
}

impl Casting {
    /// Of the maps of `views`, those of a slot one after the other, at `visible` points of strands in this `order`; at
    /// all points where there are none given.
    pub fn new(
        views: Vec<ShadowView>,
        (strands, order): (&Strands, &Arc<StripOrder>),
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
        Casting {
            strips: Strips::new(order, strands, looked_up),
            views,
            n_done: 0,
            places: None,
            works: Vec::new(),
            part: Part::Project,
            found: Unblocked {
                lit: Vec::new(),
                maps_of,
                is_everywhere: visible.is_none(),
                n_texels: 0,
            },
        }
    }

    /// Works some milliseconds on as many maps as there are threads; answers whether all are done.
    pub fn step(&mut self, beside: &Beside) -> bool {
        let rest = &self.views[self.n_done..];
        let largest = rest.iter().map(|view| view.side).max().unwrap_or(1);
        let texels = 4 * (largest as usize).pow(2);
        let at_a_time =
            MAX_MAP_BYTES / (texels + BYTES_PER_POINT * self.strips.order.points[0].len());
        let n = at_a_time
            .clamp(1, rayon::current_num_threads())
            .min(rest.len());
        self.works
            .resize_with(n.max(self.works.len()), Work::default);
        let side = rest[..n].iter().map(|view| view.side).max().unwrap_or(1);
        let strips = &self.strips;
        let works = self.works.par_iter_mut().zip(&rest[..n]);
        match self.part {
            Part::Project => {
                works.for_each(|(work, view)| work.project(view, strips));
                self.part = Part::Prepare;
            }
            Part::Prepare => {
                works.for_each(|(work, view)| work.prepare(view, strips));
                self.part = Part::Cast(0);
            }
            Part::Cast(first) => {
                let range = some_runs(first, side);
                let end = range.end;
                let n_drawn = works.map(|(work, view)| {
                    work.cast(view, strips, range.clone());
                    work.n_drawn()
                });
                self.part = match n_drawn.max() {
                    Some(n_drawn) if n_drawn > end => Part::Cast(end),
                    _ => Part::Receive(0),
                };
            }
            Part::Receive(first) => {
                let Some(places) = &self.places else {
                    let position = |ix: usize| strips.position(&strips.seen[ix]);
                    self.places = Some(beside.places(strips.seen.len(), position));
                    return false;
                };
                let range = strips.some_seen(first, side);
                let end = range.end;
                let stands = (beside, places);
                works.for_each(|(work, view)| work.receive(view, strips, range.clone(), stands));
                self.part = Part::Receive(end);
                if end == strips.seen.len() {
                    self.add(n);
                    self.part = Part::Project;
                }
            }
        }
        self.n_done == self.views.len()
    }

    /// Takes the answers of the next maps.
    fn add(&mut self, n: usize) {
        for work in &mut self.works[..n] {
            self.found.n_texels += work.n_texels;
            self.found.lit.push(std::mem::take(&mut work.lit));
        }
        self.n_done += n;
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
            let views = plan.views.clone();
            let mut casting = Casting::new(views, (&strands, &order), visible);
            while !casting.step(&Beside::none()) {}
            casting.finish()
        };
        let (unblocked, everywhere) = (find(Some(&visible)), find(None));
        assert!(unblocked.n_texels <= n_texels);
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
