//! Every place where the program writes fails once, or is where it is killed: it says so, and the same command ends in
//! the same bytes afterwards. `ORATOR_FAULTS=all` tries every place (`make prove`), else a few of them are drawn.

pub mod scenes;
pub mod shim;
pub mod sweep;
