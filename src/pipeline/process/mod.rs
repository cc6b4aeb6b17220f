//! Stages that hand foreign files to foreign libraries, each unit in a process of its own that is restricted before it
//! reads: `stage` stands for the stage in the run, `subprocess` starts the process and follows it within its `limits`, `unit`
//! is what happens in it, `message` goes between them as MessagePack, `failure` carries errors over with their types.

pub mod failure;
pub mod limits;
pub mod message;
pub mod stage;
pub mod subprocess;
pub mod unit;

pub use limits::Limits;
pub use stage::{SubprocessStage, ask_media, probe};
pub use unit::{VERB, answer_media, serve};
