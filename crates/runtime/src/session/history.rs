//! Steps that can be taken back.

use std::collections::{HashSet, VecDeque};
use std::sync::Arc;

use strandlight_formats::Scene;

use super::asset_snapshot::{AssetSnapshot, PaintState};
use strandlight_scene::paint::Stroke;

/// Most steps that are remembered.
pub const MAX_STEPS: usize = 500;

/// Most points in all strokes that are remembered: some 200 MB.
pub const MAX_STROKE_POINTS: usize = 4 << 20;

/// Most bytes of files that are remembered beside those of the document.
pub const MAX_FILE_BYTES: usize = 512 << 20;

/// One step between two states of the document.
#[derive(Clone, Debug)]
pub(super) enum Step {
    /// Keys of the scene; with the files before and after where the step read others.
    Scene {
        before: Box<Scene>,
        after: Box<Scene>,
        snapshot: Option<Box<[AssetSnapshot; 2]>>,
    },
    /// A stroke, and the states of paint and mask around it.
    Stroke {
        stroke: Arc<Stroke>,
        states: [PaintState; 2],
    },
}

impl Step {
    fn stroke_points(&self) -> usize {
        match self {
            Step::Scene { .. } => 0,
            Step::Stroke { stroke, .. } => stroke.changed.len() + stroke.masked.len(),
        }
    }

    /// Does it bring another groom?
    fn has_other_groom(&self) -> bool {
        self.snapshots()
            .is_some_and(|[before, after]| !Arc::ptr_eq(&before.assets.groom, &after.assets.groom))
    }

