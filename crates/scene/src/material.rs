//! What an edit of the hair recomputes: from parameter to texture.
//!
//! [`RULES`] lists every part that is derived from [`HairParams`], what it is made of, and the
//! modes that need it. [`HairMaterial::apply`] makes a part when one of its parameters changed or
//! one of its sources was recomputed, and keeps it otherwise. Parts of modes that are not enabled
//! do not exist, nor do the averages where multiple scattering is switched off. Whatever the order
//! of edits, the parts are bit for bit those of [`HairMaterial::new`] with the last parameters.

mod lobes;
mod parts;

use std::sync::Arc;

use rayon::prelude::*;
use web_time::Instant;

use strandlight_formats::TableFile;
pub use strandlight_scattering::Parameter;
use strandlight_scattering::closed_form::{
    AverageTexel, Fibre, LobeDecode, N_AVERAGE_COLUMNS, PaintedAverages, PaintedDecode,
    Reflectance, TERM_GLOBAL, TERM_LOCAL, Tables, pack_averages,
};
use strandlight_scattering::dual_scattering::{
    AverageTable, DEFAULT_AVERAGE_LAYERS, DEFAULT_SCALES, N_INCLINATIONS, PaintedAverageTable,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::jobs::Job;
use strandlight_scattering::lobes::{
    DEFAULT_PAINTED_TEXELS, LobeTable, LobeTexture, PaintedTexture, slice_painted,
};
use strandlight_scattering::multiple_tables::MultipleSource;
use strandlight_scattering::{HairParams, Lobe, Model};

pub use crate::error::EditError;
use crate::optics::{Optics, no_lobes};
use crate::paint::{PaintKinds, no_painted_averages, no_painted_lobes};
use crate::tables::{ShadingTablesError, lobe_table};
use lobes::{LobeMaker, LobeSources};
use parts::{OF_TRT, OF_TT};
pub use parts::{Part, RULES, Rule};

/// What became of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// No enabled mode needs it.
    Absent,
    /// It is as it was.
    Kept,
    /// Recomputed by the edit.
    Rebuilt,
}

impl Outcome {
    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Outcome::Absent => "absent",
            Outcome::Kept => "kept",
            Outcome::Rebuilt => "rebuilt",
        }
    }
}

/// One part in an [`EditReport`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartReport {
    /// The part.
    pub part: Part,
    /// Its name.
    pub name: &'static str,
    /// What became of it.
    pub outcome: Outcome,
    /// Bytes it has on the GPU: 0 for what stays in memory.
    pub gpu_bytes: usize,
    /// What making it took, other parts being made at once perhaps; 0 unless rebuilt.
    pub microseconds: f64,
}

/// What an edit did, a part each row of [`RULES`].
#[derive(Clone, Debug, PartialEq)]
pub struct EditReport {
    /// In the order of [`RULES`].
    pub parts: Vec<PartReport>,
}

impl EditReport {
    /// Whether `part` was recomputed.
    pub fn is_rebuilt(&self, part: Part) -> bool {
        self.rebuilt().any(|report| report.part == part)
    }

    /// The parts that were recomputed.
    pub fn rebuilt(&self) -> impl Iterator<Item = &PartReport> {
        let rebuilt = |report: &&PartReport| report.outcome == Outcome::Rebuilt;
        self.parts.iter().filter(rebuilt)
    }

    /// Adds a later edit: what either recomputed was recomputed.
    pub fn add(&mut self, later: &EditReport) {
        let parts = later.parts.iter().map(|part| {
            let mut part = *part;
            let before = self.parts.iter().find(|before| before.part == part.part);
            if let Some(before) = before.filter(|before| before.outcome == Outcome::Rebuilt) {
                part.microseconds += before.microseconds;
                // A part that is there again after it was not is another one.
                if part.outcome == Outcome::Kept {
                    part.outcome = Outcome::Rebuilt;
                }
            }
            part
        });
        self.parts = parts.collect();
    }

    /// Bytes that have to be written on the GPU.
    pub fn bytes_to_upload(&self) -> usize {
        self.rebuilt().map(|report| report.gpu_bytes).sum()
    }

    /// What making the parts took in all, one after the other; several are made at once.
    pub fn microseconds(&self) -> f64 {
        self.rebuilt().map(|report| report.microseconds).sum()
    }
}

/// The baked lobes that slices are taken from; only those of enabled modes are looked at.
#[derive(Clone, Debug, Default, PartialEq)]
#[doc(hidden)]
pub struct LobeTables {
    /// Lobes of TT.
    pub tt: Option<LobeTable>,
    /// Lobes of TRT.
    pub trt: Option<LobeTable>,
}

