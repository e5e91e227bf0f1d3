//! What differs between two states of a document, in terms of what has to be made anew.

use std::ops::Range;

use strandlight_formats::{
    GroomSection, HairSection, LightsSection, RenderSection, Scene, TablesSection,
};

use strandlight_scene::assets::densities;

/// What an edit, an undo or a redo has changed. Every field says what depends on it; nothing is
/// set that does not have to be made again.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Change {
    /// The view: projection, shading, drawing.
    pub camera: bool,
    /// Size of the picture.
    pub size: bool,
    /// Samples a pixel that are asked for.
    pub samples: bool,
    /// Exposure, tone map or background: composing the picture alone.
    pub grade: bool,
    /// Optical parameters of the fibres: textures, see [`strandlight_scene::edit::RULES`].
    pub hair: bool,
    /// The modes that are drawn.
    pub modes: bool,
    /// The terms that are drawn.
    pub scattering: bool,
    /// d_f or d_b: shading.
    pub densities: bool,
    /// Amplitudes of lights: shading, and a background of lights.
    pub light_colors: bool,
    /// Directions of lights, or another set: sweeps, shadow maps, amplitudes.
    pub lights: bool,
    /// How many shadow maps are drawn.
    pub shadow_maps: bool,
    /// Thickness of the fibres: the points' radii, and so volume, sweeps and shadow maps.
    pub diameter: bool,
    /// Another groom: everything.
    pub geometry: bool,
    /// Other tables: everything that is made of them.
    pub tables: bool,
    /// Points of the groom that were painted.
    pub paint: Option<Range<usize>>,
    /// Things beside the hair that stand in the light.
    pub proxies: bool,
    /// How the hair moves.
    pub motion: bool,
    /// What only the file holds: the name of a preset, the same number told in another way.
    pub label: bool,
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
            camera,
            render,
            proxies,
            motion,
            folder: _,
        } = after;
        let mut change = Change {
            camera: before.camera != *camera,
            geometry: before.groom_path() != after.groom_path(),
            tables: before.tables_path() != after.tables_path()
                || named(before.tables.as_ref()) != named(tables.as_ref()),
            proxies: before.proxies != *proxies,
            motion: before.motion != *motion || before.frame_paths() != after.frame_paths(),
            ..Change::default()
        };
        change.add_lights(&before.lights, lights);
        change.lights |= before.lights_path() != after.lights_path();
        change.add_hair(&before.hair, hair);
        change.add_render(&before.render, render);
        change
    }

    fn add_lights(&mut self, before: &LightsSection, after: &LightsSection) {
        let LightsSection {
            file: _,
            intensity,
            rotate_deg,
            tint,
            muted,
            solo,
            adjust,
        } = after;
        self.lights = before.rotate_deg != *rotate_deg;
        self.light_colors = before.intensity != *intensity
            || before.tint != *tint
            || before.muted != *muted
            || before.solo != *solo
            || before.adjust != *adjust;
    }

    fn add_hair(&mut self, before: &HairSection, after: &HairSection) {
        // A test sees to it that every row of the section is a change.
        let HairSection {
            preset,
            reflectance,
            melanin,
            diameter_cm,
            density_forward,
            density_back,
            ..
        } = after;
        self.hair = before.params().bits() != after.params().bits();
        self.modes = before.modes != after.modes;
        self.densities = densities(before) != densities(after);
        self.diameter = before.diameter_cm != *diameter_cm;
        // The same numbers, told in another way.
        self.label = before.preset != *preset
            || before.reflectance != *reflectance
            || before.melanin != *melanin
            || before.density_forward != *density_forward
            || before.density_back != *density_back;
    }

    fn add_render(&mut self, before: &RenderSection, after: &RenderSection) {
        let RenderSection {
            size,
            samples,
            exposure,
            tone_map,
            background,
            scattering,
            shadow_maps,
        } = after;
        self.size = before.size != *size;
        self.samples = before.samples != *samples;
        self.grade = before.exposure != *exposure
            || before.tone_map != *tone_map
            || before.background != *background;
        self.scattering = before.scattering != *scattering;
        self.shadow_maps = before.shadow_maps != *shadow_maps;
    }

    /// Painted points `range` of the groom.
    pub fn painted(range: Range<usize>) -> Change {
        Change {
            paint: (!range.is_empty()).then_some(range),
            ..Change::default()
        }
    }

    /// Everything: the document was replaced.
    pub fn everything() -> Change {
        Change {
            camera: true,
            size: true,
            samples: true,
            grade: true,
            hair: true,
            modes: true,
            scattering: true,
            densities: true,
            light_colors: true,
            lights: true,
            shadow_maps: true,
            diameter: true,
            geometry: true,
            tables: true,
            paint: None,
            proxies: true,
            motion: true,
            label: true,
        }
    }

    /// Is nothing changed?
    pub fn is_empty(&self) -> bool {
        *self == Change::default()
    }

    /// Both changes, one after the other.
    #[must_use]
    pub fn and(self, other: Change) -> Change {
        let paint = match (self.paint, other.paint) {
            (Some(a), Some(b)) => Some(a.start.min(b.start)..a.end.max(b.end)),
            (a, b) => a.or(b),
        };
        Change {
            camera: self.camera | other.camera,
            size: self.size | other.size,
            samples: self.samples | other.samples,
            grade: self.grade | other.grade,
            hair: self.hair | other.hair,
            modes: self.modes | other.modes,
            scattering: self.scattering | other.scattering,
            densities: self.densities | other.densities,
            light_colors: self.light_colors | other.light_colors,
            lights: self.lights | other.lights,
            shadow_maps: self.shadow_maps | other.shadow_maps,
            diameter: self.diameter | other.diameter,
            geometry: self.geometry | other.geometry,
            tables: self.tables | other.tables,
            paint,
            proxies: self.proxies | other.proxies,
            motion: self.motion | other.motion,
            label: self.label | other.label,
        }
    }

    /// Names of what is changed, as in [`Change`].
    pub fn names(&self) -> Vec<&'static str> {
        [
            ("camera", self.camera),
            ("size", self.size),
            ("samples", self.samples),
            ("grade", self.grade),
            ("hair", self.hair),
            ("modes", self.modes),
            ("scattering", self.scattering),
            ("densities", self.densities),
            ("light_colors", self.light_colors),
            ("lights", self.lights),
            ("shadow_maps", self.shadow_maps),
            ("diameter", self.diameter),
            ("geometry", self.geometry),
            ("tables", self.tables),
            ("paint", self.paint.is_some()),
            ("proxies", self.proxies),
            ("motion", self.motion),
            ("label", self.label),
        ]
        .into_iter()
        .filter_map(|(name, is_set)| is_set.then_some(name))
        .collect()
    }
}

fn named(tables: Option<&TablesSection>) -> Option<&std::path::Path> {
    tables.map(|tables| tables.file.as_path())
}
