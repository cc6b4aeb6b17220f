//! Training of a sequence-to-sequence network. The same data, settings and seed give the same checkpoints, even if the
//! training was interrupted: the segments and the dropout of a step depend only on the seed and the step, and
//! everything else is stored in the checkpoint.

use super::reading;
use super::segments::{PoseSequence, SegmentLoader, SequenceSplits, roll_out_previous};
use super::source::TrainingSource;
use super::step::{SequenceLosses, SequenceState, SequenceTrainer};
use super::validate::{SequenceValidation, ValidationSegments};
pub use crate::generate::model::BEST;
use crate::generate::seq2seq::architecture::{self, Vocabulary, network_config};
use crate::generate::seq2seq::metadata::SequenceMetadata;
use crate::train::epochs::{self, EpochSchedule, StepReport, TrainingOutcome, ValidatedStep, ValidatedTraining};
use crate::train::log;
use crate::train::no_window::{self, NeededFrames};
use crate::train::resume::{self, sample_windows, step_rng};
use crate::train::word_vectors::{self, WORD_DIM};
use anyhow::{Result, ensure};
use candle_core::{Device, Tensor};
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir::{self, FolderLock};
use orator_base::text::counted;
use orator_dataset::Split;
use orator_dataset::config::{Auto, FineMotionReading, SeamState, Seq2seqConfig, Seq2seqSettings};
use orator_formats::checkpoint;
use orator_formats::word_vectors::WordVectors;
use orator_nn::cpu::spin_pool::with_spinning_workers;
use orator_nn::seq2seq::config::Config;
use orator_nn::weights::Contents;
use std::path::Path;

/// Trains on `device` to the last step of `requested`, resuming from the newest checkpoint in `folder` if there is one;
/// then its settings apply, and differences are reported. `vectors` initialise the word embeddings; else they are
/// random. Calls `validated` after each validation, when its log line and checkpoint have been written.
///
/// # Errors
/// Data that cannot be read, with the name of the file; no segment to train on; a checkpoint of other data; another
/// training running in `folder`; a loss that is not finite or explodes (the last good checkpoint is kept);
/// `StoppedTraining` if `progress` requests a stop.
pub fn train(
    source: TrainingSource,
    vectors: Option<&WordVectors>,
    requested: &Seq2seqConfig,
    device: &Device,
    folder: &Path,
    progress: &dyn Progress,
    validated: &mut dyn FnMut(ValidatedStep),
) -> Result<TrainingOutcome<SequenceValidation>> {
    check(requested)?;
    ensure!(
        vectors.is_none() || architecture::word_encoder(requested.network).is_some(),
        "the network {} does not read words: omit --words",
        serde_json::to_value(requested.network)?
    );
    let Config { previous, predicted, .. } = network_config(source.fps(), 0, 0, [0, 0]);
    let needed = NeededFrames { name: "a segment", n_frames: previous + predicted, key: None };
    if let TrainingSource::Dataset(dataset) = source {
        // Checked before the statistics are read, which an empty split does not have.
        no_window::ensure_window(dataset, needed)?;
    }
    // Shared lock: `generate` may load the model during training; `forget` may not remove it.
    let _model = FolderLock::shared(folder)?;
    let _lock = workdir::lock(folder)?;
    workdir::sweep_folder(folder, 0);
    let resumed = resume(source, requested, folder, progress)?;
    let (mut trainer, splits) = match &resumed {
        Some((stored, contents)) => {
            let SequenceMetadata { poses, network, .. } = &stored.speaker;
            let mismatched = vectors.filter(|vectors| vectors.dim() != network.word);
            ensure!(
                mismatched.is_none(),
                "the word vectors have {} dimensions, those of the checkpoint in {} {}: omit --words, or choose another \
                 --out",
                mismatched.map_or(0, WordVectors::dim),
                folder.display(),
                network.word
            );
            let splits = source.sequences(poses, network.context)?;
            let mut trainer = SequenceTrainer::new(stored.speaker.clone(), stored.settings.clone(), device)?;
            trainer.load(stored, contents)?;
            // A process killed before removing the oldest checkpoint leaves one too many.
            checkpoint::prune(folder, trainer.settings.keep_checkpoints)?;
            (trainer, splits)
        }
        None => {
            let initial = initialise(source, vectors, requested, device)?;
            let reads_words = architecture::word_encoder(requested.network).is_some();
            if reads_words && vectors.is_none() && requested.reading == FineMotionReading::Paper {
                progress.say("the word vectors are random: the paper's are GloVe's (`--words FILE`)");
            }
            if let Some(vectors) = vectors {
                let words = initial.0.metadata.vocabulary.words();
                let n_known = vectors.n_known(words.iter().map(String::as_str));
                progress.say(&format!("{n_known} of {} have pretrained vectors", counted(words.len(), "word")));
            }
            initial
        }
    };
    splits.notes.iter().for_each(|note| progress.say(note));
    let train = SegmentLoader::new(splits.train, &trainer.metadata, trainer.settings.stride_frames);
    let Config { predicted, .. } = trainer.metadata.network;
    if resumed.is_none() {
        reading::set_length(&mut trainer.settings, requested, train.len(), predicted, source.fps())?;
    } else {
        let per_epoch = reading::epoch_length(&trainer.settings, train.len());
        let settings = &mut trainer.settings;
        match (requested.steps.given(), requested.epochs.given()) {
            (Some(_), _) => settings.epochs = settings.steps.div_ceil(per_epoch),
            (None, Some(epochs)) => settings.steps = epochs * per_epoch,
            (None, None) => {}
        }
    }
    progress.say(&reading::line(&trainer.settings));
    ensure!(
        !train.is_empty(),
        "{}: no training motion is as long as a segment ({} frames)",
        source.path(),
        needed.n_frames
    );
    progress.say(&format!(
        "{} of {}; writing checkpoints to {}",
        counted(train.len(), "training segment"),
        source.path(),
        folder.display()
    ));
    let secs = reading::motion_secs(&trainer.settings, train.len(), predicted, source.fps());
    no_window::motion_warning(secs).iter().for_each(|warning| progress.say(warning));
    let held_out = SegmentLoader::new(splits.held_out, &trainer.metadata, 0);
    if held_out.is_empty() {
        let cause = match source {
            TrainingSource::Dataset(dataset) => {
                no_window::cause(dataset, Split::Validation, needed).unwrap_or_default()
            }
            TrainingSource::Captures(_) => "use `--hold-out NAME` for captures to validate on".to_owned(),
        };
        progress.say(&format!("no validation segments, so the metrics are those of training segments: {cause}"));
    }
    let held_out = ValidationSegments::new(&held_out, &train, trainer.settings.batch, device)?;
    let mut training = SequenceTraining { trainer: &mut trainer, loader: &train, held_out: &held_out };
    let outcome = with_spinning_workers(|| epochs::run(&mut training, folder, progress, validated))?;
    let (n_parameters, n_words) = (trainer.params().n_parameters(), trainer.metadata.vocabulary.words().len());
    Ok(TrainingOutcome { n_examples: train.len(), n_parameters, n_words, ..outcome })
}

