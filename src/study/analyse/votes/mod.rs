//! Votes read from a table, whoever wrote it: `columns` names what is needed, `delimited` and `json_lines` cut a file into
//! rows, `row` makes a vote of each or says why not, `read` opens a file and gathers pages of sliders.

pub mod columns;
pub mod delimited;
pub mod json_lines;
pub mod read;
pub mod row;
