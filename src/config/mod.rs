//! `pipeline.toml`, twice: as written (`file`: a table with the line of every key) and resolved (`Settings`:
//! defaults in, paths absolute, every value in its range). Each section is one small struct whose defaults are the
//! documented ones; the top level `pipeline.toml` documents them and a test holds the two together.

mod sections;

pub use sections::*;
