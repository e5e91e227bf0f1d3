//! The layers that `--aov` and `--light-group` name.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use strandlight_bake::aov::Group;
use strandlight_scattering::Lobe;
use strandlight_scene::layers::{Content, LAYERS, Layer, Split, data_layers};

/// What layers are wanted.
#[derive(Clone, Copy, Debug)]
pub enum Aov {
    /// Parts of the light.
    Split(Split),
    /// All data.
    AllData,
    /// One layer of data.
    Data(&'static Layer),
}

impl Aov {
    /// Names, help and what they stand for.
    fn all() -> impl Iterator<Item = (&'static str, String, Aov)> {
        let of_light = Split::ALL.map(|split| (split.name(), members(split), Aov::Split(split)));
        let data = ("data", "all of the following".to_owned(), Aov::AllData);
        let by_name = data_layers().map(|(layer, _)| (layer.name, layer.help(), Aov::Data(layer)));
        of_light.into_iter().chain([data]).chain(by_name)
    }

    /// Is it the layers of lights?
    pub fn is_lights(&self) -> bool {
        matches!(self, Aov::Split(Split::Lights))
    }
}

/// Names of the layers that `split` makes.
fn members(split: Split) -> String {
    let layers = LAYERS.iter().filter(|layer| layer.is_written_with(split));
    let names = layers.flat_map(|layer| match layer.content {
        Content::Mode(_) => Lobe::ALL.map(|mode| layer.name_of(mode.name())).to_vec(),
        _ => vec![layer.name.to_owned()],
    });
    names.collect::<Vec<_>>().join(", ")
}

/// Parses a value of `--aov`.
pub fn aov() -> impl TypedValueParser<Value = Aov> {
    let values = Aov::all().map(|(name, help, _)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(values).try_map(|name| {
        let found = Aov::all().find(|(known, ..)| *known == name);
        found.map(|(_, _, aov)| aov).ok_or("unknown")
    })
}

/// A group of lights on the command line, like key=0,3.
pub fn parse_group(text: &str) -> Result<Group, String> {
    let parsed = text.split_once('=').and_then(|(name, lights)| {
        let lights = lights.split(',').map(|ix| ix.trim().parse().ok());
        Some((name, lights.collect::<Option<Vec<usize>>>()?))
    });
    let (name, lights) = parsed.ok_or("a group is a name and lights like key=0,3")?;
    let fine = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.is_empty() || name.len() > 64 || !name.chars().all(fine) || name == "rest" {
        return Err("a group's name is ASCII letters, digits, - and _, and not rest".to_owned());
    }
    Ok(Group {
        name: name.to_owned(),
        lights,
    })
}