    /// The files before and after it, where it read others.
    fn snapshots(&self) -> Option<&[AssetSnapshot; 2]> {
        match self {
            Step::Scene { snapshot, .. } => snapshot.as_deref(),
            Step::Stroke { .. } => None,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub label: String,
    pub step: Step,
    /// Number of the state after it.
    pub state: u64,
}

/// What was done and can be undone, what was undone and can be done again.
#[derive(Clone, Debug)]
pub(super) struct History {
    done: VecDeque<Entry>,
    undone: Vec<Entry>,
    /// May the newest step take in another of the same label?
    is_open: bool,
    /// What the last push took the place of, until it is kept.
    replaced: Option<Replaced>,
    /// Number of the state before the oldest step.
    first_state: u64,
    /// States so far, but for the first.
    n_states: u64,
    /// [`MAX_FILE_BYTES`], or less in tests.
    pub max_file_bytes: usize,
}

/// What a push took the place of.
#[derive(Clone, Debug)]
struct Replaced {
    /// The step that was pushed.
    pushed: Step,
    /// The step before it, if the two became one.
    joined: Option<Entry>,
    undone: Vec<Entry>,
    was_open: bool,
}

impl Default for History {
    fn default() -> Self {
        History {
            done: VecDeque::new(),
            undone: Vec::new(),
            is_open: false,
            replaced: None,
            first_state: 0,
            n_states: 0,
            max_file_bytes: MAX_FILE_BYTES,
        }
    }
}

impl History {
    /// Adds a step; what was undone can no longer be done again. A step of the same label as the
    /// open one before it becomes part of that.
    pub fn push(&mut self, label: &str, step: Step) {
        let is_more = |last: &Entry| match (&last.step, &step) {
            // The paint of another groom is that step's alone.
            (Step::Scene { .. }, Step::Scene { .. }) => {
                last.label == label && last.step.has_other_groom() == step.has_other_groom()
            }
            _ => false,
        };
        let was_open = self.is_open;
        let last = self.done.pop_back_if(|last| was_open && is_more(last));
        self.replaced = Some(Replaced {
            pushed: step.clone(),
            joined: last.clone(),
            undone: std::mem::take(&mut self.undone),
            was_open,
        });
        if let Some(last) = last {
            let joined = joined(last.step, step);
            // Where nothing is left, the newest step is an earlier one.
            self.is_open = joined.is_some();
            self.add(label, joined);
        } else {
            self.add(label, Some(step));
            self.is_open = true;
        }
    }

    fn add(&mut self, label: &str, step: Option<Step>) {
        self.n_states += 1;
        let entry = step.map(|step| Entry {
            label: label.to_owned(),
            step,
            state: self.n_states,
        });
        self.done.extend(entry);
        let n_kept = self.n_that_fit();
        while self.done.len() > n_kept {
            let Some(oldest) = self.done.pop_front() else {
                break;
            };
            self.first_state = oldest.state;
        }
    }

    /// How many of the newest steps fit into all limits. The newest stays, however large.
    fn n_that_fit(&self) -> usize {
        let newest_first = || self.done.iter().rev().take(MAX_STEPS);
        // What the document has is in memory anyway.
        let current = newest_first().find_map(|entry| entry.step.snapshots());
        let current = current.map_or_else(Vec::new, |[_, after]| after.parts());
        let mut counted: HashSet<usize> = current.iter().map(|(part, _)| *part).collect();
        let (mut points, mut bytes) = (0, 0);
        let fits = |entry: &&Entry| {
            points += entry.step.stroke_points();
            let snapshots = entry.step.snapshots().into_iter().flatten();
            for (part, of_part) in snapshots.flat_map(AssetSnapshot::parts) {
                // One that several steps share is there once.
                if counted.insert(part) {
                    bytes += of_part;
                }
            }
            points <= MAX_STROKE_POINTS && bytes <= self.max_file_bytes
        };
        let n_fitting = newest_first().take_while(fits).count();
        n_fitting.max(self.done.len().min(1))
    }

    /// Steps that can be undone, oldest first, then those that can be done again: their labels, and numbers of the states
    /// after them.
    pub fn steps(&self) -> impl Iterator<Item = (&str, u64)> {
        let all = self.done.iter().chain(self.undone.iter().rev());
        all.map(|entry| (entry.label.as_str(), entry.state))
    }

    /// How many can be undone.
    pub fn n_done(&self) -> usize {
        self.done.len()
    }

    /// Number of the state before all of them.
    pub fn first_state(&self) -> u64 {
        self.first_state
    }

    /// Closes the newest step: the next one is a step of its own.
    pub fn close(&mut self) {
        (self.is_open, self.replaced) = (false, None);
    }

    /// The last push stands: [`History::take_back`] takes none back.
    pub fn keep(&mut self) {
        self.replaced = None;
    }

    /// Takes the last push back, as if it had not been made, if it was not kept and nothing was done since: what it pushed, to be undone.
    pub fn take_back(&mut self) -> Option<Step> {
        let replaced = self.replaced.take()?;
        let is_there = self
            .done
            .back()
            .is_some_and(|last| last.state == self.n_states);
        if is_there {
            self.done.pop_back();
        }
        self.done.extend(replaced.joined);
        (self.undone, self.is_open) = (replaced.undone, replaced.was_open);
        Some(replaced.pushed)
    }

    /// The step to undo; it can be done again after.
    pub fn undo(&mut self) -> Option<Step> {
        self.close();
        let entry = self.done.pop_back()?;
        self.undone.push(entry.clone());
        Some(entry.step)
    }

    /// The step to do again.
    pub fn redo(&mut self) -> Option<Step> {
        self.close();
        let entry = self.undone.pop()?;
        self.done.push_back(entry.clone());
        Some(entry.step)
    }

    /// What would be undone, and done again.
    pub fn labels(&self) -> [Option<&str>; 2] {
        [self.done.back(), self.undone.last()].map(|entry| Some(entry?.label.as_str()))
    }

    /// Changes all scenes that are remembered, and what is remembered of their files.
    pub fn for_each_scene(&mut self, change: impl Fn(&mut Scene, Option<&mut AssetSnapshot>)) {
        self.replaced = None;
        for entry in self.done.iter_mut().chain(&mut self.undone) {
            if let Step::Scene {
                before,
                after,
                snapshot,
            } = &mut entry.step
            {
                let [of_before, of_after] = match snapshot {
                    Some(snapshots) => snapshots.each_mut().map(Some),
                    None => [None, None],
                };
                change(before, of_before);
                change(after, of_after);
            }
        }
    }
}

/// Two steps as one, which is the second if they cannot be; `None` if the second took back the
/// first.
fn joined(first: Step, second: Step) -> Option<Step> {
    match (first, second) {
        (
            Step::Scene {
                before,
                snapshot: first,
                ..
            },
            Step::Scene {
                after,
                snapshot: second,
                ..
            },
        ) => {
            let snapshot = match (first, second) {
                (Some(first), Some(second)) => {
                    let ([before, _], [_, after]) = (*first, *second);
                    Some(Box::new([before, after]))
                }
                (first, second) => first.or(second),
            };
            let is_nothing = snapshot.is_none() && before == after;
            (!is_nothing).then_some(Step::Scene {
                before,
                after,
                snapshot,
            })
        }
        (_, second) => Some(second),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(eta: f64) -> Step {
        let scene = |eta| {
            let mut scene = Scene::new("a", "b");
            scene.hair.eta = eta;
            Box::new(scene)
        };
        Step::Scene {
            before: scene(eta - 0.1),
            after: scene(eta),
            snapshot: None,
        }
    }

    #[test]
    fn a_push_is_taken_back_with_all_that_it_did() {
        let eta_after = |step: &Step| match step {
            Step::Scene { after, .. } => after.hair.eta,
            Step::Stroke { .. } => f64::NAN,
        };
        let mut history = History::default();
        history.push("a", step(1.4));
        history.push("b", step(1.5));
        history.undo().expect("b");
        // Another step.
        history.push("c", step(1.6));
        assert_eq!(history.labels(), [Some("c"), None]);
        assert_eq!(eta_after(&history.take_back().expect("c")), 1.6);
        assert_eq!(history.labels(), [Some("a"), Some("b")]);
        // More of an open one.
        history.redo().expect("b");
        history.push("d", step(1.7));
        history.push("d", step(1.8));
        assert_eq!(eta_after(&history.take_back().expect("d")), 1.8);
        assert_eq!(history.n_done(), 3);
        assert_eq!(eta_after(&history.undo().expect("d")), 1.7);
        // What is kept stays.
        history.push("e", step(1.9));
        history.keep();
        assert!(history.take_back().is_none());
        assert_eq!(history.labels(), [Some("e"), None]);
    }

    #[test]
    fn states_keep_their_numbers_and_the_oldest_are_forgotten() {
        let mut history = History::default();
        history.push("a", step(1.4));
        // More of the same step is another state.
        history.push("a", step(1.5));
        history.close();
        history.push("b", step(1.6));
        let of = |history: &History| -> Vec<(String, u64)> {
            let steps = history.steps();
            steps
                .map(|(label, state)| (label.to_owned(), state))
                .collect()
        };
        let both = [("a".to_owned(), 2), ("b".to_owned(), 3)];
        assert_eq!((of(&history), history.n_done()), (both.to_vec(), 2));
        history.undo().expect("b");
        assert_eq!((of(&history), history.n_done()), (both.to_vec(), 1));
        history.redo().expect("b");
        assert_eq!(of(&history), both);
        for _ in 0..MAX_STEPS {
            history.close();
            history.push("c", step(1.7));
        }
        // State 3 was that before the oldest step that is left.
        assert_eq!((history.n_done(), history.first_state()), (MAX_STEPS, 3));
        assert_eq!(history.steps().next(), Some(("c", 4)));
    }
}
