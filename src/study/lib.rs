//! User study of gesture generation: films of several conditions are built and sealed, served to participants in a
//! browser, and the responses are collected and analysed (Rebol, Guetl, Pietroszek 2021, section 4; Kucherenko et al.
//! 2021). `file` is the study file that a researcher writes, `folder` the layout on disk, `plan` the trials that each
//! participant sees.

pub mod analyse;
pub mod build;
pub mod design;
pub mod export;
pub mod file;
pub mod folder;
pub mod pages;
pub mod plan;
pub mod power;
pub mod preregistration;
pub mod seal;
pub mod server;
pub mod stats;
pub mod stimuli;
pub mod store;
pub mod vote;
