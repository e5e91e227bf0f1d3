//! The table of formats that hair comes in and goes out by.

use crate::alembic::AlembicFormat;
use crate::ct2hair::Ct2hairFormat;
use crate::groom_format::{FormatInfo, GroomFormat, Sniff};
use crate::hair::HairFormat;
use crate::mitsuba::MitsubaFormat;
use crate::npy::NpyFormat;
use crate::pbrt::PbrtFormat;
use crate::ply::PlyFormat;
use crate::tfx::TfxFormat;
use crate::usc::UscFormat;
use crate::usd::UsdFormat;

/// All formats, those of surer signs first.
pub static GROOM_FORMATS: [&dyn GroomFormat; 10] = [
    &HairFormat,
    &AlembicFormat,
    &UsdFormat,
    &TfxFormat,
    &PlyFormat,
    &NpyFormat,
    &PbrtFormat,
    &MitsubaFormat,
    &Ct2hairFormat,
    &UscFormat,
];

/// The format called `name`: see [`FormatInfo::name`].
pub fn groom_format(name: &str) -> Option<&'static dyn GroomFormat> {
    GROOM_FORMATS
        .into_iter()
        .find(|format| format.info().name == name)
}

/// The format that files ending in `extension` are written in, capitals or not.
pub fn groom_format_for(extension: &str) -> Option<&'static dyn GroomFormat> {
    GROOM_FORMATS.into_iter().find(|format| {
        let FormatInfo {
            extensions, can, ..
        } = format.info();
        can.writes && extensions.iter().any(|e| e.eq_ignore_ascii_case(extension))
    })
}

/// The format of a file that starts with `start`, if one is at least so `sure`.
pub(crate) fn sniff_groom(start: &[u8], sure: Sniff) -> Option<&'static dyn GroomFormat> {
    GROOM_FORMATS
        .into_iter()
        .filter(|format| format.info().can.reads)
        .find(|format| format.sniff(start) >= sure)
}

/// The usual endings of the formats that `wanted` picks: `.hair or .data`.
pub(crate) fn extension_list(wanted: impl Fn(&FormatInfo) -> bool) -> String {
    let infos = GROOM_FORMATS.into_iter().map(GroomFormat::info);
    let mut names: Vec<String> = infos
        .filter(|info| wanted(info))
        .map(|info| format!(".{}", info.extensions[0]))
        .collect();
    let last = names.pop().unwrap_or_default();
    match names.is_empty() {
        true => last,
        false => format!("{} or {last}", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_complete_and_differ() {
        for (ix, format) in GROOM_FORMATS.into_iter().enumerate() {
            let info = format.info();
            let plain = |text: &str| {
                !text.is_empty()
                    && text
                        .bytes()
                        .all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_')
            };
            assert!(plain(info.name), "{info:?}");
            assert!(!info.extensions.is_empty(), "{info:?}");
            assert!(info.extensions.iter().all(|name| plain(name)), "{info:?}");
            assert!(info.title.starts_with("a"), "{info:?}");
            assert!(info.can.reads || info.can.writes, "{info:?}");
            assert!(!info.can.bases.is_empty(), "{info:?}");
            assert!((1e-6..=1e6).contains(&info.cm_per_unit), "{info:?}");
            assert_eq!(groom_format(info.name).map(GroomFormat::info), Some(info));
            for other in &GROOM_FORMATS[..ix] {
                let other = other.info();
                assert_ne!(info.name, other.name);
                let same = |extension| other.extensions.contains(extension);
                let both = info.can.writes && other.can.writes;
                assert!(!both || !info.extensions.iter().any(same), "{info:?}");
            }
            for extension in info.extensions {
                let capitals = extension.to_ascii_uppercase();
                let found = groom_format_for(&capitals).map(GroomFormat::info);
                assert_eq!(found.is_some(), info.can.writes);
            }
        }
        assert_eq!(groom_format("groom").map(GroomFormat::info), None);
        let list = extension_list(|info| info.can.reads);
        assert!(
            list.starts_with(".hair, ") && list.ends_with(" or .data"),
            "{list}"
        );
    }
}
