//! What is shown once a picture is finished: its way to ground truth, and what is inspected of it.

use std::time::Duration;

use strandlight_scene::interactive::PictureProgress;
use strandlight_scene::motion::Motion;
use strandlight_scene::{PreparedScene, RenderError};

use super::Viewer;
use crate::ground_truth::{self, GroundTruth, MapLight, Subject, TruthError, TruthProgress};
use crate::inspection::{self, Drawn, Inspected, InspectedState, Inspection, Inspector, Radiance};
use crate::interactive::Display;

impl Viewer {
    /// Lets the picture go on to ground truth once it is finished and as long as nothing changes, or no
    /// longer: in the light of the scene's map, or of its light set where it names none.
    pub fn set_ground_truth(&mut self, is_wanted: bool) {
        self.ground_truth = is_wanted.then(GroundTruth::default);
    }

    /// How far it is to ground truth; `None` where that is not wanted.
    pub fn ground_truth(&self) -> Option<Result<TruthProgress, &TruthError>> {
        let truth = self.ground_truth.as_ref()?;
        Some(truth.error().map_or(Ok(truth.progress()), Err))
    }

    /// When [`Viewer::advance`] has something new without any edit, about; `None` for never.
    pub fn next_update(&self) -> Option<Duration> {
        let is_tracing = self
            .ground_truth
            .as_ref()
            .is_some_and(GroundTruth::is_working);
        let inspector = self.inspector.as_ref();
        let is_drawing = inspector.is_some_and(|inspector| inspector.apart.is_drawing());
        let is_looking = self.mask_view.is_working();
        (is_tracing || is_drawing || is_looking).then_some(ground_truth::PERIOD)
    }

    /// Shows something else than the picture's colours once the picture is finished, or them again. An error
    /// needs [`Viewer::set_ground_truth`].
    pub fn set_inspection(&mut self, inspection: Option<Inspection>) {
        // What is on its way is waited for before something else is drawn.
        let apart = self.inspector.take().map(|inspector| inspector.apart);
        self.inspector = inspection.map(|inspection| Inspector {
            inspection,
            inspected: Inspected::default(),
            of: None,
            picture: None,
            apart: apart.unwrap_or_default(),
        });
    }

    /// Is what is inspected of the picture as it is now? If not, the picture itself is shown.
    pub fn is_inspection_shown(&self) -> bool {
        self.current_inspector().is_some()
    }

    /// The name of what is to be shown in place of the picture's colours and is still being drawn.
    #[cfg(feature = "ui")]
    pub(crate) fn awaited_layer(&self) -> Option<String> {
        let inspection = self.inspection()?;
        let is_awaited = inspection.is_drawn_apart() && !self.is_inspection_shown();
        is_awaited.then(|| inspection.name())
    }

    fn current_inspector(&self) -> Option<&Inspector> {
        let inspector = self.inspector.as_ref()?;
        let (number, ..) = inspector.of.as_ref()?;
        (*number == self.n_outdated).then_some(inspector)
    }

    /// What is shown in place of the picture's colours.
    pub fn inspection(&self) -> Option<Inspection> {
        Some(self.inspector.as_ref()?.inspection)
    }

    /// Linear radiance times 2^exposure and alpha of a pixel of the picture that is inspected for its light, and
    /// its luminance in stops from middle grey.
    pub fn readout(&self, [x, y]: [f32; 2]) -> Option<([f32; 4], f32)> {
        let picture = self.current_inspector()?.picture.as_ref()?;
        let (width, height) = (picture.width as f32, picture.height as f32);
        let is_inside = x >= 0.0 && y >= 0.0 && x < width && y < height;
        let at = is_inside.then(|| y as usize * picture.width as usize + x as usize)?;
        let [r, g, b, a] = *picture.rgba.get(at)?;
        let scale = self.renderer.scene().exposure.exp2();
        let [r, g, b] = [r, g, b].map(|x| scale * x);
        let luminance = inspection::luminance([r, g, b]);
        Some(([r, g, b, a], inspection::stops(luminance)))
    }

