//! Baking and verifying the tables.