impl LobeTables {
    /// Takes the lobes of `modes` out of a file.
    ///
    /// # Errors
    /// As [`lobe_table`].
    pub fn from_file(file: &TableFile, modes: &[Lobe]) -> Result<LobeTables, ShadingTablesError> {
        let read = |mode: Lobe| {
            let wanted = modes.contains(&mode);
            wanted.then(|| lobe_table(file, mode)).transpose()
        };
        Ok(LobeTables {
            tt: read(Lobe::Tt)?,
            trt: read(Lobe::Trt)?,
        })
    }
}

/// Parts that are made while others are, and what that took.
type Timed = Vec<(Part, f64)>;

/// Does `work` and notes that it made `part`.
fn timed(part: Part, made: &mut Timed, work: impl FnOnce()) {
    let start = Instant::now();
    work();
    made.push((part, 1e6 * start.elapsed().as_secs_f64()));
}

/// Runs all jobs at once.
fn at_once(jobs: Vec<Job>) {
    jobs.into_par_iter().for_each(Job::run);
}

/// Everything that shading reads of one fibre, and what it takes to edit it.
#[derive(Clone, Debug, PartialEq)]
pub struct HairMaterial {
    tables: Arc<LobeTables>,
    fresnel: Fresnel,
    segments: u32,
    hair: HairParams,
    modes: Vec<Lobe>,
    is_multiple: bool,
    paint: Option<PaintKinds>,
    /// Are the parts of hair that is not painted there beside those of painted hair?
    keeps_plain: bool,
    /// Of TT and TRT.
    sources: [LobeSources; 2],
    /// Which of `optics` is made.
    made: [bool; RULES.len()],
    /// Shared with clones until one of them is edited.
    optics: Arc<Optics>,
}

impl HairMaterial {
    /// The material of `hair` for `modes`, without multiple scattering. `segments` is
    /// [`Fibre::segments`]; `fresnel` is that of `tables`.
    ///
    /// # Errors
    /// The first parameter outside its range; a mode without its lobes.
    pub fn new(
        tables: Arc<LobeTables>,
        fresnel: Fresnel,
        hair: &HairParams,
        modes: &[Lobe],
        segments: u32,
    ) -> Result<HairMaterial, EditError> {
        let fibre = Fibre::new(hair, &[], segments)?;
        let mut textures = HairMaterial {
            tables,
            fresnel,
            segments,
            hair: *hair,
            modes: Vec::new(),
            is_multiple: false,
            paint: None,
            keeps_plain: false,
            sources: Default::default(),
            made: [false; RULES.len()],
            optics: Optics::paper(fibre).into(),
        };
        textures.edit(hair, modes)?;
        Ok(textures)
    }

    /// Changes the parameters and makes what they touch.
    ///
    /// # Errors
    /// As [`HairMaterial::new`]; nothing is changed then.
    #[doc(hidden)]
    pub fn apply(&mut self, hair: &HairParams) -> Result<EditReport, EditError> {
        let modes = self.modes.clone();
        self.edit(hair, &modes)
    }

    /// Changes which modes are enabled: textures of modes that no longer are go.
    ///
    /// # Errors
    /// A mode without its lobes; nothing is changed then.
    #[doc(hidden)]
    pub fn enable(&mut self, modes: &[Lobe]) -> Result<EditReport, EditError> {
        let hair = self.hair;
        self.edit(&hair, modes)
    }

    /// Switches multiple scattering on or off: the averages come or go.
    #[doc(hidden)]
    pub fn enable_multiple(&mut self, is_multiple: bool) -> EditReport {
        self.is_multiple = is_multiple;
        self.update(self.optics.fibre, Default::default(), false)
    }

    /// Takes the hair for painted with these factors, or for not painted: its parts come or go.
    ///
    /// # Errors
    /// The hair is elliptic or of model `energy`; nothing is changed then.
    #[doc(hidden)]
    pub fn enable_paint(&mut self, paint: Option<PaintKinds>) -> Result<EditReport, EditError> {
        if paint.is_some() {
            check_paintable(&self.hair)?;
        }
        if paint != self.paint {
            let ix = RULES
                .iter()
                .position(|rule| rule.part == Part::PaintedAverages);
            self.made[ix.unwrap_or_default()] = false;
        }
        self.paint = paint;
        Ok(self.update(self.optics.fibre, Default::default(), false))
    }

