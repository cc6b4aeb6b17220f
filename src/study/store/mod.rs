//! Responses on the disk, an SQLite database: one thread writes, and what comes in while it commits is one commit more.
//! Who was answered "stored" is stored, whatever happens to the program or the machine.

pub mod answers;
pub mod database;
pub mod participants;
pub mod writer;
