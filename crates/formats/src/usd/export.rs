//! From grooms to a text layer.

use std::collections::BTreeSet;
use std::fmt::Display;
use std::io::Write;

use super::info::INFO;
use crate::attribute_names::{ATTRIBUTE_NAMES, unreal_name};
use crate::error::Result;
use crate::groom::{Attribute, Domain, Groom, UpAxis};
use crate::groom_format::{Export, ExportOptions, Note, NoteKind, Placement};

/// Bytes of text for a point, about.
const BYTES_PER_POINT: usize = 40;

/// Writes points in time of one groom, of which there is at least one; a file that does not move
/// without `frames_per_second`.
pub(super) fn write(
    frames: &[Groom],
    frames_per_second: Option<f64>,
    options: &ExportOptions,
) -> Result<Export> {
    let groom = &frames[0];
    let mut notes = Vec::new();
    let mut placement = options.placement(groom, &INFO);
    if placement.up == UpAxis::X {
        placement.up = UpAxis::Y;
        let text = "USD has no x axis that points up: y is written";
        notes.push(Note::new(NoteKind::Assumed, text));
    }
    let frames_per_second = frames_per_second.filter(|_| frames.len() > 1);
    let n_points: usize = frames.iter().map(|frame| frame.points.len()).sum();
    let mut text = Text {
        bytes: Vec::with_capacity(1000 + n_points * BYTES_PER_POINT),
    };
    text.line("#usda 1.0");
    text.line("(");
    text.line("    defaultPrim = \"groom\"");
    if let Some(rate) = frames_per_second {
        text.line(format!("    endTimeCode = {}", frames.len() - 1));
        text.line(format!("    framesPerSecond = {rate}"));
    }
    text.line(format!(
        "    metersPerUnit = {}",
        placement.cm_per_unit / 100.0
    ));
    if let Some(rate) = frames_per_second {
        text.line("    startTimeCode = 0");
        text.line(format!("    timeCodesPerSecond = {rate}"));
    }
    let up = placement.up.name().to_ascii_uppercase();
    text.line(format!("    upAxis = \"{up}\"\n)\n"));
    text.line("def Xform \"groom\" (\n    kind = \"component\"\n)\n{");
    text.line("    def BasisCurves \"hair\"\n    {");

    text.start("int[] curveVertexCounts");
    let lengths = groom
        .strand_offsets
        .windows(2)
        .map(|pair| pair[1] - pair[0]);
    text.array(lengths, |text, length| text.number(length));
    text.end();
    over_time(
        &mut text,
        frames,
        frames_per_second,
        "float3[] extent",
        |text, frame| {
            let extent = extent(frame, placement);
            text.array(extent, |text, point| text.tuple(&point));
        },
    );
    over_time(
        &mut text,
        frames,
        frames_per_second,
        "point3f[] points",
        |text, frame| {
            let points = frame.points.iter().map(|&point| placement.to_file(point));
            text.array(points, |text, point| text.tuple(&point));
        },
    );
    attributes(&mut text, groom, placement, &mut notes);
    text.line("        uniform token type = \"linear\"\n    }\n}");
    let mut export = Export::new(text.bytes);
    export.notes = notes;
    Ok(export)
}

/// `name = value`, or a value for each frame.
fn over_time(
    text: &mut Text,
    frames: &[Groom],
    frames_per_second: Option<f64>,
    name: &str,
    value: impl Fn(&mut Text, &Groom),
) {
    if frames_per_second.is_none() {
        text.start(name);
        value(text, &frames[0]);
        return text.end();
    }
    text.line(format!("        {name}.timeSamples = {{"));
    for (code, frame) in frames.iter().enumerate() {
        text.put(format!("            {code}: "));
        value(text, frame);
        text.line(",");
    }
    text.line("        }");
}

/// Smallest and largest coordinates of the fibres.
fn extent(groom: &Groom, placement: Placement) -> [[f32; 3]; 2] {
    let (min, max) = groom.bounds();
    let radius = width(groom).map_or(0.0, |attribute| {
        attribute.data.iter().copied().fold(0.0, f32::max) / 2.0
    });
    let corners = [min.map(|x| x - radius), max.map(|x| x + radius)];
    let [a, b] = corners.map(|corner| placement.to_file(corner));
    // Turned axes swap them.
    let pick = |pick: fn(f32, f32) -> f32| [0, 1, 2].map(|axis: usize| pick(a[axis], b[axis]));
    [pick(f32::min), pick(f32::max)]
}

/// The diameters.
fn width(groom: &Groom) -> Option<&Attribute> {
    groom
        .attribute("diameter")
        .filter(|attribute| attribute.components == 1)
}

