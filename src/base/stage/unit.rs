//! The interface of a stage: the units that it processes, the files that it reads, and its report.

use super::progress::Progress;
use anyhow::Context;
use std::fmt;
use std::path::{Path, PathBuf};

/// Work item of a stage: a video of a speaker, or a whole speaker (for the dataset).
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Unit {
    /// Name of the speaker; empty if the unit belongs to no speaker.
    pub speaker: String,
    /// Work folder name of the video: slug of its stem, `-`, 8 hex digits of its path; empty for a whole speaker.
    pub video: String,
    /// The video file; the configuration file for a whole speaker.
    pub source: PathBuf,
}

impl Unit {
    /// Folder of the unit in `stage`, a stage's folder: `<speaker>/<video>`, or `<speaker>` for a whole speaker.
    pub fn dir(&self, stage: &Path) -> PathBuf {
        let speaker = stage.join(&self.speaker);
        if self.video.is_empty() { speaker } else { speaker.join(&self.video) }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.speaker.as_str(), self.video.as_str()) {
            (name, "") | ("", name) => write!(f, "{name}"),
            (speaker, video) => write!(f, "{speaker}/{video}"),
        }
    }
}

/// An input file of a stage: its role (`video`, `keypoints`, `model:body`) and its path.
#[derive(Clone, Debug)]
pub struct Input {
    pub role: String,
    pub path: PathBuf,
}

/// Report of a stage on a unit: a line for the user, and the values behind it for programs.
#[derive(Clone, Debug, Default)]
pub struct Report {
    pub line: String,
    pub facts: serde_json::Map<String, serde_json::Value>,
}

/// A step of the pipeline. Equal inputs and settings give identical bytes, whatever else runs at the same time.
pub trait Stage: Sync {
    /// Stage name: an argument of `--from`, and the stage's folder under `work/`.
    fn name(&self) -> &'static str;
    /// Version of the stage; incremented when the bytes that it writes change their meaning.
    fn version(&self) -> u32;
    /// Run time per video relative to other stages.
    fn cost(&self) -> u32 {
        1
    }
    /// Every setting that influences the output for `unit`, and the versions of the tools that do. Reads nothing from
    /// disk: settings that depend on files are determined when the stage is constructed.
    fn settings(&self, unit: &Unit) -> serde_json::Value;
    /// Input files for `unit`; their contents are part of the fingerprint.
    fn inputs(&self, unit: &Unit) -> anyhow::Result<Vec<Input>>;
    /// Folder that receives the files of all units; `None`: each unit has its own folder in the stage's folder.
    fn common_folder(&self) -> Option<&Path> {
        None
    }
    /// Whether other programs read the unit's folder for a long time, so that it is locked before it is replaced.
    fn needs_folder_lock(&self) -> bool {
        false
    }
    /// Processes the unit: writes its files into the empty folder `out` and nowhere else.
    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> anyhow::Result<Report>;
    /// Number of parts of `unit`. Parts can run in any order and process; `join` then gives the same bytes as `run`.
    fn n_parts(&self, _unit: &Unit) -> anyhow::Result<usize> {
        Ok(1)
    }
    /// Processes part `part`, counted from 0: writes its files into the empty folder `out` and nowhere else.
    fn run_part(&self, unit: &Unit, part: usize, _out: &Path, _progress: &dyn Progress) -> anyhow::Result<()> {
        anyhow::bail!("stage {} cannot process part {part} of {unit}: it does not split units", self.name())
    }
    /// Builds the unit's files in the empty folder `out` from the folders of all `parts`, in order.
    fn join(&self, unit: &Unit, parts: &[PathBuf], _out: &Path) -> anyhow::Result<Report> {
        anyhow::bail!(
            "stage {} cannot join the parts of {unit} ({}): it does not split units",
            self.name(),
            parts.len()
        )
    }
}

/// Writes a file of a stage as indented JSON.
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> anyhow::Result<()> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}
