//! Many machines on one work folder. A sealed `plan` lists the units; each `worker` claims units in the shared folder
//! (`claims`, by files that are only ever created, in a `shared_folder` that may show them late), says that it is alive
//! (`heartbeat`), runs the stages of what it claimed, and takes over what dead ones left (`takeover`); `progress` is what
//! all of them did so far. `slurm` and `kubernetes` write the jobs that start workers; `estimate` says what all of it takes.

pub mod claim_files;
pub mod claims;
pub mod estimate;
pub mod heartbeat;
pub mod job;
pub mod kubernetes;
pub mod plan;
pub mod progress;
pub mod shared_folder;
pub mod shell;
pub mod slurm;
pub mod takeover;
pub mod worker;
