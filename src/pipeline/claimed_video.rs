//! Processing of one claimed video by a worker that shares the work folder with workers on other machines. The claim
//! is checked again before the output of a stage is moved into place.

use super::pipeline::Pipeline;
use super::pose2d::models::ChosenModels;
use super::stages::{self, HookedStage, UnitWork};
use anyhow::Result;
use orator_base::stage::artifacts::StageName;
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::progress::Progress;
use orator_base::stage::runner::StageOutcome;
use orator_base::stage::{Input, Report, Stage, Unit, runner};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Checks that the worker still holds its claim on the video; fails with `runner::ClaimLost` if it does not.
pub type ClaimCheck<'a> = &'a (dyn Fn() -> Result<()> + Sync);

/// Runs `work` with a claim check before and after.
fn checked(check_claim: ClaimCheck, work: UnitWork) -> Result<Report> {
    check_claim()?;
    let report = work()?;
    check_claim()?;
    Ok(report)
}

impl Pipeline {
    /// Runs the given per-video stages for one video; fresh ones are skipped. The outcomes end with the first failure.
    ///
    /// # Errors
    /// Errors that affect every video: missing weights or manifest.
    pub fn run_video(
        &self,
        names: &[StageName],
        unit: &Unit,
        hashes: &HashCache,
        check_claim: ClaimCheck,
        progress: &dyn Progress,
    ) -> Result<Vec<StageOutcome>> {
        let hook = |_: &'static str, _: &Unit, work: UnitWork| checked(check_claim, work);
        let stage = |name: &StageName| Ok(HookedStage { stage: self.stage(*name, &[])?, hook: &hook });
        let stages = names.iter().map(stage).collect::<Result<Vec<_>>>()?;
        let stages: Vec<&dyn Stage> = stages.iter().map(|stage| stage as &dyn Stage).collect();
        let work = &self.config().settings.work.dir;
        let outcomes = runner::run_stages(&stages, std::slice::from_ref(unit), work, hashes, (1, false), progress);
        Ok(outcomes.into_iter().flatten().collect())
    }

    /// Processes share `share.0` of `share.1` of the parts of a video whose `pose2d` stage is in progress; does
    /// nothing if it has no parts. The result contains an outcome only on failure.
    ///
    /// # Errors
    /// Those of `run_video`.
    pub fn run_parts(
        &self,
        unit: &Unit,
        share: (usize, usize),
        hashes: &HashCache,
        check_claim: ClaimCheck,
        progress: &dyn Progress,
    ) -> Result<Vec<StageOutcome>> {
        let hook = |_: &'static str, _: &Unit, work: UnitWork| checked(check_claim, work);
        let stage = HookedStage { stage: self.stage(StageName::Pose2d, &[])?, hook: &hook };
        let result = runner::run_parts(&stage, unit, share, &self.config().settings.work.dir, hashes, progress);
        Ok(result.err().map(|error| StageOutcome::Failed(Arc::new(error))).into_iter().collect())
    }

    /// Input files of the first stage for each unit: the video, or keypoints of another program and their audio.
    ///
    /// # Errors
    /// Those of `run_video`.
    pub fn source_inputs(&self, units: &[Unit]) -> Result<Vec<Vec<Input>>> {
        let stage = self.stage(StageName::Extract, &[])?;
        // If keypoints have no audio, the stage reports that when it runs.
        let source = |unit: &Unit| vec![Input { role: "video".into(), path: unit.source.clone() }];
        Ok(units.iter().map(|unit| stage.inputs(unit).unwrap_or_else(|_| source(unit))).collect())
    }

    /// BLAKE3 hashes of the weights that the per-video stages use, by file name.
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
        let recogniser = settings.transcribes_any().then(|| -> Result<_> {
            let id = settings.transcribe.model_id();
            Ok((id.to_owned(), hashes.hash(&chosen.store.recogniser(id)?)?))
        });
        used.iter().map(hash).chain(recogniser).collect()
    }

    /// Checks that the stages have what they need: models, manifest, weights. Returns a note to print.
    ///
    /// # Errors
    /// The missing file, and where to get it.
    pub fn check(&self) -> Result<Option<String>> {
        let has_videos = self.all_videos().iter().any(orator_dataset::config::videos::Videos::has_video_files);
        let note = if has_videos { stages::check_models(&self.config().settings)? } else { None };
        let settings = &self.config().settings;
        let names = self.all_videos().iter().flat_map(|videos| settings.stages_of(&videos.speaker));
        names.collect::<BTreeSet<_>>().into_iter().try_for_each(|name| self.stage(name, &[]).map(drop))?;
        Ok(note)
    }
}
