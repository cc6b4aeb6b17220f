//! Statistics of a user study as pure functions of numbers: proportions, means, equivalence, clusters of participants
//! and clips, mixed models, randomisation tests, ranks, strengths, agreement of raters. The headline figures are
//! `cluster::crossed`, which holds for other participants and other clips, and `permutation::sides`, which assumes
//! nothing but the plan's own draw.

pub mod cluster;
pub mod equivalence;
pub mod error;
pub mod estimate;
pub mod glmm;
pub mod holm;
pub mod krippendorff;
pub mod median;
pub mod paired;
pub mod permutation;
pub mod proportion;
pub mod rank;
