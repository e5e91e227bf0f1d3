//! Hair that is written: as a .groom, or in the format of another program.

use std::borrow::Cow;
use std::path::Path;

use strandlight_formats::{
    Attribute, BakedFile, DiameterSource, Domain, Export, ExportOptions, GROOM_FORMATS, Groom,
    GroomFormat, Kind, UpAxis, counted, groom_format, groom_format_for,
};

use super::kept::note_kept;
use super::presets::Preset;
use crate::cli::{
    Failure, Outcome, check_own_extension, is_stream, note, print_line, write_output,
};

/// What the command line says of a file that is written.
#[derive(Clone, Copy, Default)]
pub struct Wish {
    /// `--to`
    pub to: Option<&'static Preset>,
    /// `--format`
    pub format: Option<&'static dyn GroomFormat>,
    /// Centimetres per unit.
    pub cm_per_unit: Option<f64>,
    /// Up axis.
    pub up: Option<UpAxis>,
}

/// The format of a file, and how it is written.
pub struct Target {
    /// `None`: a .groom.
    format: Option<&'static dyn GroomFormat>,
    options: ExportOptions,
    to: Option<&'static Preset>,
}

impl Target {
    /// Of the file at `path`: as `wish` says, or else by its ending. `plain` is the format for a
    /// stream, `None` a .groom.
    pub fn new(path: &Path, wish: Wish, plain: Option<&str>) -> Result<Target, Failure> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        let by_name = extension.and_then(groom_format_for);
        let is_groom = extension.is_some_and(|end| end.eq_ignore_ascii_case("groom"));
        let is_plain = extension.is_none() && is_stream(path);
        let format = match (wish.to, wish.format) {
            (Some(preset), chosen) => Some(of_preset(path, preset, chosen.or(by_name), extension)?),
            (None, Some(format)) => Some(format),
            (None, None) if is_groom => None,
            (None, None) if is_plain => plain.and_then(groom_format),
            (None, None) => {
                let what = || format!("a groom can be exported to {}", extensions());
                Some(by_name.ok_or_else(|| Failure::file(path, what()))?)
            }
        };
        if let (Some(format), Some(extension)) = (format, extension) {
            check_ending(path, format, extension)?;
        }
        let mut options = ExportOptions::default();
        options.cm_per_unit = wish.cm_per_unit.or(wish.to.map(|to| to.cm_per_unit));
        options.up = wish.up.or(wish.to.map(|to| to.up));
        if format.is_none() && options != ExportOptions::default() {
            let what = "a .groom is in centimetres with y up; name another format";
            return Err(Failure::file(path, what));
        }
        Ok(Target {
            format,
            options,
            to: wish.to,
        })
    }

    /// Is it a .groom?
    pub fn is_groom(&self) -> bool {
        self.format.is_none()
    }

    /// Can one file hold several points in time?
    pub fn holds_frames(&self) -> bool {
        self.format.is_some_and(|format| format.info().can.frames)
    }

    /// Writes `groom` to `path`; on stderr what was kept, on stdout what was written.
    pub fn write(&self, groom: &Groom, path: &Path) -> Outcome {
        let Some(format) = self.format else {
            return write_groom(groom, path);
        };
        let groom = self.prepared(groom);
        let export = groom.export(format, &self.options);
        let export = export.map_err(|error| Failure::file(path, error))?;
        finish(&groom, format, export, path, "")
    }

    /// Writes points in time of a groom to one file.
    pub fn write_frames(&self, frames: &[Groom], fps: f64, path: &Path) -> Outcome {
        let (Some(format), Some(first)) = (self.format, frames.first()) else {
            return Err(Failure::file(path, "a .groom holds one frame"));
        };
        let prepared: Vec<Groom>;
        let frames = match self.prepared(first) {
            Cow::Borrowed(_) => frames,
            // Attributes are those of the first frame.
            Cow::Owned(first) => {
                let others = frames[1..].iter().cloned();
                prepared = std::iter::once(first).chain(others).collect();
                &prepared
            }
        };
        let export = Groom::export_frames(frames, fps, format, &self.options);
        let export = export.map_err(|error| Failure::file(path, error))?;
        let what = format!(
            ", {} at {fps} a second",
            counted(frames.len(), "frame", "frames")
        );
        finish(&frames[0], format, export, path, &what)
    }

    /// The groom with what the program it goes to needs.
    fn prepared<'a>(&self, groom: &'a Groom) -> Cow<'a, Groom> {
        let drawn = groom.diameter_range();
        if self.to.is_none() || drawn.source != DiameterSource::Default {
            return Cow::Borrowed(groom);
        }
        note!("the groom has no widths; {} cm is written", drawn.median);
        let mut groom = groom.clone();
        groom
            .attributes
            .retain(|attribute| attribute.name != "diameter");
        groom.attributes.push(Attribute {
            name: "diameter".to_owned(),
            domain: Domain::Groom,
            components: 1,
            data: vec![drawn.median],
        });
        Cow::Owned(groom)
    }
}

