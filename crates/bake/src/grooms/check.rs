//! What is commonly wrong with hair of other programs.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use glam::Vec3;
use strandlight_formats::{Attribute, DiameterSource, Domain, Error, Groom, Guess, counted};
use strandlight_scene::strands::MAX_POINTS;

use super::edit::guides;
use super::roots::{median, quantile, turned_strands};

/// Something wrong with a groom, or doubtful.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Stable name, e.g. `guides-only`.
    pub code: &'static str,
    /// How many strands are concerned, or values where the message says so.
    pub count: usize,
    /// The first strand concerned; `None` where it is the groom as a whole.
    pub first_strand: Option<usize>,
    /// What is found.
    pub message: String,
    /// What to do about it.
    pub advice: String,
}

/// Largest width of hair on a head, cm: a millimetre.
const WIDE_CM: f32 = 0.1;
/// Least width of any hair, cm.
const THIN_CM: f32 = 0.0005;
/// A groom of such a size is taken for one on a head, cm.
const HEAD_CM: f32 = 10.0;
/// Between a lash and a mammoth, cm.
const ANY_HAIR_CM: (f32, f32) = (1.0, 1000.0);
/// Roots that are closer than this are at one place, cm.
const ONE_PLACE_CM: f32 = 1e-4;
/// Strands this many times as far from the middle as nearly all others are far away.
const FAR: f32 = 8.0;
/// Fewer strands than this, as a share, may seem turned by the style alone.
const TURNED: f64 = 0.05;

/// Everything that [`Finding::code`] may be, with what it means.
pub const FINDINGS: [(&str, &str); 18] = [
    (
        "bad-value",
        "a number that is not finite or out of range: the file is not read",
    ),
    ("damaged", "the file contradicts itself or is cut short"),
    ("unit", "the size is that of hair in another unit"),
    (
        "size",
        "the groom is smaller than 1 cm or larger than 1000 cm",
    ),
    ("up-axis", "another axis seems to point up"),
    ("guides-only", "all strands are guides"),
    (
        "guides-mixed",
        "guides are drawn together with the strands that they guide",
    ),
    (
        "no-width",
        "no widths: strands are drawn with the default diameter",
    ),
    ("bad-width", "widths that are negative, zero or too large"),
    (
        "wide",
        "wider than 1 mm on a head, or than a twentieth of the groom",
    ),
    ("thin", "thinner than 5 micrometres"),
    (
        "root-order",
        "strands that seem to run from the tip to the root",
    ),
    (
        "degenerate",
        "strands of zero length, or with fewer than two distinct points",
    ),
    ("coincident-roots", "strands that start in one point"),
    ("duplicate-strands", "strands that are equal to others"),
    ("root-uv-equal", "all root UV are equal"),
    ("far-points", "strands far away from all others"),
    ("limit", "more points than can be drawn"),
];

/// What a reader refused, where that is the file's fault; `None` where it is no such file.
pub fn finding_of_error(error: &Error) -> Option<Finding> {
    let code = match error {
        Error::Value { .. } => "bad-value",
        Error::Invalid { .. } | Error::Syntax { .. } => "damaged",
        _ => return None,
    };
    let message = without_file(error);
    let advice = if message.contains("strand ") {
        "find the strand in the program that wrote the file, and export again"
    } else if ["truncated", "the file has "]
        .iter()
        .any(|short| message.contains(short))
    {
        "write or copy the file again; another program may have cut it short"
    } else {
        "export it again from the program that wrote it"
    };
    let after = message.split("strand ").nth(1).unwrap_or_default();
    let digits = after.split(|c: char| !c.is_ascii_digit()).next();
    Some(Finding {
        code,
        count: 1,
        first_strand: digits.and_then(|digits| digits.parse().ok()),
        message,
        advice: advice.to_owned(),
    })
}

