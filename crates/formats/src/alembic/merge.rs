//! Several objects of curves as one groom.

use std::collections::{HashMap, HashSet};

use super::notes::Notes;
use super::ogawa::Ogawa;
use super::strands::Strands;
use crate::error::Result;
use crate::groom::{Attribute, Domain, Groom, MAX_DIAMETER_CM, MIN_DIAMETER_CM};
use crate::groom_format::NoteKind;
use crate::paint::{self, SHIFT_SCALE, WIDTH_SCALE};
use crate::scene_hair::HairSection;

/// Objects and groups that are listed in the parameters of a groom.
const MAX_LISTED: usize = 1000;

/// More attributes than this do not fit into a `.groom` file.
const MAX_ATTRIBUTES: usize = 1000;

/// What an attribute has where an object lacks it.
fn missing(name: &str) -> f32 {
    match name {
        "diameter" => HairSection::DEFAULT_DIAMETER_CM as f32,
        WIDTH_SCALE | SHIFT_SCALE => 1.0,
        _ => 0.0,
    }
}

/// One groom of all `objects`, of which there is at least one.
pub(super) fn merge(
    ogawa: &Ogawa<'_>,
    mut objects: Vec<Strands>,
    notes: &mut Notes,
) -> Result<Groom> {
    for object in &mut objects {
        check_attributes(object, notes);
    }
    let mut groom = Groom {
        strand_offsets: vec![0],
        ..Groom::default()
    };
    let mut parameters = Vec::new();
    for (ix, object) in objects.iter().enumerate().take(MAX_LISTED) {
        let text = format!("{} ({})", object.path, object.curves);
        parameters.push((format!("object.{ix}"), text));
    }
    group(&mut objects, &mut parameters, notes);
    merge_attributes(ogawa, &mut groom, &objects, notes)?;
    for object in objects {
        groom.points.extend(object.points);
        for length in object.lengths {
            let last = groom.strand_offsets[groom.strand_offsets.len() - 1];
            // The number of points was checked to be a u32.
            groom.strand_offsets.push(last + length);
        }
    }
    groom.source.parameters = parameters;
    Ok(groom)
}

/// Leaves out what a groom cannot hold, and makes root coordinates those of strands.
fn check_attributes(object: &mut Strands, notes: &mut Notes) {
    let Strands {
        path,
        lengths,
        attributes,
        ..
    } = object;
    attributes.retain_mut(|attribute| {
        let mut drop = |text: String| {
            notes.add(NoteKind::Dropped, path, text);
            false
        };
        let name = &*attribute.name;
        if name == "diameter" {
            let data = &mut attribute.data;
            let fits = data.iter().all(|x| (0.0..=MAX_DIAMETER_CM).contains(x));
            if !fits || data.iter().all(|&x| x < MIN_DIAMETER_CM) {
                let [min, max] = range(data);
                return drop(format!(
                    "widths of {min} to {max} cm cannot be drawn and are not kept"
                ));
            }
            let n_thin = data.iter().filter(|x| **x < MIN_DIAMETER_CM).count();
            data.iter_mut().for_each(|x| *x = x.max(MIN_DIAMETER_CM));
            if n_thin > 0 {
                let n = data.len();
                let text = format!("{n_thin} of {n} widths are 0: {MIN_DIAMETER_CM} cm there");
                notes.add(NoteKind::Assumed, path, text);
            }
            return true;
        }
        if let Err(error) = paint::check(name, attribute.components, &attribute.data) {
            return drop(format!("{name:?} is not kept, for it is no paint: {error}"));
        }
        let of_strands = ["root_uv", "group_id", "id", "guide"];
        if of_strands.contains(&name) && attribute.domain == Domain::Point {
            match of_roots(attribute, lengths) {
                Some(data) => {
                    attribute.domain = Domain::Strand;
                    attribute.data = data;
                }
                None if name == "root_uv" => attribute.name = "uv".to_owned(),
                None => return drop(format!("{name:?} differs within strands and is not kept")),
            }
        }
        true
    });
}

fn range(data: &[f32]) -> [f32; 2] {
    let fold = |f: fn(f32, f32) -> f32| data.iter().copied().fold(data[0], f);
    [fold(f32::min), fold(f32::max)]
}

/// Values of the first points of strands, if all of a strand are the same.
fn of_roots(attribute: &Attribute, lengths: &[u32]) -> Option<Vec<f32>> {
    let k = attribute.components as usize;
    let mut rest = &*attribute.data;
    let mut roots = Vec::with_capacity(lengths.len() * k);
    for &length in lengths {
        let (own, after) = rest.split_at(length as usize * k);
        rest = after;
        let root = &own[..k];
        if own.chunks_exact(k).any(|value| value != root) {
            return None;
        }
        roots.extend_from_slice(root);
    }
    Some(roots)
}

