//! Statistics of a user study as pure functions: proportions, means, equivalence, clustering by participants and clips,
//! mixed models, randomisation tests, rank tests, Bradley-Terry strengths, inter-rater agreement. The headline
//! statistics are `cluster::crossed`, which generalises to other participants and clips, and
//! `cluster::sides::side_p`, the exact randomisation test of the plan's assignment of sides, which assumes nothing
//! beyond that randomisation.

pub mod bradley_terry;
pub mod cluster;
pub mod estimate;
pub mod glmm;
pub mod proportion;
pub mod rank;