    /// Makes what is inspected anew where the picture is another one.
    pub(super) fn inspect(&mut self, progress: &PictureProgress) -> Result<(), RenderError> {
        let size = self.size();
        let Some(inspector) = &self.inspector else {
            return Ok(());
        };
        let scene = self.renderer.scene();
        let (exposure, display) = (scene.exposure, scene.display.clone());
        let converged = self.ground_truth.as_ref().and_then(GroundTruth::converged);
        let samples = converged.map_or(0, |converged| converged.samples);
        let state = (self.n_outdated, (exposure, display), samples);
        let is_finished = progress.is_done && progress.is_shown;
        let inspection = inspector.inspection;
        let is_current = match inspection.is_of_light() {
            true => inspector.of.as_ref() == Some(&state),
            // Light changes nothing of the strands.
            false => inspector
                .of
                .as_ref()
                .is_some_and(|(n, ..)| *n == self.n_outdated),
        };
        if inspection.is_drawn_apart() {
            let is_wanted = is_finished && !size.contains(&0);
            return self.inspect_apart(state, is_current, is_wanted);
        }
        if is_current || !is_finished || size.contains(&0) {
            return Ok(());
        }
        let (pixels, picture) = if inspection.is_of_light() {
            let picture = match converged {
                Some(converged) => converged.picture.clone(),
                None => {
                    self.renderer
                        .render(size, self.renderer.scene().samples, &|_| ())?
                        .0
                }
            };
            let converged = self.ground_truth.as_ref().and_then(GroundTruth::converged);
            let radiance = Radiance {
                picture: &picture,
                grade: (exposure, &state.1.1),
                converged,
            };
            (inspection::of_light(inspection, &radiance), Some(picture))
        } else {
            let scene = self.moved_scene()?;
            let pixels = inspection::of_strands(inspection, &scene, &scene.camera, size)?;
            (Some(pixels), None)
        };
        if let Some(inspector) = &mut self.inspector {
            inspector.inspected = Inspected::new(pixels.unwrap_or_default(), size);
            (inspector.of, inspector.picture) = (Some(state), picture);
        }
        Ok(())
    }

    /// Takes up what is drawn apart of the picture, and has it drawn where that `is_wanted`.
    fn inspect_apart(
        &mut self,
        state: InspectedState,
        is_current: bool,
        is_wanted: bool,
    ) -> Result<(), RenderError> {
        let (size, number) = (self.size(), self.n_outdated);
        let Some(inspector) = &mut self.inspector else {
            return Ok(());
        };
        let wanted = (inspector.inspection, number);
        inspector.apart.take()?;
        if let Some(drawn) = inspector.apart.of(wanted) {
            if !is_current {
                let (_, (exposure, display), _) = &state;
                let pixels = inspection::of_drawn(drawn, (*exposure, display));
                inspector.picture = match drawn {
                    Drawn::Light(picture) => Some(picture.clone()),
                    Drawn::Shares(_) => None,
                };
                inspector.inspected = Inspected::new(pixels, size);
                inspector.of = Some(state);
            }
        } else if is_wanted && inspector.apart.wants(wanted) {
            let scene = self.moved_scene()?;
            if let Some(inspector) = &mut self.inspector {
                inspector.apart.start(wanted, scene, size);
            }
        }
        Ok(())
    }

    /// The scene with its hair where it is now, which a device may have bent for itself.
    pub(super) fn moved_scene(&mut self) -> Result<PreparedScene, RenderError> {
        let mut scene = self.renderer.scene().clone();
        let device = self.renderer.device();
        if let (Some(motion @ Motion::Wind(_)), Some(_)) = (&mut self.motion, device) {
            scene.strands = motion.strands_at(&scene.strands, self.time)?.into();
        }
        Ok(scene)
    }

    /// Starts to trace the picture once it is finished, and takes up what was traced.
    pub(super) fn go_to_ground_truth(
        &mut self,
        progress: &PictureProgress,
    ) -> Result<(), RenderError> {
        let size = self.size();
        let Some(truth) = &mut self.ground_truth else {
            return Ok(());
        };
        truth.set_map(self.session.scene().map_path());
        if truth.wants_subject(progress) {
            let subject = self.subject(size);
            if let Some(truth) = &mut self.ground_truth {
                match subject {
                    Ok(subject) => truth.start(subject),
                    Err(error @ RenderError::DeviceLost(_)) => return Err(error),
                    Err(error) => truth.refuse(error.into()),
                }
            }
        }
        let scene = self.renderer.scene();
        let grade = (scene.exposure, &scene.display);
        if let Some(truth) = &mut self.ground_truth {
            truth.follow(grade);
        }
        Ok(())
    }

    /// The finished picture, over nothing, and what it shows.
    fn subject(&mut self, size: [u32; 2]) -> Result<Subject, RenderError> {
        let scene = self.moved_scene()?;
        let fast = self.renderer.over_nothing(size)?;
        let document = self.session.scene();
        let map = document.map_path().map(|path| MapLight {
            path,
            section: document.lights.clone(),
            scene: self.session.path().to_owned(),
        });
        Ok(Subject { fast, scene, map })
    }

    /// What is inspected, or the picture on its way to ground truth; none where the renderer's own is shown.
    pub(super) fn override_display(&self) -> Option<Display<'_>> {
        let inspector = self.current_inspector();
        let inspected = inspector.and_then(|inspector| inspector.inspected.display());
        let truth = || self.ground_truth.as_ref().and_then(GroundTruth::display);
        inspected.or_else(truth).map(Display::Pixels)
    }
}
