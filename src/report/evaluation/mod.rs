//! Page of an evaluation: table, charts, and the player of ground truth beside prediction.

pub mod charts;
pub mod page;
pub mod player;
pub mod table;
