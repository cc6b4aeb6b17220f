//! A plan as the verbs take it up.

use crate::cli::confine::this_program;
use anyhow::Result;
use orator_cluster::plan::ClusterPlan;
use orator_dataset::config;
use orator_pipeline::Pipeline;
use std::path::Path;

/// Reads a plan and the pipeline it is of, and checks that they still belong together.
pub fn open(path: &Path) -> Result<(ClusterPlan, Pipeline)> {
    let plan = ClusterPlan::read(path)?;
    let config = config::load(&plan.config, &plan.sets)?;
    let pipeline = Pipeline::open(config)?.with_processes(this_program());
    plan.check(&pipeline, &this_program())?;
    Ok((plan, pipeline))
}
