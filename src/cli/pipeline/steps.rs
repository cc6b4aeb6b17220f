//! The five stages in their order, and the units each works on.

use anyhow::Result;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use orator::config::videos::Videos;
use orator::config::{Config, Settings};
use orator::dataset::info::ModelUsed;
use orator::external::onnx::{Model, Runtime};
use orator::pipeline::dataset::stage::DatasetStage;
use orator::pipeline::extract::Extract;
use orator::pipeline::lift::LiftStage;
use orator::pipeline::pose2d::Pose2dStage;
use orator::pipeline::segment::SegmentStage;
use orator::stage::artifacts::StageName;
use orator::stage::fingerprint::HashCache;
use orator::stage::runner;
use orator::stage::runner::State;
use orator::stage::{Stage, Unit};

/// Reads a stage's name of the command line; a former name is an alias.
pub fn stage_parser() -> impl TypedValueParser<Value = StageName> {
    let name = |stage: StageName| PossibleValue::new(stage.as_str()).aliases(stage.former());
    PossibleValuesParser::new(StageName::ALL.map(name)).try_map(|name| name.parse::<StageName>())
}

/// The stage, ready to run. `videos` are those the dataset is made of.
///
/// # Errors
/// A model that is missing or not what its manifest says, weights that cannot be read.
pub fn stage(name: StageName, config: &Config, videos: &[Unit]) -> Result<Box<dyn Stage>> {
    let settings = &config.settings;
    Ok(match name {
        StageName::Extract => Box::new(Extract::new(&settings.extract)),
        StageName::Pose2d => Box::new(Pose2dStage::new(settings)?),
        StageName::Segment => Box::new(SegmentStage::new(&settings.segment, &settings.work.dir)),
        StageName::Lift => Box::new(LiftStage::new(&settings.lift, &settings.segment, &settings.work.dir)?),
        StageName::Dataset => Box::new(
            DatasetStage::new(settings, videos)
                .with_videos(orator::config::videos::of(config))
                .with_models(models_used(settings)?),
        ),
    })
}

/// What a stage works on: every video, or the speaker as a whole.
pub fn units(stage: StageName, config: &Config, videos: &Videos) -> Vec<Unit> {
    if stage != StageName::Dataset {
        return videos.units.clone();
    }
    let speaker = videos.speaker.clone();
    vec![Unit { speaker, video: String::new(), source: config.file.clone() }]
}

/// The videos of a speaker that are fresh at every stage before the last: those a dataset is made of.
///
/// # Errors
/// As those of `stage`.
pub fn ready(config: &Config, videos: &Videos, hashes: &HashCache) -> Result<Vec<Unit>> {
    let stages = StageName::OF_VIDEOS.into_iter().map(|name| stage(name, config, &[])).collect::<Result<Vec<_>>>()?;
    let state = |stage: &dyn Stage, unit: &Unit| runner::state(stage, unit, &config.settings.work.dir, hashes);
    let fresh = |unit: &&Unit| stages.iter().all(|stage| matches!(state(&**stage, unit), State::Fresh(_)));
    Ok(videos.units.iter().filter(fresh).cloned().collect())
}

/// The speakers asked for; all where none is named.
///
/// # Errors
/// A name the configuration does not have, or a configuration without speakers.
pub fn speakers(config: &Config, wanted: &[String]) -> Result<Vec<Videos>> {
    let all = orator::config::videos::of(config);
    let names: Vec<&str> = all.iter().map(|videos| videos.speaker.as_str()).collect();
    anyhow::ensure!(!all.is_empty(), "{} names no [[speaker]]", config.file.display());
    for name in wanted {
        let known = names.join(", ");
        anyhow::ensure!(names.contains(&name.as_str()), "no speaker is called {name}; there are: {known}");
    }
    Ok(all.into_iter().filter(|videos| wanted.is_empty() || wanted.contains(&videos.speaker)).collect())
}

/// Opens every model the configuration chooses, so that a wrong set-up is said before any work.
///
/// # Errors
/// No ONNX Runtime; a model that is missing or not what the manifest says.
pub fn check_models(settings: &Settings) -> Result<()> {
    let runtime = Runtime::load(&settings.models.onnxruntime, &settings.models.dir)?;
    for (_, entry) in Pose2dStage::new(settings)?.used()? {
        Model::open(&runtime, entry, &settings.models.dir)?;
    }
    Ok(())
}

fn models_used(settings: &Settings) -> Result<Vec<ModelUsed>> {
    let stage = Pose2dStage::new(settings)?;
    let used = stage.used()?.into_iter();
    let named =
        used.map(|(role, entry)| ModelUsed { role: role.into(), id: entry.id.clone(), sha256: entry.sha256.clone() });
    Ok(named.collect())
}
