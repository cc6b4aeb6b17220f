//! People: the page of the errors on rendered ones, and whom the videos of a speaker show.

pub mod faces;
pub mod page;
