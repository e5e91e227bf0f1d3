//! The layers that `strandlight render --aov` writes beside a picture.
//!
//! [`LAYERS`] declares each of them once. The values of `--aov` and their help, the names in
//! reports, the channels of the OpenEXR file and the table in the documentation are made from it;
//! what computes the values matches on [`Content`].

use strandlight_formats::Scattering;

/// A way to split the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Split {
    /// By term of scattering.
    Terms,
    /// Single and global scattering by mode; local scattering is of all modes together.
    Modes,
    /// By light, or group of lights.
    Lights,
}

impl Split {
    /// All of them.
    pub const ALL: [Split; 3] = [Split::Terms, Split::Modes, Split::Lights];

    /// Its value of `--aov`.
    pub fn name(self) -> &'static str {
        match self {
            Split::Terms => "terms",
            Split::Modes => "modes",
            Split::Lights => "lights",
        }
    }
}

/// When a layer is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Written {
    /// With every `--aov`.
    Always,
    /// With every `--aov`, unless the scene has no background.
    WithBackground,
    /// With every `--aov`, in scenes with proxies.
    WithProxies,
    /// With these splits of the light.
    Splits(&'static [Split]),
    /// With `data`, and with its own name.
    Data,
}

/// What a layer shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Content {
    /// The picture, with alpha.
    Picture,
    /// All light of the hair.
    Total,
    /// What is seen between the strands.
    Background,
    /// The proxies, and how much of each pixel they cover.
    Proxies,
    /// One term of scattering.
    Term(Scattering),
    /// One mode of a term of scattering.
    Mode(Scattering),
    /// One light.
    Light,
    /// A group of lights.
    Group,
    /// The lights of no group.
    Rest,
    /// Data of the strand that is seen at the centre of a pixel.
    Data(Data),
}

/// What is known of a strand. Whatever computes data layers has all of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Data {
    /// Depth along the optical axis.
    Depth,
    /// Share of the pixel that hair covers.
    Coverage,
    /// Direction of the strand.
    Tangent,
    /// Index of the strand.
    StrandId,
    /// Way along the strand.
    RootDistance,
    /// Place in the world.
    Position,
    /// Diameter of the fibre.
    Diameter,
}

/// A layer, or a family of layers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Layer {
    /// Its name; of data also the value of `--aov`. A family's has a word in capitals in place of
    /// the name of a mode or a group, or of the index of a light: see [`Layer::name_of`].
    pub name: &'static str,
    /// Its channels in OpenEXR, with the same word.
    pub channels: &'static [&'static str],
    /// What it shows.
    pub content: Content,
    /// When it is written.
    pub written: Written,
    /// What it is, in words.
    pub help: &'static str,
    /// Unit of the values.
    pub unit: Option<&'static str>,
    /// Value of all channels of a pixel without hair; none where another thing is seen there.
    pub background: Option<f32>,
}

/// Words in the names of families.
const PLACEHOLDERS: [&str; 3] = ["MODE", "INDEX", "GROUP"];

impl Layer {
    /// Name of the member `part` of a family: of a mode, a light or a group.
    pub fn name_of(&self, part: &str) -> String {
        fill(self.name, part)
    }

    /// Channels of the member `part` of a family.
    pub fn channels_of(&self, part: &str) -> Vec<String> {
        let channels = self.channels.iter();
        channels.map(|channel| fill(channel, part)).collect()
    }

    /// Is it written with `split`?
    pub fn is_written_with(&self, split: Split) -> bool {
        matches!(self.written, Written::Splits(splits) if splits.contains(&split))
    }

    /// What the layer is, with its unit, and with the value of pixels without hair unless it is 0.
    pub fn help(&self) -> String {
        let mut text = self.help.to_owned();
        if let Some(unit) = self.unit {
            text += &format!(", {unit}");
        }
        if let Some(background) = self.background.filter(|&value| value != 0.0) {
            text += &format!("; {background} without hair");
        }
        text
    }
}

/// `name` with `part` in place of its placeholder.
fn fill(name: &str, part: &str) -> String {
    let has = |word: &&&str| name.contains(**word);
    match PLACEHOLDERS.iter().find(has) {
        Some(word) => name.replace(word, part),
        None => name.to_owned(),
    }
}

/// The channels of a colour.
macro_rules! rgb {
    ($name:literal) => {
        &[
            concat!($name, ".R"),
            concat!($name, ".G"),
            concat!($name, ".B"),
        ]
    };
}

/// The picture as `strandlight render` writes it.
pub const PICTURE: Layer = Layer {
    name: "picture",
    channels: &["R", "G", "B", "A"],
    content: Content::Picture,
    written: Written::Always,
    help: "the picture as `strandlight render` writes it, over its background",
    unit: None,
    background: None,
};

/// The hair alone, with all its light.
pub const TOTAL: Layer = light(
    "total",
    rgb!("total"),
    Content::Total,
    Written::Always,
    "radiance of the hair alone, times its coverage",
);

/// What is seen between the strands.
pub const BACKGROUND: Layer = Layer {
    background: None,
    ..light(
        "background",
        rgb!("background"),
        Content::Background,
        Written::WithBackground,
        "what is seen between the strands, times what the hair leaves of it",
    )
};

/// The proxies.
pub const PROXIES: Layer = light(
    "proxies",
    &["proxies.R", "proxies.G", "proxies.B", "proxies.Y"],
    Content::Proxies,
    Written::WithProxies,
    "light of the proxies: what is seen of them and what they send back to the hair; and the share of each pixel that they cover",
);

/// What hair covers, which every file of layers has: the picture's alpha before a background, less
/// what proxies cover.
pub const COVERAGE: Layer = Layer {
    written: Written::Always,
    ..data(
        "coverage",
        &["coverage.Y"],
        Data::Coverage,
        "share of the pixel that hair covers, 0 to 1, filtered as the picture is",
        None,
    )
};

