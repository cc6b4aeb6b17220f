//! What is written beside joints in files that hold numbers alone.

pub mod description;
