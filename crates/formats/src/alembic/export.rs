//! Writing grooms.

use super::info::INFO;
use super::pod::Pod;
use super::writer::{PropertySpec, Writer, Written};
use crate::attribute_names::{known_attribute, unreal_name};
use crate::error::Result;
use crate::groom::{Attribute, Domain, Groom};
use crate::groom_format::{Export, ExportOptions, Note, NoteKind};
use crate::validate::in_range;

const XFORM: &str = "schema=AbcGeom_Xform_v3";
const CURVES: &str = "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1";
/// Unreal's schema, major and minor version.
const SCHEMA: [(&str, i16); 2] = [("groom_version_major", 1), ("groom_version_minor", 5)];
/// Index of the sampling of what moves; 0 is that of what does not.
const MOVING: u8 = 1;

/// Writes points in time of one groom; attributes are those of the first.
pub(super) fn write(
    frames: &[Groom],
    frames_per_second: f64,
    options: &ExportOptions,
) -> Result<Export> {
    let groom = &frames[0];
    let placement = options.placement(groom, &INFO);
    for strand in 0..groom.n_strands() {
        let n = groom.strand(strand).len() as f64;
        let key = format!("number of points of strand {strand}");
        in_range(key, n, 0.0, f64::from(i32::MAX))?;
    }
    let mut writer = Writer::new();
    let mut notes = Vec::new();

    let moves = if frames.len() > 1 { MOVING } else { 0 };
    let to_file = |frame: &Groom| -> Vec<[f32; 3]> {
        let points = frame.points.iter();
        points.map(|&point| placement.to_file(point)).collect()
    };
    let scalar = |name, pod, extent, metadata: &str| PropertySpec {
        name,
        pod,
        extent,
        metadata: metadata.to_owned(),
        is_array: false,
        sampling: moves,
    };
    let array = |name, pod, extent, metadata: &str| PropertySpec {
        is_array: true,
        ..scalar(name, pod, extent, metadata)
    };
    let bounds = frames.iter().map(|frame| (bounds(&to_file(frame)), 0));
    let positions = frames.iter().map(|frame| {
        let points = to_file(frame);
        (
            points
                .iter()
                .flatten()
                .flat_map(|x| x.to_le_bytes())
                .collect(),
            0,
        )
    });
    let counts = || {
        let counts = (0..groom.n_strands()).map(|ix| groom.strand(ix).len() as i32);
        (counts.flat_map(i32::to_le_bytes).collect(), 0)
    };
    // Linear, open, no basis.
    let kind = (vec![1, 0, 0, 0], 0);
    let n = frames.len();
    let mut geom = vec![
        writer.property(
            &scalar(".selfBnds", Pod::F64, 6, "interpretation=box"),
            bounds,
        ),
        writer.property(
            &array("P", Pod::F32, 3, "geoScope=vtx;interpretation=point"),
            positions,
        ),
        writer.property(
            &array("nVertices", Pod::I32, 1, ""),
            std::iter::repeat_with(counts).take(n),
        ),
        writer.property(
            &scalar("curveBasisAndType", Pod::U8, 4, ""),
            std::iter::repeat_n(kind, n),
        ),
    ];
    let width = groom.attribute("diameter").map(|diameter| {
        let to_unit = |&cm: &f32| match placement.cm_per_unit {
            1.0 => cm,
            unit => (f64::from(cm) / unit) as f32,
        };
        Attribute {
            data: diameter.data.iter().map(to_unit).collect(),
            ..diameter.clone()
        }
    });
    if let Some(width) = &width {
        geom.push(parameter(&mut writer, "width", width));
    }
    let params = parameters(&mut writer, groom, width.as_ref(), &mut notes);
    if !params.is_empty() {
        geom.push(writer.compound(".arbGeomParams", "", &params));
    }
    let geom = writer.compound(".geom", CURVES, &geom);
    let title = format!("{CURVES};schemaObjTitle=AbcGeom_Curve_v2:.geom");
    let hair = writer.object("hair", title, &[geom], &[]);

    let xform = xform(&mut writer, groom);
    let title = format!("{XFORM};schemaObjTitle=AbcGeom_Xform_v3:.xform");
    let root = writer.object("groom", title, &[xform], &[hair]);
    let top = writer.object("ABC", String::new(), &[], &[root]);
    let mut samplings = vec![(1, 1.0)];
    if moves == MOVING {
        samplings.push((n as u32, 1.0 / frames_per_second));
    }
    let mut export = Export::new(writer.finish(&top, &samplings));
    export.notes = notes;
    Ok(export)
}

fn bounds(points: &[[f32; 3]]) -> Vec<u8> {
    let first = points.first().copied().unwrap_or_default();
    let (mut min, mut max) = (first, first);
    for point in points {
        for axis in 0..3 {
            min[axis] = min[axis].min(point[axis]);
            max[axis] = max[axis].max(point[axis]);
        }
    }
    let all = min.into_iter().chain(max);
    all.flat_map(|x| f64::from(x).to_le_bytes()).collect()
}

