//! What differs between two states of a document, in terms of what must be recomputed.

use std::ops::Range;
use std::path::PathBuf;

use strandlight_formats::{
    AddedLight, GroomSection, HairSection, LightsSection, RenderSection, Scene, TablesSection,
};

use strandlight_render::invalidation::Inputs;
use strandlight_scene::assets::densities;

bitflags::bitflags! {
    /// Parts of a scene, as edits change them.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct Edits: u32 {
        /// The view.
        const CAMERA = 1;
        /// Size of the picture.
        const SIZE = 1 << 1;
        /// Samples per pixel that are asked for.
        const SAMPLES = 1 << 2;
        /// Exposure, tone map, LUT or background.
        const GRADE = 1 << 3;
        /// Optical parameters of the fibres: tables, see [`strandlight_scene::material::RULES`].
        const HAIR = 1 << 4;
        /// The modes that are drawn.
        const MODES = 1 << 5;
        /// The terms that are drawn.
        const SCATTERING = 1 << 6;
        /// d_f or d_b.
        const DENSITIES = 1 << 7;
        /// Amplitudes of lights, and so a background of lights.
        const LIGHT_COLORS = 1 << 8;
        /// Directions of lights, or another set.
        const LIGHTS = 1 << 9;
        /// How many shadow maps are drawn.
        const SHADOW_MAPS = 1 << 10;
        /// Thickness of the fibres: the points' radii.
        const DIAMETER = 1 << 11;
        /// Another groom.
        const GEOMETRY = 1 << 12;
        /// Other tables.
        const TABLES = 1 << 13;
        /// Paint of points.
        const PAINT = 1 << 14;
        /// Things beside the hair that stand in the light.
        const PROXIES = 1 << 15;
        /// How the hair moves.
        const MOTION = 1 << 16;
        /// What only the file holds: the name of a preset, the same number in another notation.
        const LABEL = 1 << 17;
        /// Fibres of strands that differ, or the hair's own where those go by it: what points are
        /// painted with.
        const VARIATION = 1 << 18;
        /// Clumps and frizz.
        const SHAPE = 1 << 19;
        /// Mask of points: what brushes leave alone, which no picture shows.
        const MASK = 1 << 20;
    }
}

/// An edit, its name in reports, and what it sets on a renderer.
#[derive(Clone, Copy, Debug)]
pub struct EditRule {
    /// Name, as `timings.json` has it.
    pub name: &'static str,
    /// The edit.
    pub edit: Edits,
    /// What [`STAGES`](strandlight_render::invalidation::STAGES) are recomputed from it. All inputs
    /// where the scene is prepared again.
    pub inputs: Inputs,
}

const fn rule(name: &'static str, edit: Edits, inputs: Inputs) -> EditRule {
    EditRule { name, edit, inputs }
}

/// What every edit sets on a renderer: the roots of the invalidation graph.
pub const EDITS: [EditRule; 21] = [
    rule("camera", Edits::CAMERA, Inputs::VIEW),
    rule("size", Edits::SIZE, Inputs::VIEW),
    rule("samples", Edits::SAMPLES, Inputs::empty()),
    rule("grade", Edits::GRADE, Inputs::GRADE),
    rule("hair", Edits::HAIR, Inputs::HAIR),
    rule("modes", Edits::MODES, Inputs::TERMS),
    rule("scattering", Edits::SCATTERING, Inputs::TERMS),
    rule("densities", Edits::DENSITIES, Inputs::DENSITIES),
    rule("light_colors", Edits::LIGHT_COLORS, Inputs::LIGHT_COLORS),
    rule(
        "lights",
        Edits::LIGHTS,
        Inputs::LIGHTS.union(Inputs::LIGHT_COLORS),
    ),
    rule("shadow_maps", Edits::SHADOW_MAPS, Inputs::all()),
    rule("diameter", Edits::DIAMETER, Inputs::POINTS),
    rule("geometry", Edits::GEOMETRY, Inputs::all()),
    rule("tables", Edits::TABLES, Inputs::all()),
    rule("paint", Edits::PAINT, Inputs::PAINT),
    rule("mask", Edits::MASK, Inputs::empty()),
    rule("variation", Edits::VARIATION, Inputs::PAINT),
    rule("shape", Edits::SHAPE, Inputs::all()),
    rule("proxies", Edits::PROXIES, Inputs::PROXIES),
    rule("motion", Edits::MOTION, Inputs::all()),
    rule("label", Edits::LABEL, Inputs::empty()),
];

