//! Seeded procedural grooms.
