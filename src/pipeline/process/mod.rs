//! Sandboxed subprocesses, one per unit, for stages that pass untrusted files to C libraries: `stage` wraps a stage so
//! that it runs in a subprocess, `subprocess` starts and supervises it within its `limits`, `unit` is the code of the
//! subprocess, `message` is the protocol between them (MessagePack), `failure` transfers errors with their types.

pub mod failure;
pub mod limits;
pub mod message;
pub mod stage;
pub mod subprocess;
pub mod unit;

pub use limits::Limits;
pub use stage::{SubprocessStage, ask_media, probe};
pub use unit::{VERB, answer_media, parent_inference, serve};
