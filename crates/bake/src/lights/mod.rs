//! Environment maps and their fit by spherical Gaussian lights.
