//! Baked tables in the form that shading reads, in memory and on the GPU.

use strandlight_formats::{Axis, Spacing, Table, TableFile};
use strandlight_scattering::Lobe;
use strandlight_scattering::axis;
use strandlight_scattering::closed_form::{TableAxes, Tables};
use strandlight_scattering::table_layout::{
    C_AXIS_NAMES, H_AXIS_NAMES_DIELECTRIC, H_AXIS_NAMES_SCHLICK,
};

use crate::gpu::Context;

/// Why a `.tables` file cannot be used for shading.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TablesError {
    /// A table is not in the file.
    #[error("table '{0}' is missing")]
    Missing(&'static str),
    /// A table has other axes than shading knows how to read.
    #[error("table '{table}' has the axes {found}, expected {expected}")]
    Axes {
        /// The table.
        table: &'static str,
        /// Names of its axes.
        found: String,
        /// Names of the axes that are understood.
        expected: String,
    },
    /// A channel is not in a table.
    #[error("table '{table}' has no channel '{channel}'")]
    Channel {
        /// The table.
        table: &'static str,
        /// The missing channel.
        channel: &'static str,
    },
    /// The table has another amount of data than its axes ask for, or too much of it.
    #[error("table '{table}' holds {found} floats in axes of {rows} x {columns}")]
    Size {
        /// The table.
        table: &'static str,
        /// Floats in the file.
        found: usize,
        /// Count of the first axis.
        rows: u32,
        /// Count of the second axis.
        columns: u32,
    },
    /// H_TT and H_TRT do not share their axes.
    #[error("tables 'H_TT' and 'H_TRT' have different axes")]
    Different,
}

/// The default tables as a `.tables` file: dielectric, the paper's ranges.
pub const BUNDLED: &[u8] = include_bytes!("../../../data/default.tables");

/// Name of the table that shading with `mode` reads.
pub const fn table_of(mode: Lobe) -> &'static str {
    match mode {
        Lobe::R => "C",
        Lobe::Tt => "H_TT",
        Lobe::Trt => "H_TRT",
    }
}

/// Axes and texels of a table.
type TexelTable = ([axis::Axis; 2], Vec<[f32; 4]>);

/// Axis of a table that is not there.
const NO_AXIS: axis::Axis = axis::Axis {
    min: 0.0,
    max: 1.0,
    count: 2,
    spacing: axis::Spacing::Linear,
};

/// Most texels along a side, the least that every WebGPU device takes.
const MAX_SIDE: u32 = 8192;

/// The tables C, H_TT and H_TRT as RGBA texels, row by row; see
/// [`strandlight_scattering::closed_form::Tables`] for their layout.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadingTables {
    c: Vec<[f32; 4]>,
    h_tt: Vec<[f32; 4]>,
    h_trt: Vec<[f32; 4]>,
    axes: TableAxes,
}

impl ShadingTables {
    /// Takes what shading with all modes needs out of a file; see [`ShadingTables::for_modes`].
    ///
    /// # Errors
    /// As there.
    pub fn from_file(file: &TableFile) -> Result<ShadingTables, TablesError> {
        ShadingTables::for_modes(file, &Lobe::ALL)
    }

    /// Takes what shading with `modes` needs out of a file: one table a mode, see
    /// [`table_of`]; the others stay empty and must not be sampled. Channels are found by name, so
    /// their order in the file does not matter.
    ///
    /// # Errors
    /// A missing table or channel, axes of another meaning, or an amount of data that does not
    /// fit the axes.
    pub fn for_modes(file: &TableFile, modes: &[Lobe]) -> Result<ShadingTables, TablesError> {
        let schlick = file.fresnel == "schlick";
        let h_names = if schlick {
            H_AXIS_NAMES_SCHLICK
        } else {
            H_AXIS_NAMES_DIELECTRIC
        };
        let read = |mode: Lobe, axis_names, channels: &[&'static str]| {
            let wanted = modes.contains(&mode);
            wanted
                .then(|| texels(file, table_of(mode), axis_names, channels))
                .transpose()
        };
        let h_channels = ["H0", "H2", "H4", "H6"];
        let c = read(Lobe::R, C_AXIS_NAMES, &["b1", "b2", "b3", "b4", "b5", "b6"])?;
        let h_tt = read(Lobe::Tt, h_names, &h_channels)?;
        let h_trt = read(Lobe::Trt, h_names, &h_channels)?;
        if let (Some((tt_axes, _)), Some((trt_axes, _))) = (&h_tt, &h_trt)
            && tt_axes != trt_axes
        {
            return Err(TablesError::Different);
        }
        let axes_of = |table: Option<&TexelTable>| table.map_or([NO_AXIS; 2], |(axes, _)| *axes);
        let c_axes = axes_of(c.as_ref());
        let h_axes = axes_of(h_tt.as_ref().or(h_trt.as_ref()));
        // A texture cannot be empty: one column that nothing reads.
        let texels_of = |table: Option<TexelTable>, axes: [axis::Axis; 2]| match table {
            Some((_, texels)) => texels,
            None => vec![[0.0; 4]; axes[0].count as usize],
        };
        Ok(ShadingTables {
            c: texels_of(c, c_axes),
            h_tt: texels_of(h_tt, h_axes),
            h_trt: texels_of(h_trt, h_axes),
            axes: TableAxes {
                c_rows: c_axes[0].into(),
                c_columns: c_axes[1].into(),
                h_rows: h_axes[0].into(),
                h_columns: h_axes[1].into(),
                schlick: u32::from(schlick),
                padding_0: 0,
                padding_1: 0,
                padding_2: 0,
            },
        })
    }

