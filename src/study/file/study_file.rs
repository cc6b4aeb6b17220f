//! Sections of the study file, and defaults derived from the rest: conditions of a task, hypotheses of a design.

use super::condition::{ConditionSource, StudyCondition};
use super::layers::StudyPreset;
use crate::plan::TaskDesign;
use orator_base::types::split::Split;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Resolved study file: all defaults are filled in and all paths are absolute.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    pub title: String,
    /// Preset that the file is merged onto; `None` in a resolved file, which contains all settings.
    #[serde(default, skip_serializing)]
    pub preset: Option<StudyPreset>,
    /// Seed of all random draws: order, sides, positions and numbers of attention checks.
    #[serde(default = "one")]
    pub seed: u64,
    /// Target number of participants.
    pub participants: usize,
    /// Extra sessions, for replacing participants who withdraw or are excluded, divided by the number of participants.
    #[serde(default = "half", alias = "spare")]
    pub extra_session_ratio: f64,
    /// Languages of the page; the first is the fallback for participants who prefer none of them.
    #[serde(default = "english")]
    pub languages: Vec<String>,
    /// URL to which participants return at the end; `{code}` stands for their completion code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub return_url: Option<String>,
    /// Whether starting requires the participant ID of a recruiting site in the URL.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub require_id: bool,
    /// Whether the first task starts with a trial that only shows how the page works.
    #[serde(default = "yes")]
    pub practice: bool,
    /// Whether the training trials of all tasks precede the analysed trials of the first task.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub training_first: bool,
    #[serde(default = "two")]
    pub attention_checks: usize,
    #[serde(default)]
    pub task_order: TaskOrder,
    #[serde(default)]
    pub clips: ClipSettings,
    #[serde(default, skip_serializing_if = "FilmSettings::is_default")]
    pub films: FilmSettings,
    #[serde(default)]
    pub exclusion: ExclusionRules,
    #[serde(default)]
    pub analysis: AnalysisSettings,
    #[serde(default)]
    pub speaker: Vec<StudySpeaker>,
    #[serde(default)]
    pub condition: Vec<StudyCondition>,
    #[serde(default)]
    pub task: Vec<StudyTask>,
    /// Hypotheses that the analysis tests; all other results are marked as exploratory.
    #[serde(default)]
    pub hypothesis: Vec<StudyHypothesis>,
    /// Texts of the page by language and key, which replace the built-in ones.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub texts: BTreeMap<String, BTreeMap<String, String>>,
}

fn one() -> u64 {
    1
}

fn two() -> usize {
    2
}

fn half() -> f64 {
    0.5
}

fn yes() -> bool {
    true
}

fn english() -> Vec<String> {
    vec!["en".to_owned()]
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TaskOrder {
    /// Balanced over the sessions (Williams 1949).
    #[default]
    Balanced,
    /// Order of the study file.
    Written,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClipSettings {
    /// Length of each film, seconds.
    pub seconds: f64,
    pub reuse: ClipReuse,
    #[serde(skip_serializing_if = "MismatchedClip::is_fixed")]
    pub mismatched: MismatchedClip,
    /// Number of classes of stroke rate from which equally many clips are cut, for speakers with a dataset; 1: the
    /// stroke rate is ignored.
    #[serde(skip_serializing_if = "is_one")]
    pub stroke_rate_groups: usize,
}

fn is_one(number: &usize) -> bool {
    *number == 1
}

impl Default for ClipSettings {
    fn default() -> Self {
        let (reuse, mismatched) = (ClipReuse::Never, MismatchedClip::Fixed);
        Self { seconds: 12.0, reuse, mismatched, stroke_rate_groups: 1 }
    }
}

/// Whether the same speech may occur again in a session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClipReuse {
    /// Never within a session.
    #[default]
    Never,
    /// In another task; for speakers with few clips.
    OtherTasks,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilmSettings {
    pub layout: FilmLayout,
}

impl FilmSettings {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// Distribution of the compared avatars over films.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FilmLayout {
    /// One avatar per film; the page plays the two films of a comparison together.
    #[default]
    Separate,
    /// One film with both avatars of a comparison (Rebol et al. 2021, section 4.1).
    SideBySide,
}

impl FilmLayout {
    /// Width and height of the films, px.
    pub const fn size(self) -> [usize; 2] {
        match self {
            Self::Separate => [800, 600],
            Self::SideBySide => [1000, 360],
        }
    }
}

/// Choice of the other clip whose motion a mismatched condition shows for a clip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MismatchedClip {
    /// One other clip, from another recording if possible, for all participants.
    #[default]
    Fixed,
    /// Drawn for each trial of each session from the other clips of the speaker in the task.
    PerParticipant,
}

impl MismatchedClip {
    fn is_fixed(&self) -> bool {
        *self == Self::Fixed
    }
}

/// Speaker whose clips are shown; either `dataset` or `sounds` is set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudySpeaker {
    pub name: String,
    /// Folder of a dataset with speech and natural motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dataset: Option<PathBuf>,
    #[serde(default = "test_split")]
    pub split: Split,
    /// Glob pattern of sound files with speech only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sounds: Option<PathBuf>,
    /// Number of clips to cut; by default as many as the design needs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clips: Option<usize>,
}

