//! The pipeline as a value: a configuration with the videos it names, to be run and asked how it stands.

use super::process::SubprocessStage;
use super::stages;
use anyhow::{Result, ensure};
use orator_base::stage::artifacts::{self, StageName};
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::{Stage, Unit};
use orator_dataset::config::videos::Videos;
use orator_dataset::config::{Config, videos};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Videos to datasets, by one configuration. `run` does the work, `status` says how far it is.
#[derive(Clone, Debug)]
pub struct Pipeline {
    config: Config,
    videos: Vec<Videos>,
    program: Option<PathBuf>,
}

impl Pipeline {
    /// Looks for the videos that the configuration names; writes nothing.
    ///
    /// # Errors
    /// A configuration without speakers.
    pub fn open(config: Config) -> Result<Self> {
        let videos = videos::all(&config);
        ensure!(!videos.is_empty(), "{} names no [[speaker]]", config.file.display());
        Ok(Self { config, videos, program: None })
    }

    /// Lets foreign files be read in restricted processes of their own, one a unit and stage, unless `work.sandbox` says
    /// no: `program` is the program `orator`. Without it a run reads them in this process.
    pub fn with_processes(self, program: PathBuf) -> Self {
        Self { program: Some(program), ..self }
    }

    /// This pipeline with the program of another.
    pub fn like(self, other: &Self) -> Self {
        Self { program: other.program.clone(), ..self }
    }

    /// Another configuration and other videos with the same program.
    pub(super) fn with(&self, config: Config, videos: Vec<Videos>) -> Self {
        Self { config, videos, program: self.program.clone() }
    }

    /// Videos worked on side by side: so many as asked for, else as the configuration says; 0 is one a processor core.
    pub fn jobs(&self, asked: Option<usize>) -> usize {
        match asked.unwrap_or(self.config.settings.work.jobs) {
            0 => std::thread::available_parallelism().map_or(1, NonZeroUsize::get),
            n => n,
        }
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The videos of the speakers of those names; of all where none is named.
    ///
    /// # Errors
    /// A name the configuration does not have.
    pub fn videos(&self, speakers: &[String]) -> Result<Vec<Videos>> {
        for name in speakers {
            let known: Vec<&str> = self.videos.iter().map(|videos| videos.speaker.as_str()).collect();
            ensure!(known.contains(&name.as_str()), "no speaker is called {name}; there are: {}", known.join(", "));
        }
        let chosen = self.videos.iter().filter(|v| speakers.is_empty() || speakers.contains(&v.speaker));
        Ok(chosen.cloned().collect())
    }

    /// The videos of all speakers.
    pub(super) fn all_videos(&self) -> &[Videos] {
        &self.videos
    }

    /// The program of the processes in which foreign files are read, where they are.
    pub(super) fn program(&self) -> Option<&Path> {
        self.program.as_deref().filter(|_| self.config.settings.work.sandbox)
    }

    /// The stage; one that hands foreign files to foreign libraries does so in processes of their own, where the pipeline
    /// has a program for them. The last two stages read what the first three wrote, in Rust alone.
    pub(super) fn stage(&self, name: StageName, ready: &[Unit]) -> Result<Box<dyn Stage + '_>> {
        let (config, videos) = (self.config(), self.all_videos());
        let stage = stages::build(name, config, videos, ready)?;
        Ok(match self.program() {
            Some(program) if name < StageName::Lift => Box::new(SubprocessStage { stage, program, config, videos }),
            _ => stage,
        })
    }

    /// The hashes of files that are known from earlier runs.
    pub fn hashes(&self) -> HashCache {
        HashCache::open(&artifacts::hashes(&self.config.settings.work.dir))
    }
}
