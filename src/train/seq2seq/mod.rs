//! Training of FineMotion's sequence-to-sequence networks (`nn::seq2seq`).

pub mod losses;
