//! The `.tables` file, version 1.
//!
//! | section | content |
//! |---|---|
//! | `META` | record: Fresnel term, tool version, parameters, and the header of each table |
//! | `DATA i` | texels of table i, f32, in the order of the axes, `[rows][columns][channels]` |

use std::io::{Cursor, Read, Seek};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use strandlight_scattering::axis::Spacing;

use crate::baked_file::BakedFile;
use crate::container::{Container, ContainerWriter, Kind, encode_record};
use crate::error::{Error, Result};
use crate::input::Input;
use crate::tables::{Axis, Table, TableFile, TableHeader, TableInfo, validate_file};

#[derive(Serialize, Deserialize)]
struct Meta {
    fresnel: String,
    tool_version: String,
    parameters: Vec<(String, String)>,
    tables: Vec<TableMeta>,
}

#[derive(Serialize, Deserialize)]
struct TableMeta {
    name: String,
    axes: Vec<AxisMeta>,
    channels: Vec<String>,
    /// See [`TableHeader::format`].
    format: String,
    max_interpolation_error: f32,
}

#[derive(Serialize, Deserialize)]
struct AxisMeta {
    name: String,
    min: f64,
    max: f64,
    count: u32,
    /// See [`Spacing::name`].
    spacing: String,
    /// [`Axis::TEXEL_CENTRES`].
    texel_centres: String,
}

const META: [u8; 4] = *b"META";
const DATA: [u8; 4] = *b"DATA";

/// An opened `.tables` file: the headers are read, the data of a table when asked for.
#[derive(Debug)]
pub struct TableReader<R> {
    container: Container<R>,
    path: Option<PathBuf>,
    fresnel: String,
    info: TableInfo,
    headers: Vec<TableHeader>,
}

impl TableReader<Cursor<&'static [u8]>> {
    /// Opens tables compiled into a program.
    ///
    /// # Errors
    /// Any of [`Error`].
    pub fn from_static(bytes: &'static [u8]) -> Result<Self> {
        TableReader::new(Container::from_bytes(bytes, Kind::Tables)?)
    }
}

impl<R: Read + Seek> TableReader<R> {
    /// Reads and checks the headers.
    ///
    /// # Errors
    /// Any of [`Error`].
    pub fn new(mut container: Container<R>) -> Result<Self> {
        let meta: Meta = container.read_record(META)?;
        let offset = container.require(META, 0)?.offset;
        let mut headers = Vec::with_capacity(meta.tables.len().min(256));
        for table in meta.tables {
            headers.push(header_from_meta(table, offset)?);
        }
        validate_file(&meta.fresnel, headers.iter().map(|header| &header.name))?;
        for (ix, header) in (0u32..).zip(&headers) {
            let section = container.require(DATA, ix)?;
            if section.length != 4 * header.n_floats()? as u64 {
                return Err(Error::invalid(
                    format!("table {} has {} bytes of data", header.name, section.length),
                    section.offset,
                ));
            }
        }
        Ok(TableReader {
            container,
            path: None,
            fresnel: meta.fresnel,
            info: TableInfo {
                tool_version: meta.tool_version,
                parameters: meta.parameters,
            },
            headers,
        })
    }

    /// Fresnel term of the H tables: `dielectric` or `schlick`.
    pub fn fresnel(&self) -> &str {
        &self.fresnel
    }

    /// How the tables were made.
    pub fn info(&self) -> &TableInfo {
        &self.info
    }

    /// Headers of all tables, in file order.
    pub fn headers(&self) -> &[TableHeader] {
        &self.headers
    }

    /// Reads the table called `name` and nothing else.
    ///
    /// # Errors
    /// `Invalid` if there is none of that name or its data are damaged; `Io`.
    pub fn read_table(&mut self, name: &str) -> Result<Table> {
        let result = self.read_named(name);
        match &self.path {
            Some(path) => result.map_err(|error| error.in_file(path)),
            None => result,
        }
    }

