//! Tests of single modules of `orator-cluster`.

mod job;
mod plan;
mod slurm;
