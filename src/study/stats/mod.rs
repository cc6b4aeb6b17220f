//! Statistics of a user study as pure functions of numbers: proportions, means, equivalence, clusters of participants
//! and clips, mixed models, randomisation tests, ranks, strengths, agreement of raters. The headline figures are
//! `cluster::crossed`, which holds for other participants and other clips, and `cluster::sign_flips::side_p`, the
//! randomisation test of the plan's own draw, which assumes nothing but that draw.

pub mod bradley_terry;
pub mod cluster;
pub mod equivalence;
pub mod estimate;
pub mod glmm;
pub mod proportion;
pub mod rank;

#[cfg(test)]
mod golden;
