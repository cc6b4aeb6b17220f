//! Plan of a study, fixed before the first participant: the trials of each session in order, the content of each film.

use super::vote::Response;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Task that participants perform on the films of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TaskDesign {
    /// Two avatars with the same speech: which is the real one?
    Turing,
    /// One film: is it real?
    TuringSingle,
    /// Two avatars with the same speech: which is preferred, in five steps?
    Preference,
    /// Several films of the same speech, each rated from 0 to 100 (Jonell et al. 2021, HEMVIP).
    Sliders,
    /// Two avatars, one with the motion of its own speech, one with that of another speech: which fits the speech?
    Mismatch,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrialPhase {
    /// Shows how the page works; not analysed.
    Practice,
    /// Familiarises participants with the task; not analysed.
    Training,
    /// Analysed.
    Main,
    /// Asks for the number that a film shows; not analysed, but may exclude the participant.
    AttentionCheck,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyPlan {
    pub version: u32,
    pub seed: u64,
    pub tasks: Vec<PlannedTask>,
    /// Opaque name of the film of the sound check before the first trial; empty if there is none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub sound_check: String,
    /// One session per participant, in the order of assignment. Sessions beyond the target number of participants
    /// replace participants who withdraw or are excluded.
    pub sessions: Vec<PlannedSession>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedTask {
    /// Name in the study file; the column `task` of exported responses.
    pub name: String,
    pub design: TaskDesign,
    /// Whether films may be replayed.
    pub replay: bool,
    /// Scale of the sliders, a key of the page texts: `human-likeness` or `appropriateness`; empty for other designs.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub scale: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedSession {
    pub trials: Vec<Trial>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Index into [`StudyPlan::tasks`].
    pub task: usize,
    pub phase: TrialPhase,
    /// Opaque names of the films, left to right; one name if both avatars are in one film.
    pub films: Vec<String>,
    /// Correct response of an attention check, or of a training trial with feedback.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<Response>,
}

/// Content of every film. Stored outside `public/`, so that participants cannot reach it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyKey {
    /// Content by opaque film name.
    pub films: BTreeMap<String, FilmContent>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilmContent {
    /// Clip whose speech the film belongs to, `speaker/clip`; the unit of resampling in the analysis.
    pub clip: String,
    pub speaker: String,
    /// Name of the condition in the study file, such as `real` or `generated`.
    pub condition: String,
    /// Clip whose motion is shown; differs from `clip` in mismatched films.
    pub motion_of: String,
    /// Number displayed in an attention check.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub number: Option<u16>,
    #[serde(default, skip_serializing_if = "FilmSound::is_speech")]
    pub sound: FilmSound,
    /// Right avatar of a side-by-side film; `condition` and `motion_of` then describe the left one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub right: Option<RightAvatar>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RightAvatar {
    pub condition: String,
    pub motion_of: String,
}

impl FilmContent {
    /// Conditions of the avatars, left to right.
    pub fn conditions(&self) -> impl Iterator<Item = &str> {
        let right = self.right.as_ref().map(|right| right.condition.as_str());
        std::iter::once(self.condition.as_str()).chain(right)
    }

    pub fn right_alone(&self) -> Option<Self> {
        let RightAvatar { condition, motion_of } = self.right.clone()?;
        Some(Self { condition, motion_of, right: None, ..self.clone() })
    }

    /// Content of the side-by-side film of this one and, on the right, another film of the same speech.
    #[must_use]
    pub fn with_right(self, right: Self) -> Self {
        let Self { condition, motion_of, number, .. } = right;
        Self { number: self.number.or(number), right: Some(RightAvatar { condition, motion_of }), ..self }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FilmSound {
    /// The clip's speech.
    #[default]
    Speech,
    /// No audio, in a task without sound.
    Silence,
    /// Tones that the participant counts in the sound check.
    Tones,
}

impl FilmSound {
    fn is_speech(&self) -> bool {
        *self == Self::Speech
    }
}