fn attributes(text: &mut Text, groom: &Groom, placement: Placement, notes: &mut Vec<Note>) {
    match width(groom) {
        Some(width) => {
            text.start("float[] widths");
            let in_unit = |value: &f32| match placement.cm_per_unit {
                1.0 => *value,
                cm => (f64::from(*value) / cm) as f32,
            };
            text.array(width.data.iter().map(in_unit), |text, value| {
                text.number(value)
            });
            text.interpolation(width.domain);
        }
        None => notes.push(Note::new(
            NoteKind::Dropped,
            "the groom has no diameters: the file has no widths, and programs differ in theirs",
        )),
    }
    let mut used = BTreeSet::new();
    for attribute in &groom.attributes {
        let name = &*attribute.name;
        if name == "diameter" && attribute.components == 1 {
            continue;
        }
        let primvar = match unreal_name(name) {
            // Names that mean something else, or that USD does not allow.
            "widths" | "diameter" => format!("_{name}"),
            name if name.starts_with(|c: char| c.is_ascii_digit()) => format!("_{name}"),
            name => name.to_owned(),
        };
        if primvar.starts_with('_') && !name.starts_with('_') {
            let text = format!("attribute {name} is called {primvar} in the file");
            notes.push(Note::new(NoteKind::Assumed, text));
        }
        if !used.insert(primvar.clone()) {
            let text = format!("attribute {name} left out: there is another {primvar}");
            notes.push(Note::new(NoteKind::Dropped, text));
            continue;
        }
        text.start(&format!("{} primvars:{primvar}", type_of(attribute)));
        text.values(attribute);
        if name == "color" && attribute.components == 3 {
            text.start("color3f[] primvars:displayColor");
            text.values(attribute);
        }
    }
}

/// USD's type for the values of `attribute`.
fn type_of(attribute: &Attribute) -> &'static str {
    let name = &*attribute.name;
    let known = ATTRIBUTE_NAMES.iter().find(|known| known.name == name);
    let is_whole = |value: &f32| value.fract() == 0.0 && value.abs() <= 16_777_216.0;
    let is_integer =
        known.is_some_and(|known| known.is_integer) && attribute.data.iter().all(is_whole);
    match (name, attribute.components, is_integer) {
        (_, 1, true) => "int[]",
        (_, 2, true) => "int2[]",
        (_, 3, true) => "int3[]",
        (_, 4, true) => "int4[]",
        ("root_uv", 2, _) => "texCoord2f[]",
        ("color", 3, _) => "color3f[]",
        (_, 1, _) => "float[]",
        (_, 2, _) => "float2[]",
        (_, 3, _) => "float3[]",
        _ => "float4[]",
    }
}

/// The text that is being written.
struct Text {
    bytes: Vec<u8>,
}

impl Text {
    fn put(&mut self, text: impl AsRef<str>) {
        self.bytes.extend_from_slice(text.as_ref().as_bytes());
    }

    fn line(&mut self, text: impl AsRef<str>) {
        self.put(text);
        self.bytes.push(b'\n');
    }

    /// `name = `, as a property of the curves.
    fn start(&mut self, name: &str) {
        self.put(format!("        {name} = "));
    }

    fn end(&mut self) {
        self.bytes.push(b'\n');
    }

    /// The shortest text that is read as the same number.
    fn number(&mut self, number: impl Display) {
        // Writing to memory does not fail.
        let _ = write!(self.bytes, "{number}");
    }

    fn tuple(&mut self, numbers: &[f32]) {
        self.bytes.push(b'(');
        for (ix, number) in numbers.iter().enumerate() {
            if ix > 0 {
                self.put(", ");
            }
            self.number(number);
        }
        self.bytes.push(b')');
    }

    fn array<T>(&mut self, items: impl IntoIterator<Item = T>, put: impl Fn(&mut Text, T)) {
        self.bytes.push(b'[');
        for (ix, item) in items.into_iter().enumerate() {
            if ix > 0 {
                self.put(", ");
            }
            put(self, item);
        }
        self.bytes.push(b']');
    }

    fn interpolation(&mut self, domain: Domain) {
        let interpolation = match domain {
            Domain::Groom => "constant",
            Domain::Strand => "uniform",
            Domain::Point => "vertex",
        };
        self.line(format!(
            " (\n            interpolation = \"{interpolation}\"\n        )"
        ));
    }

    fn values(&mut self, attribute: &Attribute) {
        let components = attribute.components as usize;
        match components {
            1 => self.array(&attribute.data, |text, value| text.number(value)),
            _ => self.array(attribute.data.chunks_exact(components), |text, value| {
                text.tuple(value);
            }),
        }
        self.interpolation(attribute.domain);
    }
}
