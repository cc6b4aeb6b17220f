//! Tests of single modules of `orator-cluster`.

mod job;
mod kubernetes;
mod plan;
mod progress;
mod slurm;
