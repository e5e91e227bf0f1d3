//! How strands differ from each other.

use serde::{Deserialize, Serialize};

/// `[variation]`: seeded differences between strands and between locks. Ranges are those of
/// [`params::VARIATION`](crate::params::VARIATION). At its defaults nothing varies.
///
/// A lock is made of the strands whose roots lie nearest to the same one of points that are strewn
/// about `lock_size_cm` apart. Amounts are standard deviations; those of strands and of locks add
/// up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VariationSection {
    /// Another variation for every number.
    pub seed: u32,
    /// Distance between the centres of neighbouring locks, about, cm.
    pub lock_size_cm: f64,
    /// Of the logarithm of the absorption, from strand to strand.
    pub melanin_strand: f64,
    /// The same from lock to lock.
    pub melanin_lock: f64,
    /// Of the redness: 1 turns the absorption of eumelanin into that of pheomelanin.
    pub redness_strand: f64,
    /// The same from lock to lock.
    pub redness_lock: f64,
    /// Of the logarithm of the longitudinal widths, from strand to strand.
    pub roughness_strand: f64,
    /// The same from lock to lock.
    pub roughness_lock: f64,
    /// Share of the strands that have no pigment.
    pub grey: f64,
    /// How far tips are drawn to the middle strand of their lock: 0 not at all, 1 wholly.
    pub clump: f64,
    /// Tangent of the angle by which pieces are turned aside at the tip, about.
    pub frizz: f64,
    /// Length along a strand after which frizz turns it another way, cm.
    pub frizz_length_cm: f64,
}

impl Default for VariationSection {
    /// None.
    fn default() -> Self {
        VariationSection {
            seed: 0,
            lock_size_cm: 2.0,
            melanin_strand: 0.0,
            melanin_lock: 0.0,
            redness_strand: 0.0,
            redness_lock: 0.0,
            roughness_strand: 0.0,
            roughness_lock: 0.0,
            grey: 0.0,
            clump: 0.0,
            frizz: 0.0,
            frizz_length_cm: 1.0,
        }
    }
}

impl VariationSection {
    /// Does it say nothing? Then it is left out of files.
    pub(crate) fn is_default(&self) -> bool {
        *self == VariationSection::default()
    }

