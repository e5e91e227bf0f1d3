//! What is out of date, and the steps that are left to bring it up to date.

use std::collections::VecDeque;
use std::ops::Range;

use crate::invalidation::{Inputs, is_stale};
use crate::passes::step::Step;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::material::EditReport;

/// What was set since the last shading job began.
#[derive(Clone, Debug, Default)]
pub(crate) struct DirtyFlags {
    /// The inputs that are others.
    pub inputs: Inputs,
    /// No shadow was found yet.
    pub is_new: bool,
    /// Which tables of the hair were rebuilt.
    pub hair: Option<EditReport>,
    /// Points whose paint is another.
    pub paint: Option<Range<usize>>,
}

impl DirtyFlags {
    /// Those of a scene of which nothing was lit yet.
    pub fn all() -> DirtyFlags {
        DirtyFlags {
            inputs: Inputs::VIEW,
            is_new: true,
            ..DirtyFlags::default()
        }
    }

    /// Marks `input` as another if it is.
    pub fn mark(&mut self, input: Inputs, is_other: bool) {
        if is_other {
            self.inputs |= input;
        }
    }

    /// Is one of `inputs` another?
    pub fn has(&self, inputs: Inputs) -> bool {
        self.inputs.intersects(inputs)
    }

    /// Does `stage` of [`STAGES`](crate::invalidation::STAGES) have to run?
    pub fn is_stale(&self, stage: &str) -> bool {
        self.is_new || is_stale(stage, self.inputs)
    }

    pub fn is_clean(&self) -> bool {
        !self.is_new && self.inputs.is_empty()
    }

    /// Is there anything but the view?
    pub fn is_edited(&self) -> bool {
        self.is_new || !self.inputs.difference(Inputs::VIEW).is_empty()
    }

    /// Adds what an edit of the hair rebuilt.
    pub fn add_hair(&mut self, report: &EditReport) {
        self.inputs |= Inputs::HAIR;
        match &mut self.hair {
            Some(before) => before.add(report),
            None => self.hair = Some(report.clone()),
        }
    }

    /// Adds points that were painted.
    pub fn add_paint(&mut self, range: Range<usize>) {
        self.inputs |= Inputs::PAINT;
        self.paint = Some(match self.paint.take() {
            Some(before) => before.start.min(range.start)..before.end.max(range.end),
            None => range,
        });
    }

    /// Adds the flags of `other`.
    pub fn add(&mut self, other: &DirtyFlags) {
        self.inputs |= other.inputs;
        self.is_new |= other.is_new;
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
    /// Most points that a step shades.
    pub chunk: u32,
    /// The view whose list is to say which points are shaded; the steps that shade them are planned when it is there.
    pub awaited_list: Option<ViewUniform>,
    /// It took the place of one that was given up.
    pub is_second_try: bool,
}

impl ShadingJob {
    /// The list has so many points: no step shades more.
    pub fn know_points(&mut self, n: u32) {
        let before = self.steps.len();
        self.steps.retain_mut(|step| step.keep_first(n));
        self.n_steps -= before - self.steps.len();
    }

    /// Are its further steps not known yet?
    pub fn awaits_list(&self) -> bool {
        self.awaited_list.is_some()
    }

    /// May it be given up for a new edit? Once, and early, so that dragging a slider shows
    /// something.
    pub fn may_restart(&self) -> bool {
        !self.is_second_try && (self.awaits_list() || 2 * self.steps.len() > self.n_steps)
    }
}

/// What a step of a job was.
pub(crate) enum Stepped {
    /// Which points are to be shaded is not known yet.
    AwaitsList,
    /// A list was submitted.
    Listed,
    /// A step was submitted.
    Ran {
        stage: &'static str,
        /// How much of the stage's work it is.
        units: f64,
        /// Is it exactly that much? Not of a list whose points the device alone has counted.
        is_counted: bool,
    },
    /// An edit came early in the job, which began again.
    Restarted,
    /// The job is done and its radiance is shown.
    Done(Box<ShadingJob>),
}