    /// Keeps the parts of hair that is not painted where some is: points without paint are shaded by them.
    #[doc(hidden)]
    pub fn keep_plain(&mut self) -> EditReport {
        self.keeps_plain = true;
        self.update(self.optics.fibre, Default::default(), false)
    }

    /// What of the hair is painted; [`None`] if nothing is.
    pub fn paint(&self) -> Option<PaintKinds> {
        self.paint
    }

    /// The largest A_b of any fibre: what local scattering sends back of power at most.
    pub(crate) fn largest_local(&self) -> f32 {
        let uniform = self.averages().iter().flat_map(|texel| &texel[..3]);
        let table = &self.optics.painted.averages;
        let rows = table.texels.chunks_exact(N_AVERAGE_COLUMNS);
        let painted = rows.flat_map(|row| row[..N_INCLINATIONS].iter().map(|texel| &texel[0]));
        uniform.chain(painted).fold(0.0, |a, &b| f32::max(a, b))
    }

    /// [`HairMaterial::apply`] and [`HairMaterial::enable`] at once.
    ///
    /// # Errors
    /// As those.
    pub fn edit(&mut self, hair: &HairParams, modes: &[Lobe]) -> Result<EditReport, EditError> {
        // In the order of p, each once: equal sets are equal states.
        let modes: Vec<Lobe> = Lobe::ALL
            .into_iter()
            .filter(|lobe| modes.contains(lobe))
            .collect();
        let fibre = Fibre::new(hair, &modes, self.segments)?;
        if self.paint.is_some() {
            check_paintable(hair)?;
        }
        if hair.model == Model::Energy && self.fresnel != Fresnel::Dielectric {
            return Err(EditError::EnergySchlick);
        }
        for &mode in &modes {
            if mode != Lobe::R && self.table(mode).is_none() {
                return Err(EditError::NoLobes(mode));
            }
        }
        let modes_differ = modes != self.modes;
        let changed = Parameter::ALL.map(|parameter| parameter.differs(&self.hair, hair));
        // Of model `energy` the fibre and the averages hold more than their parameters say.
        let is_other = hair.model != self.hair.model;
        for (rule, is_made) in RULES.iter().zip(&mut self.made) {
            *is_made &= match rule.part {
                Part::Fibre => fibre == self.optics.fibre,
                Part::Averages => !is_other,
                _ => true,
            };
        }
        self.hair = *hair;
        self.modes = modes;
        Ok(self.update(fibre, changed, modes_differ))
    }

    /// Makes what is needed and not there, or of another state: `changed` parameters, other modes.
    fn update(
        &mut self,
        fibre: Fibre,
        changed: [bool; Parameter::ALL.len()],
        modes_differ: bool,
    ) -> EditReport {
        let mut parts: Vec<PartReport> = Vec::with_capacity(RULES.len());
        for (ix, rule) in RULES.iter().enumerate() {
            let of_modes = rule.modes.iter().any(|mode| self.modes.contains(mode));
            let needed = match rule.part {
                Part::Fibre => true,
                Part::Reflectance => of_modes,
                part if part.is_painted() && self.paint.is_none() => false,
                part if !part.is_painted() && self.paint.is_some() && !self.keeps_plain => false,
                Part::Averages | Part::Multiple | Part::PaintedAverages => self.is_multiple,
                _ => of_modes,
            };
            let of_parameters = rule
                .parameters
                .iter()
                .any(|&parameter| changed[parameter as usize]);
            let of_sources = parts.iter().any(|report| {
                report.outcome == Outcome::Rebuilt && rule.sources.contains(&report.part)
            });
            // The fibre holds the modes as well.
            let of_modes = rule.part == Part::Fibre && modes_differ;
            let stale = !self.made[ix] || of_parameters || of_sources || of_modes;
            let outcome = match (needed, stale) {
                (false, _) => Outcome::Absent,
                (true, false) => Outcome::Kept,
                (true, true) => Outcome::Rebuilt,
            };
            if !needed {
                self.drop_part(rule.part);
            }
            self.made[ix] = needed;
            parts.push(PartReport {
                part: rule.part,
                name: rule.name,
                outcome,
                gpu_bytes: 0,
                microseconds: 0.0,
            });
        }
        let rebuilt = parts
            .iter()
            .filter(|report| report.outcome == Outcome::Rebuilt);
        let rebuilt: Vec<Part> = rebuilt.map(|report| report.part).collect();
        for (part, microseconds) in self.make_all(&rebuilt, fibre) {
            let report = parts.iter_mut().find(|report| report.part == part);
            if let Some(report) = report {
                report.microseconds = microseconds;
            }
        }
        for report in &mut parts {
            if report.outcome != Outcome::Absent {
                report.gpu_bytes = self.gpu_bytes(report.part);
            }
        }
        EditReport { parts }
    }