/// Initial trainer of a new training, and its data.
fn initialise(
    source: TrainingSource,
    vectors: Option<&WordVectors>,
    requested: &Seq2seqConfig,
    device: &Device,
) -> Result<(SequenceTrainer, SequenceSplits)> {
    let settings = reading::settings(requested)?;
    let (fps, poses) = (source.fps(), source.pose_format()?);
    let word = vectors.map_or(WORD_DIM, WordVectors::dim);
    let sizes = |n_words| Config {
        audio_context: settings.audio_context,
        score_blocks: settings.discriminator_blocks,
        ..network_config(fps, poses.n_features(), n_words, [settings.hidden, word])
    };
    let splits = source.sequences(&poses, sizes(0).context)?;
    let vocabulary = match architecture::word_encoder(settings.network) {
        Some(_) => Vocabulary::of(splits.train.iter().flat_map(|sequence: &PoseSequence| &sequence.words)),
        None => Vocabulary::default(),
    };
    let metadata = SequenceMetadata {
        kind: SequenceMetadata::kind(),
        name: source.name(),
        fps,
        rate: source.rate(),
        architecture: settings.network,
        network: sizes(vocabulary.n_indices()),
        poses,
        vocabulary,
        words_around_secs: settings.words_around_secs,
        carries_state: settings.state_at_seams == SeamState::Carried,
        has_word_vectors: vectors.is_some(),
        dataset: source.hash()?,
    };
    let trainer = SequenceTrainer::new(metadata, settings, device)?;
    if let Some(encoder) = architecture::word_encoder(trainer.metadata.architecture) {
        word_vectors::initialise(trainer.params(), encoder, &trainer.metadata.vocabulary, vectors)?;
    }
    initialise_scales(&trainer, &splits.train)?;
    Ok((trainer, splits))
}

/// Standard deviation of the noise that is added to poses, as a share of that of the data (published value).
const NOISE: f32 = 0.01;

/// Sets the output scale of the audio baseline, whose tanh is limited to 1, to the largest magnitude of each training
/// feature (at least 1), and the noise of its inputs to a share of the feature's standard deviation.
fn initialise_scales(trainer: &SequenceTrainer, train: &[PoseSequence]) -> Result<()> {
    let Some(baseline) = trainer.network.audio_baseline() else { return Ok(()) };
    let column = |c: usize| train.iter().flat_map(move |sequence| sequence.poses.column(c).to_vec());
    let scale = |c: usize| column(c).fold(1.0f32, |largest, value| largest.max(value.abs()));
    let deviation = |c: usize| {
        let (n, sum, squares) = column(c).fold((0.0f64, 0.0, 0.0), |(n, sum, squares), value| {
            (n + 1.0, sum + f64::from(value), squares + f64::from(value).powi(2))
        });
        let mean = sum / n.max(1.0);
        (squares / n.max(1.0) - mean * mean).max(0.0).sqrt() as f32
    };
    let n = trainer.metadata.network.pose;
    let scales: Vec<f32> = (0..n).map(scale).collect();
    let noise: Vec<f32> = (0..n).map(|c| NOISE * deviation(c) / scales[c]).collect();
    let tensor = |values: Vec<f32>| Tensor::from_vec(values, n, trainer.params().device());
    Ok(baseline.set_scale(&tensor(scales)?, &tensor(noise)?)?)
}

