//! Where a map came from: which image of its file, and which part of the sphere that holds.

use std::fmt;
use strandlight_formats::counted;

/// Where a map came from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MapSource {
    /// [`strandlight_formats::content_hash`] of the file's bytes; of the pixels for a map that was
    /// made in memory.
    pub hash: String,
    /// Format and layout in words, e.g. `OpenEXR, tiles, ZIP, half`.
    pub format: String,
    /// Which image of the file it is, where the file has several.
    pub image: Option<MapImage>,
    /// The windows of an OpenEXR file whose pixels are not exactly the sphere.
    pub windows: Option<MapWindows>,
}

/// Which image of an OpenEXR file to read. What is not said is chosen: the first part that has
/// colour and is not deep, and in it the plain channels before layers, RGB before luminance.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MapSelection {
    /// Name of a part, or its index counted from 0.
    pub part: Option<String>,
    /// Name of a layer, the text before `.R`; empty for the plain channels.
    pub layer: Option<String>,
}

/// Names under which light sets record the image of their map.
const PART_PARAMETER: &str = "map_part";
const LAYER_PARAMETER: &str = "map_layer";

impl MapSelection {
    /// The image that a light set with these parameters
    /// ([`strandlight_formats::LightSetInfo::parameters`]) was fitted to.
    pub fn recorded(parameters: &[(String, String)]) -> MapSelection {
        let find = |name| {
            let found = parameters.iter().find(|(other, _)| other == name);
            found.map(|(_, value)| value.clone())
        };
        MapSelection {
            part: find(PART_PARAMETER),
            layer: find(LAYER_PARAMETER),
        }
    }
}

/// The image that was read of an OpenEXR file with several.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct MapImage {
    /// Index of the part, counted from 0.
    pub part: usize,
    /// Its name.
    pub part_name: Option<String>,
    /// Name of the layer; empty for the plain channels.
    pub layer: String,
    /// What the file has, in words.
    pub choices: String,
}

impl MapImage {
    /// What a light set records, for [`MapSelection::recorded`].
    pub(super) fn parameters(&self) -> impl Iterator<Item = (String, String)> {
        let name = self.part_name.clone();
        // The index, for names may be missing or used twice.
        let part = (PART_PARAMETER.to_owned(), self.part.to_string());
        let layer = (LAYER_PARAMETER.to_owned(), self.layer.clone());
        [part, layer]
            .into_iter()
            .chain(name.map(|name| ("map_part_name".to_owned(), name)))
    }
}

impl fmt::Display for MapImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "part {}", self.part)?;
        if let Some(name) = &self.part_name {
            write!(f, " {name:?}")?;
        }
        match self.layer.as_str() {
            "" => write!(f, ", plain channels"),
            layer => write!(f, ", layer {layer:?}"),
        }
    }
}

/// A rectangle of pixels in the plane of an OpenEXR file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Window {
    /// Column and row of the first pixel.
    pub position: [i64; 2],
    /// Width and height.
    pub size: [usize; 2],
}

impl Window {
    /// The part of this window that is in `other` too; `None` if they do not overlap.
    pub(super) fn intersection(self, other: Window) -> Option<Window> {
        let mut both = self;
        for axis in 0..2 {
            let end = |window: Window| window.position[axis] + window.size[axis] as i64;
            let first = self.position[axis].max(other.position[axis]);
            let last = end(self).min(end(other));
            both.position[axis] = first;
            both.size[axis] = usize::try_from(last - first)
                .ok()
                .filter(|size| *size > 0)?;
        }
        Some(both)
    }

    pub(super) fn moved(mut self, by: [i64; 2]) -> Window {
        for (position, by) in self.position.iter_mut().zip(by) {
            *position += by;
        }
        self
    }

    pub(super) fn area(self) -> u64 {
        self.size[0] as u64 * self.size[1] as u64
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([width, height], [x, y]) = (self.size, self.position);
        write!(f, "{width} x {height} at ({x}, {y})")
    }
}

/// The windows of an OpenEXR file. The sphere is the display window; the file holds the pixels of
/// the data window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct MapWindows {
    /// The pixels that the file holds.
    pub data: Window,
    /// The sphere.
    pub display: Window,
    /// Pixels of the sphere outside the data window, which are black.
    pub black_pixels: u64,
    /// Pixels of the data window outside the sphere, which are left out.
    pub dropped_pixels: u64,
}

impl fmt::Display for MapWindows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the display window, {}, is the sphere; the data window is {}",
            self.display, self.data
        )?;
        if self.black_pixels > 0 {
            let black = counted(
                self.black_pixels,
                "pixel outside it is",
                "pixels outside it are",
            );
            write!(f, "; {black} black")?;
        }
        if self.dropped_pixels > 0 {
            let (one, many) = (
                "pixel outside the sphere is",
                "pixels outside the sphere are",
            );
            let dropped = counted(self.dropped_pixels, one, many);
            write!(f, "; {dropped} left out")?;
        }
        Ok(())
    }
}
