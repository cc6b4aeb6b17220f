//! What a stage is, what it works on, reads and reports.

use super::progress::Progress;
use anyhow::Context;
use std::fmt;
use std::path::{Path, PathBuf};

/// One thing a stage works on: a video of a speaker, or (for the dataset) a whole speaker.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Unit {
    /// Name of the speaker; empty where a unit belongs to none.
    pub speaker: String,
    /// Work folder name of the video: slug of its stem, `-`, 8 hex digits of its path; empty for a whole speaker.
    pub video: String,
    /// The video file; for a whole speaker the configuration file.
    pub source: PathBuf,
}

impl Unit {
    /// The folder of the unit under `stage`, a stage's folder: `<speaker>/<video>`, or `<speaker>` of a whole speaker.
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

/// A file a stage reads: its role (`video`, `keypoints`, `model:body`) and where it is.
#[derive(Clone, Debug)]
pub struct Input {
    pub role: String,
    pub path: PathBuf,
}

/// One line of a stage's report on a unit, for people; and the numbers behind it, for programs.
#[derive(Clone, Debug, Default)]
pub struct Report {
    pub line: String,
    pub facts: serde_json::Map<String, serde_json::Value>,
}

/// A step of the pipeline. The same inputs and settings give the same bytes, whatever else runs beside it.
pub trait Stage: Sync {
    /// The name: an argument of `--from`, and the folder under `work/`.
    fn name(&self) -> &'static str;
    /// Goes up when the bytes it writes change their meaning.
    fn version(&self) -> u32;
    /// Time it takes for a video, relative to other stages.
    fn cost(&self) -> u32 {
        1
    }
    /// Every setting that influences the bytes made of `unit`, and the versions of the tools that do. Reads nothing from
    /// disk: what depends on files is determined when the stage is constructed.
    fn settings(&self, unit: &Unit) -> serde_json::Value;
    /// The files it reads for `unit`; their contents are part of the fingerprint.
    fn inputs(&self, unit: &Unit) -> anyhow::Result<Vec<Input>>;
    /// The folder into which the files of all units go side by side; none: each unit's own folder under the stage's.
    fn common_folder(&self) -> Option<&Path> {
        None
    }
    /// Whether others read the unit's folder for long: nobody may while the stage writes it anew.
    fn is_read_long(&self) -> bool {
        false
    }
    /// Does the work: writes its files into the empty folder `out` and nowhere else.
    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> anyhow::Result<Report>;
    /// The number of parts in which the work on `unit` can be done, in any order and by anybody; with `join` that gives the
    /// bytes of `run`.
    fn n_parts(&self, _unit: &Unit) -> anyhow::Result<usize> {
        Ok(1)
    }
    /// Does a part of the work, from 0: writes its files into the empty folder `out` and nowhere else.
    fn run_part(&self, unit: &Unit, part: usize, _out: &Path, _progress: &dyn Progress) -> anyhow::Result<()> {
        anyhow::bail!("{} of {unit} has no part {part}", self.name())
    }
    /// Makes the unit's files in the empty folder `out` of the folders of all `parts`, in order.
    fn join(&self, unit: &Unit, parts: &[PathBuf], _out: &Path) -> anyhow::Result<Report> {
        anyhow::bail!("{} of {unit} has no {} parts", self.name(), parts.len())
    }
}

/// Writes a file of a stage into its `out` folder as JSON for people.
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> anyhow::Result<()> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// `1 video`, `2 videos`.
pub fn counted(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}
