//! The window of `strandview`, on a display of its own.

mod window_common;
mod window_cpu;
mod window_edit;
mod window_files;
mod window_layout;
mod window_lights;
mod window_paint;
mod window_robust;
mod window_sessions;
