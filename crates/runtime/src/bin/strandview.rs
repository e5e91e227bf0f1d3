//! `strandview`: shows a scene in a window or renders one frame without one.

fn main() {}
