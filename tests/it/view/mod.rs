//! The local page of `orator view`.

mod pages;
mod server;
