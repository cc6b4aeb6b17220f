//! Speech to motion with a trained speaker.
