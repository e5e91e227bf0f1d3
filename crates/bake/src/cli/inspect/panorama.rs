//! HDR maps behind the hair.

use std::path::Path;

use serde::Serialize;
use strandlight_bake::lights::exchange;
use strandlight_formats::{BakedFile, Kind, Panorama};
use strandlight_images::LatLong;

use super::super::Failure;
use super::parts::{as_map, parameters, version};

#[derive(Serialize)]
pub(super) struct PanoramaInfo {
    kind: &'static str,
    format_version: String,
    /// Texels across and down.
    size: [u32; 2],
    /// Of the texels, whose factor is 2 to the power of `exponent`.
    format: &'static str,
    exponent: i32,
    /// Means over the sphere and largest values, linear radiance.
    mean: [f64; 3],
    max: [f32; 3],
    up: &'static str,
    frame: &'static str,
    map_hash: String,
    map_size: [u32; 2],
    #[serde(serialize_with = "as_map")]
    parameters: Vec<(String, String)>,
    tool_version: String,
}

pub(super) fn panorama(path: &Path) -> Result<PanoramaInfo, Failure> {
    let format_version = version(path, Kind::Panorama)?;
    let panorama = Panorama::read(path).map_err(Failure::input)?;
    let pixels = panorama.pixels();
    let max = |c: usize| pixels.iter().map(|rgb| rgb[c]).fold(0.0, f32::max);
    let grid = LatLong {
        width: panorama.width() as usize,
        height: panorama.height() as usize,
    };
    let energy = grid.energy(pixels.chunks_exact(grid.width));
    Ok(PanoramaInfo {
        kind: "panorama",
        format_version,
        size: [panorama.width(), panorama.height()],
        format: "rgb9e5",
        exponent: panorama.exponent(),
        mean: energy.map(|x| x / (4.0 * std::f64::consts::PI)),
        max: [0, 1, 2].map(max),
        up: "+Y",
        frame: exchange::FRAME,
        map_hash: panorama.source.map_hash,
        map_size: panorama.source.map_size,
        parameters: panorama.source.parameters,
        tool_version: panorama.source.tool_version,
    })
}

pub(super) fn text_of_panorama(info: &PanoramaInfo) -> Vec<String> {
    let ([width, height], exponent) = (info.size, info.exponent);
    let mut lines = vec![
        format!("panorama {}", info.format_version),
        format!(
            "{width} x {height} texels, {}, times 2^{exponent}",
            info.format
        ),
        format!("mean {:.4?}, max {:.4?}", info.mean, info.max),
    ];
    if !info.map_hash.is_empty() {
        let [width, height] = info.map_size;
        lines.push(format!("map: {width} x {height}, hash {}", info.map_hash));
    }
    lines.extend(parameters(&info.parameters, &info.tool_version));
    lines
}