/// All layers.
///
/// Depth without hair is 0 and not infinite: infinity becomes NaN once a compositor multiplies it by
/// alpha or filters it, and no strand has depth 0.
pub static LAYERS: [Layer; 19] = [
    PICTURE,
    TOTAL,
    BACKGROUND,
    PROXIES,
    light(
        "single",
        rgb!("single"),
        Content::Term(Scattering::Single),
        Written::Splits(&[Split::Terms]),
        "single scattering",
    ),
    light(
        "single.MODE",
        rgb!("single.MODE"),
        Content::Mode(Scattering::Single),
        Written::Splits(&[Split::Modes]),
        "single scattering of one mode: R, TT or TRT",
    ),
    light(
        "global",
        rgb!("global"),
        Content::Term(Scattering::Global),
        Written::Splits(&[Split::Terms]),
        "global multiple scattering",
    ),
    light(
        "global.MODE",
        rgb!("global.MODE"),
        Content::Mode(Scattering::Global),
        Written::Splits(&[Split::Modes]),
        "global multiple scattering of one mode",
    ),
    light(
        "local",
        rgb!("local"),
        Content::Term(Scattering::Local),
        Written::Splits(&[Split::Terms, Split::Modes]),
        "local multiple scattering, which is not split by mode",
    ),
    light(
        "light.INDEX",
        rgb!("light.INDEX"),
        Content::Light,
        Written::Splits(&[Split::Lights]),
        "one light, by its index in the light set in three digits; lights that are off are left out",
    ),
    light(
        "light.GROUP",
        rgb!("light.GROUP"),
        Content::Group,
        Written::Splits(&[Split::Lights]),
        "in place of single lights, a group of `--light-group`",
    ),
    light(
        "light.rest",
        rgb!("light.rest"),
        Content::Rest,
        Written::Splits(&[Split::Lights]),
        "beside groups, all lights outside of them",
    ),
    data(
        "depth",
        &["depth.Z"],
        Data::Depth,
        "distance from the camera along its optical axis",
        Some("cm"),
    ),
    COVERAGE,
    data(
        "tangent",
        &["tangent.X", "tangent.Y", "tangent.Z"],
        Data::Tangent,
        "unit vector along the strand from root to tip, world space",
        None,
    ),
    Layer {
        background: Some(-1.0),
        // Exact: grooms have fewer than 2^24 points.
        ..data(
            "strand_id",
            &["strand_id.Y"],
            Data::StrandId,
            "index of the strand in the groom, from 0",
            None,
        )
    },
    data(
        "root_distance",
        &["root_distance.Y"],
        Data::RootDistance,
        "way along the strand as a share of its length, 0 at its root and 1 at its tip",
        None,
    ),
    data(
        "position",
        &["P.X", "P.Y", "P.Z"],
        Data::Position,
        "position in world space",
        Some("cm"),
    ),
    data(
        "diameter",
        &["diameter.Y"],
        Data::Diameter,
        "diameter of the fibre",
        Some("cm"),
    ),
];

/// A layer of radiance: black without hair.
const fn light(
    name: &'static str,
    channels: &'static [&'static str],
    content: Content,
    written: Written,
    help: &'static str,
) -> Layer {
    Layer {
        name,
        channels,
        content,
        written,
        help,
        unit: None,
        background: Some(0.0),
    }
}

/// A layer of data: 0 without hair.
const fn data(
    name: &'static str,
    channels: &'static [&'static str],
    data: Data,
    help: &'static str,
    unit: Option<&'static str>,
) -> Layer {
    Layer {
        name,
        channels,
        content: Content::Data(data),
        written: Written::Data,
        help,
        unit,
        background: Some(0.0),
    }
}

/// The layers of data, in the order of the table.
pub fn data_layers() -> impl Iterator<Item = (&'static Layer, Data)> {
    LAYERS.iter().filter_map(|layer| match layer.content {
        Content::Data(data) => Some((layer, data)),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_layers_share_a_name_or_a_channel() {
        let mut names: Vec<&str> = LAYERS.iter().map(|layer| layer.name).collect();
        names.extend(Split::ALL.map(Split::name));
        names.push("data");
        let mut channels: Vec<&str> = LAYERS.iter().flat_map(|l| l.channels).copied().collect();
        for list in [&mut names, &mut channels] {
            list.sort_unstable();
            assert!(list.windows(2).all(|pair| pair[0] != pair[1]), "{list:?}");
        }
    }

    #[test]
    fn families_have_members() {
        let of_mode = LAYERS
            .iter()
            .find(|layer| layer.content == Content::Mode(Scattering::Global))
            .expect("there");
        assert_eq!(of_mode.name_of("TT"), "global.TT");
        assert_eq!(
            of_mode.channels_of("TT"),
            ["global.TT.R", "global.TT.G", "global.TT.B"]
        );
        assert_eq!(TOTAL.channels_of(""), TOTAL.channels);
        for layer in &LAYERS {
            let is_family = matches!(
                layer.content,
                Content::Mode(_) | Content::Light | Content::Group
            );
            let member = layer.name_of("x");
            assert_eq!(member != layer.name, is_family, "{member}");
            assert!(!member.chars().any(|c| c.is_ascii_uppercase()), "{member}");
        }
    }

    #[test]
    fn data_has_up_to_three_channels_and_light_three() {
        for layer in &LAYERS {
            let n_channels = match layer.content {
                // And what is covered.
                Content::Picture | Content::Proxies => 4..=4,
                Content::Data(_) => 1..=3,
                _ => 3..=3,
            };
            assert!(n_channels.contains(&layer.channels.len()), "{}", layer.name);
        }
    }
}
