//! Several grooms as one.

use std::collections::{BTreeMap, BTreeSet};

use strandlight_formats::{Attribute, Domain, Groom, GroomSource, UpAxis, counted};

use super::edit::{EditError, guides};

/// A groom to merge.
#[derive(Clone, Debug, PartialEq)]
pub struct MergeInput {
    /// What it is called in messages, and its group if it has none: a file's name without folder.
    pub name: String,
    /// The groom.
    pub groom: Groom,
}

/// Several grooms as one.
#[derive(Clone, Debug, PartialEq)]
pub struct Merged {
    /// All strands, one input after another.
    pub groom: Groom,
    /// What was assumed, as sentences.
    pub notes: Vec<String>,
    /// Attributes that are left out, each with its reason.
    pub dropped: Vec<String>,
}

const GROUP: &str = "group_id";
const ID: &str = "id";
const CLOSEST: &str = "closest_guides";
/// What the names of groups start with among a groom's parameters; the number follows.
const GROUP_NAME: &str = "group_name.";
/// Whole numbers that f32 holds are below.
const MOST_NUMBER: f64 = 16_777_216.0;
/// Most groups that a note lists, and most that are named.
const MOST_LISTED: usize = 8;
const MOST_NAMED: usize = 4096;

/// Joins grooms: their strands in order, with the attributes that all of them have.
///
/// - An attribute that some lack is filled where there is a value that says nothing: `diameter` with
///   the thickness that the groom is drawn with, `guide` with 0, paint with none. Others are left out,
///   as are attributes whose number of components differs, and `thickness`, for which `diameter`
///   stands.
/// - A groom without `group_id` becomes a group of its name. Groups that are there keep their
///   numbers, but for two: one with the name of a group of an earlier groom joins it, and one with the
///   number of such a group but not its name gets a new number. Names are parameters `group_name.0`
///   and so on.
/// - An `id` stays unique: those of a groom that come again are shifted, and `closest_guides` with
///   them.
///
/// # Errors
/// A groom that breaks a promise; more points than a groom may have.
pub fn merge(inputs: &[MergeInput]) -> Result<Merged, EditError> {
    check(inputs)?;
    let mut notes = Vec::new();
    let mut grooms: Vec<Groom> = inputs.iter().map(|input| input.groom.clone()).collect();
    let names: Vec<&str> = inputs.iter().map(|input| &*input.name).collect();
    let group_names = group(&mut grooms, &names, &mut notes);
    let mut dropped = Vec::new();
    number(&mut grooms, &names, &mut dropped);
    fill(&mut grooms, &names, &mut notes);
    let attributes = attributes(&grooms, &names, &mut dropped);
    let mut merged = Groom {
        strand_offsets: vec![0],
        attributes,
        source: source(inputs, group_names),
        ..Groom::default()
    };
    for groom in &grooms {
        // The sum was checked to fit.
        let before = merged.points.len() as u32;
        let ends = groom.strand_offsets[1..].iter().map(|end| before + end);
        merged.strand_offsets.extend(ends);
        merged.points.extend_from_slice(&groom.points);
    }
    merged.validate()?;
    Ok(Merged {
        groom: merged,
        notes,
        dropped,
    })
}

fn check(inputs: &[MergeInput]) -> Result<(), EditError> {
    if inputs.is_empty() {
        return Err(EditError::range("number of grooms", 0, "at least 1"));
    }
    for input in inputs {
        input.groom.validate()?;
    }
    let points = inputs.iter().map(|input| input.groom.points.len() as u64);
    let points: u64 = points.sum();
    match u32::try_from(points) {
        Ok(_) => Ok(()),
        Err(_) => {
            let range = format!("at most {}", u32::MAX);
            Err(EditError::range("number of points", points, range))
        }
    }
}

