//! The CPU twin of the renderer: the same closed forms, the same files, with rayon.
