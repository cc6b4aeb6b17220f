//! Optimisers, and steps on a GPU.

mod adam;
mod gpu;
