//! Small formats of other programs: literal bytes, round trips, and every damage.

use strandlight_formats::{
    Attribute, BakedFile, Domain, Error, Export, ExportOptions, FileKind, GROOM_FORMATS, Groom,
    GroomFormat, Import, ImportOptions, NoteKind, Result, SourceFile, UpAxis, groom_format,
};

#[path = "small_formats/all.rs"]
mod all;
#[path = "small_formats/arrays.rs"]
mod arrays;
#[path = "small_formats/mitsuba.rs"]
mod mitsuba;
#[path = "small_formats/pbrt.rs"]
mod pbrt;
#[path = "small_formats/ply.rs"]
mod ply;
#[path = "small_formats/real.rs"]
mod real;
#[path = "small_formats/tfx.rs"]
mod tfx;

fn format(name: &str) -> &'static dyn GroomFormat {
    groom_format(name).unwrap()
}

fn cm() -> ImportOptions {
    ImportOptions::default().with_unit(1.0)
}

/// The file as what its content says it is, which must be the format called `name`.
fn import(name: &str, bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let file = SourceFile::from_bytes(bytes)?;
    assert_eq!(file.format().info().name, name);
    file.import(options)
}

fn export(groom: &Groom, name: &str) -> Export {
    let export = groom.export(format(name), &ExportOptions::default());
    export.unwrap()
}

fn floats(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

fn words(values: &[u32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

fn attribute(name: &str, domain: Domain, components: u32, data: &[f32]) -> Attribute {
    Attribute {
        name: name.to_owned(),
        domain,
        components,
        data: data.to_vec(),
    }
}

fn data<'a>(groom: &'a Groom, name: &str) -> &'a [f32] {
    &groom.attribute(name).unwrap().data
}

/// The texts of the notes of one kind.
fn notes(import: &Import, kind: NoteKind) -> Vec<&str> {
    let of_kind = import.notes.iter().filter(|note| note.kind == kind);
    of_kind.map(|note| &*note.text).collect()
}

/// Points that lie nowhere nice.
fn curve(n: usize, salt: f32) -> Vec<[f32; 3]> {
    let point = |ix| {
        let t = ix as f32 * 0.37 + salt;
        [t.sin() * 3.3, 0.1 - t * 0.7, (t * 1.7).cos() / 3.0]
    };
    (0..n).map(point).collect()
}

/// Strands of these lengths, with a diameter at each point that tapers.
fn groom(lengths: &[usize]) -> Groom {
    let mut groom = Groom {
        strand_offsets: vec![0],
        ..Groom::default()
    };
    let mut diameter = Vec::new();
    for (ix, &n) in lengths.iter().enumerate() {
        groom.points.extend(curve(n, ix as f32));
        groom.strand_offsets.push(groom.points.len() as u32);
        let taper = |point| 0.01 + 0.002 * ix as f32 - 0.004 * point as f32 / (n - 1) as f32;
        diameter.extend((0..n).map(taper));
    }
    groom.attributes = vec![attribute("diameter", Domain::Point, 1, &diameter)];
    groom
}

/// What the format called `name` has against the file.
fn format_error(name: &str, bytes: &[u8]) -> String {
    format(name).read(bytes, &cm()).unwrap_err().to_string()
}
