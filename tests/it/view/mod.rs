//! The local page of `orator view`.

mod browser;
mod server;
