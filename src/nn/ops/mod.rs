//! Operators with forward and backward passes: convolutions, batch norm, linear layers, dropout, resizing, recurrent
//! layers. `operator` connects them to candle.

pub mod affine;
pub mod batch_norm;
pub mod conv1d;
pub mod conv2d;
pub mod conv_norm;
pub mod dropout;
pub mod operator;
pub mod recurrent;
pub mod resize;
