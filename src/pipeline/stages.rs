//! Construction of the stages by name, and the units that each processes.

use super::dataset::stage::{DatasetInputs, DatasetStage};
use super::extract::ExtractStage;
use super::keypoints::stage::StageBySource;
use super::lift::LiftStage;
use super::lift::lifter::context_secs;
use super::pose2d::Pose2dStage;
use super::pose2d::models::{self, ChosenModels};
use super::segment::SegmentStage;
use super::speech::speech_rule::SpeechDetector;
use super::transcribe::TranscribeStage;
use anyhow::Result;
use orator_base::stage::artifacts::StageName;
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::progress::Progress;
use orator_base::stage::runner::{self, State};
use orator_base::stage::{Report, Stage, StageWrapper, Unit};
use orator_dataset::config::videos::Videos;
use orator_dataset::config::{Config, Settings};
use orator_dataset::info::ModelUsed;
use orator_onnx::{Model, ModelEntry, Runtime};
use std::path::Path;

/// Builds a stage for `all` videos. `ready` are the videos that the dataset is built from.
///
/// # Errors
/// A model that the manifest does not list; weights that cannot be read.
pub fn build(name: StageName, config: &Config, all: &[Videos], ready: &[Unit]) -> Result<Box<dyn Stage>> {
    let settings = &config.settings;
    let decisions = || all.iter().flat_map(|videos| videos.decisions.iter().cloned()).collect();
    Ok(match name {
        StageName::Extract => StageBySource::extract(Box::new(ExtractStage::of_config(config)), settings, all),
        StageName::Pose2d => {
            StageBySource::pose2d(Box::new(Pose2dStage::new(settings)?.with_decisions(decisions())), settings, all)
        }
        StageName::Segment => Box::new(
            SegmentStage::new(&settings.segment, &settings.work.dir)
                .with_speech(SpeechDetector::find(settings)?)
                .with_decisions(decisions()),
        ),
        StageName::Lift => {
            Box::new(LiftStage::new(&settings.lift, &settings.segment, &settings.work.dir)?.with_decisions(decisions()))
        }
        StageName::Transcribe => Box::new(TranscribeStage::new(settings, SpeechDetector::find(settings)?)?),
        StageName::Dataset => {
            let inputs = DatasetInputs {
                ready: ready.to_vec(),
                all: all.to_vec(),
                models: models_used(settings)?,
                notes: vec![SpeechDetector::note(settings)?],
                context_secs: context_secs(&settings.lift),
            };
            Box::new(DatasetStage::new(settings, inputs))
        }
    })
}

/// Units of a stage: the speaker for `dataset`, otherwise every video, if the stage is configured for the speaker.
pub fn units(name: StageName, config: &Config, videos: &Videos) -> Vec<Unit> {
    let speaker = videos.speaker.clone();
    match name {
        StageName::Dataset => vec![Unit { speaker, video: String::new(), source: config.file.clone() }],
        _ if config.settings.stages_of(&speaker).contains(&name) => videos.units.clone(),
        _ => Vec::new(),
    }
}

/// Videos of a speaker that are fresh at every stage before `dataset`: the dataset is built from them.
///
/// # Errors
/// Those of `build`.
pub fn ready(config: &Config, videos: &Videos, hashes: &HashCache) -> Result<Vec<Unit>> {
    let all = std::slice::from_ref(videos);
    let names = config.settings.stages_of(&videos.speaker).into_iter();
    let stages = names.map(|name| build(name, config, all, &[])).collect::<Result<Vec<_>>>()?;
    let state = |stage: &dyn Stage, unit: &Unit| runner::state(stage, unit, &config.settings.work.dir, hashes);
    let fresh = |unit: &&Unit| stages.iter().all(|stage| matches!(state(&**stage, unit), State::UpToDate(_)));
    Ok(videos.units.iter().filter(fresh).cloned().collect())
}

/// Opens every model that the configuration selects, so that an invalid setup is reported before any work. Returns a note
/// to print.
///
/// # Errors
/// ONNX Runtime is missing; a model is missing or does not match the manifest; the GPU does not start.
pub fn check_models(settings: &Settings) -> Result<Option<String>> {
    let runtime = Runtime::load(&settings.models.onnxruntime, &settings.models.dir)?;
    for (_, entry) in ChosenModels::find(settings)?.used()? {
        Model::open(&runtime, entry, &settings.models.dir)?;
    }
    Ok(models::runtime(&settings.models)?.1)
}

fn models_used(settings: &Settings) -> Result<Vec<ModelUsed>> {
    let chosen = ChosenModels::find(settings)?;
    let named = chosen.used()?.into_iter().map(|(role, entry)| {
        let ModelEntry { id, sha256, origin, .. } = entry.clone();
        ModelUsed { role: role.into(), id, sha256, licence: origin.licence }
    });
    let mut models: Vec<ModelUsed> =
        named.chain(SpeechDetector::find(settings)?.map(|detector| detector.used())).collect();
    if settings.transcribes_any() {
        models.push(TranscribeStage::used(settings)?);
    }
    Ok(models)
}

/// Processing of one unit by a stage.
pub type UnitWork<'a> = &'a mut dyn FnMut() -> Result<Report>;

/// Called with the stage name, the unit and the processing function, which it calls.
pub type StageHook<'a> = &'a (dyn Fn(&'static str, &Unit, UnitWork<'_>) -> Result<Report> + Sync);

/// A stage whose `run` and `run_part` go through a hook, e.g. to check a claim or to measure time.
pub struct HookedStage<'a> {
    pub stage: Box<dyn Stage + 'a>,
    pub hook: StageHook<'a>,
}

impl StageWrapper for HookedStage<'_> {
    fn inner(&self, _unit: Option<&Unit>) -> &dyn Stage {
        &*self.stage
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        (self.hook)(self.name(), unit, &mut || self.stage.run(unit, out, progress))
    }

    fn run_part(&self, unit: &Unit, part: usize, out: &Path, progress: &dyn Progress) -> Result<()> {
        let mut work = || self.stage.run_part(unit, part, out, progress).map(|()| Report::default());
        (self.hook)(self.name(), unit, &mut work).map(drop)
    }
}
