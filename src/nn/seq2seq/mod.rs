//! FineMotion's networks for GENEA 2020: speech and words to poses by sequence-to-sequence models that share a decoder
//! (`words`, `contextual`, which was submitted, and `adversarial`), and the denoising autoencoder they were compared
//! with. A batch is a [`config::Segment`], a network a [`predict::GesturePredictor`].

pub mod adversarial;
pub mod autoencoder;
pub mod config;
pub mod context;
pub mod contextual;
pub mod decoder;
pub mod embedding;
pub mod encoder;
pub mod predict;
pub mod words;
