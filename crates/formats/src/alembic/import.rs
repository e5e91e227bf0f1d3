//! Reading archives.

use super::archive::{Archive, Compound};
use super::attributes::OF_THE_GROOM;
use super::info::INFO;
use super::merge::merge;
use super::notes::Notes;
use super::sampling::SAME_TIME;
use super::strands::{Reading, check_topology};
use super::tree::Tree;
use crate::error::{Error, Result};
use crate::groom::{GroomSource, Original};
use crate::groom_format::{Import, ImportOptions};

/// Decodes an archive at one point in time.
pub(super) fn read(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let placement = options.placement(&INFO);
    let archive = Archive::new(bytes)?;
    let mut notes = Notes::default();
    let mut tree = Tree::new(&archive, &mut notes)?;
    // Of the whole archive: a frame is the same moment whichever object is read.
    let times = times(&archive, &tree)?;
    if let Some(path) = &options.object {
        tree.select(path)?;
    }
    let Some(&time) = times.get(options.frame as usize) else {
        let range = format!("in 0..={}", times.len() - 1);
        return Err(Error::value("frame", options.frame, range));
    };
    let matrices = tree.matrices(&archive, time)?;
    let mut objects = Vec::new();
    let mut n_points_before = 0;
    for curves in &tree.curves {
        let reading = Reading {
            archive: &archive,
            tree: &tree,
            time,
            options,
            placement,
            n_points_before,
        };
        if let Some(strands) = reading.read(curves, &matrices[curves.parent], &mut notes)? {
            n_points_before += strands.points.len() as u64;
            objects.push(strands);
        }
    }
    if objects.is_empty() {
        let lines = notes.finish();
        let lines: Vec<&str> = lines.iter().take(4).map(|note| &*note.text).collect();
        let range = match lines.is_empty() {
            true => "at least 1".to_owned(),
            false => format!("at least 1 ({})", lines.join("; ")),
        };
        let key = "number of strands with two points or more";
        return Err(Error::value(key, 0, range));
    }
    let mut groom = merge(&archive.ogawa, objects, &mut notes)?;
    let mut parameters = of_the_groom(&archive, &tree, time)?;
    parameters.append(&mut groom.source.parameters);
    groom.source = GroomSource {
        cm_per_unit: placement.cm_per_unit,
        up: placement.up,
        parameters,
        original: Some(Original {
            format: INFO.name.to_owned(),
            data: Vec::new(),
        }),
        ..GroomSource::default()
    };
    Ok(Import::new(groom, notes.finish()))
}

/// Times of the points in time that the curves of an archive have, seconds, rising.
pub(super) fn frame_times(bytes: &[u8]) -> Result<Vec<f64>> {
    let archive = Archive::new(bytes)?;
    let tree = Tree::new(&archive, &mut Notes::default())?;
    for curves in &tree.curves {
        if let Some(counts) = curves.geom.get("nVertices") {
            check_topology(&archive, counts, &curves.path)?;
        }
    }
    times(&archive, &tree)
}

/// When positions or a transform above them change; one time if none does.
fn times(archive: &Archive<'_>, tree: &Tree<'_>) -> Result<Vec<f64>> {
    let mut times = Vec::new();
    let mut add = |compound: &Compound<'_>, names: &[&str], path: &str| {
        for name in names {
            let property = compound.get(name).filter(|property| property.varies());
            if let Some(property) = property {
                let sampling = archive.sampling(property, path)?;
                archive.ogawa.spend(8 * u64::from(property.n_samples), 0)?;
                times.extend((0..property.n_samples).map(|ix| sampling.time(ix)));
            }
        }
        Ok::<_, Error>(())
    };
    let mut is_seen = vec![false; tree.nodes.len()];
    for curves in &tree.curves {
        add(&curves.geom, &["P"], &curves.path)?;
        let mut node = Some(curves.parent);
        while let Some(ix) = node.filter(|&ix| !std::mem::replace(&mut is_seen[ix], true)) {
            let around = &tree.nodes[ix];
            add(&around.xform, &[".vals", ".ops", ".inherits"], &around.path)?;
            node = around.parent;
        }
    }
    times.sort_by(f64::total_cmp);
    times.dedup_by(|later, earlier| *later - *earlier < SAME_TIME);
    if times.is_empty() {
        times.push(0.0);
    }
    Ok(times)
}

/// What the file says of the groom as a whole: Unreal's version, tool and properties.
fn of_the_groom(
    archive: &Archive<'_>,
    tree: &Tree<'_>,
    time: f64,
) -> Result<Vec<(String, String)>> {
    let mut parameters: Vec<(String, String)> = Vec::new();
    let mut look = |compound: &Compound<'_>, path: &str| {
        for property in &compound.properties {
            let known = parameters.iter().any(|(name, _)| name == property.name);
            if known || !OF_THE_GROOM.contains(&property.name) {
                continue;
            }
            let values = archive.values_at(property, time, path)?;
            let value = match values.pod.is_text() {
                true => values.texts().into_iter().next(),
                false => values.doubles().next().map(|value| value.to_string()),
            };
            if let Some(value) = value {
                archive.ogawa.spend(value.len() as u64, values.offset)?;
                parameters.push((property.name.to_owned(), value));
            }
        }
        Ok::<_, Error>(())
    };
    for curves in &tree.curves {
        for name in [".userProperties", ".arbGeomParams"] {
            look(
                &archive.compound(curves.geom.get(name), &curves.path)?,
                &curves.path,
            )?;
        }
        look(&curves.properties, &curves.path)?;
        for node in tree.ancestors(curves) {
            for name in [".userProperties", ".arbGeomParams"] {
                look(
                    &archive.compound(node.xform.get(name), &node.path)?,
                    &node.path,
                )?;
            }
            look(&node.properties, &node.path)?;
        }
    }
    parameters.sort();
    Ok(parameters)
}
