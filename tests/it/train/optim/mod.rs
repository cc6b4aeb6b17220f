//! Optimisers.

mod adam;
