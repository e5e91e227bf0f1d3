//! Grooms from and to files of any format.

use std::path::Path;

use strandlight_bake::grooms::{
    PRESETS, Preset, dye_from_color, guides, subset, turn_strands, turned_strands,
};
use strandlight_formats::{
    Attribute, BakedFile, DiameterSource, Domain, Error, ExportOptions, FileKind, Groom,
    GroomFormat, ImportOptions, Kind, LengthUnit, SNIFF_BYTES, SourceFile, StatedBy, UpAxis,
    groom_format, groom_format_for, read_start, write_file,
};

use crate::fault::{Fault, Outcome};

/// How a file is understood, as Python says it.
pub struct Wishes {
    /// Centimetres, a name, or `auto`.
    pub unit: Option<String>,
    /// x, y, z or `auto`.
    pub up: Option<String>,
    /// One object of the file.
    pub prim: Option<String>,
    /// Points that a cubic segment becomes.
    pub samples_per_segment: Option<u32>,
    /// Point in time.
    pub frame: u32,
    /// `keep` or `auto`.
    pub root: String,
    /// `drop`, `keep` or `only`.
    pub guides: String,
    /// Attribute that the hair is dyed by.
    pub color_from: Option<String>,
}

/// A unit as the command line names it, in centimetres.
pub fn unit_cm(text: &str) -> Outcome<f64> {
    let named = LengthUnit::from_name(text).map(LengthUnit::cm);
    let cm = named.or_else(|| text.parse().ok());
    cm.filter(|cm| (1e-6..=1e6).contains(cm)).ok_or_else(|| {
        let names = LengthUnit::ALL.map(LengthUnit::name).join(", ");
        Fault::value(format!(
            "unit is {text:?}, must be {names}, or a number of centimetres in 1e-6..=1e6"
        ))
    })
}

/// An axis by its name.
pub fn up_axis(text: &str) -> Outcome<UpAxis> {
    match text {
        "x" => Ok(UpAxis::X),
        "y" => Ok(UpAxis::Y),
        "z" => Ok(UpAxis::Z),
        _ => Err(Fault::value(format!("up is {text:?}, must be x, y or z"))),
    }
}

/// Reads any file of hair.
pub fn read(path: &Path, wishes: &Wishes) -> Outcome<Groom> {
    let start = read_start(path, SNIFF_BYTES as u64)?;
    let mut groom = match FileKind::of(&start) {
        FileKind::Ours(Kind::Groom) => {
            let asked = [
                ("unit", wishes.unit.is_some()),
                ("up", wishes.up.is_some()),
                ("prim", wishes.prim.is_some()),
                ("samples_per_segment", wishes.samples_per_segment.is_some()),
                ("frame", wishes.frame > 0),
            ];
            if let Some((name, _)) = asked.into_iter().find(|(_, is_asked)| *is_asked) {
                let what = format!(
                    "a .groom is in centimetres with y up and holds one frame and object; {name} is \
                     for files of other programs"
                );
                return Err(Fault::value(what).in_file(path));
            }
            Groom::read(path)?
        }
        _ => import(path, wishes)?,
    };
    use_guides(&mut groom, &wishes.guides).map_err(|fault| fault.in_file(path))?;
    match wishes.root.as_str() {
        "keep" => {}
        "auto" => {
            let turned = turned_strands(&groom);
            turn_strands(&mut groom, &turned)?;
        }
        other => {
            let what = format!("root is {other:?}, must be keep or auto");
            return Err(Fault::value(what));
        }
    }
    if let Some(name) = &wishes.color_from {
        let dyed = dye_from_color(&mut groom, name);
        dyed.map_err(|error| Fault::from(error).in_file(path))?;
    }
    Ok(groom)
}

/// Reads a file of another program.
fn import(path: &Path, wishes: &Wishes) -> Outcome<Groom> {
    let is_auto = |wish: &Option<String>| wish.as_deref() == Some("auto");
    let (guess_unit, guess_up) = (is_auto(&wishes.unit), is_auto(&wishes.up));
    let mut options = ImportOptions::default().with_frame(wishes.frame);
    options.object = wishes.prim.clone();
    if let Some(n) = wishes.samples_per_segment {
        options.samples_per_segment = n;
    }
    if let (Some(unit), false) = (&wishes.unit, guess_unit) {
        options.cm_per_unit = Some(unit_cm(unit)?);
    }
    if let (Some(up), false) = (&wishes.up, guess_up) {
        options.up = Some(up_axis(up)?);
    }
    let file = SourceFile::read(path)?;
    if guess_unit || guess_up {
        find_out(&file, &mut options, [guess_unit, guess_up])
            .map_err(|fault| fault.in_file(path))?;
    }
    Ok(file.import(&options)?.groom)
}

/// Unit and axis where they are to be guessed and the file does not state them.
fn find_out(file: &SourceFile, options: &mut ImportOptions, asked: [bool; 2]) -> Outcome<()> {
    let (stated, guesses) = match file.import(options) {
        Ok(import) => (
            [import.unit_by, import.up_by].map(|by| by == StatedBy::File),
            import.groom.guess_source(),
        ),
        // In the usual unit it may be too large for a groom.
        Err(Error::Value { .. }) if options.cm_per_unit.is_none() => {
            let small = options.clone().with_unit(0.01);
            ([false; 2], file.import(&small)?.groom.guess_source())
        }
        Err(error) => return Err(error.into()),
    };
    if asked[0] && !stated[0] {
        let unit = guesses.unit.ok_or_else(|| {
            Fault::value(
                "unit is \"auto\", and it is not like a head of hair in any unit; name one",
            )
        })?;
        options.cm_per_unit = Some(unit.value.cm());
    }
    if asked[1] && !stated[1] {
        let up = guesses.up.ok_or_else(|| {
            Fault::value("up is \"auto\", and neither position nor hair tells the axis; name it")
        })?;
        options.up = Some(up.value);
    }
    Ok(())
}

