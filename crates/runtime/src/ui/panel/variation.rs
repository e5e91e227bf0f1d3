//! How strands differ from each other.

use egui::Ui;
use strandlight_formats::params::VARIATION;
use strandlight_formats::{Scene, VariationSection};

use crate::ui::field::Changes;
use crate::ui::param::Rows;

/// All of the section.
pub fn show(ui: &mut Ui, scene: &mut Scene, changes: &mut Changes) {
    let plain = VariationSection::default();
    let mut rows = Rows {
        section: &VARIATION,
        target: &mut scene.variation,
        plain: &plain,
        suffix: "",
    };
    for param in VARIATION.params {
        rows.show(ui, param, changes);
    }
}
