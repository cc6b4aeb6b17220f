//! Numbers, rotations, motion, sound features and texts of the base crate.

mod body_view;
mod gaussian;
mod hand;
mod loudness;
mod mel;
mod mfcc;
mod openness;
mod order;
mod overall;
mod resample;
mod rotation;
mod text;
mod time;
mod unit;
mod units;
