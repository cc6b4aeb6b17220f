//! Errors of the lifters on motion with known truth (`lifter`), and of the complete pipeline on rendered persons
//! (`people`).

pub mod lifter;
pub mod people;
