//! Responses in the database, and sealed files.

mod answers;
mod participants;
mod seal;