    /// Makes `parts`, which are in the order of [`RULES`]: the lobes of both modes and the averages, which are not made
    /// of each other, at once, and then what is made of them.
    fn make_all(&mut self, parts: &[Part], fibre: Fibre) -> Timed {
        let mut made = Timed::with_capacity(parts.len());
        let is_among = |those: &[Part]| parts.iter().any(|part| those.contains(part));
        let has_averages = is_among(&[Part::Averages]);
        let [tt, trt] = &mut self.sources;
        let optics = Arc::make_mut(&mut self.optics);
        let maker = |mode, table| LobeMaker {
            mode,
            hair: &self.hair,
            fresnel: self.fresnel,
            table,
        };
        let lobes =
            |maker: LobeMaker, those: [Part; 5], sources: &mut LobeSources, texture: &mut _| {
                let mut made = Timed::new();
                for &part in parts.iter().filter(|part| those.contains(part)) {
                    timed(part, &mut made, || maker.make(part, sources, texture));
                }
                made
            };
        let averages = |averages: &mut Vec<AverageTexel>| {
            let mut made = Timed::new();
            if has_averages {
                timed(Part::Averages, &mut made, || {
                    let table = AverageTable::with(&self.hair, self.fresnel, at_once);
                    *averages = pack_averages(&table);
                });
            }
            made
        };
        let (of_tt, of_trt) = (
            maker(Lobe::Tt, self.tables.tt.as_ref()),
            maker(Lobe::Trt, self.tables.trt.as_ref()),
        );
        let (first, (second, third)) = rayon::join(
            || averages(&mut optics.averages),
            || {
                rayon::join(
                    || lobes(of_tt, OF_TT, tt, &mut optics.tt),
                    || lobes(of_trt, OF_TRT, trt, &mut optics.trt),
                )
            },
        );
        made.extend([first, second, third].concat());
        for &part in parts {
            if made.iter().all(|(done, _)| *done != part) {
                timed(part, &mut made, || self.make(part, fibre));
            }
        }
        made
    }

    /// The parameters.
    pub fn hair(&self) -> &HairParams {
        &self.hair
    }

    /// The enabled modes, in the order of p.
    pub fn modes(&self) -> &[Lobe] {
        &self.modes
    }

    /// Is multiple scattering switched on?
    pub fn is_multiple(&self) -> bool {
        self.is_multiple
    }

    /// The averages of multiple scattering; none where that is switched off.
    #[doc(hidden)]
    pub fn averages(&self) -> &[AverageTexel] {
        &self.optics.averages
    }

    /// Fresnel term of the tables.
    pub fn fresnel(&self) -> Fresnel {
        self.fresnel
    }

    /// What shading reads.
    #[doc(hidden)]
    pub fn optics(&self) -> &Optics {
        &self.optics
    }

    fn table(&self, mode: Lobe) -> Option<&LobeTable> {
        match mode {
            Lobe::R => None,
            Lobe::Tt => self.tables.tt.as_ref(),
            Lobe::Trt => self.tables.trt.as_ref(),
        }
    }

    /// Makes `part`, whose sources are there, unless it is one of [`HairMaterial::make_all`]'s own.
    fn make(&mut self, part: Part, fibre: Fibre) {
        match part {
            Part::Fibre => self.optics_mut().fibre = fibre,
            Part::Reflectance => {
                let (eta, intensity) = (self.hair.eta, self.hair.intensity.r);
                let reflectance = Reflectance::new(self.fresnel, eta);
                self.optics_mut().reflectance = reflectance.scaled(intensity);
            }
            Part::Multiple => {
                // Multiple scattering reads none of the baked tables but the lobes.
                let none = Tables {
                    c: &[],
                    h_tt: &[],
                    h_trt: &[],
                    axes: bytemuck::Zeroable::zeroed(),
                };
                let shading = self.optics.shading(none);
                let terms = TERM_GLOBAL | TERM_LOCAL;
                let source = MultipleSource::new(&shading, &self.optics.averages, terms, at_once);
                self.optics_mut().multiple = Some(source);
            }
            Part::PaintedTt => {
                let lobes = self.painted_lobes(Lobe::Tt);
                self.optics_mut().painted.tt = lobes;
            }
            Part::PaintedTrt => {
                let lobes = self.painted_lobes(Lobe::Trt);
                self.optics_mut().painted.trt = lobes;
            }
            Part::PaintedAverages => {
                let kinds = self.paint.unwrap_or_default();
                let scales = |is_painted| if is_painted { DEFAULT_SCALES } else { 1 };
                let size = [
                    DEFAULT_AVERAGE_LAYERS,
                    scales(kinds.widths),
                    scales(kinds.shifts),
                ];
                let table = PaintedAverageTable::new(&self.hair, self.fresnel, size);
                self.optics_mut().painted.averages = table;
            }
            // Of `make_all`.
            Part::RowTt
            | Part::EnergiesTt
            | Part::ShapesTt
            | Part::SharesTt
            | Part::LobesTt
            | Part::RowTrt
            | Part::EnergiesTrt
            | Part::ShapesTrt
            | Part::SharesTrt
            | Part::LobesTrt
            | Part::Averages => {}
        }
    }

