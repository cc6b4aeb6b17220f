//! Enums of settings with a fixed set of values; any other value is rejected with a message that lists the valid ones.

use serde::{Deserialize, Serialize};

/// Enums whose first variant is the default, written in kebab case.
macro_rules! choices {
    ($($(#[$doc:meta])* pub enum $name:ident {
        $(#[$of_first:meta])* $first:ident, $($(#[$of_variant:meta])* $variant:ident,)*
    })*) => {
        $($(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum $name {
            $(#[$of_first])*
            #[default]
            $first,
            $($(#[$of_variant])* $variant,)*
        })*
    };
}

choices! {
    /// Size of the generator's network.
    pub enum NetworkPreset {
        /// Chosen by the recipe; replaced before training.
        Auto,
        /// `Light` with half the channels, for previews, tests and a few minutes of simple gestures.
        Small,
        /// Small network for CPUs: convolutions over time only.
        Light,
        /// Network of Ginosar et al. (2019), on which Rebol et al. (2021) build: convolutions over time and frequency.
        Paper,
    }

    /// Representation of a pose in the generator's output.
    pub enum MotionRepresentation {
        /// Chosen by the recipe; replaced before training.
        Auto,
        /// Bone directions; bone lengths are constant by construction.
        Bones,
        /// Joint positions, as in Rebol et al. (2021).
        Positions,
    }

    /// Adversarial loss of generator and discriminator.
    pub enum AdversarialLoss {
        /// Chosen by the recipe; replaced before training.
        Auto,
        /// Least squares (Mao et al. 2017), as in the code that Rebol et al. (2021) built on: scores of real motion are
        /// pushed towards 1, scores of generated motion towards 0.
        LeastSquares,
        /// Cross entropy with the scores as logits (Goodfellow et al. 2014). The generator minimises the non-saturating
        /// form, -log D(generated) instead of log(1 - D(generated)).
        Log,
        /// The minimax game as written in Rebol et al. (2021), eq. 3: the generator minimises log(1 - D(generated)),
        /// whose gradient vanishes where the discriminator is certain.
        Minimax,
    }

    /// Form of the bone length loss (Rebol et al. 2021, eq. 1, second term).
    pub enum BoneLoss {
        /// Chosen by the recipe; replaced before training.
        Auto,
        /// Change of each bone's length relative to the speaker's length of that bone, averaged over the bones.
        Relative,
        /// Change of the bone lengths in metres, summed over the bones (the 1-norm of eq. 1).
        Metres,
    }

    /// Rule by which the stage pose2d selects one of several visible persons.
    pub enum FollowRule {
        /// The largest person, with the highest score and closest to the centre.
        Largest,
        /// The person whose mouth moves with the voice if that is unambiguous, otherwise as `Largest`; needs the face
        /// model.
        Speaking,
    }

    /// Architecture of the sequence-to-sequence network.
    pub enum SequenceNetwork {
        /// Input: the sound and words around each pose.
        Contextual,
        /// Input: the sound of each pose and the words of the segment.
        Words,
        /// Input: the sound of each pose (FineMotion 2020, section 4.1, without the word encoder).
        Audio,
        /// Input: sound only; trained against a discriminator.
        Adversarial,
        /// Input: sound only; predicts the codes of a pose autoencoder.
        Autoencoder,
    }

    /// Reconstruction loss between generated and real poses.
    pub enum DistanceLoss {
        /// Chosen by the reading; replaced before training.
        Auto,
        L1,
        Mse,
    }

    /// Loss on the change between consecutive poses.
    pub enum ContinuityLoss {
        /// Chosen by the reading; replaced before training.
        Auto,
        Numbers,
        Poses,
    }

    /// Loss term that rewards a wide range of motion.
    pub enum VarianceLoss {
        /// Chosen by the reading; replaced before training.
        Auto,
        /// Norm over time of each coordinate (code of the authors).
        #[serde(rename(serialize = "excursion"), alias = "excursion")]
        Norm,
        /// Variance over time of each coordinate (paper).
        Variance,
    }

    /// State of the decoder at the start of each generated segment except the first.
    pub enum SeamState {
        /// Chosen by the reading; replaced before training.
        Auto,
        /// Computed from the encoder.
        Renewed,
        /// State after the previous segment.
        Carried,
    }

    /// Source of the settings of FineMotion's networks that are `"auto"`, where their paper and their code differ.
    pub enum FineMotionReading {
        /// Values of the code; the number of epochs depends on the minutes of motion.
        Auto,
        /// FineMotion's paper on its entry to GENEA 2020; its code where the paper states nothing.
        Paper,
        /// FineMotion's published code.
        Code,
    }

    /// Method that distinguishes speech from other sound.
    pub enum SpeechRule {
        /// Speech model and loudness if the model is installed, otherwise loudness only.
        Auto,
        /// Loudness only.
        Loudness,
        /// Speech model and loudness; an error if the model is not installed.
        Vad,
    }

    /// Unit that is assigned to a split.
    pub enum SplitUnit {
        /// Time blocks for a speaker with few videos, whole videos otherwise; the first choice is recorded and kept.
        Auto,
        /// Whole videos.
        Video,
        /// Time blocks of each video, with gaps between the splits.
        Time,
    }

    /// Recipe that chooses the training settings that are `"auto"`.
    pub enum GanRecipe {
        /// Chosen by the minutes of speech in the dataset.
        Auto,
        /// System of Rebol et al. (2021), with the values of the code they built on (Ginosar et al. 2019) where the
        /// paper states none; for many hours of speech.
        #[serde(alias = "paper")]
        Rebol2021,
    }
}
