//! What a pixel shows, ribbon by ribbon.

use strandlight_scattering::wide::Simd;

use super::blocked::Blocked;
use super::places::{PLACES, sum};

/// A pixel is closed once less than this share of what lies behind shows: 1/256.
const CLOSED: f32 = 0.003_906_25;

/// Weights below this are added to the entry before.
const LEAST_WEIGHT: f32 = 1.0 / 65_536.0;

/// Share of a pixel that a segment gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Entry {
    /// The segment's first point; the second is the next one.
    pub first: u32,
    /// Share of the way to the second point, unorm16.
    t: u16,
    /// Mean of the places across the ribbon that the pixel shows, snorm8: -1 at the left edge, 1 at the right one.
    across: i8,
    /// Mean of their squares, unorm8.
    across_2: u8,
    /// Share of the pixel's colour.
    pub weight: f32,
}

impl Entry {
    /// That of the segment after the point `first`.
    #[inline(always)]
    fn new(first: u32, drawn: &Drawn, weight: f32) -> Entry {
        let [across, across_2] = drawn.across;
        // Casts saturate.
        Entry {
            first,
            t: (drawn.t * 65_535.0 + 0.5) as i32 as u16,
            across: (across * 127.0 + 0.5_f32.copysign(across)) as i32 as i8,
            across_2: (across_2 * 255.0 + 0.5) as i32 as u8,
            weight,
        }
    }

    /// Share of the way to the second point, 0..=1.
    pub fn t(&self) -> f32 {
        f32::from(self.t) * (1.0 / 65_535.0)
    }

    /// Means of the places across the ribbon, -1..=1, and of their squares.
    pub fn across(&self) -> [f32; 2] {
        [
            f32::from(self.across) * (1.0 / 127.0),
            f32::from(self.across_2) * (1.0 / 255.0),
        ]
    }
}

/// A ribbon in a pixel.
#[derive(Clone, Copy)]
pub(super) struct Drawn {
    /// Share of the way along its segment, 0..=1.
    pub t: f32,
    /// Means over the width, see [`Entry::across`].
    pub across: [f32; 2],
    pub alpha: f32,
    /// Share of each place's surroundings that it covers.
    pub covers: [f32; PLACES],
}

/// Ribbons in the pixels of a tile, until nothing can come before them any more.
#[derive(Default)]
pub(super) struct Waiting {
    drawn: Vec<Drawn>,
    /// Places in `drawn` that are free.
    free: Vec<u32>,
}

impl Waiting {
    pub fn clear(&mut self) {
        self.drawn.clear();
        self.free.clear();
    }

    #[inline(always)]
    fn insert(&mut self, new: Drawn) -> u32 {
        if let Some(place) = self.free.pop() {
            self.drawn[place as usize] = new;
            return place;
        }
        self.drawn.push(new);
        self.drawn.len() as u32 - 1
    }
}

/// One of those that wait.
#[derive(Clone, Copy)]
struct Next {
    /// [`super::bins::key`] of its depth here and its first point.
    key: u64,
    /// Where it is in [`Waiting`].
    place: u32,
}

/// A pixel while its list is made.
pub(super) struct Pixel {
    /// Share of each place that nothing covers yet.
    pub open: [f32; PLACES],
    /// The farthest first.
    waiting: Vec<Next>,
    pub entries: Vec<Entry>,
    pub is_closed: bool,
}

impl Pixel {
    pub fn new() -> Pixel {
        Pixel {
            open: [1.0; PLACES],
            waiting: Vec::new(),
            entries: Vec::new(),
            is_closed: false,
        }
    }

    /// Forgets the pixel that it was of the tile before.
    pub fn start(&mut self) {
        self.open = [1.0; PLACES];
        self.waiting.clear();
        self.entries.clear();
        self.is_closed = false;
    }

    /// Adds a ribbon to those that wait.
    #[inline(always)]
    pub fn insert(&mut self, waiting: &mut Waiting, key: u64, new: Drawn) {
        let next = Next {
            key,
            place: waiting.insert(new),
        };
        // Most are among the farthest.
        let is_farther = |other: &Next| other.key > key;
        let n_farther = self.waiting.iter().take_while(|next| is_farther(next));
        let ix = n_farther.count();
        self.waiting.insert(ix, next);
    }

    /// Puts those ribbons into the list that are no farther than `nearest`; answers whether they close the pixel.
    #[inline(always)]
    pub fn settle<S: Simd>(
        &mut self,
        simd: S,
        waiting: &mut Waiting,
        blocked: Option<&Blocked>,
        nearest: f32,
    ) -> bool {
        let depth_of = |next: &Next| f32::from_bits((next.key >> 32) as u32);
        if (self.waiting.last()).is_none_or(|next| depth_of(next) > nearest) {
            return false;
        }
        let mut open = self.open;
        while let Some(next) = self.waiting.pop_if(|next| depth_of(next) <= nearest) {
            let depth = depth_of(&next);
            let drawn = &waiting.drawn[next.place as usize];
            let mut shares = [0.0; PLACES];
            for place in 0..PLACES {
                shares[place] = open[place] * (drawn.covers[place] * drawn.alpha);
            }
            if let Some(blocked) = blocked {
                for (share, blocked) in shares.iter_mut().zip(&blocked.depth) {
                    *share = if depth <= *blocked { *share } else { 0.0 };
                }
            }
            for place in 0..PLACES {
                open[place] -= shares[place];
            }
            let mut left = open;
            if let Some(blocked) = blocked {
                for (left, blocked) in left.iter_mut().zip(&blocked.depth) {
                    *left = if depth <= *blocked { *left } else { 0.0 };
                }
            }
            let weight = sum(simd, &shares) * (1.0 / PLACES as f32);
            self.add(Entry::new(next.key as u32, drawn, weight));
            waiting.free.push(next.place);
            self.is_closed = sum(simd, &left) < CLOSED * PLACES as f32;
            if self.is_closed {
                let places = self.waiting.drain(..).map(|next| next.place);
                waiting.free.extend(places);
            }
        }
        self.open = open;
        self.is_closed
    }

    /// Adds `entry` behind the others.
    #[inline(always)]
    fn add(&mut self, entry: Entry) {
        if entry.weight <= 0.0 {
            return;
        }
        match self.entries.last_mut() {
            Some(before) if entry.weight < LEAST_WEIGHT => before.weight += entry.weight,
            _ => self.entries.push(entry),
        }
    }
}