fn test_split() -> Split {
    Split::Test
}

/// Task: a block of trials with one question.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyTask {
    pub name: String,
    pub design: TaskDesign,
    /// Names of the compared conditions; if empty, all conditions that fit the design.
    #[serde(default)]
    pub conditions: Vec<String>,
    /// Analysed trials per participant; 0 removes a task of the preset.
    pub trials: usize,
    /// Training trials before the analysed ones; not analysed.
    #[serde(default)]
    pub training: usize,
    /// Whether a training trial shows the correct response afterwards.
    #[serde(default)]
    pub feedback: bool,
    /// Whether films may be replayed.
    #[serde(default)]
    pub replay: bool,
    #[serde(default = "yes")]
    pub sound: bool,
    /// Scale of the sliders: `human-likeness` or `appropriateness`; empty for other designs.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub scale: String,
}

/// Exclusion rules of the analysis. An absent rule excludes nothing; without the section the default rules apply.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExclusionRules {
    /// Minimum number of failed attention checks that excludes a participant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed_checks: Option<u32>,
    /// Whether participants who did not complete the session are excluded.
    #[serde(default = "yes")]
    pub incomplete: bool,
    /// Stalled playback above which a trial is excluded, seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stalled_secs: Option<f64>,
    /// Time without focus above which a trial is excluded, seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unfocused_secs: Option<f64>,
    /// Whether a trial is excluded if the page was reloaded after one of its films began to play.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reloaded: bool,
}

impl Default for ExclusionRules {
    fn default() -> Self {
        let (stalled_secs, unfocused_secs) = (Some(2.0), Some(5.0));
        Self { failed_checks: Some(1), incomplete: true, stalled_secs, unfocused_secs, reloaded: false }
    }
}

/// Settings of the analysis, fixed before the first participant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AnalysisSettings {
    /// Significance level; confidence intervals cover 1 - `alpha`.
    pub alpha: f64,
    /// Number of bootstrap draws of participants.
    pub resamples: usize,
    pub seed: u64,
}

