//! Phases of a hand's gestures from 3D joints, in the terms of Kendon (2004), Kita, van Gijn and van der Hulst (1998):
//! strokes, retractions, holds and rests, with times, confidence and kinematics. `wrist_track` follows a hand relative
//! to the trunk, `movements` finds its movements, `phase` classifies them and the pauses, `totals` sums them, and
//! `annotations` writes those of a dataset.

pub mod annotations;
mod movements;
pub mod phase;
pub mod totals;
pub mod wrist_track;

pub use phase::{GesturePhase, PhaseKind, find_phases};
pub use totals::PhaseTotals;
pub use wrist_track::{HANDS, WristTrack};
