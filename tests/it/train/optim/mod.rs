//! Optimisers, and steps on a card.

mod adam;
mod card;
