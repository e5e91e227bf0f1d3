//! The baking side of Strandlight: tables, light sets, grooms, and the CPU twin of the renderer.

pub mod aov;
pub mod grooms;
pub mod lights;
pub mod maps;
pub mod scenes;
pub mod tables;