/// What an edit, an undo or a redo has changed, and nothing else.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Change {
    /// Parts of the scene.
    pub edits: Edits,
    /// Points of the groom that were painted, where [`Edits::PAINT`] is among the edits.
    pub paint: Option<Range<usize>>,
}

impl Change {
    /// What has to be made again when `after` takes the place of `before`.
    pub fn between(before: &Scene, after: &Scene) -> Change {
        // Taken apart, so that no key of a scene is forgotten here.
        let Scene {
            version: _,
            groom: GroomSection { file: _ },
            lights,
            tables,
            hair,
            variation,
            camera,
            render,
            proxies,
            motion,
            folder: _,
        } = after;
        let mut edits = Edits::empty();
        edits.set(Edits::CAMERA, before.camera != *camera);
        edits.set(Edits::GEOMETRY, before.groom_path() != after.groom_path());
        let has_other_tables = before.tables_path() != after.tables_path()
            || named(before.tables.as_ref()) != named(tables.as_ref());
        edits.set(Edits::TABLES, has_other_tables);
        let has_other_meshes = before.mesh_paths() != after.mesh_paths();
        edits.set(
            Edits::PROXIES,
            before.proxies != *proxies || has_other_meshes,
        );
        let has_other_frames = before.frame_paths() != after.frame_paths();
        edits.set(Edits::MOTION, before.motion != *motion || has_other_frames);
        edits |= edits_of_lights(&before.lights, lights);
        let has_other_lights = before.lights_path() != after.lights_path();
        edits.set(
            Edits::LIGHTS,
            edits.contains(Edits::LIGHTS) || has_other_lights,
        );
        edits |= edits_of_hair(&before.hair, hair) | edits_of_render(&before.render, render);
        edits |= edits_of_variation(before, after);
        let is_label = edits.contains(Edits::LABEL)
            || before.variation != *variation && !edits.intersects(Edits::VARIATION | Edits::SHAPE);
        edits.set(
            Edits::GRADE,
            edits.contains(Edits::GRADE)
                || before.lut_path() != after.lut_path()
                || behind(before) != behind(after),
        );
        // A panorama that is not seen changes nothing.
        let has_other_panorama = before.lights.panorama != lights.panorama;
        // Ground truth alone is lit by it, and looks for itself.
        let has_other_map = before.lights.map != lights.map;
        edits.set(
            Edits::LABEL,
            is_label || has_other_map || has_other_panorama && !edits.contains(Edits::GRADE),
        );
        Change { edits, paint: None }
    }

    /// Painted points `range` of the groom.
    pub fn painted(range: Range<usize>) -> Change {
        if range.is_empty() {
            return Change::default();
        }
        Change {
            edits: Edits::PAINT,
            paint: Some(range),
        }
    }

    /// Everything: the document was replaced.
    pub fn everything() -> Change {
        Change {
            edits: Edits::all().difference(Edits::PAINT | Edits::MASK),
            paint: None,
        }
    }

    /// Is any of `edits` among the changes?
    pub fn has(&self, edits: Edits) -> bool {
        self.edits.intersects(edits)
    }

    /// Is nothing changed?
    pub fn is_empty(&self) -> bool {
        self.edits.is_empty()
    }

    /// Both changes, one after the other.
    #[must_use]
    pub fn and(self, other: Change) -> Change {
        let paint = match (self.paint, other.paint) {
            (Some(a), Some(b)) => Some(a.start.min(b.start)..a.end.max(b.end)),
            (a, b) => a.or(b),
        };
        Change {
            edits: self.edits | other.edits,
            paint,
        }
    }