    /// The amounts that change fibres, with their keys.
    pub(crate) fn fibre_amounts(&self) -> [(&'static str, f64); 7] {
        [
            ("melanin_strand", self.melanin_strand),
            ("melanin_lock", self.melanin_lock),
            ("redness_strand", self.redness_strand),
            ("redness_lock", self.redness_lock),
            ("roughness_strand", self.roughness_strand),
            ("roughness_lock", self.roughness_lock),
            ("grey", self.grey),
        ]
    }

    /// What of it changes fibres: absorption and widths. The rest has its defaults, and so has all of
    /// it where no amount is above 0: equal answers are equal fibres.
    pub fn of_fibres(&self) -> VariationSection {
        let plain = VariationSection::default();
        if self
            .fibre_amounts()
            .iter()
            .all(|&(_, amount)| amount == 0.0)
        {
            return plain;
        }
        let of_locks = [self.melanin_lock, self.redness_lock, self.roughness_lock];
        let has_locks = of_locks.iter().any(|&amount| amount > 0.0);
        VariationSection {
            lock_size_cm: if has_locks {
                self.lock_size_cm
            } else {
                plain.lock_size_cm
            },
            clump: plain.clump,
            frizz: plain.frizz,
            frizz_length_cm: plain.frizz_length_cm,
            ..self.clone()
        }
    }

    /// What of it changes the shape of strands, in the same way.
    pub fn of_shape(&self) -> VariationSection {
        let plain = VariationSection::default();
        let [is_clumped, is_frizzy] = [self.clump, self.frizz].map(|amount| amount > 0.0);
        if !is_clumped && !is_frizzy {
            return plain;
        }
        VariationSection {
            seed: self.seed,
            lock_size_cm: if is_clumped {
                self.lock_size_cm
            } else {
                plain.lock_size_cm
            },
            clump: self.clump,
            frizz: self.frizz,
            frizz_length_cm: if is_frizzy {
                self.frizz_length_cm
            } else {
                plain.frizz_length_cm
            },
            ..plain
        }
    }

    /// Do the widths of any strand differ from those of `[hair]`?
    pub fn varies_widths(&self) -> bool {
        self.roughness_strand > 0.0 || self.roughness_lock > 0.0
    }

    /// Does the absorption of any strand differ from that of `[hair]`?
    pub fn varies_absorption(&self) -> bool {
        let amounts = [
            self.melanin_strand,
            self.melanin_lock,
            self.redness_strand,
            self.redness_lock,
            self.grey,
        ];
        amounts.iter().any(|&amount| amount > 0.0)
    }

    /// Does any strand have another fibre than `[hair]` says?
    pub fn varies_fibres(&self) -> bool {
        !self.of_fibres().is_default()
    }

    /// Is any strand bent?
    pub fn varies_shape(&self) -> bool {
        !self.of_shape().is_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    #[test]
    fn what_varies_is_told_apart() {
        let plain = VariationSection::default();
        assert!(!plain.varies_fibres() && !plain.varies_shape());
        let idle = VariationSection {
            seed: 7,
            lock_size_cm: 5.0,
            frizz_length_cm: 3.0,
            ..plain.clone()
        };
        assert_eq!(
            (idle.of_fibres(), idle.of_shape()),
            (plain.clone(), plain.clone())
        );
        let melanin = VariationSection {
            melanin_strand: 0.2,
            ..idle.clone()
        };
        assert!(melanin.varies_fibres() && !melanin.varies_shape());
        // Without locks their size does not matter.
        let other = VariationSection {
            lock_size_cm: 1.0,
            ..melanin.clone()
        };
        assert_eq!(melanin.of_fibres(), other.of_fibres());
        let clumped = VariationSection { clump: 0.5, ..idle };
        assert!(!clumped.varies_fibres() && clumped.varies_shape());
        assert_eq!(clumped.of_shape().lock_size_cm, 5.0);
        assert_eq!(clumped.of_shape().frizz_length_cm, plain.frizz_length_cm);
    }

    #[test]
    fn it_is_read_and_written_as_it_is_and_left_out_at_its_defaults() {
        let text = "[variation]\nseed = 3\nmelanin_lock = 0.25\nfrizz = 0.5\n";
        let scene = Scene::from_lines(text).unwrap();
        let expected = VariationSection {
            seed: 3,
            melanin_lock: 0.25,
            frizz: 0.5,
            ..VariationSection::default()
        };
        assert_eq!(scene.variation, expected);
        let again = Scene::from_toml(&scene.to_toml_string().unwrap()).unwrap();
        assert_eq!(again, scene);
        let plain = Scene::new("a", "b").to_toml_string().unwrap();
        assert!(!plain.contains("variation"), "{plain}");
    }

    #[test]
    fn what_cannot_be_is_named() {
        for (text, needle) in [
            ("melanin_strand = -0.1", "variation.melanin_strand is -0.1"),
            ("grey = 1.5", "variation.grey is 1.5"),
            ("lock_size_cm = 0.0", "variation.lock_size_cm is 0"),
            ("frizz_length_cm = nan", "variation.frizz_length_cm is NaN"),
            ("clump = 2.0", "variation.clump is 2"),
            ("melanine = 0.1", "melanine"),
            (
                "grey = 0.5\n[hair]\nmodel = 'energy'",
                "variation.grey is 0.5, must be 0 with hair.model",
            ),
            (
                "roughness_lock = 0.5\n[hair]\neccentricity = 0.9",
                "variation.roughness_lock is 0.5, must be 0 where hair.eccentricity",
            ),
        ] {
            let error = Scene::from_lines(&format!("[variation]\n{text}\n")).unwrap_err();
            assert!(error.to_string().contains(needle), "{text}: {error}");
        }
        // Shape alone is for all hair.
        let text = "[variation]\nfrizz = 0.5\n[hair]\nmodel = 'energy'\n";
        assert!(Scene::from_lines(text).is_ok());
    }
}