    fn read_named(&mut self, name: &str) -> Result<Table> {
        let ix = self
            .headers
            .iter()
            .position(|header| header.name == name)
            .ok_or_else(|| {
                let names: Vec<_> = self.headers.iter().map(|header| &*header.name).collect();
                let what = format!("there is no table {name}, only {}", names.join(", "));
                Error::invalid(what, 0)
            })?;
        let data = self.container.read_array(DATA, ix as u32)?;
        self.headers[ix].clone().with_data(data)
    }

    fn read_all(mut self) -> Result<TableFile> {
        let mut tables = Vec::with_capacity(self.headers.len());
        for (ix, header) in (0u32..).zip(std::mem::take(&mut self.headers)) {
            tables.push(header.with_data(self.container.read_array(DATA, ix)?)?);
        }
        self.container.check_unread()?;
        Ok(TableFile {
            fresnel: self.fresnel,
            tables,
            info: self.info,
        })
    }
}

fn header_from_meta(meta: TableMeta, offset: u64) -> Result<TableHeader> {
    let mut axes = Vec::with_capacity(meta.axes.len().min(4));
    for axis in meta.axes {
        let spacing = Spacing::from_name(&axis.spacing).ok_or_else(|| {
            let what = format!("axis {} has unknown spacing {:?}", axis.name, axis.spacing);
            Error::invalid(what, offset)
        })?;
        if axis.texel_centres != Axis::TEXEL_CENTRES {
            let rule = format!("{:?}", axis.texel_centres);
            return Err(Error::value("texel-centre rule", rule, Axis::TEXEL_CENTRES));
        }
        axes.push(Axis {
            name: axis.name,
            min: axis.min,
            max: axis.max,
            count: axis.count,
            spacing,
        });
    }
    let header = TableHeader {
        name: meta.name,
        axes,
        channels: meta.channels,
        max_interpolation_error: meta.max_interpolation_error,
    };
    header.validate()?;
    if meta.format != header.format() {
        let key = format!("format of table {}", header.name);
        return Err(Error::value(
            key,
            format!("{:?}", meta.format),
            header.format(),
        ));
    }
    Ok(header)
}

impl TableFile {
    /// Opens a `.tables` file to read single tables from.
    ///
    /// # Errors
    /// Any of [`Error`], naming the path.
    pub fn open(path: &Path) -> Result<TableReader<Input>> {
        let mut reader = Container::open(path, Kind::Tables)
            .and_then(TableReader::new)
            .map_err(|error| error.in_file(path))?;
        reader.path = Some(path.to_owned());
        Ok(reader)
    }
}

impl BakedFile for TableFile {
    const KIND: Kind = Kind::Tables;

    fn from_container<R: Read + Seek>(file: Container<R>) -> Result<Self> {
        TableReader::new(file)?.read_all()
    }

    fn to_bytes(&self) -> Result<Vec<u8>> {
        self.validate()?;
        let tables = self.tables.iter().map(|table| TableMeta {
            name: table.name.clone(),
            axes: table.axes.iter().map(axis_meta).collect(),
            channels: table.channels.clone(),
            format: table.header().format(),
            max_interpolation_error: table.max_interpolation_error,
        });
        let meta = Meta {
            fresnel: self.fresnel.clone(),
            tool_version: self.info.tool_version.clone(),
            parameters: self.info.parameters.clone(),
            tables: tables.collect(),
        };
        let mut file = ContainerWriter::new(Kind::Tables);
        file.section(META, 0, encode_record(&meta)?);
        for (ix, table) in (0u32..).zip(&self.tables) {
            file.section(DATA, ix, bytemuck::cast_slice(&table.data));
        }
        file.finish()
    }
}

fn axis_meta(axis: &Axis) -> AxisMeta {
    AxisMeta {
        name: axis.name.clone(),
        min: axis.min,
        max: axis.max,
        count: axis.count,
        spacing: axis.spacing.name().to_owned(),
        texel_centres: Axis::TEXEL_CENTRES.to_owned(),
    }
}