/// What is wrong, for who has named the file already.
fn without_file(error: &Error) -> String {
    let text = error.to_string();
    let path = error.path().map(|path| path.display().to_string());
    let Some(rest) = path.and_then(|path| text.strip_prefix(&path)) else {
        return text;
    };
    if let Some(what) = rest.strip_prefix(": ") {
        return what.to_owned();
    }
    // `:line:column: `
    match rest.trim_start_matches(':').split_once(": ") {
        Some((place, what)) => format!("line {}: {what}", place.replace(':', ", column ")),
        None => text,
    }
}

/// Checks a groom, in centimetres with +Y up; findings in the order of [`FINDINGS`].
pub fn check(groom: &Groom) -> Vec<Finding> {
    let mut findings = Vec::new();
    scale(groom, &mut findings);
    guide_findings(groom, &mut findings);
    widths(groom, &mut findings);
    let turned = turned_strands(groom);
    if turned.len() as f64 > TURNED * groom.n_strands() as f64 {
        findings.push(Finding {
            code: "root-order",
            count: turned.len(),
            first_strand: Some(turned[0]),
            message: format!(
                "{} of {} nearer to the middle of the head than {}",
                turned.len(),
                match turned.len() {
                    1 => format!("{} strands has its tip", groom.n_strands()),
                    _ => format!("{} strands have their tips", groom.n_strands()),
                },
                if turned.len() == 1 {
                    "its root"
                } else {
                    "their roots"
                },
            ),
            advice: "look at root and tip colours; --root auto turns these strands on import, \
                     transform --flip-root all of them"
                .to_owned(),
        });
    }
    strands(groom, &mut findings);
    findings
}

fn scale(groom: &Groom, findings: &mut Vec<Finding>) {
    let guesses = groom.guess_source();
    let source = &groom.source;
    let size = groom.size();
    let all = groom.n_strands();
    let other = |cm: f64| (cm / source.cm_per_unit - 1.0).abs() > 0.01;
    match guesses.unit {
        Some(Guess { value, because }) if other(value.cm()) => findings.push(Finding {
            code: "unit",
            count: all,
            first_strand: None,
            message: format!(
                "the groom is {size:.3} cm large; its file seems to be in {}: {because}",
                value.name()
            ),
            advice: format!("import with --unit {}", value.name()),
        }),
        _ if !(ANY_HAIR_CM.0..=ANY_HAIR_CM.1).contains(&size) => findings.push(Finding {
            code: "size",
            count: all,
            first_strand: None,
            message: format!("the groom is {size:.3} cm large"),
            advice: "give the unit on import (--unit), or scale it (transform --scale)".to_owned(),
        }),
        _ => {}
    }
    if let Some(Guess { value, because }) = guesses.up.filter(|up| up.value != source.up) {
        findings.push(Finding {
            code: "up-axis",
            count: all,
            first_strand: None,
            message: format!(
                "{} seems to be up in its file, not {}: {because}",
                value.name(),
                source.up.name()
            ),
            advice: format!("import with --up {}", value.name()),
        });
    }
}

fn guide_findings(groom: &Groom, findings: &mut Vec<Finding>) {
    let Some(is_guide) = guides(groom) else {
        return;
    };
    let count = is_guide.iter().filter(|&&is_guide| is_guide).count();
    let first_strand = is_guide.iter().position(|&is_guide| is_guide);
    let (code, message, advice) = match count == groom.n_strands() {
        true => (
            "guides-only",
            counted(count, "curve, a guide", "curves, all guides")
                + ": the hair itself is not in the file",
            "export the strands as well, or make them with groom interpolate",
        ),
        false => (
            "guides-mixed",
            format!("{count} of {} curves are guides", groom.n_strands()),
            "import leaves out guides unless it is given --guides keep",
        ),
    };
    findings.push(Finding {
        code,
        count,
        first_strand,
        message,
        advice: advice.to_owned(),
    });
}