/// Where the merged groom is from.
fn source(inputs: &[MergeInput], group_names: Vec<(String, String)>) -> GroomSource {
    let first = &inputs[0].groom.source;
    let unit = |source: &GroomSource| (source.cm_per_unit, source.up);
    let are_alike = inputs
        .iter()
        .all(|input| unit(&input.groom.source) == unit(first));
    let (cm_per_unit, up) = match are_alike {
        true => unit(first),
        false => (1.0, UpAxis::Y),
    };
    let merged = inputs.iter().enumerate().map(|(ix, input)| {
        let text = format!("{} {}", input.name, input.groom.source.hash);
        (format!("merged.{ix}"), text.trim_end().to_owned())
    });
    GroomSource {
        cm_per_unit,
        up,
        parameters: merged.chain(group_names).collect(),
        ..GroomSource::default()
    }
}

fn attribute_mut<'a>(groom: &'a mut Groom, name: &str) -> Option<&'a mut Attribute> {
    let mut attributes = groom.attributes.iter_mut();
    attributes.find(|attribute| attribute.name == name)
}

/// An attribute of one number for all strands.
fn constant(name: &str, data: Vec<f32>) -> Attribute {
    Attribute {
        name: name.to_owned(),
        domain: Domain::Groom,
        components: data.len() as u32,
        data,
    }
}

/// Sees to it that every strand has a group, and no group of one groom is another's; answers the
/// parameters that name them.
fn group(grooms: &mut [Groom], names: &[&str], notes: &mut Vec<String>) -> Vec<(String, String)> {
    // By the bits of numbers, which may be any.
    let mut groups: BTreeMap<u32, Option<String>> = BTreeMap::new();
    let mut fresh = Fresh::beside(grooms);
    let mut renumbered = 0;
    for (groom, name) in grooms.iter_mut().zip(names) {
        // What is no number is no group.
        let is_other = |attribute: &Attribute| attribute.name == GROUP && attribute.components != 1;
        if groom.attributes.iter().any(is_other) {
            notes.push(format!(
                "{name}: {GROUP} has several components and is left out"
            ));
            groom.attributes.retain(|attribute| !is_other(attribute));
        }
        let own = own_names(groom);
        let taken = groups.clone();
        let numbers: BTreeMap<String, f32> = taken
            .iter()
            .filter_map(|(&bits, name)| Some((name.clone()?, f32::from_bits(bits))))
            .collect();
        let mut new: BTreeMap<u32, f32> = BTreeMap::new();
        if let Some(ids) = attribute_mut(groom, GROUP) {
            for id in &mut ids.data {
                // One zero.
                *id += 0.0;
                let own = own.get(&id.to_bits()).cloned();
                let known = own.as_ref().and_then(|name| numbers.get(name));
                let is_taken = taken.contains_key(&id.to_bits());
                let before = *id;
                *id = *new.entry(id.to_bits()).or_insert_with(|| match known {
                    Some(&number) => number,
                    None if is_taken => fresh.number(),
                    None => before,
                });
                groups.insert(id.to_bits(), own);
            }
            renumbered += new
                .iter()
                .filter(|(bits, new)| **bits != new.to_bits())
                .count();
        } else {
            let number = fresh.number();
            groom.attributes.push(constant(GROUP, vec![number]));
            let is_free =
                |name: &String| !groups.values().any(|known| known.as_ref() == Some(name));
            let others = (2_u32..).map(|ix| format!("{name} {ix}"));
            let mut free = std::iter::once((*name).to_owned()).chain(others);
            let free = free.find(is_free);
            groups.insert(number.to_bits(), free);
        }
    }
    if renumbered > 0 {
        let renumbered = counted(
            renumbered,
            "group gets another number",
            "groups get other numbers",
        );
        notes.push(renumbered + ", to stay apart or to be one by name");
    }
    let mut named: Vec<(f32, String)> = groups
        .into_iter()
        .filter_map(|(bits, name)| Some((f32::from_bits(bits), name?)))
        .collect();
    named.sort_by(|a, b| a.0.total_cmp(&b.0));
    named.truncate(MOST_NAMED);
    let listed = named.iter().take(MOST_LISTED);
    let mut list: Vec<String> = listed.map(|(id, name)| format!("{id} {name}")).collect();
    if named.len() > MOST_LISTED {
        list.push(format!("{} more", named.len() - MOST_LISTED));
    }
    if !list.is_empty() {
        notes.push(format!("{GROUP}: {}", list.join(", ")));
    }
    let named = named.into_iter();
    named
        .map(|(id, name)| (format!("{GROUP_NAME}{id}"), name))
        .collect()
}

