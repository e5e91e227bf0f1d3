//! Version 2, text.

use super::layout::{INFO, held_at_both_ends, placement, set_version, usual_notes};
use crate::error::{Error, Result};
use crate::groom::Domain;
use crate::groom_format::{Import, ImportOptions, Note, NoteKind};
use crate::strand_list::{StrandList, attribute};
use crate::text_lines::{count, lines, number};

/// What the settings say.
#[derive(Debug, Default)]
struct Settings {
    n_strands: Option<u32>,
    n_follow: u32,
    is_held_at_both_ends: bool,
    /// Lines of a transform that does something.
    transforms: Vec<String>,
}

pub(super) fn read(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    let mut lines = lines(bytes)
        .filter(|line| line.words().next().is_some())
        .peekable();
    let mut settings = Settings::default();
    let is_strand = |line: &crate::text_lines::Line<'_>| line.words().next() == Some(b"strand");
    while let Some(line) = lines.next_if(|line| !is_strand(line)) {
        let words: Vec<&[u8]> = line.words().collect();
        match words[..] {
            [b"version", version] if matches!(number(version), Some(1.0..3.0)) => {}
            [b"version", ..] => return Err(line.is_not("a version of TressFX text, 2.0")),
            [b"numStrands", n] => {
                settings.n_strands = Some(count(n).ok_or_else(|| line.is_not("a count"))?);
            }
            [b"numFollowHairsPerGuideHair", n] => {
                settings.n_follow = count(n).ok_or_else(|| line.is_not("a count"))?;
            }
            [b"bothEndsImmovable", flag] => settings.is_held_at_both_ends = flag != b"0",
            [b"scale" | b"rotation" | b"translation", ref values @ ..] => {
                let rest = if words[0] == b"scale" { 1.0 } else { 0.0 };
                let values: Option<Vec<f32>> = values.iter().map(|word| number(word)).collect();
                let values = values.ok_or_else(|| line.is_not("numbers"))?;
                if values.iter().any(|&value| value != rest) {
                    let shown = String::from_utf8_lossy(line.bytes).trim().to_owned();
                    settings.transforms.push(shown);
                }
            }
            // What else there is concerns the simulation.
            _ => {}
        }
    }
    let Some(n_strands) = settings.n_strands else {
        return Err(Error::invalid("file does not say numStrands", 0));
    };
    let mut list = StrandList::new(placement(2, options), options);
    let mut uvs = Vec::new();
    let mut points = Vec::new();
    let mut n_found = 0;
    while let Some(line) = lines.next() {
        let words: Vec<&[u8]> = line.words().collect();
        let (n_points, uv) = match words[..] {
            [b"strand", _, b"numVerts", n] => (count(n), Some([0.0; 2])),
            [b"strand", _, b"numVerts", n, b"texcoord", u, v] => {
                (count(n), number(u).zip(number(v)).map(|(u, v)| [u, v]))
            }
            _ => (None, None),
        };
        let Some((n_points, uv)) = n_points.zip(uv) else {
            return Err(line.is_not("`strand I numVerts N texcoord U V`"));
        };
        points.clear();
        for ix in 0..n_points {
            let Some(line) = lines.next() else {
                let what = format!("file ends after {ix} of {n_points} points of strand {n_found}");
                return Err(Error::invalid(what, bytes.len() as u64));
            };
            points.push(line.numbers("a point, `x y z`")?);
        }
        if list.push(n_found, points.iter().copied())? {
            uvs.extend(uv);
        }
        n_found += 1;
    }
    if n_found != n_strands as usize {
        let what = format!("file has {n_found} strands, but says numStrands {n_strands}");
        return Err(Error::invalid(what, bytes.len() as u64));
    }
    let mut notes = usual_notes(2, n_found, settings.n_follow, options);
    for transform in settings.transforms {
        let what = format!("`{transform}` of the file is not applied");
        notes.push(Note::new(NoteKind::Dropped, what));
    }
    let mut groom = list.finish(INFO.name, &mut notes)?;
    set_version(&mut groom, 2);
    match uvs.iter().all(|&x| x == 0.0) {
        true => {
            let what = "texture coordinates are left out: all are 0";
            notes.push(Note::new(NoteKind::Dropped, what));
        }
        false => groom
            .attributes
            .push(attribute("root_uv", Domain::Strand, 2, uvs)),
    }
    if settings.is_held_at_both_ends {
        groom.attributes.push(held_at_both_ends(&groom));
    }
    Ok(Import::new(groom, notes))
}
