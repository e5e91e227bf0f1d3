//! Tables of multiple scattering of a scene.

use rayon::prelude::*;
use strandlight_scattering::closed_form::PaintedHair;
use strandlight_scattering::jobs::Job;
use strandlight_scattering::multiple_tables::{MultipleTables, Packs, PaintedTables};
use strandlight_scene::PreparedScene;
use strandlight_scene::paint::PaintedOptics;

/// Tables of multiple scattering: of the scene's fibre where some points have that, and of painted points where they serve some.
#[derive(Default)]
pub(super) struct SceneTables {
    pub plain: Option<MultipleTables>,
    pub painted: PaintedTables,
    /// What the painted ones are made of.
    source: Option<PaintedSource>,
}

/// What packs are made of. It has no absorption: after an edit of that they stay what they are.
#[derive(PartialEq)]
struct PaintedSource {
    hair: PaintedHair,
    optics: PaintedOptics,
    terms: u32,
}

impl PaintedSource {
    fn of(scene: &PreparedScene) -> PaintedSource {
        let optics = scene.hair.optics();
        let mut hair = optics.painted_hair();
        hair.fibre.sigma_a = [0.0; 3];
        PaintedSource {
            hair,
            optics: optics.painted.clone(),
            terms: scene.terms(),
        }
    }
}

impl SceneTables {
    /// Drops the packs that are of other hair than that of `scene`.
    pub fn keep_packs_of(&mut self, scene: &PreparedScene) {
        if let Some(source) = &self.source
            && (scene.paint().is_none() || *source != PaintedSource::of(scene))
        {
            (self.painted, self.source) = (PaintedTables::default(), None);
        }
    }

    /// Fills the first of the packs that are `needed` and missing, if there is one.
    pub fn fill_pack(&mut self, scene: &PreparedScene, needed: Packs) {
        let missing = self.painted.missing(needed);
        if missing == 0 {
            return;
        }
        self.source.get_or_insert_with(|| PaintedSource::of(scene));
        let optics = scene.hair.optics();
        let hair = optics.painted_hair();
        let views = optics.painted_views(&hair, scene.tables.view());
        let pack = missing.trailing_zeros() as usize;
        self.painted.fill(pack, &views, scene.terms(), run);
    }
}

/// Runs jobs on all threads.
pub(super) fn run(jobs: Vec<Job>) {
    jobs.into_par_iter().for_each(Job::run);
}
