//! Audio features from waveforms, as pure functions of samples.

pub mod fingerprint;
pub mod loudness;
pub mod mel;
pub mod mfcc;
pub mod onset;
pub mod openness;
pub mod pauses;
pub mod spectrum;
