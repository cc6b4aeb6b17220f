//! Processing on many machines that share one work folder. A sealed `plan` lists the units and the hashes of their
//! files (`sealed_input`). Each `worker` claims units by creating files (`claims`) in a `shared_folder` that may show
//! them late, publishes a `heartbeat`, runs the stages, and takes over the units of dead workers. `progress` summarises
//! all workers; `forget` finds plans that name a video; `slurm` and `kubernetes` write the jobs that start workers
//! (`job`).

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
pub mod worker;
