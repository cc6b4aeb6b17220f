//! Recurrent layers, each a single operator over a complete sequence: GRU, and decoder with attention.

pub mod cell;
pub mod decoder;
pub mod decoder_pass;
pub mod gru;
