//! Speech to motion with FineMotion's sequence-to-sequence networks: what a trained one is (`metadata`), what it reads
//! (`architecture`, `vocabulary`) and makes (`poses`), and the generation segment after segment (`generator`).

pub mod architecture;
pub mod generator;
pub mod metadata;
pub mod poses;
pub mod vocabulary;

pub use generator::SequenceGenerator;
