//! The study file: what a researcher writes, laid over a preset, with every default filled in and every rule held.

mod condition;
mod defaults;
mod hypothesis;
mod layers;
mod read;
mod rules;
mod study_file;

pub use condition::{ConditionSource, StudyCondition, filled};
pub use hypothesis::{HypothesisKind, StudyHypothesis};
pub use layers::StudyPreset;
pub use read::EXAMPLE;
pub use study_file::{
    AnalysisSettings, ClipReuse, ClipSettings, ExclusionRules, StudyFile, StudySpeaker, StudyTask, TaskOrder,
};
