//! A study without a server of its own: static files for a web host, and the responses that an address of the
//! researcher's collects, one JSON a line.

mod address;
pub mod files;
pub mod posts;
