//! Many machines on one work folder. A sealed `plan` lists the units with the content of their files (`sealed_input`); each `worker` claims units in the shared folder
//! (`claims`, by files that are only ever created, in a `shared_folder` that may show them late), shows that it is alive
//! (`heartbeat`), runs the stages of what it claimed, and takes over what dead workers left; `progress` is what all of them
//! did so far; `forget` finds the plans that name a video. `slurm` and `kubernetes` write the jobs that start workers. `timing` times the stages on excerpts,
//! `stage_times` derives what a plan takes.

pub mod claims;
pub mod forget;
pub mod heartbeat;
pub mod job;
pub mod kubernetes;
pub mod plan;
pub mod progress;
pub mod sealed_input;
pub mod shared_folder;
pub mod slurm;
pub mod stage_times;
pub mod timing;
pub mod worker;

#[cfg(test)]
mod simulation;