fn use_guides(groom: &mut Groom, asked: &str) -> Outcome<()> {
    let wanted = match asked {
        "keep" => return Ok(()),
        "drop" => false,
        "only" => true,
        _ => {
            let what = format!("guides is {asked:?}, must be drop, keep or only");
            return Err(Fault::value(what));
        }
    };
    let Some(is_guide) = guides(groom) else {
        return match wanted {
            true => Err(Fault::value("guides is \"only\", and it has no guides")),
            false => Ok(()),
        };
    };
    // Guides alone are all the hair there is.
    if is_guide.iter().all(|&it| it) {
        return Ok(());
    }
    let strands = 0..groom.n_strands();
    let kept: Vec<usize> = strands.filter(|&ix| is_guide[ix] == wanted).collect();
    *groom = subset(groom, &kept);
    // It is about all strands of the file.
    groom.source.original = None;
    Ok(())
}

/// How a file is written, as Python says it.
pub struct Target {
    /// A program that the file is for.
    pub to: Option<String>,
    /// A format by its name.
    pub format: Option<String>,
    /// Centimetres or a name.
    pub unit: Option<String>,
    /// x, y or z.
    pub up: Option<String>,
}

/// Writes a file of hair; answers the names of attributes that it cannot hold.
pub fn write(groom: &Groom, path: &Path, target: &Target) -> Outcome<Vec<String>> {
    let preset = target.to.as_deref().map(preset).transpose()?;
    let mut options = ExportOptions::default();
    let unit = target.unit.as_deref().map(unit_cm).transpose()?;
    let up = target.up.as_deref().map(up_axis).transpose()?;
    options.cm_per_unit = unit.or(preset.map(|to| to.cm_per_unit));
    options.up = up.or(preset.map(|to| to.up));
    let Some(format) = format(path, target.format.as_deref(), preset)? else {
        if options != ExportOptions::default() {
            let what = "a .groom is in centimetres with y up; name another format";
            return Err(Fault::value(what).in_file(path));
        }
        groom.write(path)?;
        return Ok(Vec::new());
    };
    let with_width = preset.and_then(|_| with_width(groom));
    let groom = with_width.as_ref().unwrap_or(groom);
    let export = groom.export(format, &options);
    let export = export.map_err(|error| Fault::from(error.in_file(path)))?;
    let written = write_file(path, &export.bytes);
    written.map_err(|error| Error::from(error).in_file(path))?;
    Ok(export.dropped)
}

fn preset(name: &str) -> Outcome<&'static Preset> {
    PRESETS.iter().find(|it| it.name == name).ok_or_else(|| {
        let names: Vec<&str> = PRESETS.iter().map(|it| it.name).collect();
        let what = format!("to is {name:?}, must be one of {}", names.join(", "));
        Fault::value(what)
    })
}

/// The format of the file at `path`; `None` is a .groom.
fn format(
    path: &Path,
    named: Option<&str>,
    preset: Option<&Preset>,
) -> Outcome<Option<&'static dyn GroomFormat>> {
    let extension = path.extension().and_then(|extension| extension.to_str());
    let by_name = extension.and_then(groom_format_for);
    let chosen = match named {
        None => None,
        Some("groom") => return Ok(None),
        Some(name) => {
            let found = groom_format(name).filter(|it| it.info().can.writes);
            let unknown = || Fault::value(format!("format is {name:?}, which is not written"));
            Some(found.ok_or_else(unknown)?)
        }
    };
    let refused = |what: String| Err(Fault::value(what).in_file(path));
    let found = match (preset, chosen.or(by_name)) {
        (None, Some(found)) => found,
        (None, None) if extension.is_some_and(|it| it.eq_ignore_ascii_case("groom")) => {
            return Ok(None);
        }
        (None, None) => return refused("its ending is of no format of hair".to_owned()),
        (Some(preset), Some(found)) if preset.formats.contains(&found.info().name) => found,
        (Some(preset), _) => {
            return refused(format!("to {} means {}", preset.name, preset.expects));
        }
    };
    let info = found.info();
    let only_read = info.extensions[1..].iter();
    let mut only_read =
        only_read.filter(|end| extension.is_some_and(|it| it.eq_ignore_ascii_case(end)));
    match only_read.next() {
        Some(_) => refused(format!(
            "{} is written as .{}; name it so",
            info.name, info.extensions[0]
        )),
        None => Ok(Some(found)),
    }
}

/// The groom with the width that it is drawn with, if it has none: what programs need.
fn with_width(groom: &Groom) -> Option<Groom> {
    let drawn = groom.diameter_range();
    if drawn.source != DiameterSource::Default {
        return None;
    }
    let mut groom = groom.clone();
    groom.attributes.retain(|it| it.name != "diameter");
    groom.attributes.push(Attribute {
        name: "diameter".to_owned(),
        domain: Domain::Groom,
        components: 1,
        data: vec![drawn.median],
    });
    Some(groom)
}
