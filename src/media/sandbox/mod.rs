//! Restriction of the whole process for good, before it starts threads: which `files` it may read and write (Landlock),
//! which system `calls` it may make (seccomp). Neither needs privileges.

pub mod access;
#[cfg(target_os = "linux")]
mod calls;
#[cfg(target_os = "linux")]
mod files;
pub mod restrict;

pub use access::{FileAccess, Restriction};
pub use restrict::restrict;
