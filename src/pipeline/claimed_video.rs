//! One video through its stages, for a worker that shares the work folder with workers on other machines: it has claimed
//! the video, and looks once more whether the claim still is its own before a stage's work is put in its place.

use super::pipeline::Pipeline;
use super::pose2d::models::ChosenModels;
use super::stages::{self, HookedStage, UnitWork};
use anyhow::Result;
use orator_base::stage::artifacts::StageName;
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::progress::Progress;
use orator_base::stage::runner::StageOutcome;
use orator_base::stage::{Input, Report, Stage, Unit, runner};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Checks that the worker still holds its claim on the video: `Err` of `runner::ClaimLost` where it does not.
pub type ClaimCheck<'a> = &'a (dyn Fn() -> Result<()> + Sync);

/// Does the work if the video is the worker's before and after.
fn around(is_mine: ClaimCheck, work: UnitWork) -> Result<Report> {
    is_mine()?;
    let report = work()?;
    is_mine()?;
    Ok(report)
}

impl Pipeline {
    /// These stages of videos for one video of the pipeline; fresh ones are skipped. The answers end with the first failure.
    ///
    /// # Errors
    /// What no video can be worked on without: weights, the manifest.
    pub fn run_video(
        &self,
        names: &[StageName],
        unit: &Unit,
        hashes: &HashCache,
        is_mine: ClaimCheck,
        progress: &dyn Progress,
    ) -> Result<Vec<StageOutcome>> {
        let while_mine = |_: &'static str, _: &Unit, work: UnitWork| around(is_mine, work);
        let stage = |name: &StageName| Ok(HookedStage { stage: self.stage(*name, &[])?, hook: &while_mine });
        let stages = names.iter().map(stage).collect::<Result<Vec<_>>>()?;
        let stages: Vec<&dyn Stage> = stages.iter().map(|stage| stage as &dyn Stage).collect();
        let work = &self.config().settings.work.dir;
        let ended = runner::run_stages(&stages, std::slice::from_ref(unit), work, hashes, (1, false), progress);
        Ok(ended.into_iter().flatten().collect())
    }

    /// Share `idx` of `of` of the parts of a video that has begun; nothing where its stage has no parts. An answer is a
    /// failure.
    ///
    /// # Errors
    /// Those of `run_video`.
    pub fn run_parts(
        &self,
        unit: &Unit,
        share: (usize, usize),
        hashes: &HashCache,
        is_mine: ClaimCheck,
        progress: &dyn Progress,
    ) -> Result<Vec<StageOutcome>> {
        let while_mine = |_: &'static str, _: &Unit, work: UnitWork| around(is_mine, work);
        let stage = HookedStage { stage: self.stage(StageName::Pose2d, &[])?, hook: &while_mine };
        let ended = runner::run_parts(&stage, unit, share, &self.config().settings.work.dir, hashes, progress);
        Ok(ended.err().map(|error| StageOutcome::Failed(Arc::new(error))).into_iter().collect())
    }

    /// The files that the first stage reads for each of the videos: the video, or keypoints of another program and their
    /// sound.
    ///
    /// # Errors
    /// Those of `run_video`.
    pub fn source_inputs(&self, units: &[Unit]) -> Result<Vec<Vec<Input>>> {
        let stage = self.stage(StageName::Extract, &[])?;
        // Where no sound belongs to keypoints, the stage says so when its turn comes.
        let source = |unit: &Unit| vec![Input { role: "video".into(), path: unit.source.clone() }];
        Ok(units.iter().map(|unit| stage.inputs(unit).unwrap_or_else(|_| source(unit))).collect())
    }

    /// BLAKE3 of the weights that the stages of videos ask, by the names of their files.
    ///
    /// # Errors
    /// Weights that cannot be read.
    pub fn model_hashes(&self) -> Result<BTreeMap<String, String>> {
        let settings = &self.config().settings;
        let (chosen, hashes) = (ChosenModels::find(settings)?, self.hashes());
        let used = chosen.used()?;
        let hash = |(_, entry): &(_, &orator_onnx::ModelEntry)| {
            Ok((entry.file.clone(), hashes.hash(&settings.models.dir.join(&entry.file))?))
        };
        used.iter().map(hash).collect()
    }

    /// Looks whether the stages have what they need: models, the manifest, weights.
    ///
    /// # Errors
    /// What is missing, and where it comes from.
    pub fn check(&self) -> Result<()> {
        if self.all_videos().iter().any(orator_dataset::config::videos::Videos::has_video_files) {
            stages::check_models(&self.config().settings)?;
        }
        StageName::OF_VIDEOS.into_iter().try_for_each(|name| self.stage(name, &[]).map(drop))
    }
}
