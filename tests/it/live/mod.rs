//! Gestures to speech that is not over yet.

mod generation;
mod page;
mod receivers;
mod session;
mod sound;
mod training;
