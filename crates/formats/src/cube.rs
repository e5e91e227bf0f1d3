//! LUTs as `.cube` files: Adobe's (Cube LUT Specification 1.0) and those of DaVinci Resolve, which
//! may put curves before the grid.

use std::path::Path;

use crate::error::{Error, FileName, Result};
use crate::input::read_file;
use crate::sniff::FileKind;
use crate::text_lines::{Line, count, lines, numbers};

/// Most samples of a curve, as Adobe has it.
pub const MAX_CURVE_SIZE: u32 = 65_536;

/// Most samples along an edge of a grid: such a grid is 26 MB.
pub const MAX_GRID_SIZE: u32 = 129;

/// Shortest row of a table.
const ROW_BYTES: usize = "0 0 0\n".len();

/// Keywords of the sizes of curves and grid.
const SIZES: [&str; 2] = ["LUT_1D_SIZE", "LUT_3D_SIZE"];

/// Samples of colours, over a range of inputs that is theirs channel by channel. All are finite; the
/// range is not empty.
#[derive(Clone, Debug, PartialEq)]
pub struct CubeTable {
    /// Samples along an axis: 2..=[`MAX_CURVE_SIZE`] of curves, 2..=[`MAX_GRID_SIZE`] of a grid.
    pub size: u32,
    /// Input at the first sample, channel by channel.
    pub low: [f32; 3],
    /// Input at the last.
    pub high: [f32; 3],
    /// `size` samples, or `size`^3 in the order of the file, red changing fastest.
    pub samples: Vec<[f32; 3]>,
}

/// A `.cube` file: curves, a grid, or a grid behind curves.
///
/// ```
/// use strandlight_formats::Cube;
///
/// let text = "TITLE \"inverse\"\nLUT_1D_SIZE 2\n1 1 1\n0 0 0\n";
/// let cube = Cube::from_bytes(text.as_bytes())?;
/// assert_eq!(cube.title.as_deref(), Some("inverse"));
/// assert_eq!(cube.curves.expect("LUT_1D_SIZE").samples[0], [1.0; 3]);
/// assert!(cube.grid.is_none());
/// # Ok::<(), strandlight_formats::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Cube {
    /// What the file calls itself.
    pub title: Option<String>,
    /// A curve for each channel, `LUT_1D_SIZE`; before the grid where there are both.
    pub curves: Option<CubeTable>,
    /// Colours by colours, `LUT_3D_SIZE`.
    pub grid: Option<CubeTable>,
}

impl Cube {
    /// Longest file: the largest tables with rows of 64 bytes.
    pub const MAX_BYTES: u64 = 144 << 20;

    /// Reads a `.cube` file.
    ///
    /// # Errors
    /// As [`Cube::from_bytes`], or `Io`; the path is named.
    pub fn read(path: impl AsRef<Path>) -> Result<Cube> {
        let path = path.as_ref();
        let bytes = read_file(path, Cube::MAX_BYTES)?;
        Cube::from_bytes(&bytes).map_err(|error| error.in_file(path))
    }

    /// Decodes a `.cube` file in memory.
    ///
    /// # Errors
    /// `NotThisKind`; `Value` or `Syntax` with the line; a file without all its rows.
    pub fn from_bytes(bytes: &[u8]) -> Result<Cube> {
        match FileKind::of(bytes) {
            FileKind::Cube | FileKind::Text | FileKind::Unknown => {}
            found => return Err(Error::not_this_kind(".cube file", found.describe())),
        }
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let mut reader = Reader::default();
        for (number, line) in (1..).zip(lines(text)) {
            reader.line(line, text.len()).map_err(|fault| match fault {
                Fault::Value(error) => error.at_line(|_| Some(number)),
                Fault::Syntax(what) => Error::Syntax {
                    file: FileName::default(),
                    line: number,
                    column: 1,
                    what,
                },
            })?;
        }
        reader.finish()
    }
}

/// What is wrong with a line, whose number is not known here.
enum Fault {
    Value(Error),
    Syntax(String),
}

/// A value outside its range.
fn value(key: &str, found: impl std::fmt::Display, range: impl Into<String>) -> Fault {
    Fault::Value(Error::value(key, found, range))
}

type Bounds = [[f32; 3]; 2];

/// What the lines have said so far.
#[derive(Default)]
struct Reader {
    title: Option<String>,
    /// Of curves and grid.
    sizes: [Option<u32>; 2],
    /// Resolve's ranges of both.
    ranges: [Option<Bounds>; 2],
    /// Adobe's, of the first table there is.
    domain: [Option<[f32; 3]>; 2],
    /// All rows; `None` before the first.
    rows: Option<Vec<[f32; 3]>>,
}

