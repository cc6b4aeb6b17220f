//! Networks that look at pictures: `layers` (convolutions, and whoever runs or writes them down), `body` (heat-maps of
//! a body's points).

pub mod body;
pub mod layers;
