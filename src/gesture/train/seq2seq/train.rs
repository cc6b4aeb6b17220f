//! Training of a sequence-to-sequence network. The same data, settings and seed give the same
//! checkpoints, also when the training was interrupted: segments and dropout of a step depend on the seed and the step
//! alone, everything else is in the checkpoint.

use super::own_previous::begin_with_own;
use super::segments::SegmentLoader;
use super::sequence::{PoseSequence, SequenceSplits};
use super::source::TrainingSource;
use super::step::{SequenceLosses, SequenceState, SequenceTrainer};
use super::validate::{SequenceValidation, ValidationSegments};
pub use crate::generate::model::BEST;
use crate::generate::seq2seq::architecture::{self, network_config};
use crate::generate::seq2seq::metadata::SequenceMetadata;
use crate::generate::seq2seq::vocabulary::{PADDING, UNKNOWN, Vocabulary};
use crate::train::epochs::{self, EpochSchedule, StepReport, TrainingOutcome, ValidatedStep, ValidatedTraining};
use crate::train::log;
use crate::train::no_window::{self, NeededFrames};
use crate::train::resume::{self, sample_windows, stream};
use anyhow::{Context, Result, ensure};
use candle_core::{Device, Tensor};
use orator_base::stage::progress::Progress;
use orator_base::stage::workdir::{self, FolderLock};
use orator_dataset::Split;
use orator_dataset::config::Seq2seqConfig;
use orator_formats::checkpoint;
use orator_formats::word_vectors::WordVectors;
use orator_nn::cpu::thread_team::with_spinning_workers;
use orator_nn::seq2seq::config::Config;
use orator_nn::seq2seq::encoders::set_word_vectors;
use orator_nn::weights::Contents;
use std::path::Path;

/// Numbers of a word where no table of vectors is given.
const WORD: usize = 100;

