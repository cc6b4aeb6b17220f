//! The server of a study: a page, its films, and the interface by which a page takes part. Participants are known by a
//! signed token alone; no address and no trace of a browser is stored or written anywhere.

pub mod answer;
pub mod api;
pub mod clock;
pub mod host;
pub mod limits;
pub mod listen;
pub mod peers;
pub mod reply;
pub mod secret;
pub mod served;
pub mod start;
pub mod write_timeout;