fn widths(groom: &Groom, findings: &mut Vec<Finding>) {
    let size = groom.size();
    let drawn = groom.diameter_range();
    if let Some(faults) = groom.thickness_faults() {
        findings.push(Finding {
            code: "bad-width",
            count: 1,
            first_strand: None,
            message: faults.to_string(),
            advice: "repair the widths, or set hair.diameter_cm in the scene".to_owned(),
        });
    } else if drawn.source == DiameterSource::Default {
        findings.push(Finding {
            code: "no-width",
            count: groom.n_strands(),
            first_strand: None,
            message: format!("no widths: drawn {} cm thick", drawn.median),
            advice: "export widths, or set hair.diameter_cm in the scene".to_owned(),
        });
        return;
    }
    let Some(attribute) = groom.attribute("diameter").filter(|a| a.components == 1) else {
        return;
    };
    let limit = if size >= HEAD_CM {
        WIDE_CM
    } else {
        size / 20.0
    };
    let (n, first) = strands_where(groom, attribute, |width| width > limit);
    if n > 0 {
        findings.push(Finding {
            code: "wide",
            count: n,
            first_strand: first,
            message: format!(
                "{} wider than {limit:.3} cm, up to {:.3} cm, on a groom {size:.1} cm large",
                counted(n, "strand is", "strands are"),
                drawn.max
            ),
            advice:
                "check whether widths are radii or in another unit; few strands may be wide on \
                     purpose (groom thin); hair.diameter_cm in the scene overrides them"
                    .to_owned(),
        });
    }
    // Tips may taper to nothing: the widest place of a strand counts.
    let (wide, _) = strands_where(groom, attribute, |width| width >= THIN_CM);
    if wide < groom.n_strands() {
        let first = (0..groom.n_strands())
            .find(|&strand| values_of(groom, attribute, strand).all(|width| width < THIN_CM));
        let n = groom.n_strands() - wide;
        findings.push(Finding {
            code: "thin",
            count: n,
            first_strand: first,
            message: counted(n, "strand is", "strands are")
                + &format!(" nowhere thicker than {THIN_CM} cm"),
            advice: "check the unit of the widths".to_owned(),
        });
    }
}

fn values_of<'a>(
    groom: &Groom,
    attribute: &'a Attribute,
    strand: usize,
) -> impl Iterator<Item = f32> + 'a {
    let range = match attribute.domain {
        Domain::Groom => 0..1,
        Domain::Strand => strand..strand + 1,
        Domain::Point => groom.strand(strand),
    };
    attribute.data[range].iter().copied()
}

/// How many strands have a value that `wanted` picks, and the first of them.
fn strands_where(
    groom: &Groom,
    attribute: &Attribute,
    wanted: impl Fn(f32) -> bool,
) -> (usize, Option<usize>) {
    let mut found =
        (0..groom.n_strands()).filter(|&strand| values_of(groom, attribute, strand).any(&wanted));
    let first = found.next();
    (usize::from(first.is_some()) + found.count(), first)
}