/// Trains until `requested.steps`, going on from the newest checkpoint in `folder`; what the settings of that checkpoint say
/// counts, and differences are told. `vectors`: what words begin with; else the seed.
///
/// # Errors
/// Data that cannot be read, by the name of its file; no segment to train on; a checkpoint of other data; another training
/// at work in `folder`; a loss that is not finite or explodes (the last good checkpoint stays); `StoppedTraining` where
/// `progress` asks for an end.
pub fn train(
    source: TrainingSource,
    vectors: Option<&WordVectors>,
    requested: &Seq2seqConfig,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<TrainingOutcome<SequenceValidation>> {
    train_watched(source, vectors, requested, folder, progress, &mut |_| ())
}

/// [`train`], with a call behind each validation, when log and checkpoints are written.
pub fn train_watched(
    source: TrainingSource,
    vectors: Option<&WordVectors>,
    requested: &Seq2seqConfig,
    folder: &Path,
    progress: &dyn Progress,
    validated: &mut dyn FnMut(ValidatedStep),
) -> Result<TrainingOutcome<SequenceValidation>> {
    check(requested)?;
    let Config { previous, predicted, .. } = network_config(source.fps(), 0, 0, [0, 0]);
    let needed = NeededFrames { name: "a segment", n_frames: previous + predicted, key: None };
    if let TrainingSource::Dataset(dataset) = source {
        // Before the statistics, of which an empty split has none.
        no_window::ensure_window(dataset, needed)?;
    }
    // Others may listen to the model while it learns, and nobody may forget it.
    let _model = FolderLock::shared(folder)?;
    let _lock = workdir::lock(folder)?;
    workdir::sweep_folder(folder, 0);
    let resumed = resume(source, requested, folder, progress)?;
    let (mut trainer, splits) = match &resumed {
        Some((stored, contents)) => {
            let SequenceMetadata { poses, network, .. } = &stored.speaker;
            let other = vectors.filter(|vectors| vectors.dim() != network.word);
            ensure!(
                other.is_none(),
                "the word vectors have {} numbers, the words of the checkpoint in {} {}: leave them out, or choose another \
                 --out",
                other.map_or(0, WordVectors::dim),
                folder.display(),
                network.word
            );
            let splits = source.sequences(poses, network.context)?;
            let mut trainer = SequenceTrainer::new(stored.speaker.clone(), stored.settings.clone())?;
            trainer.load(stored, contents)?;
            // One too many is left by a kill before the oldest was removed.
            checkpoint::prune(folder, trainer.settings.keep_checkpoints)?;
            (trainer, splits)
        }
        None => {
            let begun = begin(source, vectors, requested)?;
            if let Some(vectors) = vectors {
                let words = begun.0.metadata.vocabulary.words();
                let n_known = vectors.n_known(words.iter().map(String::as_str));
                progress.say(&format!("{n_known} of {} words begin with their vectors", words.len()));
            }
            begun
        }
    };
    splits.notes.iter().for_each(|note| progress.say(note));
    let train = SegmentLoader::new(splits.train, &trainer.metadata, trainer.settings.stride_frames);
    ensure!(
        !train.is_empty(),
        "{}: no motion to train on is as long as a segment of {} frames",
        source.place(),
        needed.n_frames
    );
    progress.say(&format!(
        "{} segments of {}; what is learnt goes to {}",
        train.len(),
        source.place(),
        folder.display()
    ));
    let held_out = SegmentLoader::new(splits.held_out, &trainer.metadata, 0);
    if held_out.is_empty() {
        let cause = match source {
            TrainingSource::Dataset(dataset) => {
                no_window::cause(dataset, Split::Validation, needed).unwrap_or_default()
            }
            TrainingSource::Captures(_) => "`--hold-out NAME` names captures to validate on".to_owned(),
        };
        progress.say(&format!("no segment is held out, the figures below are on those to train on: {cause}"));
    }
    let held_out = ValidationSegments::new(&held_out, &train, trainer.settings.batch)?;
    let mut training = SequenceTraining { trainer: &mut trainer, loader: &train, held_out: &held_out };
    let end = with_spinning_workers(|| epochs::run(&mut training, folder, progress, validated))?;
    let (n_parameters, n_words) = (trainer.params().n_parameters(), trainer.metadata.vocabulary.words().len());
    Ok(TrainingOutcome { n_examples: train.len(), n_parameters, n_words, ..end })
}

/// A trainer as the seed and the word vectors make it, and the data.
fn begin(
    source: TrainingSource,
    vectors: Option<&WordVectors>,
    settings: &Seq2seqConfig,
) -> Result<(SequenceTrainer, SequenceSplits)> {
    let (fps, poses) = (source.fps(), source.pose_numbers()?);
    let word = vectors.map_or(WORD, WordVectors::dim);
    let sizes = |n_words| Config {
        hears_context: settings.hears_context,
        ..network_config(fps, poses.n_numbers(), n_words, [settings.hidden, word])
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
        network: sizes(vocabulary.n_numbers()),
        poses,
        vocabulary,
        words_around_secs: settings.words_around_secs,
        dataset: source.hash()?,
    };
    let trainer = SequenceTrainer::new(metadata, settings.clone())?;
    begin_words(&trainer, vectors)?;
    begin_codes(&trainer, &splits.train)?;
    Ok((trainer, splits))
}

/// Padding begins with zeros, the unknown word with ones, the others with their vectors where there are some.
fn begin_words(trainer: &SequenceTrainer, vectors: Option<&WordVectors>) -> Result<()> {
    let SequenceMetadata { architecture, vocabulary, network, .. } = &trainer.metadata;
    let Some(encoder) = architecture::word_encoder(*architecture) else { return Ok(()) };
    let found = trainer.params().trainables().find(|(name, _)| *name == format!("{encoder}.embedding.weight"));
    let (_, table) = found.context("this network has no table of words")?;
    let mut rows = table.to_vec2::<f32>()?;
    rows[PADDING as usize] = vec![0.0; network.word];
    rows[UNKNOWN as usize] = vec![1.0; network.word];
    if let Some(vectors) = vectors {
        for word in vocabulary.words() {
            rows[vocabulary.number(word) as usize] = vectors.vector(vectors.index(word))?;
        }
    }
    let numbers: Vec<f32> = rows.concat();
    let table = Tensor::from_vec(numbers, (vocabulary.n_numbers(), network.word), table.device())?;
    Ok(set_word_vectors(trainer.params(), encoder, &table)?)
}

/// Deviation of the noise that is added to a pose, as a share of the data's (published).
const NOISE: f32 = 0.01;

/// The audio baseline is told how far the numbers to train on reach from 0, where that is farther than tanh does, and how
/// much of them is noise.
fn begin_codes(trainer: &SequenceTrainer, train: &[PoseSequence]) -> Result<()> {
    let Some(baseline) = trainer.network.audio_baseline() else { return Ok(()) };
    let column = |c: usize| train.iter().flat_map(move |sequence| sequence.poses.column(c).to_vec());
    let scale = |c: usize| column(c).fold(1.0f32, |most, number| most.max(number.abs()));
    let deviation = |c: usize| {
        let (n, sum, squares) = column(c).fold((0.0f64, 0.0, 0.0), |(n, sum, squares), number| {
            (n + 1.0, sum + f64::from(number), squares + f64::from(number).powi(2))
        });
        let mean = sum / n.max(1.0);
        (squares / n.max(1.0) - mean * mean).max(0.0).sqrt() as f32
    };
    let n = trainer.metadata.network.pose;
    let scales: Vec<f32> = (0..n).map(scale).collect();
    let noise: Vec<f32> = (0..n).map(|c| NOISE * deviation(c) / scales[c]).collect();
    let tensor = |numbers: Vec<f32>| Tensor::from_vec(numbers, n, &Device::Cpu);
    Ok(baseline.set_scale(&tensor(scales)?, &tensor(noise)?)?)
}

/// A trainer with its segments.
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
        let Seq2seqConfig { steps, epoch_steps, checkpoint_every, patience, .. } = self.trainer.settings;
        EpochSchedule { steps, epoch_steps, checkpoint_every, patience }
    }

    fn n_done(&self) -> usize {
        self.trainer.step
    }

    fn best(&mut self) -> &mut Option<(usize, f32)> {
        &mut self.trainer.best
    }

    fn step(&mut self) -> Result<StepReport> {
        let Seq2seqConfig { seed, batch, own_previous, .. } = self.trainer.settings;
        let which = sample_windows(seed, self.trainer.step, batch, self.loader.len());
        let mut batch = self.loader.batch(&which)?;
        if own_previous > 0.0 {
            // Another seed than those of the segments and of dropout.
            let rng = &mut stream(seed.rotate_left(32), self.trainer.step);
            begin_with_own(&mut batch, &which, self.loader, &*self.trainer.network, own_previous, rng)?;
        }
        let losses = self.trainer.step(&batch)?;
        let SequenceLosses { total, l1, gradient_norm, .. } = losses;
        resume::ensure_sound(self.trainer.step, &losses.named(), gradient_norm)?;
        let words = format!("loss {total:.3}{}", l1.map_or(String::new(), |l1| format!(" L1 {l1:.3}")));
        Ok(StepReport { line: log::line(self.trainer.step, &losses), words })
    }

    fn validate(&self) -> Result<SequenceValidation> {
        self.held_out.validate(&*self.trainer.network)
    }

    fn judged(validation: &SequenceValidation) -> (f64, Option<&str>) {
        (validation.score, validation.alarm.as_deref())
    }

    fn words(validation: &SequenceValidation) -> String {
        let SequenceValidation { split, l1, mean_pose_l1, energy, .. } = validation;
        format!("{split} L1 {l1:.3} (mean pose {mean_pose_l1:.3}), energy {:.0} %", 100.0 * energy)
    }

    fn save(&self, folder: &Path) -> Result<()> {
        self.trainer.save(folder)
    }

    fn save_best(&self, folder: &Path, validation: &SequenceValidation) -> Result<()> {
        self.trainer.save_best(folder, validation)
    }
}

/// The newest checkpoint, and what it says with the settings that count now. Tells where these differ from `requested`.
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
            "it is of {} at {}, sound at {} Hz, the data of {name} at {fps}, {rate} Hz; choose another --out",
            metadata.name,
            metadata.fps,
            metadata.rate
        );
        let hash = source.hash()?;
        if metadata.dataset != hash {
            differences.push("the data are others now: trained on with the checkpoint's means and words".to_owned());
            metadata.dataset = hash;
        }
        Ok((stored, differences))
    })
}

fn check(settings: &Seq2seqConfig) -> Result<()> {
    ensure!(settings.batch > 1, "seq2seq.batch is {}: batch norm needs at least 2 segments", settings.batch);
    ensure!(
        settings.checkpoint_every > 0 && settings.epoch_steps > 0 && settings.hidden > 0,
        "seq2seq.checkpoint_every, seq2seq.epoch_steps and seq2seq.hidden must be at least 1"
    );
    Ok(())
}
