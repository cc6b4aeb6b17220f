//! Stage 1: a video to its sound at 16 kHz mono, the frame timeline at the dataset rate, and its shots.
