//! Tests of single modules of `orator-cluster`.

mod plan;
mod slurm;
