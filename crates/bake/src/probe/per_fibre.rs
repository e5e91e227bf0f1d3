//! What is made once a fibre, kept while fibres are few.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use strandlight_scattering::{HairBits, HairParams};

/// Fibres kept; one more and all are forgotten.
const MAX_KEPT: usize = 1024;

/// A value of each fibre asked for so far.
pub struct PerFibre<T>(Mutex<HashMap<HairBits, Arc<Slot<T>>>>);

type Slot<T> = OnceLock<Arc<T>>;

impl<T> Default for PerFibre<T> {
    fn default() -> Self {
        PerFibre(Mutex::default())
    }
}

impl<T> PerFibre<T> {
    /// The value of `hair`, made by `make` if there is none; whoever asks for the same fibre
    /// meanwhile waits.
    pub fn of(&self, hair: &HairParams, make: impl FnOnce() -> T) -> Arc<T> {
        let slot = {
            let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if kept.len() >= MAX_KEPT && !kept.contains_key(&hair.bits()) {
                kept.clear();
            }
            Arc::clone(kept.entry(hair.bits()).or_default())
        };
        Arc::clone(slot.get_or_init(|| Arc::new(make())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_made_once_and_few_are_kept() {
        let cache = PerFibre::default();
        let fibre = |eta| HairParams {
            eta,
            ..HairParams::default()
        };
        assert_eq!(*cache.of(&fibre(1.5), || 1), 1);
        assert_eq!(*cache.of(&fibre(1.5), || 2), 1);
        assert_eq!(*cache.of(&fibre(1.6), || 3), 3);
        for ix in 0..MAX_KEPT {
            cache.of(&fibre(1.2 + 1e-6 * ix as f64), || 4);
        }
        assert!(cache.0.lock().unwrap().len() <= MAX_KEPT);
        assert_eq!(*cache.of(&fibre(1.5), || 5), 5);
    }
}