/// The identity, and what holds for the groom as a whole.
fn xform(writer: &mut Writer, groom: &Groom) -> Written {
    let scalar = |name, pod| PropertySpec {
        name,
        pod,
        extent: 1,
        metadata: String::new(),
        is_array: false,
        sampling: 0,
    };
    let one = |values: &[u8]| std::iter::once((values.to_vec(), 1));
    let mut whole = Vec::new();
    for (name, version) in SCHEMA {
        whole.push(writer.property(&scalar(name, Pod::I16), one(&version.to_le_bytes())));
    }
    whole.push(writer.property(&scalar("groom_tool", Pod::Text), one(b"Strandlight\0")));
    let properties = groom.source.parameters.iter();
    let mut properties = properties.filter(|(name, _)| name == "groom_properties");
    if let Some((name, text)) = properties.next().filter(|(_, text)| !text.contains('\0')) {
        let text = [text.as_bytes(), b"\0"].concat();
        whole.push(writer.property(&scalar(name, Pod::Text), one(&text)));
    }
    let properties = [
        writer.property(&scalar(".inherits", Pod::Bool), one(&[1])),
        writer.compound(".userProperties", "", &whole),
    ];
    writer.compound(".xform", XFORM, &properties)
}

/// All attributes but widths in the place that the schema of curves has for them, which Unreal
/// wants a second time.
fn parameters(
    writer: &mut Writer,
    groom: &Groom,
    width: Option<&Attribute>,
    notes: &mut Vec<Note>,
) -> Vec<Written> {
    let mut names = vec!["groom_width", "width", "groom_group_name"];
    let mut params = Vec::new();
    for attribute in &groom.attributes {
        if attribute.name == "diameter" {
            params.extend(width.map(|width| parameter(writer, "groom_width", width)));
            continue;
        }
        let name = unreal_name(&attribute.name);
        if names.contains(&name) {
            let text = format!("{:?} is left out: {name} is another one", attribute.name);
            notes.push(Note::new(NoteKind::Dropped, text));
            continue;
        }
        names.push(name);
        params.push(parameter(writer, name, attribute));
    }
    params.extend(group_names(writer, groom, notes));
    params
}

/// `name` with the values of `attribute`.
fn parameter(writer: &mut Writer, name: &str, attribute: &Attribute) -> Written {
    let known = known_attribute(&attribute.name).filter(|known| known.is_integer);
    let pod = match (known, &*attribute.name) {
        (Some(known), _) if known.components != 1 => Pod::F32,
        (Some(_), "guide") if attribute.data.iter().all(|&x| x == f32::from(x as i16)) => Pod::I16,
        (Some(_), _) if attribute.data.iter().all(|&x| is_exact(x)) => Pod::I32,
        _ => Pod::F32,
    };
    let values = match pod {
        Pod::I16 => attribute
            .data
            .iter()
            .flat_map(|&x| (x as i16).to_le_bytes())
            .collect(),
        Pod::I32 => attribute
            .data
            .iter()
            .flat_map(|&x| (x as i32).to_le_bytes())
            .collect(),
        _ => attribute
            .data
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect(),
    };
    let interpretation = match (&*attribute.name, attribute.components) {
        (_, 1) => "",
        ("color", 3) => "interpretation=rgb;",
        // Alembic has no other four floats.
        (_, 4) => "interpretation=rgba;",
        _ => "interpretation=vector;",
    };
    let spec = PropertySpec {
        name,
        pod,
        extent: attribute.components as u8,
        metadata: metadata(attribute.domain, interpretation, pod, attribute.components),
        is_array: true,
        sampling: 0,
    };
    writer.property(&spec, std::iter::once((values, 0)))
}

/// Is it an integer that no other one is rounded to? The reader takes no others for integers.
fn is_exact(x: f32) -> bool {
    x.abs() <= 16_777_216.0 && x == x as i32 as f32
}

fn metadata(domain: Domain, interpretation: &str, pod: Pod, extent: u32) -> String {
    let scope = match domain {
        Domain::Groom => "con",
        Domain::Strand => "uni",
        Domain::Point => "vtx",
    };
    let name = pod.name();
    format!(
        "arrayExtent=1;geoScope={scope};{interpretation}isGeomParam=true;podExtent={extent};podName={name}"
    )
}

/// Names of groups, as the parameters `group_name.0` and so on of an imported groom have them.
fn group_names(writer: &mut Writer, groom: &Groom, notes: &mut Vec<Note>) -> Option<Written> {
    let parameters = groom.source.parameters.iter();
    let names = parameters.filter_map(|(name, text)| {
        let id = name.strip_prefix("group_name.")?.parse::<u32>().ok()?;
        Some((id as f32, text.as_str()))
    });
    let names: Vec<(f32, &str)> = names.collect();
    if names.is_empty() {
        return None;
    }
    if names.iter().any(|(_, text)| text.contains('\0')) {
        let text = "names of groups with a zero in them are left out";
        notes.push(Note::new(NoteKind::Dropped, text));
        return None;
    }
    let ids = groom
        .attribute("group_id")
        .filter(|ids| ids.components == 1 && (ids.domain != Domain::Point));
    let (domain, ids) = match ids {
        Some(ids) => (ids.domain, &*ids.data),
        None => (Domain::Groom, &[0.0][..]),
    };
    let mut bytes = Vec::new();
    for id in ids {
        match names.iter().find(|(known, _)| known == id) {
            Some((_, name)) => bytes.extend_from_slice(name.as_bytes()),
            None => bytes.extend_from_slice(id.to_string().as_bytes()),
        }
        bytes.push(0);
    }
    let spec = PropertySpec {
        name: "groom_group_name",
        pod: Pod::Text,
        extent: 1,
        metadata: metadata(domain, "", Pod::Text, 1),
        is_array: true,
        sampling: 0,
    };
    Some(writer.property(&spec, std::iter::once((bytes, ids.len()))))
}
