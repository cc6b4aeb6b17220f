//! Defaults that follow from the rest of the file: compared conditions of a task, hypotheses of a design.

use super::condition::ConditionSource;
use super::study_file::{HypothesisKind, StudyFile, StudyHypothesis, StudyTask};
use crate::plan::TaskDesign;

/// Drops tasks without trials, and fills in mismatched conditions, conditions of tasks and hypotheses where there are none.
pub fn fill_in(file: &mut StudyFile) {
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
