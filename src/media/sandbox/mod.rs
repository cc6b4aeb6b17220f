//! Restriction of the whole process for good, before it starts threads: which `files` it may read and write (Landlock),
//! which system `calls` it may make (seccomp). Neither needs privileges. `stop_signals` is for whoever starts such a process.

mod calls;
mod files;
mod restriction;
mod stop_signals;

pub use restriction::{FileAccess, Restriction, restrict, restrict_thread};
pub use stop_signals::ignore_stop_signals;