/// Refuses an ending that promises another format, or an encoding that is read and not written, such as .usdc for text.
fn check_ending(path: &Path, format: &dyn GroomFormat, extension: &str) -> Outcome {
    let info = format.info();
    let is = |end: &&str| end.eq_ignore_ascii_case(extension);
    if is_stream(path) {
        return Ok(());
    }
    let is_groom = extension.eq_ignore_ascii_case("groom");
    let is_of_another = is_groom || groom_format_for(extension).is_some();
    if info.extensions[..1].iter().any(is) || !is_of_another {
        return Ok(());
    }
    let end = info.extensions[0];
    let what = format!("{} is written as .{end}; name it so", info.name);
    Err(Failure::file(path, what))
}

/// The format that `preset` has a file of this ending in.
fn of_preset(
    path: &Path,
    preset: &Preset,
    chosen: Option<&'static dyn GroomFormat>,
    extension: Option<&str>,
) -> Result<&'static dyn GroomFormat, Failure> {
    let known: Vec<&'static dyn GroomFormat> = preset
        .formats
        .iter()
        .filter_map(|name| groom_format(name))
        .filter(|format| format.info().can.writes)
        .collect();
    let Some(&first) = known.first() else {
        let names = preset.formats.join(" or ");
        let what = format!("--to {}: this program does not write {names}", preset.name);
        return Err(Failure::Input(what));
    };
    let fits = |format: &&'static dyn GroomFormat| {
        chosen.is_some_and(|chosen| chosen.info().name == format.info().name)
    };
    match known.iter().copied().find(|format| fits(format)) {
        Some(format) => Ok(format),
        None if chosen.is_none() && (extension.is_none() || is_stream(path)) => Ok(first),
        None => {
            let endings = known.iter().map(|format| format.info().extensions[0]);
            let endings: Vec<String> = endings.map(|end| format!(".{end}")).collect();
            let what = format!(
                "--to {} takes {}: {}",
                preset.name,
                endings.join(" or "),
                preset.expects
            );
            Err(Failure::file(path, what))
        }
    }
}

/// Writes a file of `format`, and says what is in it.
fn finish(
    groom: &Groom,
    format: &dyn GroomFormat,
    export: Export,
    path: &Path,
    more: &str,
) -> Outcome {
    write_output(path, &export.bytes)?;
    for line in &export.notes {
        note!("{line}");
    }
    note_kept(path, groom, &export.dropped);
    let mut what = format!(
        ".{}, {}, {}{more}",
        format.info().extensions[0],
        counted(groom.n_strands(), "strand", "strands"),
        counted(
            export.n_points.unwrap_or(groom.points.len()),
            "point",
            "points"
        )
    );
    if !export.dropped.is_empty() {
        let lost = export.dropped.join(", ");
        what += &format!(", without {lost}, which it cannot hold");
    }
    let n_bytes = export.bytes.len();
    print_line(format_args!("{}: {what}, {n_bytes} bytes", path.display()))
}

/// Refuses a name that promises another format of hair than .groom, the only one that the command
/// writes.
pub fn check_groom_name(path: &Path) -> Outcome {
    let extension = path.extension().and_then(|extension| extension.to_str());
    match extension.and_then(groom_format_for) {
        Some(_) if !is_stream(path) => {
            let what = "a .groom is written; name it so, or use groom convert for other formats";
            Err(Failure::file(path, what))
        }
        _ => check_own_extension(path, "groom"),
    }
}

/// Writes a .groom.
pub fn write_groom(groom: &Groom, path: &Path) -> Outcome {
    let bytes = groom
        .to_bytes()
        .map_err(|error| Failure::file(path, error))?;
    write_output(path, &bytes)?;
    let (major, minor) = Kind::Groom.version();
    print_line(format_args!(
        "{}: groom {major}.{minor}, {}, {}, {} bytes",
        path.display(),
        counted(groom.n_strands(), "strand", "strands"),
        counted(groom.points.len(), "point", "points"),
        bytes.len()
    ))
}

/// A format by its name, as `--format` takes it.
pub fn parse_format(name: &str) -> Result<&'static dyn GroomFormat, String> {
    let written = || {
        let infos = GROOM_FORMATS.into_iter().map(GroomFormat::info);
        infos.filter(|info| info.can.writes)
    };
    let found = written().find(|info| info.name == name);
    found
        .and_then(|info| groom_format(info.name))
        .ok_or_else(|| {
            let names: Vec<&str> = written().map(|info| info.name).collect();
            format!("must be {}", listed(&names))
        })
}

/// The endings that grooms are exported to.
fn extensions() -> String {
    let infos = GROOM_FORMATS.into_iter().map(GroomFormat::info);
    let written = infos.filter(|info| info.can.writes);
    let names: Vec<String> = written
        .map(|info| format!(".{}", info.extensions[0]))
        .collect();
    listed(&names.iter().map(String::as_str).collect::<Vec<_>>())
}

/// `a, b or c`.
fn listed(names: &[&str]) -> String {
    match names {
        [before @ .., last] if !before.is_empty() => format!("{} or {last}", before.join(", ")),
        _ => names.concat(),
    }
}
