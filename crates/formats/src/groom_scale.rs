//! Is a groom as large as hair is, and upright? Units and axes that a file does not state are
//! guessed from what heads of hair have in common.
//!
//! | evidence | says |
//! |---|---|
//! | roots span a scalp: 13 to 28 cm across | unit |
//! | roots are 140 to 195 cm up one axis: a standing person | unit, axis |
//! | roots are 100 to 210 cm up one axis in the unit found | axis |
//! | ends of long hair hang down | axis |
//!
//! A guess is dropped where two of them disagree, or where fibres would be thinner than any hair.

use crate::groom::{Groom, UpAxis};
use crate::groom_diameter::{DiameterRange, DiameterSource};

/// A unit of length that a file may be in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthUnit {
    /// `mm`
    Millimetre,
    /// `cm`
    Centimetre,
    /// `in`
    Inch,
    /// `ft`
    Foot,
    /// `m`
    Metre,
}

impl LengthUnit {
    /// All units, short to long.
    pub const ALL: [LengthUnit; 5] = [
        LengthUnit::Millimetre,
        LengthUnit::Centimetre,
        LengthUnit::Inch,
        LengthUnit::Foot,
        LengthUnit::Metre,
    ];

    /// Name in commands and messages: `mm`, `cm`, `in`, `ft`, `m`.
    pub const fn name(self) -> &'static str {
        match self {
            LengthUnit::Millimetre => "mm",
            LengthUnit::Centimetre => "cm",
            LengthUnit::Inch => "in",
            LengthUnit::Foot => "ft",
            LengthUnit::Metre => "m",
        }
    }

    /// Centimetres in one of it.
    pub const fn cm(self) -> f64 {
        match self {
            LengthUnit::Millimetre => 0.1,
            LengthUnit::Centimetre => 1.0,
            LengthUnit::Inch => 2.54,
            LengthUnit::Foot => 30.48,
            LengthUnit::Metre => 100.0,
        }
    }

    /// The unit called `name`, or `None`.
    pub fn from_name(name: &str) -> Option<LengthUnit> {
        LengthUnit::ALL.into_iter().find(|unit| unit.name() == name)
    }
}

/// Something guessed with confidence, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Guess<T> {
    /// The guess.
    pub value: T,
    /// Why, in words that can follow a colon.
    pub because: String,
}

/// What [`Groom::guess_source`] finds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Guesses {
    /// The unit of the source file.
    pub unit: Option<Guess<LengthUnit>>,
    /// The axis of the source file that points up.
    pub up: Option<Guess<UpAxis>>,
}

/// How far the roots of a head of hair are apart, cm, along the longest of the axes: from caps of
/// hair on top of a child's head to bushy scalps. The ratio is below 2.54, so that at most one unit
/// fits.
const SCALP_CM: (f64, f64) = (13.0, 28.0);
/// Height of the scalp of a standing person, cm.
const STANDING_CM: (f64, f64) = (140.0, 195.0);
/// The same, and of children and people who sit, once the unit is known.
const UPRIGHT_CM: (f64, f64) = (100.0, 210.0);
/// How far from the vertical axis that head is.
const ASIDE_CM: f64 = 50.0;
/// No hair is thinner, cm; the finest is some 15 micrometres. Many grooms have thicker fibres than
/// hair is, fewer of them.
const THINNEST_CM: f64 = 0.001;
/// Extent of a head of hair, cm.
const HAIR_CM: (f64, f64) = (8.0, 250.0);
/// Fewer strands than this have no scalp.
const LEAST_STRANDS: usize = 30;
/// Strands this thick, as a share of the groom's size, are no hair.
const THICK: f32 = 1.0 / 20.0;
/// Between a lash and a mammoth, cm: sizes that hair may have.
const ANY_HAIR_CM: (f32, f32) = (1.0, 1000.0);

impl Groom {
    /// Largest extent, cm.
    pub fn size(&self) -> f32 {
        let (min, max) = self.bounds();
        (0..3).map(|axis| max[axis] - min[axis]).fold(0.0, f32::max)
    }

    /// Guesses unit and up axis of the file that the groom was imported from, whatever they were
    /// taken for. Nothing is guessed about grooms that were not imported.
    pub fn guess_source(&self) -> Guesses {
        match self.source.is_imported() && self.n_strands() >= LEAST_STRANDS {
            true => Shape::of(self).guesses(),
            false => Guesses::default(),
        }
    }

