//! What a training does with the speech there is: `material` (minutes, windows) -> `values` (the numbers of a recipe, as
//! data) -> `settings` (every number of the training, as its checkpoints keep them); `account` tells them.

pub mod account;
pub mod material;
pub mod settings;
pub mod start;
pub mod values;
