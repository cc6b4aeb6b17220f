//! The page of an evaluation: its table, its charts, and the player of truth beside prediction.

pub mod charts;
pub mod page;
pub mod player;
pub mod table;
