//! Writing so that a kill at any moment leaves either the old or the new, whole: write an attempt beside the target,
//! flush it to disk, rename. The only renames of the project are here, and the locks that keep programs apart.

mod attempt;
mod file;
mod folder;
mod lock;
mod process;

pub use attempt::{left_over, remove, sweep_folder};
pub use file::{NoSpace, bytes_under, full_disk, has_files, move_files, read_file, remove_file, replace, write_file};
pub use folder::{attempt_folder, build_folder, recover_folder, replace_folder, restore_folder};
pub use lock::{BusyFolder, FolderLock, announce, are_kept_apart, lock, lock_with_others};
pub use process::{is_alive, machine};
