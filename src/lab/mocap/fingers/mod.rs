//! Captured finger motion and labelled hands, read as 21 joints a hand.

pub mod files;
pub mod labels;
pub mod take;
