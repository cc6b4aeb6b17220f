//! Tests of single modules of `orator_nn::lifter`.

mod hand;
mod heatmap_network;
mod temporal;
