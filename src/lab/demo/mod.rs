//! Synthetic speakers with known joints, the embedded demo and the end-to-end test of the pipeline.
//!
//! `people`: rendered persons in rooms, one of them the demo's `host`. `captured_body`: captured motion on their bodies.
//! `appearance`: random bodies, faces and clothes; `scenery`: the static background behind the persons. `check`:
//! comparison of the results of the pipeline and of trained models with the ground truth.

pub mod appearance;
pub mod captured_body;
pub mod check;
pub mod host;
pub mod people;
pub mod scenery;

pub use check::pipeline::GENERATOR;
