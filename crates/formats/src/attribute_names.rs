//! Names that attributes of hair have in other programs.

/// An attribute of a groom, and what it is called elsewhere.
#[derive(Debug)]
pub(crate) struct AttributeName {
    /// Name in a [`Groom`](crate::Groom).
    pub name: &'static str,
    /// Floats per value.
    pub components: u32,
    /// Is it an integer elsewhere? What a float cannot hold, above 2^24, is left out with a note.
    pub is_integer: bool,
    /// Name in Unreal's groom schema for Alembic, which is also written as a primvar in USD.
    pub unreal: &'static str,
    /// Other names that are read: Houdini's, Blender's, USD's own, and common slips.
    pub others: &'static [&'static str],
}

const fn row(
    name: &'static str,
    components: u32,
    is_integer: bool,
    unreal: &'static str,
    others: &'static [&'static str],
) -> AttributeName {
    AttributeName {
        name,
        components,
        is_integer,
        unreal,
        others,
    }
}

/// The attributes with a meaning beyond their name. Widths are not among them: each format has a
/// place of its own for these. Paint (`dye`, `width_scale`, `shift_scale`) and its `mask` keep their names.
pub(crate) static ATTRIBUTE_NAMES: [AttributeName; 9] = [
    row(
        "root_uv",
        2,
        false,
        "groom_root_uv",
        &["st", "surface_uv_coordinate", "uv"],
    ),
    row("group_id", 1, true, "groom_group_id", &["group"]),
    row("id", 1, true, "groom_id", &[]),
    row("guide", 1, true, "groom_guide", &["groom_guides"]),
    row("color", 3, false, "groom_color", &["Cd", "displayColor"]),
    row("roughness", 1, false, "groom_roughness", &[]),
    row("ao", 1, false, "groom_ao", &[]),
    row("closest_guides", 3, true, "groom_closest_guides", &[]),
    row("guide_weights", 3, false, "groom_guide_weights", &[]),
];

/// The attribute of a groom that a file calls `foreign`.
pub(crate) fn known_attribute(foreign: &str) -> Option<&'static AttributeName> {
    ATTRIBUTE_NAMES.iter().find(|known| {
        known.name == foreign || known.unreal == foreign || known.others.contains(&foreign)
    })
}

/// What the attribute called `name` in a groom is called in Unreal's schema; others keep their
/// name.
pub(crate) fn unreal_name(name: &str) -> &str {
    let known = ATTRIBUTE_NAMES.iter().find(|known| known.name == name);
    known.map_or(name, |known| known.unreal)
}

/// `foreign` as a name that a groom can have: lower case, `_` for what it cannot hold, 64 letters;
/// `None` where nothing is left of it.
pub(crate) fn groom_name(foreign: &str) -> Option<String> {
    if let Some(known) = known_attribute(foreign) {
        return Some(known.name.to_owned());
    }
    let plain = |c: char| match c.to_ascii_lowercase() {
        c if c.is_ascii_lowercase() || c.is_ascii_digit() => c,
        _ => '_',
    };
    let name: String = foreign.chars().map(plain).take(64).collect();
    name.contains(|c| c != '_').then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_and_none_twice() {
        let mut seen = Vec::new();
        for known in &ATTRIBUTE_NAMES {
            assert!((1..=4).contains(&known.components));
            let names = [known.name, known.unreal];
            for name in names.iter().chain(known.others) {
                assert!(!seen.contains(name), "{name}");
                seen.push(name);
                assert_eq!(groom_name(name).as_deref(), Some(known.name));
            }
            assert_eq!(unreal_name(known.name), known.unreal);
        }
        assert_eq!(unreal_name("dye"), "dye");
    }

    #[test]
    fn other_names_are_made_plain() {
        assert_eq!(groom_name("clumpID.2").as_deref(), Some("clumpid_2"));
        assert_eq!(groom_name("é").as_deref(), None);
        assert_eq!(groom_name(""), None);
        assert_eq!(groom_name(&"x".repeat(80)).map(|name| name.len()), Some(64));
    }
}
