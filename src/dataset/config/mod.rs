//! `pipeline.toml`, twice: as written (`file`: a table with the line of every key) and resolved (`Settings`:
//! defaults in, paths absolute, every value in its range). Each section is one small struct whose defaults are the
//! documented ones; the top level `pipeline.toml` documents them and a test holds the two together.

pub mod auto;
pub mod choices;
pub mod file;
pub mod gan;
pub mod keypoints;
pub mod load;
pub mod patterns;
pub mod rules;
pub mod sections;
pub mod seq2seq;
pub mod transcripts;
pub mod videos;

pub use auto::Auto;
pub use choices::{
    AdversarialLoss, ComputeDevice, ContinuityLoss, DistanceLoss, FollowRule, GanRecipe, MotionRepresentation,
    NetworkPreset, ReachLoss, SequenceNetwork, SpeechRule, SplitUnit,
};
pub use file::{Problem, SourceLocation};
pub use gan::{GanConfig, GanSettings};
pub use keypoints::KeypointSource;
pub use load::{Config, ConfigError, DEFAULT_FILE, load, load_default};
pub use sections::*;
pub use seq2seq::Seq2seqConfig;
