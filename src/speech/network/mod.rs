//! The network of Whisper: its weight files, the encoder of a window of 30 s, and the decoder of tokens.

mod config;
mod decoder;
mod encoder;
mod layers;
#[cfg(test)]
mod tests;
mod weight_file;
mod whisper;

pub use config::WhisperConfig;
pub use decoder::TokenDecoder;
pub use whisper::{EncodedAudio, TokenAttention, Whisper};
