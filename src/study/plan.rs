//! What each participant sees in which order, fixed before the first of them comes, and what each film shows.

use super::vote::Response;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What participants are asked to do with the films of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TaskDesign {
    /// Two films of one speech side by side: which is the real one?
    Turing,
    /// One film: is it real?
    TuringSingle,
    /// Two films of one speech side by side: which is preferred, in five steps?
    Preference,
    /// Several films of one speech, each on a scale from 0 to 100 (Jonell et al. 2021, HEMVIP).
    Sliders,
    /// Two films, one with the motion of its own speech, one with that of another: which fits the speech?
    Mismatch,
}

/// Purpose of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrialPhase {
    /// Shows how the page works; not analysed.
    Practice,
    /// Makes participants used to the task; not analysed.
    Training,
    /// Analysed.
    Main,
    /// Asks for the number that a film shows; not analysed, but a ground for exclusion.
    AttentionCheck,
}

/// Plan of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyPlan {
    pub version: u32,
    pub seed: u64,
    pub tasks: Vec<PlannedTask>,
    /// Film by which participants try their sound before the first trial, by its opaque name; empty: there is none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub sound_check: String,
    /// One session for each place of a participant, in the order in which places are given out; those after the wanted
    /// number of participants replace who withdraws or is excluded.
    pub sessions: Vec<PlannedSession>,
}

/// Task of a study: a block of trials with one question.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedTask {
    /// Name in the study file, the task of the exported responses.
    pub name: String,
    pub design: TaskDesign,
    /// Whether films may be played again.
    pub replay: bool,
    /// What sliders measure, a key of the texts: `human-likeness` or `appropriateness`; empty for other designs.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub scale: String,
}

/// What one participant sees.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedSession {
    pub trials: Vec<Trial>,
}

/// One page of a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Index into [`StudyPlan::tasks`].
    pub task: usize,
    pub phase: TrialPhase,
    /// Films from left to right, by their opaque names.
    pub films: Vec<String>,
    /// Right response of an attention check, or of a training trial that tells it afterwards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<Response>,
}

/// What the films show. It is kept apart from all that participants can reach.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyKey {
    /// By opaque name.
    pub films: BTreeMap<String, FilmContent>,
}

/// What one film shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilmContent {
    /// Speech that is heard, `speaker/clip`; the unit of resampling in the analysis.
    pub clip: String,
    pub speaker: String,
    /// Name of the condition in the study file, such as `real` or `generated`.
    pub condition: String,
    /// Clip whose speech the motion belongs to: another than `clip` in mismatched films.
    pub motion_of: String,
    /// Number that an attention check shows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub number: Option<u16>,
    #[serde(default, skip_serializing_if = "FilmSound::is_speech")]
    pub sound: FilmSound,
}

/// What a film lets hear.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FilmSound {
    /// The clip's speech.
    #[default]
    Speech,
    /// Nothing, in a task without sound.
    Silence,
    /// Tones to be counted, in the sound check.
    Tones,
}

impl FilmSound {
    fn is_speech(&self) -> bool {
        *self == Self::Speech
    }
}
