//! Strengths of conditions from votes between two of them: `bradley_terry` by maximum likelihood, `elo` as public arenas
//! rank models, both with intervals by participants.

pub mod bradley_terry;
pub mod elo;
pub mod votes;

#[cfg(test)]
mod golden;
