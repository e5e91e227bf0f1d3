//! Strandlight's files: bytes of every version, damage, the corpus of the fuzz targets.

#[path = "../../../fuzz/checks.rs"]
mod checks;
mod formats_corpus;
mod formats_damage;
mod formats_golden;