    fn optics_mut(&mut self) -> &mut Optics {
        Arc::make_mut(&mut self.optics)
    }

    fn painted_lobes(&self, mode: Lobe) -> PaintedTexture {
        let (eta, caustic_width) = (self.hair.eta, self.hair.caustic_width);
        self.table(mode)
            .map(|table| slice_painted(table, eta, caustic_width, DEFAULT_PAINTED_TEXELS))
            .map(|texture| texture.scaled(self.hair.intensity.get(mode)))
            .unwrap_or_else(no_painted_lobes)
    }

    fn drop_part(&mut self, part: Part) {
        match part {
            Part::Fibre => {}
            Part::Reflectance => self.optics_mut().reflectance = bytemuck::Zeroable::zeroed(),
            Part::RowTt => self.sources[0].row = None,
            Part::EnergiesTt => self.sources[0].energies = None,
            Part::EnergiesTrt => self.sources[1].energies = None,
            Part::RowTrt => self.sources[1].row = None,
            Part::ShapesTt => self.sources[0].shapes = None,
            Part::ShapesTrt => self.sources[1].shapes = None,
            Part::SharesTt => self.sources[0].shares = None,
            Part::SharesTrt => self.sources[1].shares = None,
            Part::LobesTt => self.optics_mut().tt = no_lobes(),
            Part::LobesTrt => self.optics_mut().trt = no_lobes(),
            Part::Averages => self.optics_mut().averages = Vec::new(),
            Part::Multiple => self.optics_mut().multiple = None,
            Part::PaintedTt => self.optics_mut().painted.tt = no_painted_lobes(),
            Part::PaintedTrt => self.optics_mut().painted.trt = no_painted_lobes(),
            Part::PaintedAverages => self.optics_mut().painted.averages = no_painted_averages(),
        }
    }

    /// Bytes of `part` on the GPU, placement in the uniform included.
    fn gpu_bytes(&self, part: Part) -> usize {
        let lobes = |lobes: &LobeTexture| size_of_val(&lobes.texels[..]) + size_of::<LobeDecode>();
        // A row of shapes, and one of each layer but the last.
        let painted = |lobes: &PaintedTexture| {
            let rows = 1 + lobes.decode.last_layer as usize;
            16 * lobes.shapes.len() * rows + size_of::<PaintedDecode>()
        };
        match part {
            Part::Fibre => size_of::<Fibre>(),
            Part::Reflectance => size_of::<Reflectance>(),
            Part::LobesTt => lobes(&self.optics.tt),
            Part::LobesTrt => lobes(&self.optics.trt),
            Part::Averages => size_of_val(self.averages()),
            Part::Multiple => (self.optics.multiple.as_ref()).map_or(0, MultipleSource::bytes),
            Part::PaintedTt => painted(&self.optics.painted.tt),
            Part::PaintedTrt => painted(&self.optics.painted.trt),
            Part::PaintedAverages => {
                let texels = &self.optics.painted.averages.texels;
                size_of_val(&texels[..]) + size_of::<PaintedAverages>()
            }
            _ => 0,
        }
    }
}

/// Painted hair must be round and of Marschner's model.
///
/// # Errors
/// [`EditError::PaintedEccentric`] or [`EditError::PaintedEnergy`] if it is not.
#[doc(hidden)]
pub fn check_paintable(hair: &HairParams) -> Result<(), EditError> {
    if hair.model == Model::Energy {
        return Err(EditError::PaintedEnergy);
    }
    match hair.eccentricity == 1.0 {
        true => Ok(()),
        false => Err(EditError::PaintedEccentric(hair.eccentricity)),
    }
}
