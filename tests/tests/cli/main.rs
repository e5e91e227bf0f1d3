//! `strandlight` and `strandview` from the outside.

mod aov_command;
mod bad_input;
mod bake_command;
mod bake_kills;
mod bench_command;
mod compare_command;
mod docs;
mod formats_commands;
mod groom_commands;
mod groom_merge_command;
mod lights_budget;
mod lights_command;
mod mesh_command;
mod outputs;
mod painted_command;
mod pipeline;
mod probe_cli;
mod reference_command;
mod render_command;
mod render_files;
mod render_flags;
mod scenes_command;
mod script_command;
mod shard_command;
mod stress_command;
mod tables_default;