/// Findings about single strands and their roots.
fn strands(groom: &Groom, findings: &mut Vec<Finding>) {
    let n = groom.n_strands();
    let mut add = |code, found: &[usize], [one, many]: [&str; 2], advice: &str| {
        if let Some(&first) = found.first() {
            findings.push(Finding {
                code,
                count: found.len(),
                first_strand: Some(first),
                message: counted(found.len(), one, many),
                advice: advice.to_owned(),
            });
        }
    };
    let is_point = |&ix: &usize| {
        let points = &groom.points[groom.strand(ix)];
        points.iter().all(|point| *point == points[0])
    };
    let mut degenerate: Vec<usize> = (0..n).filter(is_point).collect();
    let set_aside = groom.source.n_set_aside();
    add(
        "degenerate",
        &degenerate,
        ["strand has zero length", "strands have zero length"],
        "they draw nothing; leave them out of the export",
    );
    if degenerate.is_empty() && set_aside > 0 {
        // They are not among the strands, so that there is no first.
        degenerate.resize(set_aside, 0);
        add(
            "degenerate",
            &degenerate,
            [
                "strand of the file has fewer than two points, and is not drawn",
                "strands of the file have fewer than two points, and are not drawn",
            ],
            "leave them out of the export",
        );
    }
    let duplicates = duplicates(groom);
    let is_duplicate = |ix: &usize| duplicates.binary_search(ix).is_ok();
    let mut at_root = HashMap::new();
    let coincident: Vec<usize> = (0..n)
        .filter(|&ix| {
            let root = groom.points[groom.strand(ix).start];
            let cell = root.map(|x| (x / ONE_PLACE_CM).round() as i64);
            let first = *at_root.entry(cell).or_insert(ix);
            first != ix && !is_duplicate(&ix)
        })
        .collect();
    add(
        "coincident-roots",
        &coincident,
        [
            "strand starts where another does",
            "strands start where another does",
        ],
        "check whether roots were lost, or whether strands were copied",
    );
    add(
        "duplicate-strands",
        &duplicates,
        [
            "strand is equal to another one",
            "strands are equal to another one",
        ],
        "the file may hold its hair twice: import one object of it by --prim",
    );
    if let Some(uv) = groom.attribute("root_uv") {
        let k = uv.components as usize;
        let first = &uv.data[..k];
        if uv.data.len() > k && uv.data.chunks_exact(k).all(|value| value == first) {
            add(
                "root-uv-equal",
                &(0..n).collect::<Vec<_>>(),
                ["strand has one root UV", "strands have one root UV"],
                "bind the hair to its mesh again before export: such hair shows no texture",
            );
        }
    }
    add(
        "far-points",
        &far_strands(groom),
        [
            "strand reaches far away from all others",
            "strands reach far away from all others",
        ],
        "look for strands that broke in a simulation, and leave them out",
    );
    if groom.points.len() > MAX_POINTS {
        let n_points = groom.points.len();
        let is_beyond = |who: &str| {
            format!("{who} beyond the {MAX_POINTS} points that can be drawn; there are {n_points}")
        };
        let beyond = |&ix: &usize| groom.strand(ix).end > MAX_POINTS;
        let beyond: Vec<usize> = (0..n).filter(beyond).collect();
        add(
            "limit",
            &beyond,
            [&is_beyond("strand is"), &is_beyond("strands are")],
            "groom thin or groom resample make it smaller",
        );
    }
}

/// Strands whose points are those of an earlier strand.
fn duplicates(groom: &Groom) -> Vec<usize> {
    let bits = |ix: usize| {
        let points = groom.points[groom.strand(ix)].iter().flatten();
        points.map(|x| x.to_bits())
    };
    let mut by_hash: HashMap<u64, Vec<usize>> = HashMap::new();
    (0..groom.n_strands())
        .filter(|&ix| {
            let mut hasher = DefaultHasher::new();
            bits(ix).for_each(|x| x.hash(&mut hasher));
            let same = by_hash.entry(hasher.finish()).or_default();
            let known = same.iter().any(|&other| bits(other).eq(bits(ix)));
            if !known {
                same.push(ix);
            }
            known
        })
        .collect()
}

