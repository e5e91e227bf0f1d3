//! What came through a conversion and what did not, in one line.

use std::path::Path;

use strandlight_formats::Groom;

use crate::cli::note;

/// Says on stderr what of `groom` is in the file at `path`, and what is not.
pub fn note_kept(path: &Path, groom: &Groom, dropped: &[String]) {
    note!("{}: {}", path.display(), kept_line(groom, dropped));
}

/// The attributes of `before` that `after` has no more because strands left, for the list of what was dropped.
pub fn lost_with_strands(before: &Groom, after: &Groom) -> Option<String> {
    let names = before.attributes.iter().map(|attribute| &*attribute.name);
    let lost: Vec<&str> = names
        .filter(|name| after.attribute(name).is_none())
        .collect();
    (!lost.is_empty()).then(|| format!("{} (of guides that are left out)", lost.join(", ")))
}

/// `kept: points, diameter, root_uv; dropped: dye`. Attributes named in `dropped` are not kept.
fn kept_line(groom: &Groom, dropped: &[String]) -> String {
    let names = groom.attributes.iter().map(|attribute| &*attribute.name);
    let held = names.filter(|name| !dropped.iter().any(|other| other == name));
    let kept: Vec<&str> = std::iter::once("points").chain(held).collect();
    let dropped = match dropped {
        [] => "nothing".to_owned(),
        _ => dropped.join(", "),
    };
    format!("kept: {}; dropped: {dropped}", kept.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandlight_formats::{Attribute, Domain};

    #[test]
    fn the_line_names_everything() {
        let mut groom = Groom {
            points: vec![[0.0; 3], [0.0, 1.0, 0.0]],
            strand_offsets: vec![0, 2],
            ..Groom::default()
        };
        assert_eq!(kept_line(&groom, &[]), "kept: points; dropped: nothing");
        for name in ["diameter", "dye", "root_uv"] {
            groom.attributes.push(Attribute {
                name: name.to_owned(),
                domain: Domain::Groom,
                components: 1,
                data: vec![0.1],
            });
        }
        assert_eq!(
            kept_line(&groom, &["dye".to_owned(), "3 guides".to_owned()]),
            "kept: points, diameter, root_uv; dropped: dye, 3 guides"
        );
    }
}
