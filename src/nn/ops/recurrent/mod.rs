//! Layers that go through a sequence step by step, the whole of it in one operator: GRU and the decoder that attends.

pub mod cell;
pub mod decoder;
pub mod decoder_pass;
pub mod gru;
pub mod saved;
