//! Page of an evaluation: table, charts, and a player that shows ground truth and prediction side by side.

pub mod charts;
pub mod page;
pub mod player;
