//! A batch of sounds: its settings, the run as a stage, and a report with the outcome of each sound.

use super::sounds::BatchSound;
use super::stage::BatchStage;
use anyhow::Result;
use orator_avatar::animate::export::file::FigureOptions;
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::progress::Progress;
use orator_base::stage::runner::{self, StageOutcome};
use orator_base::stage::{artifacts, workdir};
use serde::Serialize;
use serde_json::{Map, Value};
use std::path::PathBuf;

/// Folder of the records, below that of the motions.
const RECORDS: &str = ".made";

/// Sounds for which motion files are to be generated.
#[derive(Clone, Debug, Default)]
pub struct SpeechBatch {
    /// The sounds (`sounds::of_folder`, `sounds::of_table`).
    pub sounds: Vec<BatchSound>,
    /// Files of the folder that are neither sounds nor transcripts.
    pub passed_over: Vec<String>,
    /// Output folder.
    pub folder: PathBuf,
    /// File extensions of the output formats: npy, txt, json, bvh, fbx, glb, vrm, vrma, mp4.
    pub formats: Vec<String>,
    /// Checkpoint, or folder of a training, for sounds without their own.
    pub checkpoint: Option<PathBuf>,
    /// Table of vectors for words that are not in the vocabulary of a sequence-to-sequence network.
    pub words: Option<PathBuf>,
    /// Whether sequence-to-sequence networks are requested to carry their decoder state across segments.
    pub carry_state: bool,
    /// Bone names and frame rate of exported figures.
    pub figure: FigureOptions,
    /// Whether up-to-date motions are generated again.
    pub again: bool,
}

/// Result of a batch.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BatchReport {
    /// Number of sounds whose motion was generated.
    pub created: usize,
    /// Number of sounds whose motion was up to date.
    pub up_to_date: usize,
    /// Number of sounds that failed.
    pub failed: usize,
    /// Files of the folder that are neither sounds nor transcripts.
    pub passed_over: Vec<String>,
    /// Output folder.
    pub out_folder: PathBuf,
    /// Outcome of every sound, in the order of the batch.
    pub sounds: Vec<BatchOutcome>,
}

/// Outcome of a sound of a batch.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BatchOutcome {
    /// Sound file.
    pub audio: PathBuf,
    /// Path of the motion below the output folder, without an extension.
    pub out: String,
    /// State after the run.
    pub ended: BatchState,
    /// Error message of a failure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// `secs` of sound, `n_frames` of motion, `speaker`, `note`, and `segments` of a sequence-to-sequence network;
    /// empty if the sound failed.
    #[serde(flatten)]
    pub facts: Map<String, Value>,
}

/// State of a sound after the run of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BatchState {
    /// The motion was generated.
    Created,
    /// The motion was already up to date.
    UpToDate,
    /// The sound failed, which does not stop the others.
    Failed,
}

impl SpeechBatch {
    /// Generates motions that are missing or out of date.
    ///
    /// # Errors
    /// Errors that affect all sounds: an unknown format, a common checkpoint that cannot be read, another batch running
    /// in the same folder.
    pub fn run(&self, progress: &dyn Progress) -> Result<BatchReport> {
        let stage = BatchStage::new(self)?;
        let records = self.folder.join(RECORDS);
        let _lock = workdir::lock(&records)?;
        let hashes = HashCache::open(&artifacts::hashes(&records));
        let units: Vec<_> = self.sounds.iter().map(BatchStage::unit).collect();
        // One sound at a time, since the network itself uses all cores.
        let ended = runner::run(&stage, &units, &records, &hashes, (1, self.again), progress);
        hashes.save()?;
        let (out_folder, passed_over) = (self.folder.clone(), self.passed_over.clone());
        let mut report = BatchReport { passed_over, out_folder, ..BatchReport::default() };
        for (sound, ended) in self.sounds.iter().zip(ended) {
            let (count, ended, error, facts) = match ended {
                StageOutcome::Done(done) => (&mut report.created, BatchState::Created, None, done.facts),
                StageOutcome::Skipped(done) => (&mut report.up_to_date, BatchState::UpToDate, None, done.facts),
                StageOutcome::Failed(error) => {
                    (&mut report.failed, BatchState::Failed, Some(format!("{error:#}")), Map::new())
                }
            };
            *count += 1;
            let (audio, out) = (sound.audio.clone(), sound.name.clone());
            report.sounds.push(BatchOutcome { audio, out, ended, error, facts });
        }
        Ok(report)
    }
}
