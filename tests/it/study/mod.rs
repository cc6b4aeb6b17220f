//! User studies: building, serving, analysis.

mod analyse;
mod build;
mod coverage;
mod design;
mod end_to_end;
mod films;
mod glmm;
mod pages;
mod serve;
mod serve_begin;
mod serve_busy;
mod serve_hostile;
mod serve_load;
mod server_killed;
mod side_by_side;
mod stats_golden;
mod store;
mod unit;
