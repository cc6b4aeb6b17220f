//! Votes read from a table, whoever wrote it: `columns` names what is needed and splits a file into rows, `row` makes a vote
//! of each or gives the reason why not, `read` opens a file and gathers pages of sliders.

pub mod columns;
pub mod read;
pub mod row;