    /// What seems wrong with unit, axes or thickness, each in one line; `drawn` is how thick the
    /// strands are drawn. Empty for a groom like a head of hair.
    pub fn doubts(&self, drawn: DiameterRange) -> Vec<String> {
        let Guesses { unit, up } = self.guess_source();
        let source = &self.source;
        let is_imported = source.is_imported();
        let size = self.size();
        let thick = drawn.median > THICK * size;
        let odd = is_imported && !(ANY_HAIR_CM.0..=ANY_HAIR_CM.1).contains(&size);
        let other = unit.filter(|unit| (unit.value.cm() / source.cm_per_unit - 1.0).abs() > 0.01);

        let mut lines = Vec::new();
        let mut finding = if thick {
            format!(
                "strands are {} cm thick, the groom is {} cm large",
                short(drawn.median),
                short(size)
            )
        } else if odd || other.is_some() {
            format!("the groom is {} cm large", short(size))
        } else {
            String::new()
        };
        if let Some(Guess { value, because }) = other {
            let name = value.name();
            finding += &format!(", and its file seems to be in {name} ({because}): --unit {name}?");
        } else if thick && drawn.source == DiameterSource::Scene {
            finding += ": is the scene's hair.diameter_cm right?";
        } else if thick && !is_imported {
            finding += ": a scene can say hair.diameter_cm";
        } else if thick || odd {
            finding += ": is --unit right?";
        }
        lines.extend(Some(finding).filter(|finding| !finding.is_empty()));
        if let Some(Guess { value, because }) = up.filter(|up| up.value != source.up) {
            let (name, taken) = (value.name(), source.up.name());
            lines.push(format!(
                "{name} seems to be up in the groom's file, not {taken} ({because}): --up {name}?"
            ));
        }
        lines
    }
}