impl Reader {
    fn line(&mut self, line: Line<'_>, n_bytes: usize) -> std::result::Result<(), Fault> {
        let mut words = line.words();
        let Some(first) = words.next().filter(|word| !word.starts_with(b"#")) else {
            return Ok(());
        };
        if !first[0].is_ascii_alphabetic() || is_name_of_no_number(first) {
            return self.row(line, n_bytes);
        }
        let key = shown(first);
        if self.rows.is_some() {
            let what = format!("{key}: keywords stand before the rows");
            return Err(Fault::Syntax(what));
        }
        let rest = line.bytes.trim_ascii_start()[first.len()..].trim_ascii();
        match &*key {
            "TITLE" => {
                let quoted = rest.strip_prefix(b"\"").and_then(|t| t.strip_suffix(b"\""));
                let title = String::from_utf8_lossy(quoted.unwrap_or(rest)).into_owned();
                set(&mut self.title, &key, title)
            }
            "LUT_1D_SIZE" => set(&mut self.sizes[0], &key, size(&key, rest, MAX_CURVE_SIZE)?),
            "LUT_3D_SIZE" => set(&mut self.sizes[1], &key, size(&key, rest, MAX_GRID_SIZE)?),
            "LUT_1D_INPUT_RANGE" => set(&mut self.ranges[0], &key, range(&key, rest)?),
            "LUT_3D_INPUT_RANGE" => set(&mut self.ranges[1], &key, range(&key, rest)?),
            "DOMAIN_MIN" => set(&mut self.domain[0], &key, three(&key, rest)?),
            "DOMAIN_MAX" => set(&mut self.domain[1], &key, three(&key, rest)?),
            "LUT_IN_VIDEO_RANGE" | "LUT_OUT_VIDEO_RANGE" => Err(Fault::Syntax(format!(
                "{key}: values in video range are not read; export the LUT in full range"
            ))),
            _ => Err(Fault::Syntax(format!(
                "{key}: not a keyword of .cube files"
            ))),
        }
    }

    /// Rows that the sizes ask for.
    fn n_rows(&self) -> usize {
        let [curves, grid] = self.sizes.map(|size| size.unwrap_or(0) as usize);
        curves + grid.pow(3)
    }

    fn row(&mut self, line: Line<'_>, n_bytes: usize) -> std::result::Result<(), Fault> {
        let n_rows = self.n_rows();
        if n_rows == 0 {
            let what = "a row before LUT_1D_SIZE or LUT_3D_SIZE";
            return Err(Fault::Syntax(what.to_owned()));
        }
        let row = numbers(line.words());
        let row = row.ok_or_else(|| value("row", shown(line.bytes), "three finite numbers"))?;
        let rows = self.rows.get_or_insert_with(|| {
            // No more than the file can hold.
            Vec::with_capacity(n_rows.min(n_bytes / ROW_BYTES + 1))
        });
        if rows.len() == n_rows {
            let what = format!("a row more than the {n_rows} of the size");
            return Err(Fault::Syntax(what));
        }
        rows.push(row);
        Ok(())
    }

    fn finish(self) -> Result<Cube> {
        let n_rows = self.n_rows();
        let range = "given: LUT_1D_SIZE or LUT_3D_SIZE";
        if n_rows == 0 {
            return Err(Error::value("size", "missing", range));
        }
        let mut rows = self.rows.unwrap_or_default();
        if rows.len() != n_rows {
            let range = format!("{n_rows} by the size");
            return Err(Error::value("number of rows", rows.len(), range));
        }
        let [low, high] = self.domain;
        let domain = match (low, high) {
            (None, None) => None,
            (low, high) => {
                let bounds = [low.unwrap_or([0.0; 3]), high.unwrap_or([1.0; 3])];
                Some(checked("DOMAIN_MAX", bounds)?)
            }
        };
        let [n_curves, n_grid] = self.sizes;
        let first = usize::from(n_curves.is_none());
        for (ix, key) in ["LUT_1D_INPUT_RANGE", "LUT_3D_INPUT_RANGE"]
            .into_iter()
            .enumerate()
        {
            if self.ranges[ix].is_some() && self.sizes[ix].is_none() {
                let range = format!("absent without {}", SIZES[ix]);
                return Err(Error::value(key, "given", range));
            }
            if self.ranges[ix].is_some() && domain.is_some() && ix == first {
                let range = "absent beside DOMAIN_MIN and DOMAIN_MAX";
                return Err(Error::value(key, "given", range));
            }
        }
        let bounds = |ix: usize| {
            let of_table = match ix == first {
                true => self.ranges[ix].or(domain),
                false => self.ranges[ix],
            };
            of_table.unwrap_or([[0.0; 3], [1.0; 3]])
        };
        let table = |ix: usize, size: u32, samples| CubeTable {
            size,
            low: bounds(ix)[0],
            high: bounds(ix)[1],
            samples,
        };
        let of_grid = rows.split_off(n_curves.unwrap_or(0) as usize);
        Ok(Cube {
            title: self.title,
            curves: n_curves.map(|size| table(0, size, rows)),
            grid: n_grid.map(|size| table(1, size, of_grid)),
        })
    }
}