/// Numbers that no group has.
struct Fresh {
    taken: BTreeSet<u32>,
    next: f32,
}

impl Fresh {
    /// Above those of `grooms`, where f32 still counts there.
    fn beside(grooms: &[Groom]) -> Fresh {
        let ids = grooms.iter().filter_map(|groom| groom.attribute(GROUP));
        let ids: Vec<f32> = ids
            .flat_map(|ids| ids.data.iter().map(|id| id + 0.0))
            .collect();
        let largest = ids.iter().copied().fold(-1.0, f32::max).floor();
        Fresh {
            taken: ids.into_iter().map(f32::to_bits).collect(),
            next: if largest < MOST_NUMBER as f32 / 2.0 {
                largest + 1.0
            } else {
                0.0
            },
        }
    }

    fn number(&mut self) -> f32 {
        while !self.taken.insert(self.next.to_bits()) {
            self.next += 1.0;
        }
        self.next
    }
}

/// The names of a groom's groups by the bits of their numbers.
fn own_names(groom: &Groom) -> BTreeMap<u32, String> {
    let parameters = groom.source.parameters.iter();
    let names = parameters.filter_map(|(name, value)| {
        let id: f32 = name.strip_prefix(GROUP_NAME)?.parse().ok()?;
        Some((id.to_bits(), value.clone()))
    });
    names.collect()
}

/// Keeps the numbers of strands unique, and those of closest guides what they are of.
fn number(grooms: &mut [Groom], names: &[&str], dropped: &mut Vec<String>) {
    let plain = |groom: &Groom| groom.attribute(ID).is_some_and(|ids| ids.components == 1);
    let n_with = grooms.iter().filter(|groom| plain(groom)).count();
    let has_closest = grooms
        .iter()
        .all(|groom| groom.attribute(CLOSEST).is_some());
    let mut seen: BTreeSet<u32> = BTreeSet::new();
    let (mut next, mut n_guides) = (0.0_f64, 0.0_f64);
    let mut faults = Vec::new();
    for (groom, name) in grooms.iter_mut().zip(names) {
        let mut shift = 0.0;
        if n_with == names.len() {
            let ids = groom.attribute(ID).map_or(&[][..], |ids| &ids.data);
            let range = ids.iter().fold([f64::MAX, f64::MIN], |[low, high], &id| {
                [low.min(f64::from(id)), high.max(f64::from(id))]
            });
            if ids.iter().any(|id| seen.contains(&id.to_bits())) {
                shift = (next - range[0]).ceil();
            }
            if range[1] + shift >= MOST_NUMBER {
                faults.push(format!("the numbers of {name} become too large"));
            }
            next = next.max(range[1] + shift + 1.0);
        } else if n_with == 0 {
            let own = guides(groom).map_or(groom.n_strands(), |is_guide| {
                is_guide.into_iter().filter(|&is_guide| is_guide).count()
            });
            shift = n_guides;
            n_guides += own as f64;
        }
        for attribute in [ID, CLOSEST] {
            let Some(attribute) = attribute_mut(groom, attribute) else {
                continue;
            };
            for value in &mut attribute.data {
                *value = (f64::from(*value) + shift) as f32;
            }
        }
        seen.extend(
            groom
                .attribute(ID)
                .iter()
                .flat_map(|ids| &ids.data)
                .map(|id| id.to_bits()),
        );
    }
    if n_with > 0 && n_with < names.len() && has_closest {
        faults.push(format!("{ID}, which it names strands by, is left out"));
    }
    if let Some(fault) = faults.into_iter().next() {
        for name in [ID, CLOSEST] {
            if grooms.iter().any(|groom| groom.attribute(name).is_some()) {
                dropped.push(format!("{name} ({fault})"));
            }
            for groom in grooms.iter_mut() {
                groom.attributes.retain(|attribute| attribute.name != name);
            }
        }
    }
}

