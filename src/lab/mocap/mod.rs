//! Captured body and finger motion as training and test data of the lifters.

pub mod fingers;
pub mod upper_body;
