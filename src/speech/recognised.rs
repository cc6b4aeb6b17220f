//! Recognised text and its times.

/// Text of a sound.
#[derive(Clone, Debug, PartialEq)]
pub struct Recognised {
    /// Code of the language, for example `en`.
    pub language: String,
    /// Probability of the language, 0..1; 1 if it was given.
    pub language_probability: f32,
    /// In the order of time.
    pub segments: Vec<RecognisedSegment>,
}

/// A phrase or sentence.
#[derive(Clone, Debug, PartialEq)]
pub struct RecognisedSegment {
    /// Seconds from the start of the sound.
    pub start_secs: f64,
    pub end_secs: f64,
    pub text: String,
    pub words: Vec<RecognisedWord>,
}

/// A recognised or aligned word.
#[derive(Clone, Debug, PartialEq)]
pub struct RecognisedWord {
    /// The word with its punctuation, without spaces around it.
    pub word: String,
    /// Seconds from the start of the sound.
    pub start_secs: f64,
    pub end_secs: f64,
    /// Mean probability of its tokens, 0..1.
    pub probability: f32,
}
