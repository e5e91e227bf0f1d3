//! What each edit recomputes: the inputs of every stage, once.
//!
//! Setters mark [`Inputs`]; [`STAGES`] says which stages they make stale. Of the hair's parameters,
//! [`RULES`](strandlight_scene::material::RULES) says further which tables are rebuilt before
//! `shade`.

bitflags::bitflags! {
    /// What can be set on a renderer.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct Inputs: u32 {
        /// Positions and radii of the points, or the wind that bends them.
        const POINTS = 1;
        /// Directions and bandwidths of the lights.
        const LIGHTS = 1 << 1;
        /// Ellipsoids and ground.
        const PROXIES = 1 << 2;
        /// Amplitudes of the lights.
        const LIGHT_COLORS = 1 << 3;
        /// Parameters of the hair.
        const HAIR = 1 << 4;
        /// Modes and terms of scattering.
        const TERMS = 1 << 5;
        /// d_f and d_b.
        const DENSITIES = 1 << 6;
        /// Dye, widths and shifts of points.
        const PAINT = 1 << 7;
        /// Camera and size of the picture.
        const VIEW = 1 << 8;
        /// Exposure, tone map and background.
        const GRADE = 1 << 9;
    }
}

/// A stage of a frame and what makes it stale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StageRule {
    /// Name, as reports have it.
    pub name: &'static str,
    /// Inputs that it reads.
    pub inputs: Inputs,
    /// Earlier stages whose results it reads.
    pub sources: &'static [&'static str],
}

const fn rule(
    name: &'static str,
    inputs: &[Inputs],
    sources: &'static [&'static str],
) -> StageRule {
    let mut all = Inputs::empty();
    let mut ix = 0;
    while ix < inputs.len() {
        all = all.union(inputs[ix]);
        ix += 1;
    }
    StageRule {
        name,
        inputs: all,
        sources,
    }
}

/// All stages in the order they run.
///
/// Two run in part only: another view draws the shadow maps towards the eye, if the line of sight
/// turned, and looks them up at other points, and another amplitude draws maps only where a light got so bright that it needs one that
/// it has not; both are left out here. Pictures by samples run `project` and no `list`, those without samples `list`
/// before `shade` and no `project`.
pub const STAGES: [StageRule; 9] = [
    rule("voxelise", &[Inputs::POINTS], &[]),
    rule(
        "shadow maps",
        &[Inputs::POINTS, Inputs::LIGHTS, Inputs::PROXIES],
        &[],
    ),
    rule(
        "transmittance",
        &[Inputs::LIGHTS, Inputs::PROXIES],
        &["voxelise"],
    ),
    rule(
        "shade",
        &[
            Inputs::LIGHT_COLORS,
            Inputs::HAIR,
            Inputs::TERMS,
            Inputs::DENSITIES,
            Inputs::PAINT,
            Inputs::VIEW,
        ],
        &["shadow maps", "transmittance"],
    ),
    rule("project", &[Inputs::POINTS, Inputs::VIEW], &[]),
    rule(
        "list",
        &[Inputs::POINTS, Inputs::PROXIES, Inputs::VIEW],
        &[],
    ),
    rule("draw", &[], &["shade", "project", "list"]),
    rule("composite", &[Inputs::GRADE], &["draw"]),
    rule("display", &[Inputs::GRADE], &["composite"]),
];

/// Names of the stages that other `inputs` make stale, in the order they run.
pub fn stale_stages(inputs: Inputs) -> impl Iterator<Item = &'static str> {
    let mut stale = Vec::with_capacity(STAGES.len());
    for stage in &STAGES {
        let of_sources = stage.sources.iter().any(|source| stale.contains(source));
        if of_sources || stage.inputs.intersects(inputs) {
            stale.push(stage.name);
        }
    }
    stale.into_iter()
}

/// Does `stage` have to run after other `inputs`?
pub(crate) fn is_stale(stage: &str, inputs: Inputs) -> bool {
    stale_stages(inputs).any(|stale| stale == stage)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_come_before_and_every_input_is_read() {
        for (ix, stage) in STAGES.iter().enumerate() {
            for source in stage.sources {
                let place = STAGES.iter().position(|other| other.name == *source);
                assert!(place.is_some_and(|place| place < ix), "{source}");
            }
        }
        let read = STAGES
            .iter()
            .fold(Inputs::empty(), |all, stage| all | stage.inputs);
        assert_eq!(read, Inputs::all());
        assert_eq!(stale_stages(Inputs::all()).count(), STAGES.len());
        assert_eq!(stale_stages(Inputs::empty()).count(), 0);
    }

    #[test]
    fn edits_of_the_hair_sweep_nothing() {
        let stale: Vec<_> = stale_stages(Inputs::HAIR).collect();
        assert_eq!(stale, ["shade", "draw", "composite", "display"]);
        let stale: Vec<_> = stale_stages(Inputs::GRADE).collect();
        assert_eq!(stale, ["composite", "display"]);
        assert!(is_stale("transmittance", Inputs::POINTS));
        assert!(!is_stale("transmittance", Inputs::VIEW));
    }
}
