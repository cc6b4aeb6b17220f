//! Gestures to speech that is not over yet (`orator live`). Speech arrives in real time (`sound`), the generator and a
//! blend with the rest pose (`rest`) turn it into rotations of a humanoid (`pose`), and a clock sends them at 60 Hz
//! (`session`) as VMC messages (`vmc`), JSON lines (`lines`), or to a page (`orator-view`).

pub mod delays;
pub mod lines;
pub mod pose;
pub mod rest;
pub mod session;
pub mod sound;
pub mod vmc;
