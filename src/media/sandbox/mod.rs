//! Restriction of the whole process for good, before it starts threads: which `files` it may read and write (Landlock),
//! which system `calls` it may make (seccomp). Neither needs privileges.

mod calls;
mod files;
mod restriction;

pub use restriction::{FileAccess, Restriction, restrict, restrict_thread};
