//! The study file written by a researcher: merged onto a preset, completed with defaults and validated.

mod condition;
mod layers;
mod read;
mod rules;
mod study_file;

pub use condition::{ConditionSource, StudyCondition, fill_pattern};
pub use layers::StudyPreset;
pub use read::{EXAMPLE, resolve};
pub use study_file::{
    AnalysisSettings, ClipReuse, ClipSettings, ExclusionRules, FilmLayout, FilmSettings, HypothesisKind,
    MismatchedClip, StudyFile, StudyHypothesis, StudySpeaker, StudyTask, TaskOrder,
};
