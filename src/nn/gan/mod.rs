//! The networks of the speech-to-gesture GAN: audio encoder and motion UNet (`generator`) with speaker-specific layers
//! (`speaker_layer`), word input (`words`) and a limited look-ahead (`look_ahead`), motion discriminator, and the
//! generator run in chunks (`streaming`).

pub mod discriminator;
pub mod generator;
pub mod look_ahead;
pub mod speaker_layer;
pub mod streaming;
pub mod words;