impl Default for AnalysisSettings {
    fn default() -> Self {
        Self { alpha: 0.05, resamples: 10_000, seed: 1 }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyHypothesis {
    pub task: String,
    pub kind: HypothesisKind,
    /// The two conditions that the hypothesis compares; if empty, every pair of the task.
    #[serde(default)]
    pub conditions: Vec<String>,
    #[serde(default)]
    pub per_speaker: bool,
    /// Equivalence bound on either side of chance, percentage points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HypothesisKind {
    /// The proportion of correct responses differs from 50 %.
    DiffersFromChance,
    /// The proportion of correct responses is above 50 %.
    GreaterThanChance,
    /// The proportion of correct responses lies within `points` of 50 %.
    Equivalence,
    /// Two conditions differ in ratings, preference or how often they are judged real.
    Differs,
}

impl StudyFile {
    /// Conditions whose mismatched clips are drawn per participant: name, and name of the condition of their motion.
    pub fn drawn_conditions(&self) -> BTreeMap<&str, &str> {
        let is_drawn = self.clips.mismatched == MismatchedClip::PerParticipant;
        let drawn = self.condition.iter().filter(|_| is_drawn);
        drawn.filter_map(|condition| Some((condition.name.as_str(), condition.source.mismatch_of()?))).collect()
    }

    /// Number of planned sessions: one per participant, plus the extra ones.
    pub fn n_sessions(&self) -> usize {
        self.participants + (self.participants as f64 * self.extra_session_ratio).ceil() as usize
    }

    pub fn find_condition(&self, name: &str) -> Option<&StudyCondition> {
        self.condition.iter().find(|condition| condition.name == name)
    }
}

/// Drops tasks without trials and fills in defaults: sources of mismatched conditions, conditions of tasks, hypotheses.
pub(super) fn fill_defaults(file: &mut StudyFile) {
    let empty: Vec<String> = file.task.iter().filter(|task| task.trials == 0).map(|task| task.name.clone()).collect();
    file.task.retain(|task| task.trials > 0);
    file.hypothesis.retain(|hypothesis| !empty.contains(&hypothesis.task));
    let is_model =
        |source: &ConditionSource| matches!(source, ConditionSource::Checkpoint(_) | ConditionSource::Files(_));
    let models = file.condition.iter().filter(|condition| is_model(&condition.source) && !condition.real);
    if let [model] = &models.map(|condition| condition.name.clone()).collect::<Vec<_>>()[..] {
        let unspecified = file.condition.iter_mut().filter(|condition| condition.source.mismatch_of() == Some(""));
        unspecified.for_each(|condition| condition.source = ConditionSource::Mismatched(model.clone()));
    }
    for at in 0..file.task.len() {
        if file.task[at].conditions.is_empty() {
            file.task[at].conditions = default_conditions(file, &file.task[at]);
        }
    }
    if file.hypothesis.is_empty() {
        file.hypothesis = file.task.iter().flat_map(|task| default_hypotheses(task, file.speaker.len() > 1)).collect();
    }
}

/// Default conditions of a task: mismatched ones and their counterparts for the mismatch design, all for sliders with
/// sound, otherwise all but the mismatched ones.
fn default_conditions(file: &StudyFile, task: &StudyTask) -> Vec<String> {
    let mismatch_of = |name: &str| file.find_condition(name).and_then(|condition| condition.source.mismatch_of());
    let is_counterpart = |name: &str| file.condition.iter().any(|other| other.source.mismatch_of() == Some(name));
    let fits = |name: &str| match task.design {
        TaskDesign::Mismatch => mismatch_of(name).is_some() || is_counterpart(name),
        TaskDesign::Sliders if task.sound => true,
        TaskDesign::Sliders | TaskDesign::Turing | TaskDesign::TuringSingle | TaskDesign::Preference => {
            mismatch_of(name).is_none()
        }
    };
    file.condition.iter().map(|condition| condition.name.clone()).filter(|name| fits(name)).collect()
}

/// Default hypotheses of a task, for all speakers together and, if there are several, for each separately.
fn default_hypotheses(task: &StudyTask, has_speakers: bool) -> Vec<StudyHypothesis> {
    let kinds: &[HypothesisKind] = match task.design {
        TaskDesign::Turing | TaskDesign::TuringSingle => {
            &[HypothesisKind::DiffersFromChance, HypothesisKind::Equivalence]
        }
        TaskDesign::Mismatch => &[HypothesisKind::GreaterThanChance],
        TaskDesign::Preference | TaskDesign::Sliders => &[HypothesisKind::Differs],
    };
    let one = |kind: HypothesisKind, per_speaker: bool| StudyHypothesis {
        task: task.name.clone(),
        kind,
        conditions: Vec::new(),
        per_speaker,
        points: (kind == HypothesisKind::Equivalence).then_some(10.0),
    };
    let scopes = if has_speakers { &[false, true][..] } else { &[false] };
    kinds.iter().flat_map(|kind| scopes.iter().map(|per_speaker| one(*kind, *per_speaker))).collect()
}
