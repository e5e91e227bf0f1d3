//! `[variation]`.

use super::section::{Param, Section, at};
use super::spec::Shape;
use crate::scene_variation::VariationSection;

/// Range of a standard deviation of a logarithm: at 1 a value is halved or doubled in half of all
/// cases.
const AMOUNT: [f64; 2] = [0.0, 1.0];
/// What a slider of one covers.
const AMOUNT_SLIDER: [f64; 2] = [0.0, 0.6];

/// Differences between strands.
pub const VARIATION: Section<VariationSection> = Section {
    name: "variation",
    heading: "[variation]",
    kind: None,
    help: "Seeded differences between strands and between locks (strands whose roots lie together), over \
           `[hair]` and under paint. Amounts are standard deviations; those of strands and locks add up. \
           Without it, all strands are alike.",
    params: &[
        Param::numbers(
            "seed",
            "Seed",
            Shape::Whole,
            [0.0, u32::MAX as f64],
            at!(VariationSection.seed),
        )
        .slider(0.0, 100.0)
        .help("Random seed of the variation."),
        Param::number(
            "lock_size_cm",
            "Lock size",
            [0.05, 100.0],
            at!(VariationSection.lock_size_cm),
        )
        .unit("cm")
        .slider(0.2, 10.0)
        .logarithmic()
        .help("Mean distance between the centres of neighbouring locks, at the roots."),
        Param::number(
            "melanin_strand",
            "Melanin per strand",
            AMOUNT,
            at!(VariationSection.melanin_strand),
        )
        .slider(AMOUNT_SLIDER[0], AMOUNT_SLIDER[1])
        .decimals(3)
        .help(
            "Standard deviation of the logarithm of the absorption from strand to strand: 0.2 makes \
             strands about 20 % lighter or darker in pigment.",
        ),
        Param::number(
            "melanin_lock",
            "Melanin per lock",
            AMOUNT,
            at!(VariationSection.melanin_lock),
        )
        .slider(AMOUNT_SLIDER[0], AMOUNT_SLIDER[1])
        .decimals(3)
        .help("The same from lock to lock."),
        Param::number(
            "redness_strand",
            "Redness per strand",
            [0.0, 2.0],
            at!(VariationSection.redness_strand),
        )
        .slider(0.0, 1.0)
        .decimals(3)
        .help(
            "Hue jitter from strand to strand: standard deviation of the redness. Redness 1 turns the \
             absorption of eumelanin into that of pheomelanin, -1 is as far the other way; the \
             geometric mean over red, green and blue stays.",
        ),
        Param::number(
            "redness_lock",
            "Redness per lock",
            [0.0, 2.0],
            at!(VariationSection.redness_lock),
        )
        .slider(0.0, 1.0)
        .decimals(3)
        .help("The same from lock to lock."),
        Param::number(
            "roughness_strand",
            "Roughness per strand",
            AMOUNT,
            at!(VariationSection.roughness_strand),
        )
        .slider(AMOUNT_SLIDER[0], AMOUNT_SLIDER[1])
        .decimals(3)
        .help(
            "Standard deviation of the logarithm of a factor on the widths of all lobes, from strand to \
             strand.",
        ),
        Param::number(
            "roughness_lock",
            "Roughness per lock",
            AMOUNT,
            at!(VariationSection.roughness_lock),
        )
        .slider(AMOUNT_SLIDER[0], AMOUNT_SLIDER[1])
        .decimals(3)
        .help("The same from lock to lock."),
        Param::number("grey", "Grey", [0.0, 1.0], at!(VariationSection.grey))
            .decimals(3)
            .help("Share of the strands that have no pigment, and so no absorption."),
        Param::number("clump", "Clump", [0.0, 1.0], at!(VariationSection.clump)).help(
            "Draws strands to the middle strand of their lock, in proportion to the distance from the \
             root: 1 makes tips meet. Roots and lengths stay.",
        ),
        Param::number("frizz", "Frizz", [0.0, 4.0], at!(VariationSection.frizz))
            .slider(0.0, 1.0)
            .help(
                "Bends each strand its own way, in proportion to the distance from the root. 1 turns \
                 pieces at the tip by about 30 degrees. Roots and lengths stay.",
            ),
        Param::number(
            "frizz_length_cm",
            "Frizz length",
            [0.05, 100.0],
            at!(VariationSection.frizz_length_cm),
        )
        .unit("cm")
        .slider(0.1, 10.0)
        .logarithmic()
        .help(
            "Length along a strand after which frizz turns it another way; what is shorter than the \
             groom's segments shows as bends at its points.",
        ),
    ],
    plain: VariationSection::default,
};
