//! Videos as input of `orator lift` and `orator animate`: the stages `extract` and `pose2d` run, and everything in
//! which the speaker is visible is lifted, fit for training or not.

use crate::cli::config_args::ConfigArgs;
use crate::cli::outputs::is_same_file;
use crate::cli::sandbox::this_program;
use crate::cli::setup::models::with_models;
use crate::cli::ui::Ui;
use anyhow::{Context as _, Result, bail};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::{Artifact, StageName};
use orator_base::types::pose2d::Keypoints;
use orator_dataset::config::patterns::{VIDEO_EXTENSIONS, has_extension};
use orator_dataset::config::{Config, LiftConfig, Settings, SpeakerConfig, videos};
use orator_pipeline::lift::{LiftStage, Lifted};
use orator_pipeline::{Pipeline, Selection, UnitState, UnitStatus};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Name, in the work folder, of the speaker of a video that the configuration does not list.
const SPEAKER: &str = "video";

/// Set in the environment once the keypoints are detected.
const DETECTED: &str = "ORATOR_KEYPOINTS_DETECTED";

/// A video with detected keypoints.
pub struct VisibleVideo {
    unit: Unit,
    pub settings: Settings,
}

impl VisibleVideo {
    /// Detects the keypoints of `path` if it is a video, in the work folder of `pipeline.toml` in the current folder,
    /// or else in `work`. The program is then started anew with the same arguments, since a process that has several
    /// threads can no longer be restricted; this must be called first.
    ///
    /// # Errors
    /// A missing model; a video that cannot be processed.
    pub fn find(path: &Path, ui: &Ui) -> Result<Option<Self>> {
        if !path.is_file() || !has_extension(path, &VIDEO_EXTENSIONS) {
            return Ok(None);
        }
        let config = ConfigArgs { config: "pipeline.toml".into(), set: Vec::new() }.load_or_default()?;
        let pipeline = Pipeline::open(with_only(config, path)?)?.with_processes(this_program());
        let settings = pipeline.config().settings.clone();
        if std::env::var_os(DETECTED).is_none() {
            let is_stale = |unit: &UnitStatus| {
                matches!(unit.stage, StageName::Extract | StageName::Pose2d) && unit.state != UnitState::UpToDate
            };
            // Detected keypoints are used even while a run holds the work folder, or where it can only be read.
            if pipeline.status(&[]).map_or(true, |status| status.units.iter().any(is_stale)) {
                let selection = Selection { to: StageName::Pose2d, ..Selection::default() };
                let report = with_models(&settings, ui, || pipeline.run(&selection, ui))?;
                if let Some(failure) = report.failures.first() {
                    bail!("{}: {}", path.display(), failure.error);
                }
            }
            let error = Command::new(this_program()).args(std::env::args_os().skip(1)).env(DETECTED, "1").exec();
            bail!("cannot start the program again: {error}");
        }
        let unit = pipeline.videos(&[])?.into_iter().flat_map(|videos| videos.units).next();
        let unit = unit.with_context(|| format!("{} is excluded in pipeline.toml", path.display()))?;
        Ok(Some(Self { unit, settings }))
    }

    /// Lifts everything that is visible; also returns the keypoints.
    pub fn lift(&self, lift: &LiftConfig) -> Result<(Keypoints, Lifted)> {
        let Settings { segment, work, .. } = &self.settings;
        let lifted = LiftStage::new(lift, segment, &work.dir)?.lift_visible(&self.unit);
        lifted.with_context(|| format!("cannot lift {}", self.unit.source.display()))
    }

    /// Path of a file that a stage wrote.
    pub fn file(&self, file: Artifact) -> PathBuf {
        file.path(&self.settings.work.dir, &self.unit)
    }

    /// Path of the video.
    pub fn path(&self) -> &Path {
        &self.unit.source
    }
}

/// The configuration with `path` as its only video, under the speaker and the path that it lists for this file.
fn with_only(config: Config, path: &Path) -> Result<Config> {
    let listed = videos::all(&config).into_iter().zip(&config.settings.speaker).find_map(|(videos, speaker)| {
        let unit = videos.units.into_iter().find(|unit| is_same_file(&unit.source, path))?;
        Some((speaker.clone(), unit.source))
    });
    let new = || SpeakerConfig { name: SPEAKER.to_owned(), ..SpeakerConfig::default() };
    let (listed, source) = match listed {
        Some(listed) => listed,
        None => (new(), std::path::absolute(path)?),
    };
    let name = source.to_str().with_context(|| format!("{} is not valid UTF-8: rename it", source.display()))?;
    let folder = config.file.parent().unwrap_or(Path::new("."));
    let mirrored = listed.mirrored.into_iter().filter(|entry| videos::names(entry, &source, folder));
    let speaker = SpeakerConfig {
        name: listed.name,
        videos: vec![name.to_owned()],
        mirrored: mirrored.collect(),
        reference: listed.reference,
        ..SpeakerConfig::default()
    };
    Ok(Config { settings: Settings { speaker: vec![speaker], ..config.settings }, ..config })
}
