//! Settings with few values, as enums: a value that is none of them is refused with the names of those that are.

use serde::{Deserialize, Serialize};

/// Size of the generator's network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NetworkPreset {
    /// For CPUs: convolutions run over time only.
    #[default]
    Light,
    /// The published network (Rebol et al. 2021): convolutions over time and frequency.
    Paper,
}

/// Meaning of the generator's numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MotionRepresentation {
    /// Directions of bones, whose lengths are constant by construction.
    #[default]
    Bones,
    /// Positions of joints, as in the paper.
    Positions,
}

/// The game between generator and discriminator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AdversarialLoss {
    /// Least squares (Mao et al. 2017), as in the code the paper descends from: real scores towards 1, generated ones
    /// towards 0.
    #[default]
    LeastSquares,
    /// Cross entropy of the scores as logits (Goodfellow et al. 2014, the paper's equation); the generator's in its
    /// non-saturating form, -log D(generated) instead of log(1 - D(generated)).
    Log,
}

/// Whom of several people in view the stage pose2d follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FollowRule {
    /// The largest, surest and most central.
    #[default]
    Largest,
    /// The one whose mouth follows the voice, where that is clear, else the largest; needs the face model.
    Speaking,
}

/// Sequence-to-sequence network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SequenceNetwork {
    /// Sound and words around each pose.
    #[default]
    Contextual,
    /// Sound of each pose, words of the segment.
    Words,
    /// Sound alone, against a discriminator.
    Adversarial,
    /// Sound alone, to the codes of an autoencoder of poses.
    Autoencoder,
}

/// How far poses are from the real ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DistanceLoss {
    #[default]
    L1,
    Mse,
}

/// How much poses change from one to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContinuityLoss {
    #[default]
    Numbers,
    Poses,
}

/// How far poses reach, rewarded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReachLoss {
    #[default]
    Excursion,
    Variance,
}

/// What tells speech from other sound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SpeechRule {
    /// The speech model where it is there, else loudness alone.
    #[default]
    Auto,
    /// Loudness alone.
    Loudness,
    /// The speech model beside loudness; without the model nothing runs.
    Vad,
}

/// What is put into a split.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SplitUnit {
    /// Blocks of time for a speaker with few videos, whole videos otherwise; what was chosen first stays.
    #[default]
    Auto,
    /// Whole videos.
    Video,
    /// Blocks of time of each video, with gaps between the splits.
    Time,
}

/// Processor that holds the tensors of a training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ComputeDevice {
    #[default]
    Cpu,
    /// The first NVIDIA card, in a build with the feature `cuda`.
    Cuda,
}

/// What chooses the settings of a training that are `"auto"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GanRecipe {
    /// The minutes of speech that the dataset has.
    #[default]
    Auto,
    /// Rebol et al. 2021 and the code they built on: for many hours of speech.
    Paper,
}
