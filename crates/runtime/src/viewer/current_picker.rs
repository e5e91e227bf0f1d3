//! The picker of the strands as they are now.

use std::sync::{Arc, Weak};

use strandlight_scene::paint::Picker;
use strandlight_scene::strands::Strands;

/// A [`Picker`] that is made again once the strands are others, and not before it is needed.
#[derive(Default)]
pub struct CurrentPicker(Option<(Weak<Strands>, Picker)>);

impl CurrentPicker {
    /// That of `strands`.
    pub fn of(&mut self, strands: &Arc<Strands>) -> &Picker {
        let now = Arc::downgrade(strands);
        self.0.take_if(|(of, _)| !of.ptr_eq(&now));
        &self.0.get_or_insert_with(|| (now, Picker::new(strands))).1
    }
}
