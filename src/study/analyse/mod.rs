//! Analysis of a study's votes. `votes` reads them, `exclusion` leaves out what was agreed, `outcome` turns answers to
//! numbers, `share` and `pair` judge them by `stats`, `task` and `analysis` gather all in the one `result`, from which
//! `verdict`, `methods`, `text` and `page` speak.

pub mod analysis;
pub mod exclusion;
pub mod figure;
pub mod methods;
pub mod outcome;
pub mod page;
pub mod pair;
pub mod registration;
pub mod result;
pub mod share;
pub mod strength;
pub mod task;
pub mod text;
pub mod verdict;
pub mod votes;
pub mod words;

pub use analysis::analyse;
pub use registration::Registration;
