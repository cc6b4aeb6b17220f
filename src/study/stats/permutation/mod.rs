//! Tests whose null distribution is that of a random assignment or of random signs, not of a model. `sides` is the
//! randomisation test of the plan; `sign_flip` and `crossed_flip` ask for scores that are symmetric about chance, of
//! participants on these clips and of participants on any clips.

pub mod crossed_flip;
pub mod sides;
pub mod sign_flip;