/// `nan`, `inf` and the like, which are no keywords but bad numbers.
fn is_name_of_no_number(word: &[u8]) -> bool {
    let text = std::str::from_utf8(word);
    text.is_ok_and(|text| text.parse::<f32>().is_ok())
}

fn set<T>(place: &mut Option<T>, key: &str, value: T) -> std::result::Result<(), Fault> {
    if place.is_some() {
        return Err(Fault::Syntax(format!("{key}: given twice")));
    }
    *place = Some(value);
    Ok(())
}

/// A part of a line as messages have it.
fn shown(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    text.trim()
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .take(60)
        .collect()
}

fn size(key: &str, rest: &[u8], most: u32) -> std::result::Result<u32, Fault> {
    let size = count(rest).filter(|size| (2..=most).contains(size));
    size.ok_or_else(|| value(key, shown(rest), format!("a whole number in 2..={most}")))
}

fn words(rest: &[u8]) -> impl Iterator<Item = &[u8]> {
    rest.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

fn three(key: &str, rest: &[u8]) -> std::result::Result<[f32; 3], Fault> {
    numbers(words(rest)).ok_or_else(|| value(key, shown(rest), "three finite numbers"))
}

fn range(key: &str, rest: &[u8]) -> std::result::Result<Bounds, Fault> {
    let two: Option<[f32; 2]> = numbers(words(rest));
    let [low, high] = two.ok_or_else(|| value(key, shown(rest), "two finite numbers"))?;
    checked(key, [[low; 3], [high; 3]]).map_err(Fault::Value)
}

/// Bounds between which there is something.
fn checked(key: &str, bounds: Bounds) -> Result<Bounds> {
    let [low, high] = bounds;
    match (0..3).all(|ix| high[ix] - low[ix] > 0.0 && (high[ix] - low[ix]).is_finite()) {
        true => Ok(bounds),
        false => {
            let range = format!("above the lower end {low:?}, channel by channel");
            Err(Error::value(key, format!("{high:?}"), range))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Cube> {
        Cube::from_bytes(text.as_bytes())
    }

    /// The rows of a grid of two samples that changes nothing.
    const GRID: &str = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n";

    #[test]
    fn a_grid_of_adobe_is_read_with_all_that_may_stand_in_it() {
        let text = format!(
            "\u{feff}# made by hand\r\n\r\nTITLE \"a \\ look\"\r\nLUT_3D_SIZE 2\r\n\
             DOMAIN_MIN 0 -1 0\r\nDOMAIN_MAX 1 2 4e0\r\n  {}",
            GRID.replace('\n', " \r\n# row\r\n")
        );
        let cube = read(&text).expect("a grid");
        assert_eq!(cube.title.as_deref(), Some("a \\ look"));
        assert!(cube.curves.is_none());
        let grid = cube.grid.expect("a grid");
        assert_eq!((grid.size, grid.samples.len()), (2, 8));
        assert_eq!((grid.low, grid.high), ([0.0, -1.0, 0.0], [1.0, 2.0, 4.0]));
        assert_eq!(grid.samples[1], [1.0, 0.0, 0.0], "red changes fastest");
        assert_eq!(grid.samples[6], [0.0, 1.0, 1.0]);
    }

    #[test]
    fn curves_before_a_grid_have_ranges_of_their_own() {
        let text = format!(
            "LUT_1D_SIZE 3\nLUT_1D_INPUT_RANGE -0.5 16\nLUT_3D_SIZE 2\n\
             LUT_3D_INPUT_RANGE 0.0 0.5\n0 0 0\n.5 .5 .5\n1 1 1\n{GRID}"
        );
        let cube = read(&text).expect("both");
        let (curves, grid) = (cube.curves.expect("curves"), cube.grid.expect("a grid"));
        assert_eq!(curves.samples, [[0.0; 3], [0.5; 3], [1.0; 3]]);
        assert_eq!((curves.low, curves.high), ([-0.5; 3], [16.0; 3]));
        assert_eq!((grid.low, grid.high), ([0.0; 3], [0.5; 3]));
        assert_eq!(grid.samples.len(), 8);
        // Adobe's range is that of what comes first.
        let text = format!(
            "LUT_1D_SIZE 2\nLUT_3D_SIZE 2\nDOMAIN_MAX 2 2 2\n0 0 0\n1 1 1\n{}",
            GRID.trim_end()
        );
        let cube = read(&text).expect("both");
        assert_eq!(cube.curves.expect("curves").high, [2.0; 3]);
        assert_eq!(cube.grid.expect("a grid").high, [1.0; 3]);
    }

    #[test]
    fn faults_name_line_and_field() {
        let grid = |head: &str| format!("{head}LUT_3D_SIZE 2\n{GRID}");
        for (text, needle) in [
            (String::new(), "not a .cube file: it is empty"),
            ("# nothing\n".to_owned(), "size is missing, must be given"),
            ("LUT_3D_SIZE 1\n".to_owned(), "line 1: LUT_3D_SIZE is 1"),
            (
                "\nLUT_3D_SIZE 130\n".to_owned(),
                "line 2: LUT_3D_SIZE is 130, must be a whole number in 2..=129",
            ),
            ("LUT_1D_SIZE 65537".to_owned(), "in 2..=65536"),
            ("LUT_1D_SIZE -2".to_owned(), "LUT_1D_SIZE is -2"),
            ("LUT_1D_SIZE 4294967297".to_owned(), "is 4294967297"),
            ("LUT_1D_SIZE".to_owned(), "LUT_1D_SIZE is , must"),
            ("LUT_1D_SIZE 2\n0 0 0\n".to_owned(), "number of rows is 1"),
            ("LUT_3D_SIZE 129\n".to_owned(), "must be 2146689 by"),
            (grid("") + "0 0 0\n", "line 10, column 1: a row more"),
            ("0 0 0\nLUT_1D_SIZE 2\n".to_owned(), "a row before"),
            (
                "LUT_1D_SIZE 2\n0 0 0\n0 nan 0\n".to_owned(),
                "line 3: row is 0 nan 0, must be three finite numbers",
            ),
            ("LUT_1D_SIZE 2\ninf 0 0\n".to_owned(), "line 2: row is inf"),
            ("LUT_1D_SIZE 2\n1e39 0 0\n".to_owned(), "row is 1e39"),
            ("LUT_1D_SIZE 2\n0 0\n".to_owned(), "row is 0 0,"),
            ("LUT_1D_SIZE 2\n0 0 0 0\n".to_owned(), "row is 0 0 0 0"),
            (grid("DOMAIN_MIN 0 1 0\n"), "DOMAIN_MAX is [1.0, 1.0, 1.0]"),
            (grid("DOMAIN_MAX 1 1\n"), "line 1: DOMAIN_MAX is 1 1"),
            (
                grid("DOMAIN_MIN -3e38 0 0\nDOMAIN_MAX 3e38 1 1\n"),
                "DOMAIN_MAX",
            ),
            (grid("LUT_3D_INPUT_RANGE 1 1\n"), "LUT_3D_INPUT_RANGE is"),
            (grid("LUT_1D_INPUT_RANGE 0 1\n"), "absent without LUT_1D"),
            (
                grid("DOMAIN_MAX 2 2 2\nLUT_3D_INPUT_RANGE 0 1\n"),
                "absent beside DOMAIN",
            ),
            (grid("LUT_3D_SIZE 2\n"), "line 2, column 1: LUT_3D_SIZE: gi"),
            (grid("LUT_2D_SIZE 2\n"), "LUT_2D_SIZE: not a keyword"),
            (grid("LUT_IN_VIDEO_RANGE\n"), "full range"),
            (grid("") + "TITLE \"late\"", "TITLE: keywords stand before"),
            ("[groom]\nfile = 'a'\n".to_owned(), "it is a scene"),
        ] {
            let error = read(&text).expect_err(needle).to_string();
            assert!(error.contains(needle), "{needle}: {error}");
            assert!(!error.contains('\n'), "{error}");
        }
        let missing = Cube::read("no/such.cube").expect_err("not there");
        assert!(missing.to_string().starts_with("no/such.cube: "));
    }
}
