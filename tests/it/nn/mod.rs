//! Layers and networks against plain arithmetic and finite differences.

mod adversarial;
mod composed;
mod conv2d;
mod conv_norm;
mod decoder;
mod device;
mod gpu;
mod gru;
mod networks;
mod params;
mod predict;
mod score_maps;
mod spin_pool;
mod transformer;
mod unit;
mod weights;
mod winograd;
