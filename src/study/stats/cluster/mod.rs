//! Votes of which many come from one participant and many are about one clip, so that they are not independent.
//! Two hypotheses differ: that participants score chance on these very clips (`votes`), and that they would on
//! average over all clips of which these are a sample (`crossed`, the headline; Clark 1973). The first is rejected
//! wherever some of the chosen clips happen to be easy, the second is not.

pub mod crossed;
pub mod sign_flips;
pub mod votes;
