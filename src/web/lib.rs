//! Web servers of the program: connections with limits, checked hosts, security headers, replies, files by byte ranges.
//! `orator-study` and `orator-view` add their routes. HTTP only; nothing is logged.

pub mod files;
pub mod host;
pub mod listen;
pub mod peers;
pub mod reply;
pub mod server;

pub use axum;
