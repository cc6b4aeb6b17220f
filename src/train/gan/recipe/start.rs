//! What a training begins with.

/// What the network has learnt before the first step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrainingStart {
    Nothing,
    /// The weights of another speaker's network, or one of several begun with one.
    AnotherSpeaker,
    /// What several speakers have in common: a new one's layer (`SpeakerLayer`) is what there is to learn.
    SeveralSpeakers,
}
