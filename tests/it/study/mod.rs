//! User studies: built, served, analysed.

mod analyse;
mod build;
mod coverage;
mod films;
mod pages;
mod serve;
mod serve_begin;
mod serve_busy;
mod serve_crowd;
mod serve_hostile;
mod server_killed;
mod whole;
