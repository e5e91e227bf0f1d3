//! What a frame cost.

use std::fmt;
use strandlight_formats::counted;
use web_time::Instant;

use crate::material::PartReport;

/// Called from any thread with the share of a frame that is done, 0..=1 and growing.
pub type Observer<'a> = &'a (dyn Fn(f64) + Sync);

/// Part of a frame's progress that lighting is taken for; drawing is the rest.
#[doc(hidden)]
pub const LIGHTING_SHARE: f64 = 0.4;

/// One stage of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// Its name, such as `voxelise`, `transmittance`, `shade`, `draw`, `composite`.
    pub name: &'static str,
    /// Wall-clock milliseconds until its results were there.
    pub milliseconds: f64,
    /// Bytes of the buffers it wrote.
    pub bytes: u64,
    /// How often it ran: maps, directions of light, slices of points, passes; 1 on the CPU.
    pub runs: u32,
    /// Milliseconds by the device's time stamps, where it has them.
    pub gpu_milliseconds: Option<f64>,
}

/// What a GPU made since the edit before the frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceStats {
    /// Tables of the hair that the edit rebuilt.
    pub rebuilt: Vec<PartReport>,
    /// Pipelines compiled.
    pub pipelines: u64,
    /// Times that points of the hair were written.
    pub geometry_uploads: u64,
    /// Bytes on the device.
    pub bytes: u64,
}

/// A term of scattering in one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Term {
    /// Its name, of [`TERM_NAMES`].
    pub name: &'static str,
    /// Products of a point and a light that were evaluated.
    pub products: u64,
    /// Products left out because hardly any light takes this way to the point.
    pub skipped: u64,
}

/// The terms in the order that passes count them: T M^S, T M^{L,dir}, (f_global (T_f - T_vol) + T_b) M^G
/// and (T_f - T_vol + T_b) M^L.
#[doc(hidden)]
pub const TERM_NAMES: [&str; 4] = ["single", "direct local", "global", "local"];

/// Costs and counts of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stats {
    /// `gpu` or `cpu`, and which.
    pub backend: String,
    /// Stages in order.
    pub stages: Vec<Stage>,
    /// Strands drawn.
    pub strands: usize,
    /// Strands without extent, left out.
    pub degenerate_strands: usize,
    /// Points after refinement.
    pub points: usize,
    /// Segments after refinement.
    pub segments: usize,
    /// Voxels of the shadow volume.
    pub voxels: usize,
    /// Lights of the scene.
    pub lights: usize,
    /// Directions swept through the volume for all lights.
    pub sweeps: usize,
    /// Shadow maps drawn for all lights.
    pub shadow_maps: usize,
    /// Points outside the view, not shaded.
    pub points_skipped: u64,
    /// The terms of scattering that were asked for.
    pub scattering: &'static str,
    /// The terms that were drawn.
    pub terms: Vec<Term>,
    /// What was left out altogether, and why.
    pub skipped: Vec<String>,
    /// Samples drawn a pixel; 0 where a visibility list says what a pixel shows.
    pub samples: u32,
    /// Passes of four samples.
    pub passes: u32,
    /// Submissions that drew these; on a GPU.
    pub draws: u32,
    /// Pixels of strands that all passes looked at, those that something else hides included, or, of a visibility list, pixels within
    /// reach of a segment while any of them is open; on the CPU, which counts them.
    pub pixels_visited: u64,
    /// Points that the picture shows, which alone are shaded; where it is drawn by a visibility
    /// list.
    pub visible_points: u64,
    /// Pairs of a pixel and a segment in that list.
    pub list_entries: u64,
    /// Texels of strands drawn into all shadow maps; on the CPU.
    pub texels_visited: u64,
    /// What the device made; on a GPU.
    pub device: Option<DeviceStats>,
}

impl Stats {
    /// Products evaluated, and products left out, of all terms.
    pub fn products(&self) -> [u64; 2] {
        let sum = |of: fn(&Term) -> u64| self.terms.iter().map(of).sum();
        [sum(|term| term.products), sum(|term| term.skipped)]
    }

    /// Takes what shading counted, of which each of `n_batches` batches of lights counted all
    /// points: points skipped, then by term of [`TERM_NAMES`] products evaluated and skipped.
    pub fn set_counters(&mut self, counts: &[u64], n_batches: u64) {
        self.points_skipped = counts[0] / n_batches.max(1);
        let terms: &[[u64; 2]] = bytemuck::cast_slice(&counts[1..9]);
        self.set_terms(terms);
    }

