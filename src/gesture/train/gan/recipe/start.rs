//! What a training begins with.

/// What the network has learnt before the first step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrainingStart {
    Nothing,
    /// Another speaker's motion.
    AnotherSpeaker,
    /// What several speakers have in common; the layer of one new speaker (`SpeakerLayer`) is what there is to learn.
    SeveralSpeakers,
}
