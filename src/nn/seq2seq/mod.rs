//! FineMotion's networks for GENEA 2020: sequence-to-sequence models from speech and words to poses with a common
//! decoder (`networks`, with the discriminator of `adversarial`), and the denoising autoencoder that they were
//! compared with. A batch is a [`config::Segment`], a network a [`predict::GesturePredictor`].

pub mod adversarial;
pub mod autoencoder;
pub mod config;
pub mod encoders;
pub mod networks;
pub mod predict;