    /// The view that the closed forms sample.
    pub fn view(&self) -> Tables<'_> {
        Tables {
            c: &self.c,
            h_tt: &self.h_tt,
            h_trt: &self.h_trt,
            axes: self.axes,
        }
    }

    /// The uniform of the shaders.
    pub fn axes(&self) -> &TableAxes {
        &self.axes
    }
}

/// The axis as the scattering crate samples it.
fn sampled_axis(axis: &Axis) -> axis::Axis {
    axis::Axis {
        min: axis.min,
        max: axis.max,
        count: axis.count,
        spacing: match axis.spacing {
            Spacing::Linear => axis::Spacing::Linear,
            Spacing::Log => axis::Spacing::Log,
            Spacing::InverseSqrt => axis::Spacing::InverseSqrt,
            Spacing::RootSquare => axis::Spacing::RootSquare,
            Spacing::Reciprocal => axis::Spacing::Reciprocal,
            Spacing::Concave => axis::Spacing::Concave,
        },
    }
}

/// Axes and texels of the table `name`, `channels` in this order, the last texel filled with 0.
fn texels(
    file: &TableFile,
    name: &'static str,
    axis_names: [&'static str; 2],
    channels: &[&'static str],
) -> Result<TexelTable, TablesError> {
    let table: &Table = file.table(name).ok_or(TablesError::Missing(name))?;
    let [rows, columns] = &table.axes[..] else {
        return Err(other_axes(table, name, axis_names));
    };
    if [rows.name.as_str(), columns.name.as_str()] != axis_names {
        return Err(other_axes(table, name, axis_names));
    }
    let from: Vec<usize> = channels
        .iter()
        .map(|&channel| {
            let position = table.channels.iter().position(|found| found == channel);
            position.ok_or(TablesError::Channel {
                table: name,
                channel,
            })
        })
        .collect::<Result<_, _>>()?;
    let n_channels = table.channels.len();
    let size_error = TablesError::Size {
        table: name,
        found: table.data.len(),
        rows: rows.count,
        columns: columns.count,
    };
    let per_entry = channels.len().div_ceil(4);
    let sides_fit = (2..=MAX_SIDE).contains(&rows.count)
        && (2..=MAX_SIDE / per_entry as u32).contains(&columns.count);
    // Sides are at most 8192, so the product fits.
    if !sides_fit || table.data.len() != rows.count as usize * columns.count as usize * n_channels {
        return Err(size_error);
    }
    let mut texels = Vec::with_capacity(table.data.len() / n_channels * per_entry);
    for entry in table.data.chunks_exact(n_channels) {
        for part in from.chunks(4) {
            let mut texel = [0.0; 4];
            for (value, &channel) in texel.iter_mut().zip(part) {
                *value = entry[channel];
            }
            texels.push(texel);
        }
    }
    Ok(([sampled_axis(rows), sampled_axis(columns)], texels))
}

fn other_axes(table: &Table, name: &'static str, expected: [&'static str; 2]) -> TablesError {
    let found: Vec<&str> = table.axes.iter().map(|axis| axis.name.as_str()).collect();
    TablesError::Axes {
        table: name,
        found: found.join(", "),
        expected: expected.join(", "),
    }
}

/// The tables on the GPU: three `rgba32float` textures and a uniform with their axes.
#[derive(Debug)]
pub struct GpuTables {
    /// Texture of C, two texels an entry along x.
    pub c: wgpu::TextureView,
    /// Texture of H_TT.
    pub h_tt: wgpu::TextureView,
    /// Texture of H_TRT.
    pub h_trt: wgpu::TextureView,
    /// Uniform buffer of [`TableAxes`].
    pub axes: wgpu::Buffer,
}

impl GpuTables {
    /// Uploads `tables`.
    pub fn new(context: &Context, tables: &ShadingTables) -> GpuTables {
        let axes = &tables.axes;
        let upload = |label, texels: &[[f32; 4]], rows: f32| {
            let height = rows as u32 + 1;
            let size = wgpu::Extent3d {
                width: texels.len() as u32 / height,
                height,
                depth_or_array_layers: 1,
            };
            let texture = context.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba32Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            });
            context.queue.write_texture(
                texture.as_image_copy(),
                bytemuck::cast_slice(texels),
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(size.width * 16),
                    rows_per_image: None,
                },
                size,
            );
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let uniform = context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("table axes"),
            size: size_of::<TableAxes>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        context
            .queue
            .write_buffer(&uniform, 0, bytemuck::bytes_of(axes));
        GpuTables {
            c: upload("table C", &tables.c, axes.c_rows.last),
            h_tt: upload("table H_TT", &tables.h_tt, axes.h_rows.last),
            h_trt: upload("table H_TRT", &tables.h_trt, axes.h_rows.last),
            axes: uniform,
        }
    }

    /// Layout of four bindings from `first` on: axes, C, H_TT, H_TRT.
    pub fn layout_entries(
        first: u32,
        visibility: wgpu::ShaderStages,
    ) -> [wgpu::BindGroupLayoutEntry; 4] {
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        std::array::from_fn(|ix| wgpu::BindGroupLayoutEntry {
            binding: first + ix as u32,
            visibility,
            ty: if ix == 0 { uniform } else { texture },
            count: None,
        })
    }

    /// The bindings of [`GpuTables::layout_entries`].
    pub fn entries(&self, first: u32) -> [wgpu::BindGroupEntry<'_>; 4] {
        let resources = [
            self.axes.as_entire_binding(),
            wgpu::BindingResource::TextureView(&self.c),
            wgpu::BindingResource::TextureView(&self.h_tt),
            wgpu::BindingResource::TextureView(&self.h_trt),
        ];
        let mut binding = first;
        resources.map(|resource| {
            let entry = wgpu::BindGroupEntry { binding, resource };
            binding += 1;
            entry
        })
    }
}