    /// Takes what a pass counted: by term of [`TERM_NAMES`], evaluated and skipped.
    pub fn set_terms(&mut self, counts: &[[u64; 2]]) {
        self.terms = TERM_NAMES
            .into_iter()
            .zip(counts)
            .filter(|(_, counts)| counts.iter().any(|&n| n > 0))
            .map(|(name, &[products, skipped])| Term {
                name,
                products,
                skipped,
            })
            .collect();
    }

    /// Milliseconds of all stages.
    pub fn milliseconds(&self) -> f64 {
        total(self.stages.iter().map(|stage| stage.milliseconds))
    }

    /// How pixels were made, in words.
    pub fn visibility(&self) -> String {
        match self.samples {
            0 => "visibility list".to_owned(),
            n => counted(n, "sample", "samples"),
        }
    }

    /// One line: where, how much, how long.
    pub fn summary(&self) -> String {
        format!(
            "rendered on {}: {}, {}, {} scattering, {:.1} s",
            self.backend,
            counted(self.points, "point", "points"),
            counted(self.lights, "light", "lights"),
            self.scattering,
            1e-3 * self.milliseconds()
        )
    }

    /// Writes what was drawn and what was left out, a line each.
    pub(crate) fn write_counts(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "rendered on {}", self.backend)?;
        write!(
            f,
            "  {}, {}, {}",
            counted(self.strands, "strand", "strands"),
            counted(self.points, "point", "points"),
            counted(self.segments, "segment", "segments")
        )?;
        if self.degenerate_strands > 0 {
            write!(
                f,
                " ({} without extent left out)",
                counted(self.degenerate_strands, "strand", "strands")
            )?;
        }
        writeln!(f)?;
        writeln!(
            f,
            "  {}, {} through {}, {}",
            counted(self.lights, "light", "lights"),
            counted(self.sweeps, "sweep", "sweeps"),
            counted(self.voxels, "voxel", "voxels"),
            counted(self.shadow_maps, "shadow map", "shadow maps")
        )?;
        writeln!(
            f,
            "  {} scattering, {} out of view",
            self.scattering,
            counted(self.points_skipped, "point", "points")
        )?;
        writeln!(f, "  term            products   negligible")?;
        for term in &self.terms {
            writeln!(
                f,
                "  {:<12}{:>12} {:>12}",
                term.name, term.products, term.skipped
            )?;
        }
        for skipped in &self.skipped {
            writeln!(f, "  skipped: {skipped}")?;
        }
        Ok(())
    }

    /// Runs `work` as stage `name`; it answers its value and the bytes it wrote.
    pub fn stage<T, E>(
        &mut self,
        name: &'static str,
        work: impl FnOnce(&mut Self) -> Result<(T, u64), E>,
    ) -> Result<T, E> {
        let start = Instant::now();
        let (value, bytes) = work(self)?;
        self.stages.push(Stage {
            name,
            milliseconds: 1e3 * start.elapsed().as_secs_f64(),
            bytes,
            runs: 1,
            gpu_milliseconds: None,
        });
        Ok(value)
    }
}

/// One frame of many, as text: on a GPU, which recomputes only what an edit made stale, how often
/// each stage ran since.
#[derive(Clone, Copy, Debug)]
pub struct FrameStats<'a>(pub &'a Stats);

impl fmt::Display for FrameStats<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let FrameStats(stats) = self;
        let Some(device) = &stats.device else {
            return stats.fmt(f);
        };
        stats.write_counts(f)?;
        writeln!(f, "  pass                  time     runs")?;
        for stage in &stats.stages {
            writeln!(
                f,
                "  {:<14}{:>10.1} ms {:>8}",
                stage.name, stage.milliseconds, stage.runs
            )?;
        }
        write!(
            f,
            "  {:<14}{:>10.1} ms, {:.1} MB on the device",
            "total",
            stats.milliseconds(),
            device.bytes as f64 / 1e6
        )
    }
}

impl fmt::Display for Stats {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_counts(f)?;
        writeln!(f, "  pass                  time     memory")?;
        for stage in &self.stages {
            writeln!(
                f,
                "  {:<14}{:>10.1} ms {:>9.1} MB",
                stage.name,
                stage.milliseconds,
                stage.bytes as f64 / 1e6
            )?;
        }
        write!(f, "  {:<14}{:>10.1} ms, ", "total", self.milliseconds())?;
        match self.samples {
            0 => write!(
                f,
                "{} visible points, {} pairs of a pixel and a segment",
                self.visible_points, self.list_entries
            ),
            _ => write!(f, "{} passes of at most 4 samples", self.passes),
        }
    }
}

/// A sum that is 0 where there is nothing to add; that of `Iterator::sum` is -0 then.
#[doc(hidden)]
pub fn total(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |sum, value| sum + value)
}
