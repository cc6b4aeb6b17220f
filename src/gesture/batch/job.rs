//! A batch of sounds as a value: what to make, run as a stage, reported sound by sound.

use super::sounds::BatchSound;
use super::stage::BatchStage;
use anyhow::Result;
use orator_avatar::animate::export::file::FigureOptions;
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::progress::Progress;
use orator_base::stage::runner::{self, StageOutcome};
use orator_base::stage::{artifacts, workdir};
use orator_nn::seq2seq::predict::StateAtSeams;
use serde::Serialize;
use serde_json::{Map, Value};
use std::path::PathBuf;

/// Folder of the records, below that of the motions.
const RECORDS: &str = ".made";

/// Sounds to be made into motion files.
#[derive(Clone, Debug, Default)]
pub struct SpeechBatch {
    /// The sounds (`sounds::of_folder`, `sounds::of_table`).
    pub sounds: Vec<BatchSound>,
    /// Where the motions go.
    pub folder: PathBuf,
    /// Endings of the files of each motion: npy, txt, json, bvh, fbx, glb, vrm, vrma, mp4.
    pub formats: Vec<String>,
    /// A checkpoint or a training's folder, for sounds that name none.
    pub checkpoint: Option<PathBuf>,
    /// What sequence-to-sequence networks begin a segment with.
    pub seams: StateAtSeams,
    /// Bone names and rate of the figures.
    pub figure: FigureOptions,
    /// Whether motions are made again where nothing changed.
    pub again: bool,
}

/// How a batch ended.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BatchReport {
    /// Sounds whose motion was made.
    pub made: usize,
    /// Sounds whose motion was there.
    pub fresh: usize,
    /// Sounds that failed.
    pub failed: usize,
    /// Where the motions are.
    pub out_folder: PathBuf,
    /// Every sound, in the order of the batch.
    pub sounds: Vec<BatchOutcome>,
}

/// How a sound of a batch ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BatchOutcome {
    /// The sound.
    pub audio: PathBuf,
    /// The motion's name below the folder, without an ending.
    pub out: String,
    /// Made, fresh or failed.
    pub ended: BatchState,
    /// Of a failure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// `secs` of sound, `n_frames` of motion, `speaker`, `note`, of segments `segments`; empty of a failure.
    #[serde(flatten)]
    pub facts: Map<String, Value>,
}

/// How a sound of a batch ended, in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum BatchState {
    /// Its motion was made.
    Made,
    /// Its motion was there already.
    Fresh,
    /// Failed; the others are not stopped.
    Failed,
}

impl SpeechBatch {
    /// Makes what is missing or changed.
    ///
    /// # Errors
    /// What stops all: a format that is unknown, a common checkpoint that cannot be read, another batch in the same
    /// folder.
    pub fn run(&self, progress: &dyn Progress) -> Result<BatchReport> {
        let stage = BatchStage::new(self)?;
        let records = self.folder.join(RECORDS);
        let _lock = workdir::lock(&records)?;
        let hashes = HashCache::open(&artifacts::hashes(&records));
        let units: Vec<_> = self.sounds.iter().map(BatchStage::unit).collect();
        // One sound at a time: the network itself takes all cores.
        let ended = runner::run(&stage, &units, &records, &hashes, (1, self.again), progress);
        hashes.save()?;
        let mut report = BatchReport { out_folder: self.folder.clone(), ..BatchReport::default() };
        for (sound, ended) in self.sounds.iter().zip(ended) {
            let (count, ended, error, facts) = match ended {
                StageOutcome::Done(done) => (&mut report.made, BatchState::Made, None, done.facts),
                StageOutcome::Skipped(done) => (&mut report.fresh, BatchState::Fresh, None, done.facts),
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
