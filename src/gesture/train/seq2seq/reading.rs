//! Readings: values for the keys of `[seq2seq]` that are `"auto"`. FineMotion's paper (GENEA 2020) and its published
//! code differ in the losses, the words of a segment and the state at seams; [`READING_ROWS`] has both values of each
//! key with their sources. The reading `auto` uses those of the code and chooses the epochs by the minutes of motion.

use anyhow::{Context, Result, ensure};
use orator_base::text::counted;
use orator_base::types::time::FrameRate;
use orator_dataset::config::{FineMotionReading, SeamState, Seq2seqConfig, Seq2seqSettings, SequenceNetwork, number};
use serde_json::{Value, json};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReadingValue {
    Number(f64),
    Choice(&'static str),
}

use ReadingValue::{Choice, Number};

/// Values of a key in the paper and in the code, each with its source.
#[derive(Clone, Copy, Debug)]
pub struct ReadingRow {
    pub key: &'static str,
    /// Networks that the row is about; empty: all others.
    pub networks: &'static [SequenceNetwork],
    pub paper: (ReadingValue, &'static str),
    pub code: (ReadingValue, &'static str),
}

/// Networks of section 4.1, and that of section 4.2.
const SEGMENT: &[SequenceNetwork] = &[SequenceNetwork::Audio, SequenceNetwork::Words];
const CONTEXTUAL: &[SequenceNetwork] = &[SequenceNetwork::Contextual];
const UNSTATED: &str = "not stated; as in the code";

/// Values of the readings `paper` and `code`; the first row of a key that names the network applies.
#[rustfmt::skip]
pub const READING_ROWS: [ReadingRow; 18] = [
    row("distance", &[], (Choice("mse"), "section 4: the mean squared error is minimised"), (Choice("l1"), "L1 loss")),
    row("continuity", &[], (Choice("poses"), "section 2: norm of the difference of consecutive poses"), (Choice("numbers"), "absolute differences per coordinate")),
    row("variance_loss", &[], (Choice("variance"), "section 2: negative variance"), (Choice("norm"), "norm over time, not centred")),
    row("words_around_secs", &[], (Number(0.5), "section 4.1: a window of 2 s, for segments of 1 s"), (Number(2.0), "2 s on either side of a segment")),
    row("state_at_seams", &[], (Choice("carried"), "section 4.1: the state is supplied to the next segment"), (Choice("renewed"), "the state is not passed on")),
    row("batch", SEGMENT, (Number(512.0), "section 4.1"), (Number(512.0), "command in its README")),
    row("batch", CONTEXTUAL, (Number(50.0), "section 4.2"), (Number(50.0), "default of its trainer")),
    row("batch", &[], (Number(50.0), UNSTATED), (Number(50.0), "default of its trainer")),
    row("stride_frames", SEGMENT, (Number(1.0), UNSTATED), (Number(1.0), "command in its README")),
    row("stride_frames", &[], (Number(0.0), UNSTATED), (Number(0.0), "default of its trainer: length of a segment")),
    row("learning_rate", SEGMENT, (Number(1e-3), "section 4.1: Adam"), (Number(1e-3), "Adam")),
    row("learning_rate", CONTEXTUAL, (Number(1e-3), "section 4.2: Adam"), (Number(1e-3), "Adam")),
    row("learning_rate", &[SequenceNetwork::Adversarial], (Number(1e-3), UNSTATED), (Number(1e-3), "Adam of both networks")),
    row("learning_rate", &[SequenceNetwork::Autoencoder], (Number(3e-4), UNSTATED), (Number(3e-4), "Adam, audio baseline")),
    row("lambda_adversarial", &[], (Number(0.1), "section 4.3: small weights around 0.1"), (Number(0.01), "default of its trainer")),
    row("epochs", SEGMENT, (Number(100.0), "section 4.1"), (Number(100.0), "command in its README")),
    row("epochs", CONTEXTUAL, (Number(100.0), "section 4.2"), (Number(100.0), "command in its README")),
    row("epochs", &[], (Number(100.0), UNSTATED), (Number(100.0), "as for its other networks")),
];

const fn row(
    key: &'static str,
    networks: &'static [SequenceNetwork],
    paper: (ReadingValue, &'static str),
    code: (ReadingValue, &'static str),
) -> ReadingRow {
    ReadingRow { key, networks, paper, code }
}

/// Epochs of the reading `auto` by the minutes of training motion, interpolated linearly in the logarithm of the
/// minutes. The last is that of FineMotion's 3.5 hours.
const EPOCHS: [(f64, f64); 4] = [(2.0, 400.0), (10.0, 200.0), (30.0, 100.0), (208.0, 80.0)];

/// Smallest number of steps between two validations.
const MIN_EPOCH_STEPS: usize = 100;

/// Keys without effect for some networks, with the networks that they apply to.
const EFFECTIVE: [(&str, &[SequenceNetwork]); 14] = {
    use SequenceNetwork::{Adversarial, Audio, Contextual, Words};
    const DECODERS: &[SequenceNetwork] = &[Contextual, Words, Audio, Adversarial];
    const SUPERVISED: &[SequenceNetwork] = &[Contextual, Words, Audio];
    [
        ("distance", SUPERVISED),
        ("variance_loss", SUPERVISED),
        ("lambda_variance", SUPERVISED),
        ("continuity", DECODERS),
        ("lambda_continuity", DECODERS),
        ("scheduled_sampling", DECODERS),
        ("rollout_previous", DECODERS),
        ("state_at_seams", DECODERS),
        ("lambda_adversarial", &[Adversarial]),
        ("discriminator_blocks", &[Adversarial]),
        ("words_around_secs", &[Words]),
        ("word_dropout", &[Contextual, Words]),
        ("audio_context", &[Words, Audio, Adversarial]),
        ("autoencoder_steps", &[SequenceNetwork::Autoencoder]),
    ]
};

/// Checks that every key that differs from its default has an effect on the network.
///
/// # Errors
/// A key without effect, with the networks that it applies to; both `steps` and `epochs`.
pub fn check(requested: &Seq2seqConfig) -> Result<()> {
    let [given, default] = [serde_json::to_value(requested)?, serde_json::to_value(Seq2seqConfig::default())?];
    let network = &given["network"];
    for (key, networks) in EFFECTIVE {
        let applies = networks.contains(&requested.network) || given[key] == default[key];
        ensure!(
            applies,
            "seq2seq.{key} has no effect on the network {network}: remove it (it applies to {})",
            networks.iter().map(|of| json!(of).to_string()).collect::<Vec<_>>().join(", ")
        );
    }
    ensure!(
        requested.steps.given().is_none() || requested.epochs.given().is_none(),
        "seq2seq.steps and seq2seq.epochs are both given: remove one"
    );
    Ok(())
}

/// Settings of a training before its data are read: `requested`, with the values of its reading filled in. The length
/// of the training ([`Seq2seqSettings::steps`], `epochs`, `epoch_steps`, `autoencoder_steps`) follows from the data; see
/// [`set_length`].
///
/// # Errors
/// An `"auto"` key without a value.
pub fn settings(requested: &Seq2seqConfig) -> Result<Seq2seqSettings> {
    let value = |key: &str| match key {
        "steps" | "epoch_steps" | "autoencoder_steps" => Some(number(1.0)),
        _ => {
            let applies = |row: &&ReadingRow| {
                row.key == key && (row.networks.is_empty() || row.networks.contains(&requested.network))
            };
            let row = READING_ROWS.iter().find(applies)?;
            Some(match reading_value(row, requested) {
                Number(value) => number(value),
                Choice(value) => Value::from(value),
            })
        }
    };
    let mut settings = requested.filled(value).context("a key of [seq2seq] has no value in this reading")?;
    if requested.network == SequenceNetwork::Autoencoder {
        // It has no decoder.
        settings.state_at_seams = SeamState::Renewed;
    }
    Ok(settings)
}

/// Value of a row in the requested reading. `auto` trains every network on batches of 50 segments that do not overlap.
fn reading_value(row: &ReadingRow, requested: &Seq2seqConfig) -> ReadingValue {
    match (requested.reading, row.key) {
        (FineMotionReading::Paper, _) => row.paper.0,
        (FineMotionReading::Auto, "batch") => Number(50.0),
        (FineMotionReading::Auto, "stride_frames") => Number(0.0),
        (FineMotionReading::Code | FineMotionReading::Auto, _) => row.code.0,
    }
}

/// Steps of one pass over `n_segments` training segments.
pub fn epoch_length(settings: &Seq2seqSettings, n_segments: usize) -> usize {
    n_segments.div_ceil(settings.batch.max(1)).max(1)
}

/// Seconds of motion in `n_segments` training segments of `predicted` poses at `fps`.
pub fn motion_secs(settings: &Seq2seqSettings, n_segments: usize, predicted: usize, fps: FrameRate) -> f64 {
    fps.secs(n_segments * if settings.stride_frames == 0 { predicted } else { settings.stride_frames })
}

/// Sets the length of a training with `n_segments` training segments of `predicted` poses at `fps`: an epoch is one
/// pass over the segments; a validation follows the smallest number of epochs with at least 100 steps.
///
/// # Errors
/// `autoencoder_steps` or `decay_start` of at least the number of steps.
pub fn set_length(
    settings: &mut Seq2seqSettings,
    requested: &Seq2seqConfig,
    n_segments: usize,
    predicted: usize,
    fps: FrameRate,
) -> Result<()> {
    let per_epoch = epoch_length(settings, n_segments);
    let stride = if settings.stride_frames == 0 { predicted } else { settings.stride_frames };
    let minutes = motion_secs(settings, n_segments, predicted, fps) / 60.0;
    settings.epochs = match (requested.epochs.given(), requested.reading) {
        (Some(epochs), _) => epochs,
        // Every frame is in `predicted / stride` segments.
        (None, FineMotionReading::Auto) => (auto_epochs(minutes) * stride).div_ceil(predicted.max(1)),
        (None, FineMotionReading::Paper | FineMotionReading::Code) => settings.epochs,
    };
    settings.steps = requested.steps.given().unwrap_or(settings.epochs * per_epoch);
    settings.epochs = settings.steps.div_ceil(per_epoch);
    let validation = MIN_EPOCH_STEPS.div_ceil(per_epoch) * per_epoch;
    settings.epoch_steps = requested.epoch_steps.given().unwrap_or(validation);
    settings.autoencoder_steps = requested.autoencoder_steps.given().unwrap_or(settings.steps / 2);
    let steps = settings.steps;
    for (key, value) in [("autoencoder_steps", settings.autoencoder_steps), ("decay_start", settings.decay_start)] {
        let is_used = key == "decay_start" || settings.network == SequenceNetwork::Autoencoder;
        ensure!(
            !is_used || value == 0 || value < steps,
            "seq2seq.{key} is {value}, expected fewer than the {} of the training",
            counted(steps, "step")
        );
    }
    Ok(())
}

fn auto_epochs(minutes: f64) -> usize {
    let after = EPOCHS.iter().position(|(column, _)| *column >= minutes).unwrap_or(EPOCHS.len() - 1);
    let ((from, low), (to, high)) = (EPOCHS[after.saturating_sub(1)], EPOCHS[after]);
    let share = if to > from { ((minutes / from).ln() / (to / from).ln()).clamp(0.0, 1.0) } else { 0.0 };
    (low + share * (high - low)).round() as usize
}

/// Line that describes the settings of a new training.
pub fn line(settings: &Seq2seqSettings) -> String {
    let text = |value: Value| value.as_str().unwrap_or_default().to_owned();
    format!(
        "reading {}: {} of {} segments ({}), learning rate {}, a validation every {}",
        text(json!(settings.reading)),
        counted(settings.steps, "step"),
        settings.batch,
        counted(settings.epochs, "epoch"),
        settings.learning_rate,
        counted(settings.epoch_steps, "step")
    )
}
