//! A groom as a reader makes it, strand by strand.

use crate::counted::counted;
use crate::error::{Error, Result};
use crate::groom::{Attribute, Domain, Groom, GroomSource, Original};
use crate::groom_format::{ImportOptions, Note, NoteKind, Placement};

/// Strands in a file's own unit and axes, checked one after another.
#[derive(Debug)]
pub(crate) struct StrandList<'a> {
    groom: Groom,
    placement: Placement,
    options: &'a ImportOptions,
    n_short: usize,
}

impl<'a> StrandList<'a> {
    pub fn new(placement: Placement, options: &'a ImportOptions) -> Self {
        StrandList {
            groom: Groom {
                strand_offsets: vec![0],
                ..Groom::default()
            },
            placement,
            options,
            n_short: 0,
        }
    }

    /// Appends strand `strand` of the file, and answers whether it was: of fewer than two points it
    /// is left out and counted.
    ///
    /// # Errors
    /// `Value` where there are too many points, or one is no point of a groom.
    pub fn push(
        &mut self,
        strand: usize,
        points: impl ExactSizeIterator<Item = [f32; 3]>,
    ) -> Result<bool> {
        let n = points.len();
        if n < 2 {
            self.n_short += 1;
            return Ok(false);
        }
        let total = self.groom.points.len() as u64 + n as u64;
        self.options.check_points(total)?;
        self.groom.points.reserve(n);
        for (ix, point) in points.enumerate() {
            self.placement.check(strand, ix, point)?;
            self.groom.points.push(self.placement.to_groom(point));
        }
        // No more than `max_points`, a u32.
        self.groom.strand_offsets.push(total as u32);
        Ok(true)
    }

    /// The groom, of a file of the format called `format`; a line on what was left out goes to
    /// `notes`.
    ///
    /// # Errors
    /// `Value` where no strand has two points.
    pub fn finish(self, format: &str, notes: &mut Vec<Note>) -> Result<Groom> {
        let mut groom = self.groom;
        if groom.n_strands() == 0 {
            let key = "number of strands with two points or more";
            return Err(Error::value(key, 0, "at least 1"));
        }
        if self.n_short > 0 {
            let what = counted(
                self.n_short,
                "strand of fewer than two points is",
                "strands of fewer than two points are",
            ) + " left out";
            notes.push(Note::new(NoteKind::Dropped, what));
        }
        groom.source = GroomSource {
            cm_per_unit: self.placement.cm_per_unit,
            up: self.placement.up,
            original: Some(Original {
                format: format.to_owned(),
                data: Vec::new(),
            }),
            ..GroomSource::default()
        };
        Ok(groom)
    }
}

/// An attribute.
pub(crate) fn attribute(name: &str, domain: Domain, components: u32, data: Vec<f32>) -> Attribute {
    Attribute {
        name: name.to_owned(),
        domain,
        components,
        data,
    }
}