    /// The rules of the changes.
    fn rules(&self) -> impl Iterator<Item = &'static EditRule> {
        EDITS.iter().filter(|rule| self.has(rule.edit))
    }

    /// Names of what is changed, as [`EDITS`] has them.
    pub fn names(&self) -> Vec<&'static str> {
        self.rules().map(|rule| rule.name).collect()
    }

    /// What is set on a renderer.
    pub fn inputs(&self) -> Inputs {
        self.rules()
            .fold(Inputs::empty(), |all, rule| all | rule.inputs)
    }
}

/// What is seen of the panorama.
fn behind(scene: &Scene) -> Option<(PathBuf, f64, f64, [f64; 3])> {
    let lights = &scene.lights;
    let path = scene.seen_panorama_path()?;
    Some((path, lights.rotate_deg, lights.intensity, lights.tint))
}

fn edits_of_lights(before: &LightsSection, after: &LightsSection) -> Edits {
    let LightsSection {
        file: _,
        // Only where it is seen: with the background.
        panorama: _,
        // Of no picture but ground truth.
        map: _,
        intensity,
        rotate_deg,
        tint,
        muted,
        solo,
        adjust,
        added,
    } = after;
    let mut edits = Edits::empty();
    let shape = |light: &AddedLight| AddedLight {
        intensity: 1.0,
        color: [1.0; 3],
        ..*light
    };
    let has_other_added = !before.added.iter().map(shape).eq(added.iter().map(shape));
    edits.set(
        Edits::LIGHTS,
        before.rotate_deg != *rotate_deg || has_other_added,
    );
    let has_other_colors = before.intensity != *intensity
        || before.tint != *tint
        || before.muted != *muted
        || before.solo != *solo
        || before.adjust != *adjust
        || before.added != *added;
    edits.set(Edits::LIGHT_COLORS, has_other_colors);
    edits
}

fn edits_of_hair(before: &HairSection, after: &HairSection) -> Edits {
    // A test sees to it that every row of the section is a change.
    let HairSection {
        preset,
        reflectance,
        melanin,
        diameter_cm,
        taper,
        density_forward,
        density_back,
        ..
    } = after;
    let mut edits = Edits::empty();
    edits.set(Edits::HAIR, before.params().bits() != after.params().bits());
    edits.set(Edits::MODES, before.modes != after.modes);
    edits.set(Edits::DENSITIES, densities(before) != densities(after));
    let is_thicker = before.diameter_cm != *diameter_cm || before.taper != *taper;
    edits.set(Edits::DIAMETER, is_thicker);
    // The same numbers, in another notation.
    let has_other_label = before.preset != *preset
        || before.reflectance != *reflectance
        || before.melanin != *melanin
        || before.density_forward != *density_forward
        || before.density_back != *density_back;
    edits.set(Edits::LABEL, has_other_label);
    edits
}

fn edits_of_variation(before: &Scene, after: &Scene) -> Edits {
    let [old, new] = [&before.variation, &after.variation];
    let sigma_a = |scene: &Scene| scene.hair.params().sigma_a.map(f64::to_bits);
    let goes_by_hair = new.varies_absorption() && sigma_a(before) != sigma_a(after);
    let mut edits = Edits::empty();
    let has_other_fibres = old.of_fibres() != new.of_fibres();
    edits.set(Edits::VARIATION, has_other_fibres || goes_by_hair);
    edits.set(Edits::SHAPE, old.of_shape() != new.of_shape());
    edits
}

fn edits_of_render(before: &RenderSection, after: &RenderSection) -> Edits {
    let RenderSection {
        size,
        samples,
        exposure,
        tone_map,
        lut,
        lut_input,
        background,
        scattering,
        shadow_maps,
    } = after;
    let mut edits = Edits::empty();
    edits.set(Edits::SIZE, before.size != *size);
    edits.set(Edits::SAMPLES, before.samples != *samples);
    let has_other_grade = before.exposure != *exposure
        || before.tone_map != *tone_map
        || before.lut != *lut
        || before.lut_input != *lut_input
        || before.background != *background;
    edits.set(Edits::GRADE, has_other_grade);
    edits.set(Edits::SCATTERING, before.scattering != *scattering);
    edits.set(Edits::SHADOW_MAPS, before.shadow_maps != *shadow_maps);
    edits
}

fn named(tables: Option<&TablesSection>) -> Option<&std::path::Path> {
    tables.map(|tables| tables.file.as_path())
}
