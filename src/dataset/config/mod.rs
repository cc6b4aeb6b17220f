//! `pipeline.toml` in two forms: parsed (`file`: a table with the line of every key) and resolved (`Settings`: defaults
//! filled in, paths absolute, all values in range). Each section is a struct with its defaults; the `pipeline.toml` in
//! the repository root documents them, and a test checks that both agree.

pub mod auto;
pub mod choices;
pub mod file;
pub mod former;
pub mod gan;
pub mod keypoints;
pub mod load;
pub mod patterns;
pub mod rules;
pub mod sections;
pub mod seq2seq;
pub mod transcripts;
pub mod videos;

pub use auto::{Auto, number};
pub use choices::{
    AdversarialLoss, BoneLoss, ContinuityLoss, DistanceLoss, FineMotionReading, FollowRule, GanRecipe,
    MotionRepresentation, NetworkPreset, SeamState, SequenceNetwork, SpeechRule, SplitUnit, VarianceLoss,
};
pub use file::{Problem, SourceLocation};
pub use former::to_stored;
pub use gan::{GanConfig, GanSettings};
pub use keypoints::KeypointSource;
pub use load::{Config, ConfigError, DEFAULT_FILE, load, load_default};
pub use sections::*;
pub use seq2seq::{Seq2seqConfig, Seq2seqSettings};
