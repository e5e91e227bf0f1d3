//! Hair from and to files of other programs.

use std::path::{Path, PathBuf};

use crate::counted::counted;
use crate::error::{Error, Result};
use crate::groom::{Groom, GroomSource};
use crate::groom_format::{Export, ExportOptions, GroomFormat, Import, ImportOptions, StatedBy};
use crate::groom_formats::groom_format;
use crate::groom_scale::Guesses;
use crate::input::read_file_of_kind;
use crate::provenance::content_hash;
use crate::sniff::FileKind;
use crate::validate::in_range;

/// Largest file: 4 GiB, some 350 million points.
const MAX_FILE_BYTES: u64 = 1 << 32;

/// A file of hair that another program wrote, in memory, to be imported in one way or another.
///
/// Its format is found by its content: see [`GROOM_FORMATS`](crate::GROOM_FORMATS).
#[derive(Clone, Debug)]
pub struct SourceFile {
    path: Option<PathBuf>,
    bytes: Vec<u8>,
    format: &'static dyn GroomFormat,
}

impl SourceFile {
    /// Reads the file at `path`; but for its start it is checked by [`SourceFile::import`].
    ///
    /// # Errors
    /// `Io`, `NotThisKind`, or `Value` where it is too long; the path is named.
    pub fn read(path: &Path) -> Result<Self> {
        let is_hair = |kind| matches!(kind, FileKind::Hair(_));
        let bytes = read_file_of_kind(path, MAX_FILE_BYTES, is_hair)?;
        let mut file = SourceFile::from_bytes(bytes).map_err(|error| error.in_file(path))?;
        file.path = Some(path.to_owned());
        Ok(file)
    }

    /// A file in memory.
    ///
    /// # Errors
    /// `NotThisKind`.
    pub fn from_bytes(bytes: impl Into<Vec<u8>>) -> Result<Self> {
        let bytes = bytes.into();
        let found = FileKind::of(&bytes);
        let format = match found {
            FileKind::Hair(info) => groom_format(info.name),
            _ => None,
        };
        let Some(format) = format else {
            return Err(Error::not_this_kind("file of hair", found.describe()));
        };
        Ok(SourceFile {
            path: None,
            bytes,
            format,
        })
    }

    /// Its format.
    pub fn format(&self) -> &'static dyn GroomFormat {
        self.format
    }

    /// Makes a groom of it, in memory bounded by a small multiple of its length.
    ///
    /// # Errors
    /// `Invalid` where the file contradicts itself, `Value` for numbers out of range (naming strand
    /// and point) or where no strand has two points; the path is named.
    pub fn import(&self, options: &ImportOptions) -> Result<Import> {
        self.decode(options).map_err(|error| match &self.path {
            Some(path) => error.in_file(path),
            None => error,
        })
    }

    fn decode(&self, options: &ImportOptions) -> Result<Import> {
        options.validate()?;
        self.check_choice(options)?;
        let mut import = self.format.read(&self.bytes, options)?;
        import.groom.source.hash = content_hash(&self.bytes);
        if options.cm_per_unit.is_some() {
            import.unit_by = StatedBy::Options;
        }
        if options.up.is_some() {
            import.up_by = StatedBy::Options;
        }
        import.groom.validate()?;
        Ok(import)
    }

    /// Objects and points in time can be chosen where the format has them.
    fn check_choice(&self, options: &ImportOptions) -> Result<()> {
        let info = self.format.info();
        if let Some(path) = options.object.as_ref().filter(|_| !info.can.objects) {
            let range = format!("left out: {} has no named objects", info.title);
            return Err(Error::value("object", format!("{path:?}"), range));
        }
        if options.frame > 0 && !info.can.frames {
            let range = format!("0: {} holds one point in time", info.title);
            return Err(Error::value("frame", options.frame, range));
        }
        Ok(())
    }

    /// Times of the points in time that it holds, seconds, rising; one if it does not move. Frame
    /// `ix` is imported by [`ImportOptions::with_frame`].
    ///
    /// # Errors
    /// As [`SourceFile::import`].
    pub fn frame_times(&self) -> Result<Vec<f64>> {
        let times = self.format.frame_times(&self.bytes);
        times.map_err(|error| match &self.path {
            Some(path) => error.in_file(path),
            None => error,
        })
    }

    /// Guesses unit and up axis: see [`Groom::guess_source`].
    ///
    /// # Errors
    /// As [`SourceFile::import`].
    pub fn guess_source(&self) -> Result<Guesses> {
        // Small enough for the coordinates of a groom, whatever they are in.
        let small = ImportOptions::default().with_unit(0.01);
        Ok(self.import(&small)?.groom.guess_source())
    }
}

impl Groom {
    /// The groom as a file of `format`. A groom that was imported in centimetres from a `.hair` or
    /// `.data` file comes back byte for byte.
    ///
    /// # Errors
    /// `Value` when the groom breaks a promise or does not fit into the format.
    pub fn export(&self, format: &dyn GroomFormat, options: &ExportOptions) -> Result<Export> {
        options.validate()?;
        self.validate()?;
        let export = format.write(self, options)?;
        Ok(self.with_dropped(format, export))
    }

    /// Points in time of a groom, `frames_per_second` of them, as one file of `format`. All must
    /// have the same strands; attributes are those of the first.
    ///
    /// # Errors
    /// As [`Groom::export`]; `Value` where frames differ in their strands, or the format holds one
    /// point in time only.
    pub fn export_frames(
        frames: &[Groom],
        frames_per_second: f64,
        format: &dyn GroomFormat,
        options: &ExportOptions,
    ) -> Result<Export> {
        options.validate()?;
        in_range("frames per second", frames_per_second, 1e-3, 1e6)?;
        let Some(first) = frames.first() else {
            return Err(Error::value("number of frames", 0, "at least 1"));
        };
        for (ix, frame) in frames.iter().enumerate() {
            frame.validate()?;
            if frame.strand_offsets != first.strand_offsets {
                return Err(Error::value(
                    format!("frame {ix}"),
                    format!(
                        "of {} with {}",
                        counted(frame.n_strands(), "strand", "strands"),
                        counted(frame.points.len(), "point", "points")
                    ),
                    "of strands with as many points as in the first frame",
                ));
            }
        }
        let export = format.write_frames(frames, frames_per_second, options)?;
        Ok(first.with_dropped(format, export))
    }

    /// `export` with the names of the attributes that a file of `format` cannot hold.
    fn with_dropped(&self, format: &dyn GroomFormat, mut export: Export) -> Export {
        let held = format.info().can.attributes;
        let names = self.attributes.iter().map(|attribute| &attribute.name);
        let dropped = names.filter(|name| !held.holds(name));
        export.dropped = dropped.cloned().collect();
        export
    }
}

impl GroomSource {
    /// How many strands of the source file are not in the groom, but kept for export.
    pub fn n_set_aside(&self) -> usize {
        self.original.as_ref().map_or(0, |original| {
            groom_format(&original.format).map_or(0, |format| format.n_set_aside(&original.data))
        })
    }
}
