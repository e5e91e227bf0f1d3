//! The layers that `--aov` and `--light-group` name.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use strandlight_bake::aov::{Group, Split};
use strandlight_cpu::{DATA_LAYERS, DataLayer};

/// What layers are wanted.
#[derive(Clone, Copy, Debug)]
pub enum Aov {
    /// Parts of the light.
    Split(Split),
    /// Data, some of [`DATA_LAYERS`].
    Data(&'static [DataLayer]),
}

impl Aov {
    /// Names, help and what they stand for.
    fn all() -> impl Iterator<Item = (&'static str, &'static str, Aov)> {
        let of_light = [
            ("terms", "single, global, local", Split::Terms),
            (
                "modes",
                "single.R, single.TT, single.TRT, global.R, ..., and local",
                Split::Modes,
            ),
            (
                "lights",
                "light.000, ...: each enabled light, or light.NAME for groups",
                Split::Lights,
            ),
        ];
        let of_light = of_light.map(|(name, help, split)| (name, help, Aov::Split(split)));
        let data = ("data", "all of the following", Aov::Data(&DATA_LAYERS));
        let one = |layer| Aov::Data(std::slice::from_ref(layer));
        let by_name = DATA_LAYERS.iter();
        let by_name = by_name.map(move |layer| (layer.name, layer.help, one(layer)));
        of_light.into_iter().chain([data]).chain(by_name)
    }

    /// Is it the layers of lights?
    pub fn is_lights(&self) -> bool {
        matches!(self, Aov::Split(Split::Lights))
    }
}

/// Parses a value of `--aov`.
pub fn aov() -> impl TypedValueParser<Value = Aov> {
    let values = Aov::all().map(|(name, help, _)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(values).try_map(|name| {
        let found = Aov::all().find(|(known, _, _)| *known == name);
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
        return Err("a group's name is letters, digits, - and _, and not rest".to_owned());
    }
    Ok(Group {
        name: name.to_owned(),
        lights,
    })
}
