//! Captured body and finger motion as training and test data of the lifters and of rendered persons.

pub mod captured;
pub mod fingers;
pub mod neck;
pub mod upper_body;
