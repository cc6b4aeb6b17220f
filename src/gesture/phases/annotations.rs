//! Phases of a dataset.
