//! Sections of the study file, and the defaults that follow from the rest of it: compared conditions of a task, hypotheses of
//! a design.

use super::condition::{ConditionSource, StudyCondition};
use super::layers::StudyPreset;
use crate::plan::TaskDesign;
use orator_base::types::split::Split;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Study file with every default in and every path absolute.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    pub title: String,
    /// Settings that a file is laid over; none in the resolved one, which holds them all.
    #[serde(default, skip_serializing)]
    pub preset: Option<StudyPreset>,
    /// Seed of all that is drawn: order, sides, places of attention checks and their numbers.
    #[serde(default = "one")]
    pub seed: u64,
    /// Participants whose responses are wanted.
    pub participants: usize,
    /// Further sessions for those who withdraw or are excluded, as a share of the participants.
    #[serde(default = "half")]
    pub spare: f64,
    /// Languages of the page, the first for those who prefer none of them.
    #[serde(default = "english")]
    pub languages: Vec<String>,
    /// Address to which participants return at the end; `{code}` in it stands for their completion code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub return_url: Option<String>,
    /// Whether only those may begin whose address holds the participant ID of a recruiting site.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub require_id: bool,
    /// Whether the first task begins with a trial that only shows how the page works.
    #[serde(default = "yes")]
    pub practice: bool,
    /// Attention checks a session.
    #[serde(default = "two")]
    pub attention_checks: usize,
    #[serde(default)]
    pub task_order: TaskOrder,
    #[serde(default)]
    pub clips: ClipSettings,
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
    /// What the analysis tests; all else in it is marked as not registered before.
    #[serde(default)]
    pub hypothesis: Vec<StudyHypothesis>,
    /// Texts of the page by language and key, in the place of the built-in ones.
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

/// Order of the tasks in a session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TaskOrder {
    /// Balanced over the sessions (Williams 1949).
    #[default]
    Balanced,
    /// As the file has them.
    Written,
}

/// How clips are cut and handed out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClipSettings {
    /// Length of each film in seconds.
    pub seconds: f64,
    pub reuse: ClipReuse,
}

impl Default for ClipSettings {
    fn default() -> Self {
        Self { seconds: 12.0, reuse: ClipReuse::Never }
    }
}

/// Whether a participant may hear one speech again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClipReuse {
    /// In no other trial of the session.
    #[default]
    Never,
    /// In another task, for speakers with few clips.
    OtherTasks,
}

/// Speaker whose clips are shown. There is either a dataset or sounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudySpeaker {
    pub name: String,
    /// Folder of a dataset: speech and natural motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dataset: Option<PathBuf>,
    /// Part of the dataset.
    #[serde(default = "test_split")]
    pub split: Split,
    /// Pattern of sound files: speech alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sounds: Option<PathBuf>,
    /// Clips to cut; as many as the design needs where it is absent.
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
    /// Names of the compared conditions; those that fit the design where it is empty.
    #[serde(default)]
    pub conditions: Vec<String>,
    /// Analysed trials a participant; a task of a preset with none is left out.
    pub trials: usize,
    /// Trials before them that are not analysed.
    #[serde(default)]
    pub training: usize,
    /// Whether a training trial tells the right response afterwards.
    #[serde(default)]
    pub feedback: bool,
    /// Whether films may be played again.
    #[serde(default)]
    pub replay: bool,
    /// Whether the films are heard.
    #[serde(default = "yes")]
    pub sound: bool,
    /// What sliders measure: `human-likeness` or `appropriateness`; empty for other designs.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub scale: String,
}

/// Whose responses the analysis leaves out. A rule that is absent leaves out nobody; without the section the usual rules
/// hold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExclusionRules {
    /// Failed attention checks from which on a participant is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed_checks: Option<u32>,
    /// Whether participants are left out who did not come to the end.
    #[serde(default = "yes")]
    pub incomplete: bool,
    /// Seconds of stalled films above which a trial is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stalled_secs: Option<f64>,
    /// Seconds without focus above which a trial is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unfocused_secs: Option<f64>,
}

impl Default for ExclusionRules {
    fn default() -> Self {
        Self { failed_checks: Some(1), incomplete: true, stalled_secs: Some(2.0), unfocused_secs: Some(5.0) }
    }
}

/// Settings of the analysis, fixed before the first participant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AnalysisSettings {
    /// Error of the first kind: intervals hold 1 - `alpha`.
    pub alpha: f64,
    /// Draws of sign flips and of participants.
    pub resamples: usize,
    /// Seed of both.
    pub seed: u64,
}

impl Default for AnalysisSettings {
    fn default() -> Self {
        Self { alpha: 0.05, resamples: 10_000, seed: 1 }
    }
}

/// Hypothesis about one task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyHypothesis {
    pub task: String,
    pub kind: HypothesisKind,
    /// The two conditions that it is about; every pair that the task compares where it is empty.
    #[serde(default)]
    pub conditions: Vec<String>,
    /// Whether each speaker is tested by itself instead of all together.
    #[serde(default)]
    pub per_speaker: bool,
    /// Bound of equivalence in percentage points on either side of chance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<f64>,
}

/// What a hypothesis claims.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HypothesisKind {
    /// The share of right responses is not 50 %.
    DiffersFromChance,
    /// The share of right responses is above 50 %.
    GreaterThanChance,
    /// The share of right responses lies within `points` of 50 %.
    Equivalence,
    /// Two conditions are rated, preferred or taken for real unequally.
    Differs,
}

impl StudyFile {
    /// Sessions that are planned: one for each participant, and the spare ones.
    pub fn n_sessions(&self) -> usize {
        self.participants + (self.participants as f64 * self.spare).ceil() as usize
    }

    pub fn find_condition(&self, name: &str) -> Option<&StudyCondition> {
        self.condition.iter().find(|condition| condition.name == name)
    }
}

/// Drops tasks without trials, and fills in mismatched conditions, conditions of tasks and hypotheses where there are none.
pub(super) fn fill_in(file: &mut StudyFile) {
    let empty: Vec<String> = file.task.iter().filter(|task| task.trials == 0).map(|task| task.name.clone()).collect();
    file.task.retain(|task| task.trials > 0);
    file.hypothesis.retain(|hypothesis| !empty.contains(&hypothesis.task));
    let is_model =
        |source: &ConditionSource| matches!(source, ConditionSource::Checkpoint(_) | ConditionSource::Files(_));
    let models = file.condition.iter().filter(|condition| is_model(&condition.source) && !condition.real);
    if let [model] = &models.map(|condition| condition.name.clone()).collect::<Vec<_>>()[..] {
        let unsaid = file.condition.iter_mut().filter(|condition| condition.source.mismatch_of() == Some(""));
        unsaid.for_each(|condition| condition.source = ConditionSource::Mismatched(model.clone()));
    }
    for at in 0..file.task.len() {
        if file.task[at].conditions.is_empty() {
            file.task[at].conditions = compared(file, &file.task[at]);
        }
    }
    if file.hypothesis.is_empty() {
        file.hypothesis = file.task.iter().flat_map(|task| hypotheses(task, file.speaker.len() > 1)).collect();
    }
}

/// Conditions that fit a task: mismatched ones and theirs for a mismatch, all for sliders with sound, all but the
/// mismatched ones otherwise.
fn compared(file: &StudyFile, task: &StudyTask) -> Vec<String> {
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

/// Usual hypotheses of a task, about all speakers together and, where there are several, about each.
fn hypotheses(task: &StudyTask, has_speakers: bool) -> Vec<StudyHypothesis> {
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
