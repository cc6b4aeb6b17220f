//! Web server of a study: pages, films and the API of the pages. Participants are identified by a signed token only; no
//! address and no browser fingerprint is stored or logged.

pub mod answer;
pub mod api;
pub mod limits;
pub mod secret;
pub mod study_server;
