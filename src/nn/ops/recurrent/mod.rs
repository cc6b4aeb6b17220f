//! Recurrent layers, each a single operator over the whole sequence: GRU, and decoder with attention.

pub mod cell;
pub mod decoder;
pub mod decoder_pass;
pub mod gru;
