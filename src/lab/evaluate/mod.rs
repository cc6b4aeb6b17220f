//! Errors of the lifters on motion with known truth (`lifter`), and of the whole pipeline on rendered people (`people`).

pub mod lifter;
pub mod people;
