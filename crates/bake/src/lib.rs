//! The baking side of Strandlight: tables, light sets, grooms, and the CPU twin of the renderer.

pub mod aov;
pub mod bench;
pub mod compare;
pub mod cpu;
pub mod exr_file;
pub mod grooms;
pub mod lights;
pub mod maps;
pub mod picture;
pub mod progress;
pub mod random;
pub mod rays;
pub mod reference;
pub mod scenes;
pub mod stress;
pub mod tables;
pub mod transmittance;
