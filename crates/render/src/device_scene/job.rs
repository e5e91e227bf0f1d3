//! What is out of date, and the steps that are left to bring it up to date.

use std::collections::VecDeque;
use std::ops::Range;

use crate::passes::lighting::Step;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::edit::EditReport;

/// What was set since the last shading job began.
#[derive(Clone, Debug, Default)]
pub(crate) struct DirtyFlags {
    /// The hair moved: everything.
    pub points: bool,
    /// Directions or widths of lights: shadow maps, records.
    pub lights: bool,
    /// Shadow maps and records alone.
    pub shadows: bool,
    /// What else stands in the light.
    pub proxies: bool,
    /// Amplitudes of lights.
    pub colors: bool,
    /// Textures of the hair.
    pub hair: Option<EditReport>,
    /// Terms or modes: another pipeline.
    pub kind: bool,
    pub densities: bool,
    /// Points whose paint is another.
    pub paint: Option<Range<usize>>,
    /// The eye: the light through to it.
    pub view: bool,
}

impl DirtyFlags {
    /// Those of a scene of which nothing was lit yet.
    pub fn all() -> DirtyFlags {
        DirtyFlags {
            shadows: true,
            view: true,
            ..DirtyFlags::default()
        }
    }

    pub fn is_clean(&self) -> bool {
        !self.view && !self.is_edited()
    }

    /// Is there anything but the view?
    pub fn is_edited(&self) -> bool {
        self.points
            || self.lights
            || self.shadows
            || self.proxies
            || self.colors
            || self.hair.is_some()
            || self.kind
            || self.densities
            || self.paint.is_some()
    }

    /// Adds what an edit of the hair rebuilt.
    pub fn add_hair(&mut self, report: &EditReport) {
        match &mut self.hair {
            Some(before) => before.add(report),
            None => self.hair = Some(report.clone()),
        }
    }

    /// Adds points that were painted.
    pub fn add_paint(&mut self, range: Range<usize>) {
        self.paint = Some(match self.paint.take() {
            Some(before) => before.start.min(range.start)..before.end.max(range.end),
            None => range,
        });
    }

    /// Adds the flags of `other`.
    pub fn add(&mut self, other: &DirtyFlags) {
        self.points |= other.points;
        self.lights |= other.lights;
        self.shadows |= other.shadows;
        self.proxies |= other.proxies;
        self.colors |= other.colors;
        self.kind |= other.kind;
        self.densities |= other.densities;
        self.view |= other.view;
        if let Some(range) = &other.paint {
            self.add_paint(range.clone());
        }
        if let Some(report) = &other.hair {
            self.add_hair(report);
        }
    }
}

/// A shading of all points under way: for one state of scene and view, whatever is set meanwhile.
pub(crate) struct ShadingJob {
    pub dirty: DirtyFlags,
    pub view: ViewUniform,
    pub steps: VecDeque<Step>,
    pub n_steps: usize,
    /// It took the place of one that was given up.
    pub is_second_try: bool,
}

impl ShadingJob {
    /// May it be given up for a new edit? Once, and early, so that dragging a slider shows something.
    pub fn may_restart(&self) -> bool {
        !self.is_second_try && 2 * self.steps.len() > self.n_steps
    }
}