/// Gives grooms what others have and what says nothing.
fn fill(grooms: &mut [Groom], names: &[&str], notes: &mut Vec<String>) {
    let nothing: [(&str, &[f32]); 4] = [
        ("guide", &[0.0]),
        (strandlight_formats::DYE, &[0.0; 4]),
        (strandlight_formats::WIDTH_SCALE, &[1.0]),
        (strandlight_formats::SHIFT_SCALE, &[1.0]),
    ];
    let anyone_has = |grooms: &[Groom], name: &str| {
        let mut grooms = grooms.iter();
        grooms.any(|groom| groom.attribute(name).is_some())
    };
    for (name, values) in nothing {
        if anyone_has(grooms, name) {
            for groom in grooms.iter_mut() {
                if groom.attribute(name).is_none() {
                    groom.attributes.push(constant(name, values.to_vec()));
                }
            }
        }
    }
    if anyone_has(grooms, "diameter") || anyone_has(grooms, "thickness") {
        for (groom, name) in grooms.iter_mut().zip(names) {
            if groom.attribute("diameter").is_none() {
                let drawn = groom.diameter_range().median;
                groom.attributes.push(constant("diameter", vec![drawn]));
                notes.push(format!(
                    "{name} has no diameter: {drawn} cm, as drawn, is taken"
                ));
            }
        }
    }
}

/// The attributes that all grooms have, in the order in which they are met.
fn attributes(grooms: &[Groom], names: &[&str], dropped: &mut Vec<String>) -> Vec<Attribute> {
    let mut known: Vec<&str> = Vec::new();
    for attribute in grooms.iter().flat_map(|groom| &groom.attributes) {
        if !known.contains(&&*attribute.name) {
            known.push(&attribute.name);
        }
    }
    let mut merged = Vec::new();
    for name in known {
        let found: Vec<Option<&Attribute>> =
            grooms.iter().map(|groom| groom.attribute(name)).collect();
        let without = found.iter().position(Option::is_none);
        let found: Vec<&Attribute> = found.into_iter().flatten().collect();
        let is_alike = |other: &&Attribute| other.components == found[0].components;
        let reason = match without {
            _ if name == "thickness" => "diameter stands for it".to_owned(),
            Some(ix) => format!("{} has none", names[ix]),
            None if !found.iter().all(is_alike) => "numbers of components differ".to_owned(),
            None => {
                merged.push(joined(grooms, &found));
                continue;
            }
        };
        dropped.push(format!("{name} ({reason})"));
    }
    merged
}

/// One attribute of all grooms; `of` each of them, with as many components.
fn joined(grooms: &[Groom], of: &[&Attribute]) -> Attribute {
    let is = |domain: Domain| move |attribute: &&Attribute| attribute.domain == domain;
    let is_same = |attribute: &&Attribute| attribute.data == of[0].data;
    let domain = match of.iter().all(is(Domain::Groom)) {
        true if of.iter().all(is_same) => Domain::Groom,
        _ if of.iter().any(is(Domain::Point)) => Domain::Point,
        _ => Domain::Strand,
    };
    let mut data = Vec::new();
    if domain == Domain::Groom {
        data.clone_from(&of[0].data);
    } else {
        for (groom, attribute) in grooms.iter().zip(of) {
            spread(groom, attribute, domain, &mut data);
        }
    }
    Attribute {
        domain,
        data,
        ..of[0].clone()
    }
}