/// Three significant digits.
pub(crate) fn short(value: f32) -> String {
    let value = f64::from(value);
    if value == 0.0 {
        return "0".to_owned();
    }
    let decimals = (2 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// What guesses are made from, in the file's own unit and axes.
struct Shape {
    /// Extents of the roots without the outermost 2 % on each side, by axis.
    scalp: [f64; 3],
    /// Mean root.
    centre: [f64; 3],
    /// Largest extent of all points.
    size: f64,
    /// Mean length of the strands.
    length: f64,
    /// Mean direction of the last third of the strands; 1 long where all point the same way.
    hang: [f64; 3],
    /// Median thickness, where there is one.
    thickness: Option<f64>,
}

impl Shape {
    fn of(groom: &Groom) -> Shape {
        let source = &groom.source;
        let scale = 1.0 / source.cm_per_unit;
        let file = |point: [f32; 3]| source.up.y_up_to_file(point).map(|x| f64::from(x) * scale);
        let n = groom.n_strands() as f64;
        let mut roots: [Vec<f64>; 3] = Default::default();
        let mut hang = [0.0; 3];
        let (mut length, mut hanging) = (0.0, 0.0);
        for strand_ix in 0..groom.n_strands() {
            let points = &groom.points[groom.strand(strand_ix)];
            for (roots, x) in roots.iter_mut().zip(file(points[0])) {
                roots.push(x);
            }
            let pieces = points.windows(2);
            length += pieces
                .map(|pair| distance(file(pair[0]), file(pair[1])))
                .sum::<f64>()
                / n;
            let (from, to) = (
                file(points[2 * (points.len() - 1) / 3]),
                file(points[points.len() - 1]),
            );
            hanging += distance(from, to);
            for axis in 0..3 {
                hang[axis] += to[axis] - from[axis];
            }
        }
        let centre = [0, 1, 2].map(|axis: usize| roots[axis].iter().sum::<f64>() / n);
        let thickness = groom.attribute("thickness").map(|attribute| {
            let mut values = attribute.data.clone();
            let middle = values.len() / 2;
            f64::from(*values.select_nth_unstable_by(middle, f32::total_cmp).1)
        });
        Shape {
            scalp: roots.map(|mut roots| {
                let aside = roots.len() / 50;
                let last = roots.len() - 1 - aside;
                let low = *roots.select_nth_unstable_by(aside, f64::total_cmp).1;
                let high = *roots.select_nth_unstable_by(last, f64::total_cmp).1;
                high - low
            }),
            centre,
            size: f64::from(groom.size()) * scale,
            length,
            hang: hang.map(|x| if hanging > 0.0 { x / hanging } else { 0.0 }),
            thickness: thickness.filter(|&value| value > 0.0),
        }
    }

    fn guesses(&self) -> Guesses {
        let unit = self.unit();
        let up = self.up(unit.as_ref().map(|unit| unit.value));
        Guesses { unit, up }
    }

    fn unit(&self) -> Option<Guess<LengthUnit>> {
        let by_scalp = LengthUnit::ALL
            .into_iter()
            .find(|&unit| self.is_scalp(unit));
        let mut standing = LengthUnit::ALL
            .into_iter()
            .filter(|&unit| self.height(unit, STANDING_CM).is_some());
        let by_height = standing.next().filter(|_| standing.next().is_none());
        let value = match (by_scalp, by_height) {
            (Some(one), Some(other)) if one != other => return None,
            (one, other) => one.or(other)?,
        };
        let cm = value.cm();
        let too_thin = self.thickness.is_some_and(|value| value * cm < THINNEST_CM);
        if too_thin || !within(self.size * cm, HAIR_CM) {
            return None;
        }
        let widest = self.scalp.into_iter().fold(0.0, f64::max);
        let mut because = format!("its roots span {}", short(widest as f32));
        if let Some((axis, height)) = by_height.and_then(|unit| self.height(unit, STANDING_CM)) {
            because += &format!(", {} up along {}", short(height as f32), axis.name());
        }
        Some(Guess { value, because })
    }

    /// Would the roots cover a scalp, in this unit?
    fn is_scalp(&self, unit: LengthUnit) -> bool {
        let mut spans = self.scalp.map(|span| span * unit.cm());
        spans.sort_by(f64::total_cmp);
        within(spans[2], SCALP_CM) && spans[1] > 0.5 * spans[2] && spans[0] > 0.2 * spans[2]
    }

    /// The axis along which the roots are `range` cm up and on no other far away, and how far in
    /// the file's unit.
    fn height(&self, unit: LengthUnit, range: (f64, f64)) -> Option<(UpAxis, f64)> {
        let centre = self.centre.map(|x| x * unit.cm());
        let axes = [UpAxis::X, UpAxis::Y, UpAxis::Z];
        let up = (0..3).find(|&up| {
            let aside = |axis: usize| axis == up || centre[axis].abs() < ASIDE_CM;
            within(centre[up], range) && (0..3).all(aside)
        })?;
        // A crowd or a landscape has other sizes.
        within(self.size * unit.cm(), HAIR_CM).then_some((axes[up], self.centre[up]))
    }

    fn up(&self, unit: Option<LengthUnit>) -> Option<Guess<UpAxis>> {
        let stands = unit.and_then(|unit| self.height(unit, UPRIGHT_CM));
        let hangs = self.hanging_axis();
        match (stands, hangs) {
            (Some((axis, _)), Some(hanging)) if axis != hanging => None,
            (Some((value, height)), _) => Some(Guess {
                value,
                because: format!(
                    "its roots are {} up along {}",
                    short(height as f32),
                    value.name()
                ),
            }),
            (None, Some(value)) => Some(Guess {
                value,
                because: format!("ends of its hair hang down along {}", value.name()),
            }),
            (None, None) => None,
        }
    }

    /// The axis along which the ends of long hair hang down.
    fn hanging_axis(&self) -> Option<UpAxis> {
        let widest = self.scalp.into_iter().fold(0.0, f64::max);
        // Short hair stands off the head or lies on it, as it is combed.
        if self.length < 0.6 * widest {
            return None;
        }
        let axes = [UpAxis::X, UpAxis::Y, UpAxis::Z];
        let down = (0..3).min_by(|&a: &usize, &b| self.hang[a].total_cmp(&self.hang[b]))?;
        let others = (0..3)
            .filter(|&axis| axis != down)
            .map(|axis| self.hang[axis].abs());
        let next = others.fold(0.0, f64::max);
        (self.hang[down] < -0.35 && -self.hang[down] > 1.4 * next).then_some(axes[down])
    }
}

fn within(value: f64, (min, max): (f64, f64)) -> bool {
    (min..=max).contains(&value)
}

fn distance(from: [f64; 3], to: [f64; 3]) -> f64 {
    (0..3)
        .map(|axis| (to[axis] - from[axis]).powi(2))
        .sum::<f64>()
        .sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::groom_format::ImportOptions;
    use crate::interchange::SourceFile;

    /// A head of hair in centimetres, y up, face to z, as a `.hair` file of that unit and axis:
    /// 400 strands of 8 points on the upper part of an ellipsoid, `length` long, that fall by
    /// their weight, or stand off where `length` is short. `height` is how far up its centre is.
    struct Head {
        radii: [f64; 3],
        length: f64,
        height: f64,
        thickness_cm: f64,
    }

    const ADULT: Head = Head {
        radii: [7.5, 11.5, 9.5],
        length: 30.0,
        height: 0.0,
        thickness_cm: 0.008,
    };

    impl Head {
        fn file(&self, unit: LengthUnit, up: UpAxis) -> Vec<u8> {
            const STRANDS: u32 = 400;
            const POINTS: u32 = 8;
            let mut bytes = b"HAIR".to_vec();
            for word in [STRANDS, STRANDS * POINTS, 2, POINTS - 1] {
                bytes.extend(word.to_le_bytes());
            }
            let thickness = (self.thickness_cm / unit.cm()) as f32;
            for default in [thickness, 0.0, 1.0, 1.0, 1.0] {
                bytes.extend(default.to_le_bytes());
            }
            bytes.extend([0; 88]);
            for ix in 0..STRANDS {
                // A spiral over the sphere, from the crown to somewhat below the middle.
                let y = 1.0 - 1.3 * f64::from(ix) / f64::from(STRANDS);
                let (ring, turn) = ((1.0 - y * y).sqrt(), 2.4 * f64::from(ix));
                let normal = [ring * turn.sin(), y, ring * turn.cos()];
                let mut point: [f64; 3] = std::array::from_fn(|a| normal[a] * self.radii[a]);
                point[1] += self.height;
                let step = self.length / f64::from(POINTS - 1);
                for at in 0..POINTS {
                    let in_file = up.y_up_to_file(point.map(|x| (x / unit.cm()) as f32));
                    bytes.extend(in_file.iter().flat_map(|x| x.to_le_bytes()));
                    let fall = (f64::from(at) * step / 6.0).min(1.0);
                    for axis in 0..3 {
                        let down = if axis == 1 { -1.0 } else { 0.0 };
                        point[axis] += step * (fall * down + (1.0 - fall) * normal[axis]);
                    }
                }
            }
            bytes
        }

        fn import(&self, unit: LengthUnit, up: UpAxis, options: ImportOptions) -> Groom {
            let file = SourceFile::from_bytes(self.file(unit, up)).expect("a .hair file");
            file.import(&options).expect("a good file").groom
        }
    }

    const AXES: [UpAxis; 3] = [UpAxis::X, UpAxis::Y, UpAxis::Z];
    fn as_is() -> ImportOptions {
        ImportOptions::default()
    }

    #[test]
    fn heads_in_any_unit_and_axes_are_recognised() {
        let child = [6.5, 9.0, 8.0];
        let large = [9.0, 13.0, 11.0];
        let mut n_checked = 0;
        for radii in [child, ADULT.radii, large] {
            for height in [0.0, 115.0, 165.0, 180.0] {
                for length in [15.0, 30.0, 60.0] {
                    for thickness_cm in [0.0, 0.006, 0.1] {
                        for unit in LengthUnit::ALL {
                            for up in AXES {
                                let head = Head {
                                    radii,
                                    length,
                                    height,
                                    thickness_cm,
                                };
                                let found = head.import(unit, up, as_is()).guess_source();
                                let case = format!(
                                    "{radii:?} {height} {length} {thickness_cm} {unit:?} {up:?}"
                                );
                                let value = found.unit.map(|guess| guess.value);
                                assert_eq!(value, Some(unit), "{case}");
                                let value = found.up.map(|guess| guess.value);
                                assert_eq!(value, Some(up), "{case}");
                                n_checked += 1;
                            }
                        }
                    }
                }
            }
        }
        assert_eq!(n_checked, 3 * 4 * 3 * 3 * 5 * 3);
    }

    #[test]
    fn the_guess_is_of_the_file_however_it_was_taken() {
        let mut n_checked = 0;
        for unit in LengthUnit::ALL {
            for up in AXES {
                let options = as_is().with_unit(unit.cm()).with_up(up);
                let found = ADULT
                    .import(LengthUnit::Metre, UpAxis::Y, options)
                    .guess_source();
                assert_eq!(found.unit.map(|g| g.value), Some(LengthUnit::Metre));
                assert_eq!(found.up.map(|g| g.value), Some(UpAxis::Y));
                n_checked += 1;
            }
        }
        assert_eq!(n_checked, 15);
    }

    #[test]
    fn short_hair_tells_its_axis_only_where_the_head_is_up() {
        let crew_cut = |height| Head {
            length: 2.0,
            height,
            ..ADULT
        };
        for up in AXES {
            let found = crew_cut(0.0)
                .import(LengthUnit::Inch, up, as_is())
                .guess_source();
            assert_eq!(found.unit.map(|guess| guess.value), Some(LengthUnit::Inch));
            assert_eq!(found.up, None);
            let found = crew_cut(170.0)
                .import(LengthUnit::Inch, up, as_is())
                .guess_source();
            assert_eq!(found.up.map(|guess| guess.value), Some(up));
        }
    }

    #[test]
    fn nothing_is_guessed_of_what_is_no_head() {
        let import = |head: Head| head.import(LengthUnit::Centimetre, UpAxis::Y, as_is());
        // Twice as large as a head: between centimetres and inches.
        let double = Head {
            radii: ADULT.radii.map(|radius| 2.0 * radius),
            length: 60.0,
            ..ADULT
        };
        assert_eq!(import(double).guess_source().unit, None);
        // A bear in centimetres is no head in millimetres, for its hair would be too thin.
        let bear = Head {
            radii: [60.0, 100.0, 90.0],
            ..ADULT
        };
        assert_eq!(import(bear).guess_source().unit, None);
        // A fringe.
        let fringe = Head {
            radii: [9.5, 0.5, 1.0],
            ..ADULT
        };
        assert_eq!(import(fringe).guess_source().unit, None);
        // A groom that was not imported has a known unit.
        let mut own = import(ADULT);
        own.source.original = None;
        assert_eq!(own.guess_source(), Guesses::default());
        // Too few strands for a scalp.
        let mut few = import(ADULT);
        few.strand_offsets.truncate(21);
        few.points.truncate(160);
        assert_eq!(few.guess_source(), Guesses::default());
    }

    #[test]
    fn doubts_name_the_flag_that_would_help() {
        let doubts = |head: &Head, unit, up, options: &ImportOptions| {
            let groom = head.import(unit, up, options.clone());
            groom.doubts(groom.diameter_range())
        };
        let right = as_is();
        let (cm, metre) = (LengthUnit::Centimetre, LengthUnit::Metre);
        assert_eq!(doubts(&ADULT, cm, UpAxis::Z, &right), [""; 0]);

        // In metres with the thickness that many programs write, 1, taken as centimetres: the
        // strands are not drawn so thick, nor in the right unit.
        let thick = Head {
            thickness_cm: 100.0,
            ..ADULT
        };
        let lines = doubts(&thick, metre, UpAxis::Z, &right);
        let [line] = &lines[..] else {
            panic!("{lines:?}")
        };
        assert!(line.starts_with("the groom is 0."), "{line}");
        assert!(line.ends_with("--unit m?"), "{line}");
        for unit in [1.0, 100.0] {
            let groom = thick.import(metre, UpAxis::Z, as_is().with_unit(unit));
            assert_eq!(groom.attribute("diameter"), None);
            let faults = groom.thickness_faults().expect("it is too thick");
            assert_eq!((faults.too_thick, faults.is_left_out), (1, true));
            let said = faults.to_string();
            assert!(said.ends_with("drawn 0.008 cm thick"), "{said}");
        }
        // A scene may want it.
        let groom = thick.import(metre, UpAxis::Z, as_is());
        let lines = groom.doubts(DiameterRange {
            min: 1.0,
            median: 1.0,
            max: 1.0,
            source: DiameterSource::Scene,
        });
        assert!(lines[0].starts_with("strands are 1 cm thick"), "{lines:?}");

        let lines = doubts(&ADULT, metre, UpAxis::Y, &right);
        let [size, axis] = &lines[..] else {
            panic!("{lines:?}")
        };
        assert!(
            size.contains("--unit m?") && !size.contains("thick"),
            "{size}"
        );
        assert!(axis.ends_with("--up y?"), "{axis}");

        // Nothing to guess from, but an odd size.
        let double = Head {
            radii: ADULT.radii.map(|radius| 200.0 * radius),
            ..ADULT
        };
        let lines = doubts(&double, cm, UpAxis::Z, &right);
        assert!(
            lines.len() == 1 && lines[0].ends_with("is --unit right?"),
            "{lines:?}"
        );
    }

    #[test]
    fn three_digits_are_shown() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (0.3, "0.3"),
            (0.31234, "0.312"),
            (0.008, "0.008"),
            (1234.5, "1234"),
            (100.0, "100"),
            (30.06, "30.1"),
            (1e-6, "0.000001"),
        ] {
            assert_eq!(short(value), text);
        }
    }
}
