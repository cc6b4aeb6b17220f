//! The local page of `orator view`.

mod server;