/// Appends the values of `attribute` for each strand or point of `groom`.
fn spread(groom: &Groom, attribute: &Attribute, domain: Domain, data: &mut Vec<f32>) {
    let n = attribute.components as usize;
    let lengths = (0..groom.n_strands()).map(|ix| match domain {
        Domain::Point => groom.strand(ix).len(),
        _ => 1,
    });
    match attribute.domain {
        own if own == domain => data.extend_from_slice(&attribute.data),
        Domain::Groom => {
            let values = attribute.data.repeat(lengths.sum());
            data.extend(values);
        }
        _ => {
            for (value, length) in attribute.data.chunks_exact(n).zip(lengths) {
                (0..length).for_each(|_| data.extend_from_slice(value));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `lengths.len()` strands of so many points.
    fn input(name: &str, lengths: &[usize], attributes: &[Attribute]) -> MergeInput {
        let mut groom = Groom {
            strand_offsets: vec![0],
            attributes: attributes.to_vec(),
            ..Groom::default()
        };
        for (x, &length) in lengths.iter().enumerate() {
            let points = (0..length).map(|y| [x as f32, y as f32, name.len() as f32]);
            groom.points.extend(points);
            groom.strand_offsets.push(groom.points.len() as u32);
        }
        groom.validate().unwrap();
        MergeInput {
            name: name.to_owned(),
            groom,
        }
    }

    fn per(domain: Domain, name: &str, components: u32, data: &[f32]) -> Attribute {
        Attribute {
            name: name.to_owned(),
            domain,
            components,
            data: data.to_vec(),
        }
    }

    fn data(merged: &Merged, name: &str) -> Vec<f32> {
        merged.groom.attribute(name).unwrap().data.clone()
    }

    #[test]
    fn strands_come_one_groom_after_another() {
        let (a, b) = (input("a", &[2, 3], &[]), input("bb", &[4], &[]));
        let merged = merge(&[a.clone(), b.clone()]).unwrap();
        let groom = &merged.groom;
        assert_eq!(groom.strand_offsets, [0, 2, 5, 9]);
        assert_eq!(groom.points[..5], a.groom.points);
        assert_eq!(groom.points[5..], b.groom.points);
        assert_eq!(data(&merged, GROUP), [0.0, 0.0, 1.0]);
        let named = |name: &str| {
            let mut parameters = groom.source.parameters.iter();
            parameters
                .find(|(known, _)| known == name)
                .map(|(_, value)| &**value)
        };
        assert_eq!(named("group_name.0"), Some("a"));
        assert_eq!(named("group_name.1"), Some("bb"));
        assert_eq!(named("merged.1"), Some("bb"));
        assert_eq!(merged.notes, ["group_id: 0 a, 1 bb"]);
        assert!(merged.dropped.is_empty());
        // Twice the same name.
        let merged = merge(&[a.clone(), a.clone()]).unwrap();
        assert_eq!(merged.notes, ["group_id: 0 a, 1 a 2"]);
        assert!(merge(&[]).is_err());
        let mut bad = a.clone();
        bad.groom.points[0][0] = f32::NAN;
        assert!(merge(&[a, bad]).is_err());
    }

    #[test]
    fn attributes_of_all_are_kept_in_the_finest_domain() {
        let merged = merge(&[
            input(
                "a",
                &[2, 3],
                &[
                    per(Domain::Groom, "tint", 2, &[1.0, 2.0]),
                    per(Domain::Strand, "wet", 1, &[3.0, 4.0]),
                    per(Domain::Groom, "same", 1, &[9.0]),
                    per(Domain::Groom, "odd", 1, &[9.0]),
                ],
            ),
            input(
                "b",
                &[2],
                &[
                    per(Domain::Point, "tint", 2, &[5.0, 6.0, 7.0, 8.0]),
                    per(Domain::Groom, "wet", 1, &[0.5]),
                    per(Domain::Groom, "same", 1, &[9.0]),
                    per(Domain::Groom, "odd", 2, &[9.0, 9.0]),
                    per(Domain::Groom, "lone", 1, &[9.0]),
                ],
            ),
        ])
        .unwrap();
        let repeated = [1.0, 2.0].repeat(5);
        assert_eq!(data(&merged, "tint")[..10], repeated);
        assert_eq!(data(&merged, "tint")[10..], [5.0, 6.0, 7.0, 8.0]);
        assert_eq!(data(&merged, "wet"), [3.0, 4.0, 0.5]);
        assert_eq!(data(&merged, "same"), [9.0]);
        let dropped = ["odd (numbers of components differ)", "lone (a has none)"];
        assert_eq!(merged.dropped, dropped);
        assert!(merged.groom.attribute("odd").is_none());
    }

    #[test]
    fn strand_values_become_point_values_beside_those() {
        let merged = merge(&[
            input("a", &[2, 3], &[per(Domain::Strand, "wet", 1, &[3.0, 4.0])]),
            input("b", &[2], &[per(Domain::Point, "wet", 1, &[5.0, 6.0])]),
        ]);
        let expected = [3.0, 3.0, 4.0, 4.0, 4.0, 5.0, 6.0];
        assert_eq!(data(&merged.unwrap(), "wet"), expected);
    }

    #[test]
    fn what_says_nothing_is_filled_in() {
        let dye = strandlight_formats::DYE;
        let merged = merge(&[
            input(
                "a",
                &[2],
                &[
                    per(Domain::Groom, "diameter", 1, &[0.02]),
                    per(Domain::Groom, "thickness", 1, &[0.02]),
                    per(Domain::Groom, dye, 4, &[1.0, 2.0, 3.0, 1.0]),
                    per(Domain::Groom, "guide", 1, &[1.0]),
                ],
            ),
            input("b", &[2], &[]),
        ])
        .unwrap();
        assert_eq!(data(&merged, "diameter"), [0.02, 0.008]);
        assert_eq!(data(&merged, "guide"), [1.0, 0.0]);
        assert_eq!(data(&merged, dye)[4..], [0.0; 4]);
        assert_eq!(merged.dropped, ["thickness (diameter stands for it)"]);
        assert!(merged.notes[1].contains("b has no diameter: 0.008 cm"));
    }

    #[test]
    fn groups_stay_apart_unless_they_are_named_alike() {
        let with = |name: &str, ids: &[f32], group_names: &[(&str, &str)]| {
            let mut input = input(
                name,
                &vec![2; ids.len()],
                &[per(Domain::Strand, GROUP, 1, ids)],
            );
            let names = group_names.iter();
            let names = names.map(|(name, value)| ((*name).to_owned(), (*value).to_owned()));
            input.groom.source.parameters = names.collect();
            input
        };
        let a = with("a", &[0.0, 1.0], &[("group_name.0", "fringe")]);
        let b = with("b", &[0.0, 1.0, 5.0], &[("group_name.0", "fringe")]);
        let merged = merge(&[a, b, input("c", &[2], &[])]).unwrap();
        // 1 has no name, so it may be another.
        assert_eq!(data(&merged, GROUP), [0.0, 1.0, 0.0, 6.0, 5.0, 7.0]);
        assert_eq!(merged.notes[1], "group_id: 0 fringe, 7 c");
        let again = merge(&[
            MergeInput {
                name: "d".to_owned(),
                groom: merged.groom,
            },
            with("e", &[7.0], &[("group_name.7", "tail")]),
        ])
        .unwrap();
        assert_eq!(data(&again, GROUP), [0.0, 1.0, 0.0, 6.0, 5.0, 7.0, 8.0]);
        assert_eq!(again.notes[1], "group_id: 0 fringe, 7 c, 8 tail");
    }

    #[test]
    fn numbers_of_strands_stay_unique_and_guides_the_same() {
        let ids = per(Domain::Strand, ID, 1, &[0.0, 1.0]);
        let closest = per(Domain::Strand, CLOSEST, 3, &[0.0, 1.0, 0.0, 1.0, 1.0, 1.0]);
        let a = input("a", &[2, 2], &[ids, closest.clone()]);
        let merged = merge(&[a.clone(), a.clone()]).unwrap();
        assert_eq!(data(&merged, ID), [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(data(&merged, CLOSEST)[6..], [2.0, 3.0, 2.0, 3.0, 3.0, 3.0]);
        // Without ids: numbers among the guides.
        let guide = per(Domain::Strand, "guide", 1, &[1.0, 0.0]);
        let b = input("b", &[2, 2], &[closest.clone(), guide]);
        let merged = merge(&[b.clone(), b]).unwrap();
        assert_eq!(data(&merged, CLOSEST)[6..], [1.0, 2.0, 1.0, 2.0, 2.0, 2.0]);
        // Some with and some without: nobody knows whose numbers they are.
        let merged = merge(&[a, input("b", &[2, 2], &[closest])]).unwrap();
        assert!(merged.groom.attribute(CLOSEST).is_none());
        assert!(merged.dropped.iter().any(|text| text.starts_with(CLOSEST)));
        assert!(merged.groom.attribute(ID).is_none());
    }
}