struct SequenceTraining<'a> {
    trainer: &'a mut SequenceTrainer,
    loader: &'a SegmentLoader,
    held_out: &'a ValidationSegments,
}

impl ValidatedTraining for SequenceTraining<'_> {
    type Validation = SequenceValidation;

    fn names(&self) -> (&str, &'static str) {
        (&self.trainer.metadata.name, "seq2seq")
    }

    fn schedule(&self) -> EpochSchedule {
        let Seq2seqSettings { steps, epoch_steps, checkpoint_every, patience, .. } = self.trainer.settings;
        EpochSchedule { steps, epoch_steps, checkpoint_every, patience }
    }

    fn n_done(&self) -> usize {
        self.trainer.step
    }

    fn best(&mut self) -> &mut Option<(usize, f32)> {
        &mut self.trainer.best
    }

    fn step(&mut self) -> Result<StepReport> {
        let Seq2seqSettings { seed, batch, rollout_previous, .. } = self.trainer.settings;
        let which = sample_windows(seed, self.trainer.step, batch, self.loader.len());
        let mut batch = self.loader.batch(&which)?.on(self.trainer.params().device())?;
        if rollout_previous > 0.0 {
            // The segments and the dropout use other derived seeds.
            let rng = &mut step_rng(seed.rotate_left(32), self.trainer.step);
            roll_out_previous(&mut batch, &which, self.loader, &*self.trainer.network, rollout_previous, rng)?;
        }
        let losses = self.trainer.step(&batch)?;
        let SequenceLosses { total, l1, gradient_norm, .. } = losses;
        resume::ensure_not_diverged(self.trainer.step, &losses.named(), gradient_norm)?;
        let summary = format!("loss {total:.3}{}", l1.map_or(String::new(), |l1| format!(" L1 {l1:.3}")));
        Ok(StepReport { line: log::line(self.trainer.step, &losses), summary })
    }

    fn validate(&self) -> Result<SequenceValidation> {
        self.held_out.validate(&*self.trainer.network)
    }

    fn score_and_alarm(validation: &SequenceValidation) -> (f64, Option<&str>) {
        (validation.score, validation.alarm.as_deref())
    }

    fn summary(validation: &SequenceValidation) -> String {
        let SequenceValidation { split, l1, mean_pose_l1, energy, .. } = validation;
        format!("{split} L1 {l1:.3} (mean pose {mean_pose_l1:.3}), energy {:.0} %", 100.0 * energy)
    }

    fn save(&mut self, folder: &Path) -> Result<()> {
        self.trainer.save(folder)
    }

    fn save_best(&self, folder: &Path, validation: &SequenceValidation) -> Result<()> {
        self.trainer.save_best(folder, validation)
    }
}

/// Newest checkpoint, its state and the settings of the resumed training. Reports where these differ from `requested`.
fn resume(
    source: TrainingSource,
    requested: &Seq2seqConfig,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<Option<(SequenceState, Contents)>> {
    resume::newest(folder, progress, |contents| {
        let mut stored = SequenceState::from_checkpoint(contents)?;
        let (settings, mut differences) = stored.settings(requested)?;
        stored.settings = settings;
        let (name, fps, rate) = (source.name(), source.fps(), source.rate());
        let metadata = &mut stored.speaker;
        ensure!(
            metadata.name == name && metadata.fps == fps && metadata.rate == rate,
            "it is a model of {} at {}, audio at {} Hz; the data are of {name} at {fps}, {rate} Hz; choose another --out",
            metadata.name,
            metadata.fps,
            metadata.rate
        );
        let hash = source.hash()?;
        if metadata.dataset != hash {
            differences.push(
                "the data have changed: training continues with the checkpoint's means and vocabulary".to_owned(),
            );
            metadata.dataset = hash;
        }
        Ok((stored, differences))
    })
}

fn check(requested: &Seq2seqConfig) -> Result<()> {
    reading::check(requested)?;
    let is_zero = |count: Auto<usize>| count.given() == Some(0);
    ensure!(
        requested.batch.given().is_none_or(|batch| batch > 1),
        "seq2seq.batch is {}: expected at least 2 (for batch norm)",
        requested.batch.given().unwrap_or_default()
    );
    ensure!(
        requested.checkpoint_every > 0 && !is_zero(requested.epoch_steps) && requested.hidden > 0,
        "seq2seq.checkpoint_every, seq2seq.epoch_steps and seq2seq.hidden must be at least 1"
    );
    Ok(())
}
