//! Reads votes from tables of this or other programs: `columns` finds the required columns and splits a file into rows,
//! `row` converts each to a vote or a reason for rejection, `read` opens a file and merges slider scores into pages.

pub mod columns;
pub mod read;
pub mod row;
