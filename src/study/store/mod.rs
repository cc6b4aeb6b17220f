//! Storage of the responses in an SQLite database. A single thread writes; requests that arrive during a commit are
//! batched into the next one. An acknowledged response is durable, whatever happens to the process or the machine.

pub mod answers;
pub mod database;
pub mod participants;
