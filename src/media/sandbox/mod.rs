//! Permanent restriction of the process before it starts threads: the `files` that it can read and write (Landlock),
//! and its system `calls` (seccomp). Neither needs privileges. `stop_signals` is for parents of such processes.

mod calls;
mod files;
mod restriction;
mod stop_signals;

pub use restriction::{FileAccess, Restriction, restrict, restrict_thread};
pub use stop_signals::ignore_stop_signals;
