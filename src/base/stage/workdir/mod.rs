//! Crash-safe writing: a kill at any moment leaves the complete old or new files. An attempt is written beside the
//! target, flushed to disk and renamed. All renames of the project are here, and the locks between programs.

mod attempt;
mod file;
mod folder;
mod lock;
mod process;

pub use attempt::{left_over, remove, sweep_folder};
pub use file::{NoSpace, bytes_under, full_disk, has_files, move_files, read_file, remove_file, replace, write_file};
pub use folder::{attempt_folder, build_folder, recover_folder, replace_folder, restore_folder};
pub use lock::{BusyFolder, FolderLock, announce, lock, lock_shared, locks_work};
pub use process::{is_alive, machine};
