//! What the libraries compute and what their sources say: no adapter, no display, no commands.

mod architecture;
mod circles;
mod compiled_files;
mod cpu_edits;
mod edit;
mod golden_pictures;
mod ground_truth;
mod history;
mod invalid_parameters;
mod invalidation;
mod lights;
mod mesh;
mod motion;
mod multiple_scattering;
mod packages;
mod panorama;
mod public_api;
mod refinements;
mod shaders_constants;
mod shaders_names;
mod shaders_tables;
mod shaders_valid;
mod shadow_maps;
mod toolchain;
mod twins_closed_form;
mod variation;
