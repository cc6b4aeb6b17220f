//! Generation of motion from speech with FineMotion's sequence-to-sequence networks: the checkpoint (`metadata`), the
//! inputs (`architecture`), the output format (`poses`), and generation segment by segment (`generator`).

pub mod architecture;
pub mod generator;
pub mod metadata;
pub mod poses;

pub use generator::SequenceGenerator;
