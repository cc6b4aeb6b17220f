//! Analysis of a study's votes. `votes` reads them, `exclusion` applies the exclusion rules, `outcome` converts
//! responses to scores, `share` and `pair` test them with `stats`, `task` and `analysis` collect everything in a
//! `result`, which `conclusions`, `text` and `page` present.

pub mod analysis;
pub mod conclusions;
pub mod exclusion;
pub mod outcome;
pub mod page;
pub mod pair;
pub mod registration;
pub mod result;
pub mod share;
pub mod statistic;
pub mod task;
pub mod text;
pub mod votes;

pub use analysis::analyse;
pub use registration::Registration;
