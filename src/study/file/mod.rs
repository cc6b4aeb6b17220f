//! The study file: what a researcher writes, laid over a preset, with every default filled in and every rule held.

mod condition;
mod layers;
mod read;
mod rules;
mod study_file;

pub use condition::{ConditionSource, StudyCondition, filled};
pub use layers::StudyPreset;
pub use read::EXAMPLE;
pub use study_file::{
    AnalysisSettings, ClipReuse, ClipSettings, ExclusionRules, HypothesisKind, StudyFile, StudyHypothesis,
    StudySpeaker, StudyTask, TaskOrder,
};