/// Strands that reach many times as far from the middle of the roots as nearly all others do.
fn far_strands(groom: &Groom) -> Vec<usize> {
    let roots = (0..groom.n_strands()).map(|ix| groom.points[groom.strand(ix).start]);
    let middle = median(roots.map(Vec3::from));
    let reach: Vec<f32> = (0..groom.n_strands())
        .map(|ix| {
            let points = groom.points[groom.strand(ix)].iter();
            points
                .map(|&point| Vec3::from(point).distance(middle))
                .fold(0.0, f32::max)
        })
        .collect();
    let usual = quantile(reach.clone(), 0.9);
    (0..reach.len())
        .filter(|&ix| usual > 0.0 && reach[ix] > FAR * usual)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::edit_samples::{attribute, head, per_strand};
    use super::super::roots::turn_strands;
    use super::super::{GrowSpec, Style, generate};
    use super::*;
    use strandlight_scene::progress::Progress;

    /// Hair without a fault.
    fn good() -> Groom {
        let mut groom = head(200);
        groom
            .attributes
            .push(attribute("diameter", Domain::Groom, 1, vec![0.008]));
        groom
    }

    fn codes(groom: &Groom) -> Vec<&'static str> {
        check(groom).into_iter().map(|found| found.code).collect()
    }

    #[test]
    fn good_hair_has_no_findings() {
        assert_eq!(check(&good()), []);
        for style in Style::ALL {
            let spec = GrowSpec {
                style,
                strands: 3000,
                points_per_strand: 12,
                seed: 1,
            };
            let groom = generate(&spec, &Progress::silent()).unwrap();
            assert_eq!(check(&groom), [], "{}", style.name());
        }
    }

    #[test]
    fn every_fault_has_its_code_count_and_strand() {
        let with = |edit: &dyn Fn(&mut Groom)| {
            let mut groom = good();
            edit(&mut groom);
            groom.validate().unwrap();
            let found = check(&groom);
            assert_eq!(found.len(), 1, "{found:?}");
            let found = &found[0];
            let known = FINDINGS.iter().any(|(code, _)| *code == found.code);
            assert!(known && !found.message.is_empty() && !found.advice.is_empty());
            (found.code, found.count, found.first_strand)
        };
        let push = |groom: &mut Groom, values: &dyn Fn(usize) -> f32, name: &str| {
            let attribute = per_strand(name, groom, values);
            groom.attributes.retain(|other| other.name != name);
            groom.attributes.push(attribute);
        };
        let scaled = |groom: &mut Groom, factor: f32| {
            for x in groom.points.iter_mut().flatten() {
                *x *= factor;
            }
        };
        let guide = |from: usize| move |ix: usize| f32::from(u8::from(ix >= from));
        let width = |value: f32| move |ix: usize| if ix == 7 || ix == 150 { value } else { 0.008 };
        let copied = |groom: &mut Groom, n: usize| {
            let (from, to) = (groom.strand(3), groom.strand(90));
            let points = groom.points[from][..n].to_vec();
            groom.points[to.start..to.start + n].copy_from_slice(&points);
        };
        type Case<'a> = (&'a dyn Fn(&mut Groom), (&'static str, usize, Option<usize>));
        let cases: [Case; 12] = [
            (
                &|groom| push(groom, &guide(0), "guide"),
                ("guides-only", 200, Some(0)),
            ),
            (
                &|groom| push(groom, &guide(120), "guide"),
                ("guides-mixed", 80, Some(120)),
            ),
            (&|groom| groom.attributes.clear(), ("no-width", 200, None)),
            (
                &|groom| push(groom, &width(0.2), "diameter"),
                ("wide", 2, Some(7)),
            ),
            (
                &|groom| push(groom, &width(1e-5), "diameter"),
                ("thin", 2, Some(7)),
            ),
            (
                &|groom| turn_strands(groom, &(5..45).collect::<Vec<_>>()).unwrap(),
                ("root-order", 40, Some(5)),
            ),
            (
                &|groom| {
                    let range = groom.strand(11);
                    let root = groom.points[range.start];
                    groom.points[range].fill(root);
                },
                ("degenerate", 1, Some(11)),
            ),
            (&|groom| copied(groom, 1), ("coincident-roots", 1, Some(90))),
            (
                &|groom| copied(groom, 12),
                ("duplicate-strands", 1, Some(90)),
            ),
            (
                &|groom| {
                    let uv = attribute("root_uv", Domain::Strand, 2, [0.5, 0.25].repeat(200));
                    groom.attributes.push(uv);
                },
                ("root-uv-equal", 200, Some(0)),
            ),
            (
                &|groom| {
                    let tip = groom.strand(40).end - 1;
                    groom.points[tip] = [700.0, 0.0, 0.0];
                },
                ("far-points", 1, Some(40)),
            ),
            (
                &|groom| {
                    scaled(groom, 0.001);
                    groom.attributes[0].data[0] = 0.001;
                },
                ("size", 200, None),
            ),
        ];
        for (edit, expected) in cases {
            assert_eq!(with(edit), expected);
        }
    }

    #[test]
    fn one_finding_does_not_hide_another() {
        let mut groom = head(100);
        groom.attributes.push(per_strand("guide", &groom, |_| 1.0));
        turn_strands(&mut groom, &(0..30).collect::<Vec<_>>()).unwrap();
        assert_eq!(codes(&groom), ["guides-only", "no-width", "root-order"]);
    }
}
