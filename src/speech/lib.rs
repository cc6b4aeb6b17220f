//! Speech recognition with Whisper (Radford et al. 2022): log-mel spectrogram and network. Inference only, on the CPU.

pub mod mel;
pub mod network;
