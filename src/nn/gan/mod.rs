//! The networks of the speech-to-gesture GAN: audio encoder and motion UNet (`generator`) with speaker-specific layers
//! (`speaker_layer`) and word input (`words`), motion discriminator, and the generator run in chunks (`streaming`).

pub mod discriminator;
pub mod generator;
pub mod speaker_layer;
pub mod streaming;
pub mod words;
