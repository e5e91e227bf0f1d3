//! End-to-end tests of Strandlight live in `tests/tests/`; this library holds what they share.
