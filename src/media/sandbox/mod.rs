//! Restriction of the whole process for good, before it starts threads: which `files` it may read and write (Landlock),
//! which system `calls` it may make (seccomp). Neither needs privileges.

#[cfg(target_os = "linux")]
mod calls;
#[cfg(target_os = "linux")]
mod files;
mod restriction;

#[cfg(target_os = "linux")]
pub use restriction::restrict_thread;
pub use restriction::{FileAccess, Restriction, restrict};
