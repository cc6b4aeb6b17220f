//! Votes read from a table, whoever wrote it: `columns` names what is needed, `rows` cuts a file into
//! rows, `row` makes a vote of each or says why not, `read` opens a file and gathers pages of sliders.

pub mod columns;
pub mod read;
pub mod row;
pub mod rows;
