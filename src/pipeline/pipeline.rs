//! The pipeline: a configuration with the videos that it names.

use super::process::SubprocessStage;
use super::stages;
use anyhow::{Result, ensure};
use orator_base::stage::artifacts::{self, StageName};
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::{Stage, Unit};
use orator_dataset::config::videos::Videos;
use orator_dataset::config::{Config, videos};
use orator_dataset::decisions;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Turns videos into datasets as one configuration describes. `run` processes them, `status` reports the progress.
#[derive(Clone, Debug)]
pub struct Pipeline {
    config: Config,
    videos: Vec<Videos>,
    program: Option<PathBuf>,
}

impl Pipeline {
    /// Finds the videos that the configuration names; writes nothing.
    ///
    /// # Errors
    /// A configuration without speakers; an invalid `decisions.toml` beside it.
    pub fn open(config: Config) -> Result<Self> {
        let mut videos = videos::all(&config);
        ensure!(
            !videos.is_empty(),
            "{} has no [[speaker]] section: add one, or create a configuration with `orator init`",
            config.file.display()
        );
        decisions::attach(&config, &mut videos)?;
        Ok(Self { config, videos, program: None })
    }

    /// Processes untrusted files in sandboxed subprocesses, one per unit and stage, unless `work.sandbox` is false.
    /// `program` is the path of `orator`. By default, files are read in this process.
    pub fn with_processes(self, program: PathBuf) -> Self {
        Self { program: Some(program), ..self }
    }

    /// Number of videos to process in parallel: `asked`, else the value of the configuration; 0 means one per
    /// processor core.
    pub fn jobs(&self, asked: Option<usize>) -> usize {
        match asked.unwrap_or(self.config.settings.work.jobs) {
            0 => std::thread::available_parallelism().map_or(1, NonZeroUsize::get),
            n => n,
        }
    }

    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Videos of the named speakers, or of all if `speakers` is empty.
    ///
    /// # Errors
    /// A name that the configuration does not contain.
    pub fn videos(&self, speakers: &[String]) -> Result<Vec<Videos>> {
        for name in speakers {
            let known: Vec<&str> = self.videos.iter().map(|videos| videos.speaker.as_str()).collect();
            ensure!(known.contains(&name.as_str()), "unknown speaker {name}: expected one of {}", known.join(", "));
        }
        let chosen = self.videos.iter().filter(|v| speakers.is_empty() || speakers.contains(&v.speaker));
        Ok(chosen.cloned().collect())
    }

    pub(super) fn all_videos(&self) -> &[Videos] {
        &self.videos
    }

    /// Program of the sandboxed subprocesses; `None` if they are not used.
    pub(super) fn program(&self) -> Option<&Path> {
        self.program.as_deref().filter(|_| self.config.settings.work.sandbox)
    }

    /// Builds a stage. Stages that pass untrusted files to C libraries run in subprocesses if the pipeline has a
    /// program for them. `lift` and `dataset` only read files of the earlier stages, in Rust.
    pub(super) fn stage(&self, name: StageName, ready: &[Unit]) -> Result<Box<dyn Stage + '_>> {
        let (config, videos) = (self.config(), self.all_videos());
        let stage = stages::build(name, config, videos, ready)?;
        Ok(match self.program() {
            Some(program) if !matches!(name, StageName::Lift | StageName::Dataset) => {
                Box::new(SubprocessStage { stage, program, config, videos })
            }
            _ => stage,
        })
    }

    /// File hashes cached by earlier runs.
    pub fn hashes(&self) -> HashCache {
        HashCache::open(&artifacts::hashes(&self.config.settings.work.dir))
    }
}