/// Sees to it that every strand of several objects has a group, and names the groups.
fn group(objects: &mut [Strands], parameters: &mut Vec<(String, String)>, notes: &mut Notes) {
    let n_objects = objects.len();
    let has_id = |object: &Strands| object.attributes.iter().any(|a| a.name == "group_id");
    let mut names: Vec<(u32, String)> = Vec::new();
    let mut made: HashMap<String, u32> = HashMap::new();
    let largest = objects.iter().flat_map(|object| &object.attributes);
    let ids = largest.filter(|attribute| attribute.name == "group_id");
    let largest = ids.flat_map(|ids| &ids.data).copied().fold(-1.0, f32::max);
    // Numbers of such a size are none that a float can tell apart.
    let mut next = (largest.max(-1.0) + 1.0).min(16_777_216.0) as u32;
    for object in objects.iter_mut() {
        let is_given = has_id(object);
        if is_given {
            continue;
        }
        let own = object.group_names.as_ref();
        let (table, elements) = match own {
            Some((table, elements)) => (table.clone(), elements.clone()),
            None if n_objects > 1 => (vec![object.path.clone()], vec![0]),
            None => continue,
        };
        // Groups of the same name are one.
        let mut id_of = |name: String| {
            *made.entry(name).or_insert_with_key(|name| {
                names.push((next, name.clone()));
                next += 1;
                next - 1
            })
        };
        let ids: Vec<u32> = table.into_iter().map(&mut id_of).collect();
        if own.is_none() {
            let text = "it has no groups: they are made of the objects";
            notes.add(NoteKind::Assumed, &object.path, text);
        }
        let data: Vec<f32> = elements.iter().map(|&ix| ids[ix as usize] as f32).collect();
        object.attributes.push(Attribute {
            name: "group_id".to_owned(),
            domain: if data.len() == 1 {
                Domain::Groom
            } else {
                Domain::Strand
            },
            components: 1,
            data,
        });
        object.group_names = None;
    }
    // Where both are given, the first strand of each number has its name.
    let mut named: HashSet<u32> = names.iter().map(|(id, _)| *id).collect();
    for object in objects.iter() {
        let Some((table, elements)) = &object.group_names else {
            continue;
        };
        let Some(ids) = object.attributes.iter().find(|a| a.name == "group_id") else {
            continue;
        };
        for strand in 0..object.lengths.len() {
            let id = ids.data[if ids.data.len() == 1 { 0 } else { strand }];
            let name = elements[if elements.len() == 1 { 0 } else { strand }];
            let id = id.max(0.0) as u32;
            if named.insert(id) {
                names.push((id, table[name as usize].clone()));
            }
            if ids.data.len() == 1 && elements.len() == 1 || names.len() > MAX_LISTED {
                break;
            }
        }
    }
    names.sort();
    if names.len() > MAX_LISTED {
        let text = format!("of {} names of groups {MAX_LISTED} are kept", names.len());
        notes.add(NoteKind::Dropped, "", text);
        names.truncate(MAX_LISTED);
    }
    let names = names.into_iter();
    parameters.extend(names.map(|(id, name)| (format!("group_name.{id}"), name)));
}

/// Joins the attributes of the objects, in the order in which they come.
fn merge_attributes(
    ogawa: &Ogawa<'_>,
    groom: &mut Groom,
    objects: &[Strands],
    notes: &mut Notes,
) -> Result<()> {
    let mut known = HashSet::new();
    let all = objects.iter().flat_map(|object| &object.attributes);
    let mut names: Vec<(&str, u32)> = all
        .filter(|attribute| known.insert(&attribute.name))
        .map(|attribute| (&*attribute.name, attribute.components))
        .collect();
    if names.len() > MAX_ATTRIBUTES {
        let text = format!("of {} attributes {MAX_ATTRIBUTES} are kept", names.len());
        notes.add(NoteKind::Dropped, "", text);
        names.truncate(MAX_ATTRIBUTES);
    }
    for (name, components) in names {
        let of = |object: &'_ Strands| -> Option<Attribute> {
            let found = object.attributes.iter().find(|a| a.name == name);
            found.filter(|a| a.components == components).cloned()
        };
        let parts: Vec<Option<Attribute>> = objects.iter().map(of).collect();
        for (object, part) in objects.iter().zip(&parts) {
            // What is not marked as a guide is none.
            if part.is_some() || name == "guide" {
                continue;
            }
            let value = missing(name);
            let is_other = object.attributes.iter().any(|a| a.name == name);
            let (kind, text) = match is_other {
                true => (NoteKind::Dropped, "has other numbers of components"),
                false => (NoteKind::Assumed, "is missing"),
            };
            notes.add(
                kind,
                &object.path,
                format!("{name:?} {text}: {value} there"),
            );
        }
        let first = parts.iter().flatten().next();
        let all_same = parts.iter().all(|part| {
            let constant = part.as_ref().filter(|part| part.domain == Domain::Groom);
            constant.is_some_and(|part| Some(&part.data) == first.map(|first| &first.data))
        });
        let per_point = parts
            .iter()
            .flatten()
            .any(|part| part.domain == Domain::Point);
        let domain = match (all_same, per_point) {
            (true, _) => Domain::Groom,
            (_, true) => Domain::Point,
            _ => Domain::Strand,
        };
        let k = components as usize;
        let mut data = Vec::new();
        for (object, part) in objects.iter().zip(parts) {
            let part = part.unwrap_or_else(|| Attribute {
                name: name.to_owned(),
                domain: Domain::Groom,
                components,
                data: vec![missing(name); k],
            });
            if part.domain == domain {
                match domain {
                    Domain::Groom => data.clone_from(&part.data),
                    _ => data.extend(part.data),
                }
                continue;
            }
            let n = match domain {
                Domain::Point => object.points.len(),
                _ => object.lengths.len(),
            };
            ogawa.spend(4 * (n * k) as u64, 0)?;
            for (strand, &length) in object.lengths.iter().enumerate() {
                let ix = if part.domain == Domain::Groom {
                    0
                } else {
                    strand
                };
                let value = &part.data[ix * k..(ix + 1) * k];
                let times = if domain == Domain::Point { length } else { 1 };
                for _ in 0..times {
                    data.extend_from_slice(value);
                }
            }
        }
        groom.attributes.push(Attribute {
            name: name.to_owned(),
            domain,
            components,
            data,
        });
    }
    Ok(())
}
