//! What other programs expect of hair: `--to`.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
pub use strandlight_bake::grooms::{PRESETS, Preset};

/// Parses `--to`.
pub fn parser() -> impl TypedValueParser<Value = &'static Preset> {
    let values = PRESETS
        .iter()
        .map(|preset| PossibleValue::new(preset.name).help(preset.expects));
    PossibleValuesParser::new(values).map(|name| {
        let mut presets = PRESETS.iter();
        presets
            .find(|preset| preset.name == name)
            .unwrap_or(&PRESETS[0])
    })
}
