//! The images in an OpenEXR file: a part has one for each layer, by the names of its channels.

use std::collections::HashMap;

use exr::meta::attribute::ChannelDescription;
use exr::meta::header::Header;

use crate::source::{MapImage, MapSelection};

/// Most images that a message lists.
const MAX_LISTED: usize = 12;

/// The channel indices of red, green and blue; the same index three times for luminance.
pub(super) type Rgb = [usize; 3];

/// Three channels of a part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Image {
    /// Index of the part.
    pub part: usize,
    /// The name before the last dot of its channels; empty for plain channels.
    pub layer: String,
    pub channels: Rgb,
}

/// Finds the image that `selection` names, and says what there was to choose from, if anything.
///
/// # Errors
/// One line with the images that the file has.
pub(super) fn choose(
    headers: &[Header],
    selection: &MapSelection,
) -> Result<(Image, Option<MapImage>), String> {
    let part = match &selection.part {
        Some(text) => Some(find_part(headers, text)?),
        None => None,
    };
    let images: Vec<Image> = headers
        .iter()
        .enumerate()
        .flat_map(|(part, header)| images_of(part, &header.channels.list))
        .collect();
    let in_part = |image: &&Image| part.is_none_or(|part| image.part == part);
    let in_layer =
        |image: &&Image| (selection.layer.as_ref()).is_none_or(|layer| image.layer == *layer);
    let mut fitting = images.iter().filter(in_part).filter(in_layer).peekable();
    let first = fitting.peek().copied();
    let Some(image) = fitting.find(|image| !headers[image.part].deep) else {
        let deep = first.map(|image| image.part).or(part);
        if let Some(deep) = deep.filter(|part| headers[*part].deep) {
            return Err(format!(
                "{} is deep data, which is not supported; the file has {}",
                part_name(headers, deep),
                list(headers, &images)
            ));
        }
        return Err(if images.is_empty() {
            format!(
                "no channels R, G, B or Y: the file has {}",
                channels(headers)
            )
        } else {
            match (&selection.layer, part) {
                (Some(layer), Some(part)) => format!(
                    "no layer {layer:?} with channels R, G, B or Y in {}; the file has {}",
                    part_name(headers, part),
                    list(headers, &images)
                ),
                (Some(layer), None) => format!(
                    "no layer {layer:?} with channels R, G, B or Y; the file has {}",
                    list(headers, &images)
                ),
                (None, part) => format!(
                    "no channels R, G, B or Y in {}; the file has {}",
                    part_name(headers, part.unwrap_or(0)),
                    list(headers, &images)
                ),
            }
        });
    };
    let has_choice = headers.len() > 1 || images.len() > 1;
    let choice = has_choice.then(|| MapImage {
        part: image.part,
        part_name: name_of(&headers[image.part]),
        layer: image.layer.clone(),
        choices: list(headers, &images),
    });
    Ok((image.clone(), choice))
}

/// The part that is called `text`, or else the one of that index.
fn find_part(headers: &[Header], text: &str) -> Result<usize, String> {
    let by_name = headers
        .iter()
        .position(|header| name_of(header).as_deref() == Some(text));
    let by_index = || text.parse().ok().filter(|ix| *ix < headers.len());
    by_name.or_else(by_index).ok_or_else(|| {
        let parts: Vec<String> = (0..headers.len().min(MAX_LISTED))
            .map(|part| part_name(headers, part))
            .collect();
        format!(
            "no part {text:?}; the file has {}{}",
            parts.join(", "),
            more(headers.len())
        )
    })
}

/// The images of a part, in the order in which they are preferred: RGB before luminance, the plain
/// channels before layers, those in the order of the file.
fn images_of(part: usize, channels: &[ChannelDescription]) -> Vec<Image> {
    // R, G, B and Y of each layer.
    let mut layers: Vec<(String, [Option<usize>; 4])> = vec![(String::new(), [None; 4])];
    let mut places = HashMap::from([(String::new(), 0)]);
    for (ix, channel) in channels.iter().enumerate() {
        let name = channel.name.to_string();
        let (layer, base) = name.rsplit_once('.').unwrap_or(("", &name));
        let Some(component) = ["R", "G", "B", "Y"].iter().position(|c| *c == base) else {
            continue;
        };
        let place = *places.entry(layer.to_owned()).or_insert_with(|| {
            layers.push((layer.to_owned(), [None; 4]));
            layers.len() - 1
        });
        layers[place].1[component].get_or_insert(ix);
    }
    let (mut images, mut grey) = (Vec::new(), Vec::new());
    for (layer, components) in layers {
        let image = |channels| Image {
            part,
            layer,
            channels,
        };
        match components {
            [Some(r), Some(g), Some(b), _] => images.push(image([r, g, b])),
            [.., Some(y)] => grey.push(image([y; 3])),
            _ => {}
        }
    }
    images.extend(grey);
    images
}

fn name_of(header: &Header) -> Option<String> {
    let name = header.own_attributes.layer_name.as_ref();
    name.map(ToString::to_string)
}

/// The part in words, for messages.
fn part_name(headers: &[Header], part: usize) -> String {
    match name_of(&headers[part]) {
        Some(name) => format!("part {part} {name:?}"),
        None => format!("part {part}"),
    }
}

/// The images in words, part by part.
fn list(headers: &[Header], images: &[Image]) -> String {
    let parts: Vec<String> = (0..headers.len().min(MAX_LISTED))
        .map(|part| {
            let layers: Vec<String> = images
                .iter()
                .filter(|image| image.part == part)
                .map(|image| match image.layer.as_str() {
                    "" => "plain channels".to_owned(),
                    layer => format!("layer {layer:?}"),
                })
                .collect();
            let shown = match layers.len() {
                0 => "no colour".to_owned(),
                n => format!("{}{}", layers[..n.min(MAX_LISTED)].join(", "), more(n)),
            };
            let deep = if headers[part].deep { ", deep" } else { "" };
            format!("{} ({shown}{deep})", part_name(headers, part))
        })
        .collect();
    format!("{}{}", parts.join(", "), more(headers.len()))
}

fn channels(headers: &[Header]) -> String {
    let all = || headers.iter().flat_map(|header| &header.channels.list);
    let names: Vec<String> = all()
        .map(|channel| channel.name.to_string())
        .take(MAX_LISTED)
        .collect();
    format!("{}{}", names.join(", "), more(all().count()))
}

/// What follows a list that was cut at [`MAX_LISTED`] of `count` entries.
fn more(count: usize) -> String {
    match count.checked_sub(MAX_LISTED) {
        None | Some(0) => String::new(),
        Some(more) => format!(", and {more} more"),
    }
}
